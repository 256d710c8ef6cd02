"""How a simulated motion ended: at rest, still swinging, on a limit, or still under way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_lti.design.control import Stage
from nonlinear.trajectory import COMMAND_UNITS, Floats, Trajectory

STILL = 0.9  # of the span of the quarter before: a motion that has so much left does not die out
SEEN = 1e-4  # of the size of the motion: smaller swings are not spoken of
PLAIN = 2e-3  # of the size of the motion: a smaller swing has to be regular, as noise is not
REGULAR = 0.2  # of their mean: spread of the periods of a regular swing
BAND = 0.02  # of the size of the motion: what moves less in the last quarter has settled
HELD = 0.95  # of the last quarter: a limit that acts so long is sat on
PERIODS = 2  # in the last half

SETTLES: dict[Stage, Stage] = {
    "position": "position", "velocity": "velocity", "current": "current", "voltage": "velocity",
}  # fmt: skip
"""What is to come to rest under a constant command of a stage."""
WORDS: dict[Stage, str] = {
    "position": "output", "velocity": "speed", "current": "current", "voltage": "speed",
}  # fmt: skip


@dataclass(frozen=True)
class Conduct:
    """What a run ended in.

    Attributes
    ----------
    status : str
        ``"ok"``, ``"keeps oscillating"``, ``"sits on a limit"``, ``"has not settled"``, or why the run
        stopped.
    detail : str
        With figures; empty where there is nothing to say.
    """

    status: str
    detail: str = ""


def conduct(run: Trajectory) -> Conduct:
    """Judge the last quarter of a run.

    A command that still moves in the last half of the run is followed, not settled on: then only a limit that
    acts all the time is spoken of.

    Examples
    --------
    >>> from actuator_lti.design import load_design
    >>> from nonlinear import commands, simulate
    >>> conduct(simulate(load_design("ilr33-amber"), commands.step(0.01), duration_s=0.2)).status
    'ok'
    """
    if run.status != "ok":
        return Conduct(run.status, run.advice)
    n = run.time_s.size
    if n < 8:
        return Conduct("ok")
    last, before = slice(n - n // 4, n), slice(n - 2 * (n // 4), n - n // 4)
    reference, output = run.reference_rad, _judged(run)
    away = 0.0 if run.stage == "voltage" else float(np.abs(reference - output).max())
    size = max(away, float(np.ptp(output)), 1e-300)
    swing = float(np.ptp(output[last]))
    constant = np.ptp(reference[n - n // 2 :]) <= 1e-9 * max(float(np.abs(reference).max()), 1e-300)
    if constant and swing > SEEN * size and swing >= STILL * float(np.ptp(output[before])):
        half = slice(before.start, n)
        hertz = _frequency_hz(output[half], run.time_s[half], regular=swing <= PLAIN * size)
        if hertz is not None:
            unit, factor = COMMAND_UNITS[run.axis, SETTLES[run.stage]]
            return Conduct("keeps oscillating", f"{0.5 * swing * factor:.3g} {unit} at {hertz:.3g} Hz")
    held = [
        name for name, use in run.limits.items() if use.active and run.limit_active(name)[last].mean() >= HELD
    ]
    limit = ", ".join(
        f"{name} limit of {run.limits[name].limit:.4g} {run.limits[name].unit}" for name in held
    )
    if constant and swing > BAND * size:
        moves = f"the {WORDS[run.stage]} still moves by {100.0 * swing / size:.2g} % of its way"
        return Conduct("has not settled", f"{moves}, at the {limit}" if limit else moves)
    return Conduct("sits on a limit", limit) if limit else Conduct("ok")


def _judged(run: Trajectory) -> Floats:
    """What is to settle: what the command orders; of a voltage, the speed that it leads to."""
    return run.motor_speed_rad_s / run.ratio if run.stage == "voltage" else run.followed


def _frequency_hz(values: Floats, time: Floats, *, regular: bool) -> float | None:
    """Frequency of a swing about its mean, by its rising crossings; ``None`` where it does not swing.

    ``regular``: nor where its periods differ by more than `REGULAR`.
    """
    low = values < 0.5 * (values.max() + values.min())
    periods = np.diff(time[np.flatnonzero(low[:-1] & ~low[1:])])
    if periods.size < PERIODS or (regular and np.std(periods) > REGULAR * np.mean(periods)):
        return None
    return float(1.0 / np.mean(periods))
