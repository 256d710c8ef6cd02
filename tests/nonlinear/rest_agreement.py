"""Whoever asks for rest gets one answer: `cycles`, `validate`, `simulate`, `failures`, the report."""

from collections.abc import Iterable, Iterator

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from analyses.failures import Asked, failures
from analyses.limit_cycles.run import limit_cycles
from analyses.motion.settling import Settling, counted, ending_of, words
from analyses.validation import validate
from analyses.validation.settings import QUICK
from nonlinear import commands, simulate
from nonlinear.settling.rest import judge
from reports.sections import cycles
from reports.sections.names import fine_unit

LENGTHS, WATCHED = (1_000, 20_000), 1_000  # ticks of the runs, and after a failure


def simulated(design: Design, settlings: Iterable[Settling]) -> Iterator[str]:
    """Steps that end otherwise in runs of `simulate`."""
    full, tick_s = design.validation.full_deflection_rad, design.controller.period_s
    for one in settlings:
        for ticks in LENGTHS:
            step = commands.step(one.amplitude_rad)
            run = simulate(design, step, ticks * tick_s, one.load_Nm, raise_on_failure=False)
            rest = None if run.running is None else judge(run.running)
            verdict = "none" if rest is None else counted(rest, full).verdict
            if verdict != one.rest.verdict:
                yield f"{one.amplitude_rad:g} at {one.load_Nm:g}: {one.rest.verdict}, {ticks} ticks {verdict}"


def contradictions(design: Design) -> Iterator[str]:
    """Every pair of answers about rest that differ."""
    waited, checked = limit_cycles(design), validate(design, QUICK)
    if checked.settlings != waited.rests:
        yield f"cycles {waited.rests}, validate {checked.settlings}"
    if (waited.verdict, waited.hunting) != (checked.rest, checked.hunting):
        yield f"cycles {waited.verdict}, validate {checked.rest}"
    yield from simulated(design, waited.rests)
    try:
        watched = WATCHED * design.controller.period_s
        asked = Asked.of(design, watched_s=watched, detection_s=watched)
        yield from simulated(design, failures(design, asked).before)
    except InputError as error:
        yield f"failures: {error}"
    swing, said = waited.hunting, [cycles.summary(waited), checked.words]
    wanted = ["", ""]
    if swing is not None:
        wanted = [words(swing.rest, *fine_unit(design.axis)), ending_of(design, swing)]
    for text, part in zip(said, wanted, strict=True):
        if part not in text or (not part and "not come to rest" in text):
            yield f"said: {text!r}, not {part!r}"
