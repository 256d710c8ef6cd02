"""Inertias, stiffness, damping and delay of a design from a measured frequency response of a loop."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.special import stdtrit
from scipy.stats import chi2

from actuator_lti.design import parameter_value, paths_of, read_design_text, with_values, write_design
from actuator_lti.design.model import Design
from actuator_lti.drive.operating import Operating
from actuator_lti.drive.wiring import wire
from actuator_lti.errors import InputError, NumericalError
from actuator_lti.files.response import RecordedResponse, read_response
from actuator_lti.loops import sampled
from actuator_lti.types import Complexes, Floats
from analyses.estimation.fit import COVERAGE, Fit, Fixed
from analyses.estimation.least_squares import scaled_lstsq, told_apart
from analyses.estimation.parameters import own_share, own_std, parameter
from analyses.identification.asked import Of
from analyses.identification.design_values import CONSTANTS, at_constant, kept_constant
from analyses.identification.output_error import Moved, box_of, fit_output
from analyses.identification.to_design import design_with_fit, with_correlations
from analyses.identification.verdict import Identified, Item, kept_items, simulated_item
from analyses.records.consistency import SURE
from analyses.studies.sampling import correlation_of

KEYS = (
    "motor.rotor_inertia",
    "load.inertia",
    "coupling.stiffness",
    "coupling.damping",
    "friction.viscous",
    "control.computing_delay",
)
NEVER_ZERO = KEYS[:3]
"""Inertias and a stiffness are above 0: where noise may explain one, the response does not tell it."""
CONSTANT_KEYS = {parameter(name).key for name in CONSTANTS}
LEVEL = 1e-3
"""Probability with which noise of the stated size alone fails a response."""
RESOLVED = 1e-5
"""Share of a slope that is its own: below it two values do the same."""
STEP = 1e-5
"""Share of a value for its differences: those of a sharp resonance curve at 1e-3 already."""
STARTS: tuple[float, ...] = 1.0, 0.25, 4.0
"""Stiffnesses to begin with, over the design's: an octave of the resonance to either side."""
REACH = 30.0
"""Factor of a value that a rough fit may move it by."""
ROUNDS = 40, 100
"""Iterations of a rough fit, and of the one that follows."""
AS_WELL = float(chi2.isf(0.05, 1))
"""Rise of the sum of squares, of deviation 1, within which other values explain a response as well."""


@dataclass(frozen=True, kw_only=True)
class ResponseFit(Fit):
    """Values by key with which a loop's response is the measured one.

    ``misfit`` is the root of the mean squared residual over its deviation, None where none was measured.
    Errors are widened by a misfit above 1; without deviations they are those of the residual, so large that
    1.96 of them hold Student's 95 % interval at its degrees of freedom. ``also`` are other values, beyond
    these errors, that explain the response as well.
    """

    misfit: float | None
    at_bound: tuple[str, ...]
    also: Mapping[str, float]
    slopes: Floats = field(repr=False)


@dataclass(frozen=True)
class _Seen:
    """A measured response, the deviation of each of its parts (1: not known), and the model of it."""

    measured: Complexes
    size: Floats
    model: Callable[[Design], Complexes]

    def parts(self, values: Complexes) -> Floats:
        """Real and imaginary parts over their deviations."""
        return np.concatenate([(values / self.size).real, (values / self.size).imag])

    def of(self, tried: Design) -> Floats:
        """Those of a design."""
        return self.parts(self.model(tried))

    def ratio(self, tried: Design) -> Floats:
        """What is left of a design's logarithms: far from the truth they are straighter than the parts."""
        return self.parts(np.log(self.model(tried) / self.measured) * np.abs(self.measured))


@dataclass(frozen=True, kw_only=True)
class ResponseResult(Identified):
    """What a measured response told of a design, and the response of the design that comes of it."""

    measured: RecordedResponse = field(repr=False)
    modelled: Complexes = field(repr=False)
    loop: str
    of: Of
    fit: ResponseFit


