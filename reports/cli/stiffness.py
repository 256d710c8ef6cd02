"""`actuator-lti stiffness`: how far a moment pushes the output, powered and unpowered."""

from __future__ import annotations

from math import isfinite, isinf
from typing import TYPE_CHECKING

from actuator_lti.tree import Tree
from reports.cli.drive import SetOption, load_drive
from reports.cli.options import DEFAULT_DESIGN, DesignArgument, JsonOption

if TYPE_CHECKING:
    from analyses.stiffness import Stiffness


def stiffness(
    design: DesignArgument = DEFAULT_DESIGN, changes: SetOption = None, as_json: JsonOption = False
) -> None:
    """Print dynamic and static stiffness and lost motion, checked by an injected moment.

    The exit status is 1 where the simulator does not confirm the linear stiffness.
    """
    from analyses.stiffness import stiffness as analyse
    from reports.cli.errors import leave_with
    from reports.cli.output import print_json, print_line
    from reports.terminal import print_verdict

    result = analyse(load_drive(design, changes))
    if as_json:
        print_json(_json(result))
    else:
        print_verdict(result.agrees, f"{result.design.name}: {_verdict(result)}")
        for line in _lines(result):
            print_line(line)
    leave_with(result.agrees)


def _verdict(result: Stiffness) -> str:
    """Whether the simulator confirms the linear stiffness, and how well."""
    if not result.checks:
        return (
            "self-locking, no moment moves the output"
            if _rigid(result)
            else "no stiffness was put to the simulator"
        )
    most = max(check.difference for check in result.checks)
    said = "confirms" if result.agrees else "does not confirm"
    return f"an injected moment {said} the dynamic stiffness (relative difference up to {most:.1e})"


def _rigid(result: Stiffness) -> bool:
    """Whether the output holds against any moment."""

    return all(isinf(curve.static_Nm_rad) for curve in result.curves)


def _known(value: float | None) -> float | None:
    return None if value is None or not isfinite(value) else float(value)


def _json(result: Stiffness) -> Tree:
    """Everything for a machine; null where a stiffness is infinite."""
    import numpy as np

    lost = result.lost_motion
    return {
        "design": result.design.name,
        "unit": "N/m" if result.design.axis == "linear" else "N*m/rad",
        "agrees": result.agrees,
        "curves": [
            {
                "state": curve.state,
                "static": _known(curve.static_Nm_rad),
                "frequency_hz": curve.frequency_hz.tolist(),
                "size": [_known(x) for x in np.abs(curve.stiffness_Nm_rad)],
                "phase_deg": [_known(x) for x in np.angle(curve.stiffness_Nm_rad, deg=True)],
            }
            for curve in result.curves
        ],
        "lost_motion": None
        if lost is None
        else {
            "play": lost.play_rad,
            "foreseen": lost.foreseen_rad,
            "simulated": lost.seen_rad,
        },
        "at_rest": [
            {
                "moment": one.moment_Nm,
                "frequency_hz": one.frequency_hz,
                "size": _known(abs(one.seen_Nm_rad)),
            }
            for one in result.at_rest
        ],
        "checks": [
            {
                "frequency_hz": check.frequency_hz,
                "foreseen": abs(check.foreseen_Nm_rad),
                "simulated": abs(check.seen_Nm_rad),
                "relative_difference": check.difference,
            }
            for check in result.checks
        ],
    }


def _lines(result: Stiffness) -> list[str]:
    """The same for people."""
    from reports.sections.stiffness import STATES

    unit = "N/m" if result.design.axis == "linear" else "N m/rad"
    angle = "m" if result.design.axis == "linear" else "rad"
    lines = [f"{result.design.name}: stiffness at the output, {unit}"]
    for curve in result.curves:
        least, at = curve.least
        static = _shown(curve.static_Nm_rad)
        lines.append(f"  {STATES[curve.state]:<28} static {static}, least {least:.6g} at {at:.4g} Hz")
    lost = result.lost_motion
    if lost is not None:
        seen = "" if lost.seen_rad is None else f", simulated {lost.seen_rad:.4g} {angle}"
        lines.append(f"  play {lost.play_rad:.4g} {angle}; lost motion {lost.foreseen_rad:.4g} {angle}{seen}")
    load = "N" if result.design.axis == "linear" else "N m"
    lines.extend(
        f"  at rest, {one.moment_Nm:.4g} {load} at {one.frequency_hz:.4g} Hz: {_shown(abs(one.seen_Nm_rad))}"
        for one in result.at_rest
    )
    lines.extend(
        f"  at {check.frequency_hz:.4g} Hz: {abs(check.foreseen_Nm_rad):.6g}, simulated "
        f"{abs(check.seen_Nm_rad):.6g} (relative difference {check.difference:.1e})"
        for check in result.checks
    )
    return lines


def _shown(stiffness: float) -> str:
    """Six digits; in words where nothing moves."""
    return f"{stiffness:.6g}" if isfinite(stiffness) else "infinite"
