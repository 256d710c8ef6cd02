"""An unstable loop in the simulator: whether a small deviation grows, and as fast as the poles say."""

from __future__ import annotations

from dataclasses import replace
from math import log

import numpy as np

from actuator_lti.design.control import Stage
from actuator_lti.design.model import Design
from analyses.loop_figures import LoopFigures
from analyses.validation.ledger import Entry, not_judged
from nonlinear import State, commands, simulate
from nonlinear.on_the_bench import on_the_bench

SEED = 1e-6  # rad/s or A: the deviation that a run begins with
WATCHED = 16.0  # time constants of the growth: a factor of nine million
MOST_TICKS = 400_000
WITHIN = 0.25  # of the rate: peaks of a swing are read, not its envelope
OUTSIDE: dict[str, tuple[Stage, ...]] = {
    "current": ("position", "velocity"), "velocity": ("position",), "position": (),
}  # fmt: skip


def unstable_entry(design: Design, name: str, figures: LoopFigures) -> Entry:
    """The prediction that a loop is not stable beside a run of it: rates of growth, in 1/s.

    The loops outside it are cut, limits, dry friction and the instruments' errors left out. A loop that is
    not known to be stable or not, or on the border, is not judged.
    """
    margins = figures.margins
    if margins.verdict != "unstable":
        why = f"{margins.verdict}: {margins.evidence_reason}".rstrip(": ")
        return not_judged(name, "stability", "", None, None, why, "linear")
    poles = np.abs(figures.loop.plain_closed.poles())
    rate = log(poles.max()) / figures.loop.plain_closed.dt
    words = "without limits and dry friction, from a small deviation"
    found = growth_1_s(design, name, rate)
    if found is None:
        why = "unstable; it grows too slowly to be watched"
        return not_judged(name, "stability", "1/s", rate, None, why, words)
    passed = bool(abs(found - rate) <= WITHIN * rate)
    seen = "a run grows as its poles say" if passed else "a run does not grow as its poles say"
    return Entry(name, "stability", "1/s", words, rate, found, WITHIN * rate, passed, f"unstable: {seen}")


def growth_1_s(design: Design, name: str, rate_1_s: float) -> float | None:
    """The rate at which a small deviation grows in the simulator; None where the run would be too long.

    The difference of two runs, with and without it: what gravity does is in both.
    """
    bench = on_the_bench(design)
    cut = replace(bench, controller=replace(bench.controller, **dict.fromkeys(OUTSIDE[name])))  # type: ignore[arg-type]
    seconds = WATCHED / rate_1_s
    if seconds > MOST_TICKS * cut.controller.period_s:
        return None
    begin = State(current_A=SEED) if name == "current" else State(motor_speed_rad_s=SEED)
    runs = [
        simulate(
            cut, commands.hold(0.0), seconds, initial=state, friction_on=False, limits_on=False,
            raise_on_failure=False,
        )
        for state in (begin, State())
    ]  # fmt: skip
    signal = "current_A" if name == "current" else "motor_speed_rad_s"
    off = np.abs(getattr(runs[0], signal) - getattr(runs[1], signal))
    n = off.size
    early, late = off[n // 2 : 6 * n // 10].max(), off[9 * n // 10 :].max()
    if not (np.isfinite(late) and early > 0.0 and late > 0.0):
        return None
    return float(log(late / early) / (0.4 * seconds))