def identify_response(
    design: Design,
    source: Path | str | Any,
    *,
    loop: str | None = None,
    of: Of = "L",
    fixed: Mapping[str, float] | None = None,
    limit: float = 0.2,
    averages: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> ResponseResult:
    """Fit a design to a measured frequency response of one of its loops.

    Parameters
    ----------
    design : Design
        Its loops, sampled and exact, are the model; other values than those of `KEYS` are kept. What the
        response does not determine (a standard error above the design's value, and above a quarter of what
        it is off; of a stiffness, or of one of several inertias, above a quarter of what was found) is kept.
    source : path or control.FrequencyResponseData
        See `actuator_lti.files.response.read_response`.
    loop : str, optional
        A stage (``"position"``) or a break point (``"w_ref"``); the outermost stage by default.
    of : {"L", "T", "S", "closed"}
        Open loop, L/(1 + L), 1/(1 + L), or from the command to the output with all that is fed forward.
    fixed : mapping, optional
        Keys held at a value.
    limit : float
        Largest relative error of the design's response, root mean square over the frequencies.

    averages : int, optional
        Those behind the coherence, which then gives the deviations.

    Raises
    ------
    InputError
        If the response cannot be read, the design has no such loop, nothing is determined, or there are no
        more numbers than unknowns.
    """
    measured = read_response(source, averages)
    start = with_values(design, dict(fixed or {}))
    model = _model(start, loop, of, measured)
    known = bool(np.all(np.isfinite(measured.deviation) & (measured.deviation > 0.0)))
    size = np.abs(measured.response) * (measured.deviation / np.sqrt(2.0) if known else 1.0)
    seen = _Seen(measured.response, size, model)
    held = {key: Fixed(value=value, reason="fixed as asked") for key, value in (fixed or {}).items()}
    if start.load.inertia_kgm2 == 0.0:
        held.setdefault("load.inertia", Fixed(value=0.0, reason="0 in the design: kept"))
    names = tuple(key for key in KEYS if key in paths_of(start) and key not in held)
    _refuse_too_few(2 * len(size), len(names), measured.name)
    fit, rest = _determined(start, names, seen, known, progress)
    given = _given(start, fit, seen) if CONSTANT_KEYS.isdisjoint(held) else {}
    hanging, constant = fit.fixed.keys() & given.keys(), at_constant(replace(fit, fixed=given), start)
    made = _written(start, fit, given, f"frequency response {measured.name}{constant}")
    given |= {key: _told(start, key, given[key]) for key in hanging}
    size = len(fit.names)
    covariance = _hanging(start, fit, given, hanging).covariance[:size, :size]
    fit = replace(fit, covariance=covariance, fixed={**held, **fit.fixed, **given})
    modelled = model(read_design_text(write_design(made)))
    error = float(np.sqrt(np.mean(np.abs(modelled / measured.response - 1.0) ** 2)))
    items = [simulated_item(measured.name, error, limit, "its response, rms over the frequencies")]
    if fit.misfit is not None:
        level = float(chi2.sf(float(rest @ rest), len(rest) - len(fit.names)))
        label = f"The measured deviations explain what is left (misfit {fit.misfit:.3g})"
        why = f"by chance with a probability of {level:.1g}: another drive, or at another operating point"
        items.insert(0, Item.of("misfit", label, "" if level > LEVEL else why))
    ended = "it ended at the least or largest value of its key: the response wants another"
    items += [Item.of(f"bound-{key}", f"{key} is within what its key allows", ended) for key in fit.at_bound]
    if fit.also:
        told = ", ".join(f"{key} = {value:.4g}" for key, value in fit.also.items())
        wrong = f"{told} (SI) explain it as well: hold one of them (--fix), or measure more frequencies"
        items.append(Item.of("also", "No other values explain the response", wrong))
    items += kept_items(fit, held)
    return ResponseResult(
        design=made,
        items=tuple(items),
        measured=measured,
        modelled=modelled,
        loop=loop or design.controller.outermost,
        of=of,
        fit=fit,
    )


def _given(start: Design, fit: ResponseFit, seen: _Seen) -> dict[str, Fixed]:
    """What the design alone tells, and how the values hang on it.

    That is the constant that makes torques, which the response of a loop tells only with the values, to
    scale, and each value that is not determined.
    """
    name = next((name for name, of in CONSTANTS.items() if getattr(start.motor, of) is not None), None)
    names = [key for key in fit.fixed if fit.fixed[key].value] + ([] if name is None else [name])
    found = with_values(start, dict(zip(fit.names, fit.values.tolist(), strict=True)), check=False)
    given = dict[str, Fixed]()
    for one in names:
        key, told = parameter(one).key, fit.fixed[one].reason if one in fit.fixed else ""
        more = with_values(found, {key: (1.0 + STEP) * parameter_value(found, key)}, check=False)
        moved = scaled_lstsq(fit.slopes, seen.of(more) - seen.of(found))
        share = np.divide(moved, STEP * fit.values, out=np.zeros_like(moved), where=fit.values != 0.0)
        given |= kept_constant(start, one, fit, share, told)
    return given


def _hanging(start: Design, fit: ResponseFit, given: Mapping[str, Fixed], keys: Collection[str]) -> Fit:
    """The fit with some values that are not determined beside it: their own errors, and what those move."""
    kept = [key for key in fit.fixed if key in keys]
    moves = np.array([[given[key].moves[name] for key in kept] for name in fit.names])
    moves = moves.reshape(len(fit.names), len(kept))
    std = np.array([own_share(start, key, given[key].value) * given[key].value for key in kept])
    own = np.outer(std, std) * correlation_of(start, kept)
    beside, more = -moves @ own, np.array([given[key].value for key in kept])
    covariance = np.block([[fit.covariance + moves @ own @ moves.T, beside], [beside.T, own]])
    return Fit(names=(*fit.names, *kept), values=np.append(fit.values, more), covariance=covariance)


def _written(start: Design, fit: ResponseFit, given: Mapping[str, Fixed], source: str) -> Design:
    """The design of a fit before it is widened: what hangs on a toleranced value is correlated with it.

    Where no tolerance is stated, the values' own are those at the kept value.
    """
    joint = _hanging(start, fit, given, {key for key in given if own_std(start, key) > 0.0})
    made = design_with_fit(start, joint.renamed({name: name for name in fit.names}), source)
    return with_correlations(made, joint)


def _told(start: Design, key: str, kept: Fixed) -> Fixed:
    """What is kept, with what its own error is in the errors of the others."""
    share = f"{100.0 * own_share(start, key, kept.value):.3g} % of it (one standard deviation"
    words = f"{share}, no tolerance is stated); the written tolerances are those at this value"
    if own_std(start, key) > 0.0:
        words = f"{share}, by its tolerance); the written design has them correlated with it"
    return replace(kept, reason=f"{kept.reason}; the standard errors hold {words}")


def _model(
    design: Design, loop: str | None, of: Of, measured: RecordedResponse
) -> Callable[[Design], Complexes]:
    """The response of a design's loop at the measured frequencies."""
    wired = wire(design, Operating())
    name = loop or wired.outermost
    there = (*wired.stages, *wired.points)
    if name not in there:
        raise InputError(f'--loop "{name}": allowed: {", ".join(there)}', where=design.name)

    def seen(tried: Design) -> Any:
        wired = wire(tried, Operating())
        if of == "closed":
            return sampled.reference_to_output(wired)
        return sampled.loop(wired, name).open_loop

    def response(tried: Design) -> Complexes:
        system = seen(tried)
        value = np.asarray(system(np.exp(2j * np.pi * measured.frequency_hz * system.dt))).ravel()
        over = {"T": value, "S": np.ones_like(value)}.get(of)
        return np.asarray(value if over is None else over / (1.0 + value), dtype=np.complex128)

    top, last = 0.5 / seen(design).dt, measured.frequency_hz[-1]
    if not last < top:
        raise InputError(f"{last:g} Hz: the loop is sampled; allowed: below {top:g} Hz", measured.name)
    return response


def _refuse_too_few(numbers: int, unknowns: int, where: str) -> None:
    """Without degrees of freedom there is no interval."""
    if numbers <= unknowns:
        told = f"{numbers // 2} frequencies are {numbers} numbers for {unknowns} unknowns"
        allowed = f"{unknowns // 2 + 1} frequencies or more, or fewer unknowns (--fix KEY=VALUE)"
        raise InputError(f"{told}: no interval can be given; allowed: {allowed}", where=where)


def _rough(seen: _Seen, start: Design, names: tuple[str, ...], factors: tuple[float, ...]) -> list[Design]:
    """Where fits of the logarithms end, over the values' own, from several stiffnesses: the best ones."""
    scale, ends = box_of(start, names)
    off = np.array([name == "coupling.stiffness" for name in names], dtype=float)

    def at(moved: Floats) -> Design:
        values = np.clip(scale * np.exp(moved), *ends)
        return with_values(start, dict(zip(names, values.tolist(), strict=True)), check=False)

    ended = []
    for factor in factors if off.any() else factors[:1]:
        box, most = (-np.log(REACH), np.log(REACH)), ROUNDS[0]
        begin = np.log(factor) * off
        found = least_squares(
            lambda moved: seen.ratio(at(moved)), begin, bounds=box, ftol=1e-4, xtol=1e-4, max_nfev=most
        )
        ended.append((found.cost, at(found.x)))
    least = min(cost for cost, _ in ended)
    return [tried for cost, tried in ended if cost <= 2.0 * least]


def _least(
    seen: _Seen,
    start: Design,
    names: tuple[str, ...],
    factors: tuple[float, ...],
    progress: Callable[[int, int], None] | None,
) -> list[Moved]:
    """The fits of several starts, the best one first."""
    fits, failed, measured = list[Moved](), list[Exception](), seen.parts(seen.measured)
    for begin in _rough(seen, start, names, factors):
        try:
            fits.append(
                fit_output(begin, names, seen.of, measured, progress, step=STEP, iterations=ROUNDS[1])
            )
        except (InputError, NumericalError) as error:
            failed.append(error)
    if not fits:
        raise failed[0]
    return sorted(fits, key=lambda one: float(one.rest @ one.rest))


def _from(start: Design, values: Mapping[str, float], left: Collection[str]) -> Design:
    """A design with the values of a fit, but for those that are its own; a small one may come back."""
    kept = {key: max(one, parameter_value(start, key) / REACH) for key, one in values.items()}
    return with_values(start, {key: one for key, one in kept.items() if key not in left}, check=False)


def _determined(
    start: Design,
    names: tuple[str, ...],
    seen: _Seen,
    known: bool,
    progress: Callable[[int, int], None] | None,
) -> tuple[ResponseFit, Floats]:
    """The fit of what is determined, and its residual; of the others the one told worst goes first."""
    left: dict[str, str] = {}
    begin, factors = start, STARTS
    while names := tuple(name for name in names if name not in left):
        found, *others = _least(seen, begin, names, factors, progress)
        values = dict(zip(names, found.values.tolist(), strict=True))
        _, like = told_apart(found.slopes, names, least=RESOLVED)
        if like:
            left |= {one.name: str(one) for one in like}
            begin, factors = _from(start, values, left), STARTS[:1]
            continue
        size = np.linalg.norm(found.slopes, axis=0)
        spread = np.linalg.inv(np.linalg.qr(found.slopes / size, mode="r")) / size[:, None]
        freedom = len(found.rest) - len(size)
        variance = float(found.rest @ found.rest) / freedom
        student = float(stdtrit(freedom, 0.975)) / COVERAGE
        scale = max(variance, 1.0) if known else variance * student**2
        covariance = np.asarray(scale * spread @ spread.T)
        std, own = np.sqrt(np.diag(covariance)), np.array([parameter_value(start, name) for name in names])
        share = std / np.maximum(np.maximum(np.abs(own), np.abs(found.values - own) / SURE), 1e-300)
        never = np.isin(names, NEVER_ZERO)
        if never.sum() == 1:  # an inertia that is left alone has no other that makes up for it
            never &= np.array(names) == "coupling.stiffness"
        share[never] = np.maximum(share, SURE * std / np.maximum(found.values, RESOLVED * own))[never]
        worst = int(np.argmax(share))
        if share[worst] <= 1.0:
            break
        near = never[worst] and SURE * std[worst] > found.values[worst]
        more = f"it is less than {SURE:g} standard errors from 0"
        left[names[worst]] = more if near else "its standard error is larger than the design's value"
        begin, factors = _from(start, values, left), STARTS[:1]
    else:
        raise InputError(f"the response determines nothing of {', '.join(left)}", where=start.name)
    kept_at = {key: parameter_value(start, key) for key in left}
    told = {key: f"{why}: not determined, the design's value kept" for key, why in left.items()}
    most = float(found.rest @ found.rest) + AS_WELL * (max(variance, 1.0) if known else variance)
    also = [one.values for one in others if one.rest @ one.rest <= most]
    also = [one for one in also if np.any(np.abs(one - found.values) > COVERAGE * std)]
    fit = ResponseFit(
        names=names,
        values=found.values,
        covariance=covariance,
        fixed={key: Fixed(value=value, reason=told[key]) for key, value in kept_at.items()},
        misfit=float(np.sqrt(variance)) if known else None,
        at_bound=found.at_bound,
        also=dict(zip(names, also[0].tolist(), strict=True)) if also else {},
        slopes=found.slopes,
    )
    return fit, found.rest
