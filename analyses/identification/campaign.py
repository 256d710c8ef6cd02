"""From a campaign to coefficients: import, steady parts, surface, the question of a richer law."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from analyses.identification.points import steady_points
from analyses.identification.richer import RicherLaws, compare_laws
from analyses.identification.steady import SteadyCriterion
from analyses.identification.surface import SurfaceFit, fit_surface
from analyses.records.campaign_import import ImportedCampaign, SetAside


@dataclass(frozen=True, kw_only=True)
class CampaignResult:
    """Everything that a campaign told: the fit, the runs behind it, and those set aside with their reasons.

    ``runs_listed == len(fit.points) + len(set_aside) + outliers set aside``.
    """

    imported: ImportedCampaign
    fit: SurfaceFit
    laws: RicherLaws | None
    set_aside: tuple[SetAside, ...]
    criterion: SteadyCriterion
    torque_constant_Nm_A: float

    @property
    def runs_listed(self) -> int:
        """Runs in the campaign file."""
        return len(self.imported.campaign.runs)


def identify_campaign(
    imported: ImportedCampaign,
    design: Design,
    *,
    criterion: SteadyCriterion | None = None,
    richer: bool = True,
    progress: Callable[[int, int], None] | None = None,
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
    progress : callable, optional
        Called with (steps done, steps in all).

    Raises
    ------
    InputError
        Without a torque constant, or with too few usable runs; the reasons of those set aside are told.
    """
    constant = design.motor.torque_constant_Nm_A
    if constant is None:
        raise InputError(
            "motor.torque_constant: the design has none, so currents cannot become torques", design.name
        )
    criterion = SteadyCriterion() if criterion is None else criterion
    points, restless = steady_points(imported.runs, constant, criterion)
    aside = (*imported.set_aside, *restless)
    if progress is not None:
        progress(1, 3)
    try:
        fit = fit_surface(
            points, imported.campaign.instruments, constant, outliers=imported.campaign.outliers
        )
    except InputError as error:
        told = "; ".join(f"{run.id}: {run.reason}" for run in aside[:3])
        raise InputError(
            f"{error.message} ({told})" if told else error.message, imported.campaign.origin
        ) from None
    if progress is not None:
        progress(2, 3)
    laws = compare_laws(fit) if richer else None
    if progress is not None:
        progress(3, 3)
    return CampaignResult(
        imported=imported,
        fit=fit,
        laws=laws,
        set_aside=aside,
        criterion=criterion,
        torque_constant_Nm_A=constant,
    )
