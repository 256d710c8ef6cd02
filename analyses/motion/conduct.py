"""How a simulated motion ends: read from the one judge of rest (`nonlinear.settling.rest`)."""

from __future__ import annotations

from dataclasses import dataclass

from analyses.motion.settling import words
from nonlinear.runs.trajectory import COMMAND_UNITS, Trajectory
from nonlinear.settling.rest import judge


@dataclass(frozen=True)
class Conduct:
    """What a run ends in, the command and the load staying as they are at its end.

    Attributes
    ----------
    status : str
        ``"comes to rest"`` (of a speed or less: ``"becomes steady"``), ``"sits on a limit"`` (it does while
        this acts), ``"limit cycle"``, ``"still moving"``, ``"diverging"``; ``"following"`` where command or
        load go on changing; or why the run stopped.
    detail : str
        With figures; empty where there is nothing to say.
    """

    status: str
    detail: str = ""

    @property
    def wanted(self) -> bool:
        """Whether the drive rests, turns steadily or follows, no limit in its way."""
        return self.status in ("comes to rest", "becomes steady", "following")


def conduct(run: Trajectory) -> Conduct:
    """Judge a run; where its end comes too early, the drive is followed beyond it.

    Examples
    --------
    >>> from nonlinear import commands, simulate
    >>> conduct(simulate("ilr33-amber", commands.step(0.01), duration_s=0.2)).status
    'comes to rest'
    """
    if run.status != "ok":
        return Conduct(run.status, run.advice)
    rest = None if run.running is None else judge(run.running)
    if rest is None:
        return Conduct("following")
    unit, factor = COMMAND_UNITS[run.axis, "velocity" if run.stage == "voltage" else run.stage]
    if not rest.comes_to_rest:
        text = words(rest, factor, unit).removeprefix("limit cycle of ").removeprefix("still moving ")
        return Conduct(rest.verdict, text)
    limits = [f"{n} limit of {run.limits[n].limit:.4g} {run.limits[n].unit}" for n in rest.limited]
    if limits:
        return Conduct("sits on a limit", ", ".join(limits))
    return Conduct("comes to rest" if run.stage == "position" else "becomes steady")
