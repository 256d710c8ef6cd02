"""Inertias, stiffness, damping and delay of a design from a measured frequency response of a loop."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

from actuator_lti.design import parameter_value, paths_of, read_design_text, with_values, write_design
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.types import Complexes, Progress
from analyses.estimation.fit import Fit, Fixed
from analyses.estimation.least_squares import scaled_lstsq
from analyses.estimation.parameters import own_share, own_std, parameter
from analyses.identification.asked import Of
from analyses.identification.design_values import CONSTANTS, at_constant, kept_constant
from analyses.identification.response_fit import ResponseFit, determined
from analyses.identification.response_model import Seen, loop_model
from analyses.identification.response_search import STEP
from analyses.identification.to_design import design_with_fit, with_correlations
from analyses.identification.verdict import Identified, Item, kept_items, simulated_item
from analyses.records.finding import NO_CHANCE, SURE
from analyses.records.response import RecordedResponse, read_response
from analyses.studies.sampling import correlation_of

KEYS = (
    "motor.rotor_inertia",
    "load.inertia",
    "coupling.stiffness",
    "coupling.damping",
    "friction.viscous",
    "control.computing_delay",
)
CONSTANT_KEYS = {parameter(name).key for name in CONSTANTS}


@dataclass(frozen=True, kw_only=True)
class ResponseResult(Identified):
    """What a measured response told of a design, and the response of the design that comes of it."""

    measured: RecordedResponse = field(repr=False)
    modelled: Complexes = field(repr=False)
    loop: str
    of: Of
    fit: ResponseFit
    own: Mapping[str, float]  # the design's values of what was fitted, as it came


def identify_response(
    design: Design,
    source: Path | str | Any,
    *,
    loop: str | None = None,
    of: Of = "L",
    fixed: Mapping[str, float] | None = None,
    limit: float = 0.2,
    averages: int | None = None,
    progress: Progress = None,
) -> ResponseResult:
    """Fit a design to a measured frequency response of one of its loops.

    The design's loops, sampled and exact, are the model; other values than those of `KEYS` are kept, and what
    the response does not determine: a standard error above the design's value, and above a quarter of what
    it is off (of a delay an interval beyond a tick as well); of a stiffness, or of one of several inertias,
    no end of its interval within a factor of 30.

    ``source``: as `analyses.records.response.read_response` takes it. ``loop``: a stage (``"position"``) or
    a break point (``"w_ref"``); the outermost stage by default. ``of``: open loop, L/(1 + L), 1/(1 + L), or
    (closed) from the command to the output with all that is fed forward. ``fixed``: keys held at a value.
    ``limit``: largest relative error of the design's response, root mean square over the frequencies.
    ``averages``: those behind the coherence, which then gives the deviations.

    Raises `InputError`: if the response cannot be read, the design has no such loop, nothing is determined,
    or there are no more numbers than unknowns.
    """
    measured = read_response(source, averages)
    start = with_values(design, dict(fixed or {}))
    model, grows = loop_model(start, loop, of, measured)
    known = bool(np.all(np.isfinite(measured.deviation) & (measured.deviation > 0.0)))
    size = np.abs(measured.response) * (measured.deviation / np.sqrt(2.0) if known else 1.0)
    relative = not known or bool(np.ptp(measured.deviation) == 0.0)
    seen = Seen(
        measured=measured.response, size=size, known=known, relative=relative, model=model, grows=grows
    )
    held = {key: Fixed(value=value, reason="fixed as asked") for key, value in (fixed or {}).items()}
    if start.load.inertia_kgm2 == 0.0:
        held.setdefault("load.inertia", Fixed(value=0.0, reason="0 in the design: kept"))
    names = tuple(key for key in KEYS if key in paths_of(start) and key not in held)
    if (numbers := 2 * len(size)) <= (unknowns := len(names)):  # no degrees of freedom, no interval
        said = f"{len(size)} frequencies are {numbers} numbers for {unknowns} unknowns"
        allowed = f"{unknowns // 2 + 1} frequencies or more, or fewer unknowns (--fix KEY=VALUE)"
        raise InputError(f"{said}: no interval can be given; allowed: {allowed}", where=measured.name)
    fit = determined(start, names, seen, progress)
    kept = [key for key, one in fit.fixed.items() if one.value]
    scales = [name for name, one in CONSTANTS.items() if getattr(start.motor, one) is not None]
    toleranced = [key for key in held if own_std(start, key) > 0.0]
    hanging_on = [*kept, *toleranced, *scales[:1] * CONSTANT_KEYS.isdisjoint(held)]
    given = _given(start, replace(fit, fixed={**held, **fit.fixed}), seen, hanging_on)
    words = "the standard errors are those at it, the written design has its tolerance correlated with them"
    for key in held.keys() & given.keys():  # fixed as asked, with a tolerance in the design
        given[key] = replace(given[key], reason=f"{given[key].reason}; {words}")
    hanging, constant = fit.fixed.keys() & given.keys(), at_constant(replace(fit, fixed=given), start)
    made = _written(start, fit, given, f"frequency response {measured.name}{constant}")
    given |= {key: _determined(start, key, given[key]) for key in hanging}
    fit = replace(fit, covariance=fit.joint, fixed={**held, **fit.fixed, **given})
    modelled = loop_model(read_design_text(write_design(made)), loop, of, measured)[0]({})[0]
    error = float(np.sqrt(np.mean(np.abs(modelled / measured.response - 1.0) ** 2)))
    items = [simulated_item(measured.name, error, limit, "its response, rms over the frequencies")]
    if fit.misfit is not None:
        level = float(chi2.sf(float(fit.rest @ fit.rest), len(fit.rest) - len(fit.names)))
        label = f"The measured deviations explain what is left (misfit {fit.misfit:.3g})"
        why = f"by chance with a probability of {level:.1g}: another drive, or at another operating point"
        items.insert(0, Item.of("misfit", label, "" if level > NO_CHANCE else why))
    ended = "it ended at the least or largest value of its key: the response wants another"
    items += [Item.of(f"bound-{key}", f"{key} is within what its key allows", ended) for key in fit.at_bound]
    if grows({key: np.array([value]) for key, value in zip(fit.names, fit.values, strict=True)})[0]:
        said = "what was closed while it was measured is not stable with these values: another drive"
        items.append(Item.of("stable", "The drive that was found can be measured", said))
    if fit.also:
        said = ", ".join(f"{key} = {value:.4g}" for key, value in fit.also.items())
        wrong = f"{said} (SI) explain it as well: hold one of them (--fix), or measure more frequencies"
        items.append(Item.of("also", "No other values explain the response", wrong))
    own = {key: parameter_value(start, key) for key in fit.names}
    items += [*_far_items(start, fit, own), *_reach_items(made, start, measured), *kept_items(fit, held)]
    return ResponseResult(
        design=made,
        items=tuple(items),
        measured=measured,
        modelled=modelled,
        loop=loop or design.controller.outermost,
        of=of,
        fit=fit,
        own=own,
    )


def _far_items(start: Design, fit: Fit, own: Mapping[str, float]) -> Iterator[Item]:
    """Values that the design's own tolerance does not allow, both errors taken into account."""
    for key, value in own.items():
        std = float(np.hypot(fit.std(key), own_std(start, key)))
        if own_std(start, key) > 0.0 and abs(fit[key] - value) > SURE * std:
            off = f"{abs(fit[key] - value) / std:.3g} standard deviations, its tolerance among them"
            reason = f"{_beside(fit[key], value, parameter(key, start.axis).unit)}: {off}"
            yield Item.unproven(f"far-{key}", f"{key} is what the design allows", reason)


