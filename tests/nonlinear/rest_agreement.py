"""Random drives by the hundred: whoever asks for rest gets one answer.  Run by hand::

    python -m tests.nonlinear.rest_agreement FIRST COUNT

For each stable position drive a step of 1 % of full deflection, as `cycles` waits for it, and as `simulate`
judges it after runs of two lengths.
"""

import sys

from actuator_lti.design.model import Design
from analyses.motion.settling import counted, outcome
from nonlinear import commands, simulate
from nonlinear.settling.rest import judge
from tests.validation.random_drives import stable_drives

LENGTHS = (1_000, 20_000)  # ticks of the runs


def answers(design: Design) -> list[str]:
    """Verdicts on one step: of the wait, then of the runs."""
    full = design.validation.full_deflection_rad
    step = 0.01 * full
    result = [outcome(design, 0.0, step).rest.verdict]
    for ticks in LENGTHS:
        run = simulate(design, commands.step(step), ticks * design.controller.period_s)
        rest = None if run.running is None else judge(run.running)
        result.append("none" if rest is None else counted(rest, full).verdict)
    return result


def main(first: int, count: int) -> int:
    """Print what differs; how many do."""
    differ = 0
    for design in stable_drives(first, count):
        if design.controller.outermost != "position":
            continue
        given = answers(design)
        if len(set(given)) > 1:
            differ += 1
            sys.stdout.write(f"{design.name}: {', '.join(given)}\n")
    sys.stdout.write(f"{differ} of {count} differ\n")
    return differ


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]), int(sys.argv[2])) > 0)
