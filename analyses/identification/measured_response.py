"""Inertias, stiffness, damping and delay of a design from a measured frequency response of a loop."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import stdtrit
from scipy.stats import chi2

from actuator_lti.design import parameter_value, paths_of, read_design_text, with_values, write_design
from actuator_lti.design.model import Design
from actuator_lti.drive.operating import Operating
from actuator_lti.drive.wiring import wire
from actuator_lti.errors import InputError
from actuator_lti.files.response import RecordedResponse, read_response
from actuator_lti.loops import sampled
from actuator_lti.types import Complexes, Floats
from analyses.estimation.fit import COVERAGE, Fit, Fixed
from analyses.estimation.least_squares import scaled_lstsq, told_apart
from analyses.estimation.parameters import parameter
from analyses.identification.asked import Of
from analyses.identification.design_values import CONSTANTS, at_constant, kept_constant
from analyses.identification.output_error import STEP, fit_output
from analyses.identification.to_design import design_with_fit
from analyses.identification.verdict import Identified, Item, kept_items, simulated_item

KEYS = (
    "motor.rotor_inertia",
    "load.inertia",
    "coupling.stiffness",
    "coupling.damping",
    "friction.viscous",
    "control.computing_delay",
)
CONSTANT_KEYS = {parameter(name).key for name in CONSTANTS}
LEVEL = 1e-3
"""Probability with which noise of the stated size alone fails a response."""
RESOLVED = 1e-5
"""Share of a slope that is its own, by differences of 0.1 %: below it two values do the same."""


@dataclass(frozen=True, kw_only=True)
class ResponseFit(Fit):
    """Values by key with which a loop's response is the measured one.

    ``misfit`` is the root of the mean squared residual over its deviation, None where none was measured.
    Errors are widened by a misfit above 1; without deviations they are those of the residual, so large that
    1.96 of them hold Student's 95 % interval at its degrees of freedom.
    """

    misfit: float | None
    at_bound: tuple[str, ...]
    slopes: Floats = field(repr=False)


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
        response does not determine (a standard error above the value itself) is kept too, and said.
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

    def parts(values: Complexes) -> Floats:
        return np.concatenate([(values / size).real, (values / size).imag])

    held = {key: Fixed(value=value, reason="fixed as asked") for key, value in (fixed or {}).items()}
    if start.load.inertia_kgm2 == 0.0:
        held.setdefault("load.inertia", Fixed(value=0.0, reason="0 in the design: kept"))
    names = tuple(key for key in KEYS if key in paths_of(start) and key not in held)
    _refuse_too_few(2 * len(size), len(names), measured.name)
    fit, rest = _determined(
        start, names, lambda tried: parts(model(tried)), parts(measured.response), known, progress
    )
    given = _given(start, fit, lambda tried: parts(model(tried))) if CONSTANT_KEYS.isdisjoint(held) else {}
    fit = replace(fit, fixed={**held, **fit.fixed, **given})
    made = design_with_fit(start, fit, f"frequency response {measured.name}{at_constant(fit)}")
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


def _given(start: Design, fit: ResponseFit, parts: Callable[[Design], Floats]) -> dict[str, Fixed]:
    """The constant that makes torques, which the response of a loop tells only with the values, to scale."""
    name = next((name for name, of in CONSTANTS.items() if getattr(start.motor, of) is not None), None)
    if name is None:
        return {}
    found = with_values(start, dict(zip(fit.names, fit.values.tolist(), strict=True)), check=False)
    key = parameter(name).key
    more = with_values(found, {key: (1.0 + STEP) * parameter_value(found, key)}, check=False)
    moved = scaled_lstsq(fit.slopes, parts(more) - parts(found))
    return kept_constant(start, name, fit, moved / fit.values / STEP)


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
        if tried.coupling is not None and not tried.load_side_inertia_kgm2 > 0.0:
            told = f"no drive with a load behind the coupling has it as a response of {name}, --of {of}"
            told += f"; allowed: --loop {', '.join(there)}, and --of as it was measured"
            raise InputError(told, where=measured.name)
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


def _determined(
    start: Design,
    names: tuple[str, ...],
    parts: Callable[[Design], Floats],
    measured: Floats,
    known: bool,
    progress: Callable[[int, int], None] | None,
) -> tuple[ResponseFit, Floats]:
    """The fit of what is determined, and its residual; of the others the one told worst goes first."""
    left: dict[str, str] = {}
    while names:
        found = fit_output(start, names, parts, measured, progress)
        kept, like = told_apart(found.slopes, names, least=RESOLVED)
        if like:
            left |= {one.name: str(one) for one in like}
            names = tuple(names[k] for k in kept)
            continue
        size = np.linalg.norm(found.slopes, axis=0)
        unit = found.slopes / size
        freedom = len(found.rest) - len(size)
        variance = float(found.rest @ found.rest) / freedom
        student = float(stdtrit(freedom, 0.975)) / COVERAGE
        scale = max(variance, 1.0) if known else variance * student**2
        covariance = np.asarray(scale * (np.linalg.inv(unit.T @ unit) / np.outer(size, size)))
        share = np.sqrt(np.diag(covariance)) / np.maximum(np.abs(found.values), 1e-300)
        worst = int(np.argmax(share))
        if share[worst] <= 1.0:
            break
        left[names[worst]] = "its standard error is larger than the value"
        names = tuple(name for name in names if name != names[worst])
    else:
        raise InputError(f"the response determines nothing of {', '.join(left)}", where=start.name)
    kept_at = {key: parameter_value(start, key) for key in left}
    told = {key: f"{why}: not determined, the design's value kept" for key, why in left.items()}
    fit = ResponseFit(
        names=names,
        values=found.values,
        covariance=covariance,
        fixed={key: Fixed(value=value, reason=told[key]) for key, value in kept_at.items()},
        misfit=float(np.sqrt(variance)) if known else None,
        at_bound=found.at_bound,
        slopes=found.slopes,
    )
    return fit, found.rest
