"""Which row of a validation sees a change of each key of a design file, in the model but not in the drive.

By 1 %, or more of whole numbers or below what a row resolves. It writes docs/validation_keys.md::

    python -m tests.validation.mutation_table
"""

from collections.abc import Iterator
from operator import attrgetter
from pathlib import Path

from actuator_lti import Design, InputError, NumericalError, load_design
from actuator_lti.asked.verdict import Verdict
from analyses.validation.design_values import design_value_rows
from analyses.validation.places import Bench
from analyses.validation.row import Row
from analyses.validation.small_signal import small_signal

DRIVES = ("ilr33-amber", "joint", "ballscrew", "fin")
PAGE = Path(__file__).parents[2] / "docs" / "validation_keys.md"
FACTORS = (1.01, 1.1, 2.0, 0.5)
NO_RUN = {
    "load.moment_max": "no run reads it: it checks the design and names a load to look at",
    "validation.full_deflection": "no run reads it: it is an amplitude that analyses are asked for",
    "validation.loads": "no run reads it: it names the loads that analyses are asked for",
}
CHOICES: dict[str, tuple[object, ...]] = {
    "motor.constants": ("dc", "rms-line", "peak-phase"),
    "load.path": ("self-locking", "back-drivable"),
    "friction.law": ("coulomb", "tanh"),
    "encoder.speed": ("ideal", "difference"),
    "control.velocity.sensor": ("motor", "output"),
    "control.position.sensor": ("motor", "output"),
}


def chosen(design: Design) -> dict[str, object]:
    """What a design has of the keys whose choice another of `CHOICES` can take."""
    there: dict[str, object] = {}
    for key in CHOICES:
        part, _, name = key.replace("control.", "controller.").rpartition(".")
        owner = attrgetter(part)(design)
        there |= {key: getattr(owner, name)} if owner is not None else {}
    return there


def keys_of(design: Design) -> tuple[str, ...]:
    """Keys with a number, and those with such a choice."""
    return (*design.parameters, *chosen(design))


def seen(design: Design, key: str) -> tuple[str, str, str]:
    """The smallest change of a key that a row sees, the row, and where; or why none does."""
    why = NO_RUN.get(key) or why_idle(design, key)
    for words, model in () if why else changed(design, key):
        if isinstance(model, str):
            why = f"refused: {model}"
        elif (row := first_row(design, model)) is not None:
            return words, f"{row.loop} {row.name}", row.condition or row.because
    return "", "", why or "NOT SEEN"


def why_idle(design: Design, key: str) -> str:
    """Why a key of this drive moves nothing in a run; empty where it does."""
    velocity, position = design.controller.velocity, design.controller.position
    if key == "encoder.counts_per_rev" and design.encoder.speed == "ideal":
        return "idle: the speed is taken as ideal, and the position loop reads no counts of the motor"
    behind = [loop for loop in (velocity, position) if loop is not None and loop.sensor == "output"]
    if key == "output_encoder.counts_per_rev" and not behind:
        return "idle: no loop reads the output's encoder"
    if key == "control.position.sensor" and design.coupling is None and design.output_quantum_rad is None:
        return "idle: on a rigid drive without counts both sensors read one angle"
    if key == "control.velocity.sensor" and design.coupling is None and design.encoder.speed == "ideal":
        return "idle: on a rigid drive without counts both sensors read one speed"
    if key == "limits.continuous_current" and design.limits.peak_time_s is None:
        return "idle: without limits.peak_time nothing in the drive acts on it"
    return ""


def changed(design: Design, key: str) -> Iterator[tuple[str, Design | str]]:
    """Models with one key changed by more and more; in place of one that is refused the reason."""
    if key in CHOICES:
        own = chosen(design)[key]
        tried = [(f'"{other}"', other) for other in CHOICES[key] if other != own]
    else:
        value = design.parameters[key].value
        whole = key.endswith(("counts_per_rev", "every"))
        tried = [(f"x {x:g}", round(value * x) if whole else value * x) for x in FACTORS]
        tried = [(words, x) for words, x in tried if x not in (value, 0)]
    for words, other in tried:
        try:
            yield words, design.with_values({key: other})
        except InputError as error:
            yield words, str(error).splitlines()[0]


def rows(design: Design, model: Design) -> Iterator[Row]:
    yield from design_value_rows(design, model)
    for place in map(Bench(design, model).place, Bench(design, model).names):
        yield from small_signal(place)


def first_row(design: Design, model: Design) -> Row | None:
    """The first row that is not met, the numbers of the design first; None: the model passes."""
    try:
        return next((row for row in rows(design, model) if row.verdict is Verdict.NOT_MET), None)
    except (InputError, NumericalError) as error:
        return Row(name="refused", loop="drive", because=str(error), verdict=Verdict.NOT_MET)


def table(name: str) -> Iterator[str]:
    yield f"## {name}\n\n| key | change | seen by | where |\n|---|---|---|---|"
    for key in keys_of(design := load_design(name)):
        change, row, where = seen(design, key)
        yield f"| `{key}` | {change} | {row} | {where} |" if row else f"| `{key}` | | | {where} |"
    yield ""


HEAD = """# What a validation sees of each key

For each key of four shipped drives: the model is changed, the drive that is simulated is not, and the first
row that is not met is told; rows of the design's numbers come before those of small signals. The change is
1 %; of a whole number, or where a row resolves less, a larger one. A key that no row sees has its reason.
Every limiter has an onset row besides, which sees what stands in front of it. The profile of the command has
none: in front of it stands the command itself, so that its onset is `rate` and `acceleration` over the
differences of a sine's samples, and each of its keys is seen by the update that it limits (`command_rate`,
`command_acceleration`, `command_jerk`).
Made by `python -m tests.validation.mutation_table`; tests/validation/test_design_values.py draws from it.
"""


if __name__ == "__main__":
    PAGE.write_text("\n".join([HEAD, *(line for name in DRIVES for line in table(name))]), encoding="utf-8")
