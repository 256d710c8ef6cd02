"""The result of an identified campaign as plain data for a machine."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

from actuator_lti.tree import Tree

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from analyses.campaign_design import CampaignSuggestion
    from analyses.identification.campaign import CampaignResult
    from analyses.identification.contributions import Contribution
    from analyses.identification.verdict import Item
    from analyses.records.record import Record


def campaign_json(
    result: CampaignResult,
    shares: Sequence[Contribution],
    suggestion: CampaignSuggestion | None,
    at: dict[str, float],
    items: Sequence[Item] = (),
    written: Path | None = None,
) -> Tree:
    """Give everything that `identify` found, in SI.

    Parameters
    ----------
    at : dict
        ``load_Nm`` and ``speed_rad_s`` of the contributions.
    """
    fit = result.fit
    names = ("C0", "Cv", "CM")
    return {
        "campaign": result.imported.campaign.name,
        "runs_listed": result.runs_listed,
        "runs_used": len(fit.points),
        "set_aside": [asdict(run) for run in result.set_aside],
        "outliers": [asdict(run) for run in fit.outliers],
        "contradicting": [asdict(run) for run in result.contradicting],
        "checks": items_json(items),
        "passed": all(item.passed is not False for item in items),
        "design": None if written is None else str(written),
        "held": dict(fit.held),
        "relative_residual": fit.relative_residual,
        "inputs": campaign_inputs(result),
        "rows_in": result.imported.rows_in,
        "rows_out": result.imported.rows_out,
        "criterion": str(result.criterion),
        "coefficients": {
            name: {
                "value": fit.values[k],
                "standard_error": fit.standard_errors[k],
                "interval_95": fit.intervals[k],
            }
            for k, name in enumerate(names)
        },
        "units": {"C0": "N m", "Cv": "N m s/rad", "CM": "N m/(N m)"},
        "covariance": fit.covariance,
        "shared_shifts": fit.shared_shifts,
        "run_scatter_Nm": fit.run_scatter_Nm,
        "birge_ratio": fit.birge_ratio,
        "contributions": {**at, "terms": [asdict(term) for term in shares]},
        "richer_laws": None if result.laws is None else asdict(result.laws),
        "suggestion": None if suggestion is None else asdict(suggestion),
        "points": [
            {
                "run": p.run,
                "speed_rad_s": p.direction * p.speed_rad_s,
                "load_Nm": p.load_Nm,
                "torque_Nm": p.torque_Nm,
                "steady_s": [p.window.start_s, p.window.stop_s],
            }
            for p in fit.points
        ],
    }


def items_json(items: Sequence[Item]) -> list[Tree]:
    """The verdict, item by item; values and limits as shares."""
    return [asdict(item) for item in items]


def campaign_inputs(result: CampaignResult) -> list[Tree]:
    """The account of the columns of a campaign's files."""
    from reports.sections.identification_inputs import campaign_rows

    return [{k: v for k, v in row.items() if k != "_status"} for row in campaign_rows(result)]


def inputs_json(record: Record, used: Mapping[str, str]) -> list[Tree]:
    """The account of a record's columns."""
    from reports.sections.identification_inputs import input_rows

    return [{k: v for k, v in row.items() if k != "_status"} for row in input_rows(record, used)]