def _reach_items(made: Design, start: Design, measured: RecordedResponse) -> Iterator[Item]:
    """A stiffness that is told by frequencies below the antiresonance, sqrt(k/J) of the load side, alone."""
    if made.coupling is None or start.coupling is None or not made.load_side_inertia_kgm2 > 0.0:
        return
    k, own, top = made.coupling.stiffness_Nm_rad, start.coupling.stiffness_Nm_rad, measured.frequency_hz[-1]
    hertz = float(np.sqrt(k / made.load_side_inertia_kgm2)) / (2.0 * np.pi)
    if k != own and hertz > top:
        why = _beside(k, own, parameter("coupling.stiffness", start.axis).unit)
        reason = f"measured to {top:.4g} Hz, the antiresonance is at {hertz:.4g} Hz: stiffness {why}"
        yield Item.unproven("reach", "The measurement reaches the antiresonance", reason)


def _beside(value: float, own: float, unit: str) -> str:
    return f"{value:.4g} {unit}" + (f", {value / own:.3g} of the design's {own:.4g}" if own else "")


def _given(start: Design, fit: ResponseFit, seen: Seen, names: Sequence[str]) -> dict[str, Fixed]:
    """What the design alone tells, and how the values hang on it."""
    given = dict[str, Fixed]()
    found = dict(zip(fit.names, fit.values, strict=True))
    for one in names:
        key, why = parameter(one).key, fit.fixed[one].reason if one in fit.fixed else ""
        if not (own := parameter_value(start, key)):
            continue
        off = seen.off({**found, key: own * np.array([1.0, 1.0 + STEP])})
        moved = scaled_lstsq(fit.slopes, off[0] - off[1])
        share = np.divide(moved, STEP * fit.values, out=np.zeros_like(moved), where=fit.values != 0.0)
        given |= kept_constant(start, one, fit, share, why)
    return given


def _hanging(start: Design, fit: ResponseFit, given: Mapping[str, Fixed], keys: Collection[str]) -> Fit:
    """The fit with some values that are not determined beside it: their own errors, and what those move."""
    kept = [key for key in given if key in keys]
    moves = np.array([[given[key].moves[name] for key in kept] for name in fit.names])
    moves = moves.reshape(len(fit.names), len(kept))
    std = np.array([own_share(start, key, given[key].value) * given[key].value for key in kept])
    own, more = np.outer(std, std) * correlation_of(start, kept), [given[key].value for key in kept]
    wide = replace(fit, covariance=fit.covariance + moves @ own @ moves.T)
    return wide.joined(Fit(names=tuple(kept), values=np.array(more), covariance=own), moves @ own)


def _written(start: Design, fit: ResponseFit, given: Mapping[str, Fixed], source: str) -> Design:
    """The design of a fit before it is widened: what hangs on a toleranced value is correlated with it.

    Where no tolerance is stated, the values' own are those at the kept value.
    """
    joint = _hanging(start, fit, given, {key for key in given if own_std(start, key) > 0.0})
    made = design_with_fit(start, joint.renamed({name: name for name in fit.names}), source)
    return with_correlations(made, joint)


def _determined(start: Design, key: str, kept: Fixed) -> Fixed:
    """What is kept, with what its own error is in the errors of the others."""
    share = f"{100.0 * own_share(start, key, kept.value):.3g} % of it (one standard deviation"
    words = f"{share}, no tolerance is stated); the written tolerances are those at this value"
    if own_std(start, key) > 0.0:
        words = f"{share}, by its tolerance); the written design has them correlated with it"
    return replace(kept, reason=f"{kept.reason}; the standard errors hold {words}")
