"""From a campaign to coefficients: import, steady parts, surface, the question of a richer law."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from analyses.identification.points import steady_points
from analyses.identification.richer import RicherLaws, compare_laws
from analyses.identification.run_checks import check_runs
from analyses.identification.steady import SteadyCriterion
from analyses.identification.surface import fit_surface
from analyses.identification.surface_fit import NAMES, SurfaceFit
from analyses.identification.verdict import Item, residual_item, simulated_item, sizes_item
from analyses.records.campaign_import import ImportedCampaign, SetAside
from analyses.records.consistency import Finding
from analyses.records.inputs import InputUse


@dataclass(frozen=True, kw_only=True)
class CampaignResult:
    """Everything that a campaign told: the fit, the runs behind it, and those set aside with their reasons.

    ``runs_listed == len(fit.points) + len(set_aside) + outliers set aside``. ``contradicting`` are those of
    the runs set aside whose record does not agree with what is said of it.
    """

    imported: ImportedCampaign = field(repr=False)
    fit: SurfaceFit
    laws: RicherLaws | None
    set_aside: tuple[SetAside, ...]
    criterion: SteadyCriterion
    torque_constant_Nm_A: float
    contradicting: tuple[SetAside, ...] = ()
    findings: Mapping[str, tuple[Finding, ...]] = field(default_factory=dict)

    @property
    def runs_listed(self) -> int:
        """Runs in the campaign file."""
        return len(self.imported.campaign.runs)

    @property
    def rows_in(self) -> int:
        """Data rows in the files of the runs that are used."""
        return self.imported.rows_in

    @property
    def rows_out(self) -> int:
        """Rows that were kept of them."""
        return self.imported.rows_out

    @property
    def inputs(self) -> tuple[InputUse, ...]:
        """The columns of the runs' files, and what each was used for."""
        return self.imported.inputs


def identify_campaign(
    imported: ImportedCampaign,
    design: Design,
    *,
    criterion: SteadyCriterion | None = None,
    richer: bool = True,
    fixed: Mapping[str, float] | None = None,
) -> CampaignResult:
    """Identify C0, Cv and CM (paper, section 3) from imported runs.

    Parameters
    ----------
    imported : ImportedCampaign
    design : Design
        Its torque constant makes torques of currents.
    criterion : SteadyCriterion, optional
        When a motion counts as steady.
    richer : bool
        Whether to ask, by cross-validation, for a richer law.
    fixed : mapping, optional
        Coefficients (C0, Cv, CM) that are held at a value.

    Raises
    ------
    InputError
        Without a torque constant, or with too few usable runs; the reasons of those set aside are told.
    """
    constant = design.effective_motor.torque_constant_Nm_A
    if constant is None:
        raise InputError(
            "motor.torque_constant: the design has none, so currents cannot become torques", design.name
        )
    criterion = SteadyCriterion() if criterion is None else criterion
    points, restless = steady_points(imported.runs, constant, criterion)
    checked = check_runs(design, imported.runs, points, imported.campaign.instruments)
    aside = (*imported.set_aside, *restless, *checked.contradicting)
    try:
        fit = fit_surface(
            checked.points,
            imported.campaign.instruments,
            constant,
            outliers=imported.campaign.outliers,
            fixed=fixed,
            kept=_values_of(design),
        )
    except InputError as error:
        told = "; ".join(f"{run.id}: {run.reason}" for run in aside[:3])
        raise InputError(
            f"{error.message} ({told})" if told else error.message, imported.campaign.origin
        ) from None
    laws = compare_laws(fit) if richer and not fixed and len(fit.points) >= 5 else None
    return CampaignResult(
        imported=imported,
        fit=fit,
        laws=laws,
        set_aside=aside,
        criterion=criterion,
        torque_constant_Nm_A=constant,
        contradicting=checked.contradicting,
        findings=checked.findings,
    )


def _values_of(design: Design) -> dict[str, float]:
    """The design's own C0, Cv and CM, kept where the runs do not tell them."""
    friction = design.friction
    values = (friction.dry_torque_Nm, friction.viscous_Nms_rad, friction.load_coefficient)
    return dict(zip(NAMES, values, strict=True))


def campaign_items(
    design: Design, result: CampaignResult, simulated: float | None, limit: float
) -> tuple[Item, ...]:
    """The verdict on a campaign: runs, residual, size, and the written design simulated again."""
    fit, wrong = result.fit, result.contradicting
    items = [
        Item(
            id="runs",
            label="Runs agree with their set speed and load, themselves and the design",
            passed=not wrong,
            reason="; ".join(f"run {run.id}: {run.reason}" for run in wrong[:3])
            + (f" and {len(wrong) - 3} more" if len(wrong) > 3 else ""),
        ),
        _size_item(design, fit),
        residual_item(fit.relative_residual, limit),
    ]
    if simulated is not None:
        items.append(simulated_item("the runs", simulated, limit, "steady current, simulated"))
    return tuple(items)


def _size_item(design: Design, fit: SurfaceFit) -> Item:
    before = _values_of(design)
    ratios = {NAMES[k]: float(fit.values[k]) / before[NAMES[k]] for k in fit.told if before[NAMES[k]] > 0.0}
    return sizes_item(ratios, {design.total_ratio: f"the reduction {design.total_ratio:g}"}, leading="C0")
