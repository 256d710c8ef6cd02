"""Test vectors of a controller: states, inputs and outputs of the simulator, with the bound of rounding."""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from actuator_lti.compiled.kinds import Kind, c_float
from actuator_lti.compiled.structs import Member, Struct
from actuator_lti.design.field import BIG
from actuator_lti.types import Floats
from nonlinear._kernels import layout as at
from nonlinear.export.c_files import exported_row
from nonlinear.export.controller_cut import MOTOR_COUNTS, Controller
from nonlinear.export.program import filled
from nonlinear.export.variables import sizes
from nonlinear.native import control_tick, parameters, tick

Vector = tuple[Floats, Floats]  # state before a tick, and what the controller sees
STRETCHES, STEPS = 8, 12  # stretches of a run, and ticks of each
APART = 40  # updates of the outermost stage from one stretch, and step of the command, to the next
MOST_NUMBERS = 4000  # of the states in one stretch
SEED = 1
ROUNDINGS = 16  # one behind the other, on the way from an input to an output; and those of a law's sums
LONG = 32  # an array of more numbers is moved as a whole
_MOVE, _DOUBLE = 2.0**-24, 2.0**-29  # half an ulp of single precision; of double precision, of that
_LARGEST, _TRIED = 2.0**30, 12
_OUT = {at.IO_VOLTAGE: at.S_VOLTAGE, at.IO_CURRENT_COMMAND: at.S_CURRENT_REFERENCE,
        at.IO_SPEED_COMMAND: at.S_SPEED_REFERENCE}  # fmt: skip
_FLAGS = (at.S_FLAGS_OUTER, at.S_FLAGS_VELOCITY, at.S_FLAGS_CURRENT)


def vectors_of(ours: Controller, *, single_precision: bool) -> list[Vector]:
    """Stretches of a run under a command of random steps, large enough for limits to act.

    Ticks are left out where rounding decides whether a limit acts, and those of an unstable drive from
    where its numbers are no counts any more.
    """
    rng, (p, s) = np.random.default_rng(SEED), parameters(exported_row(ours.design))
    io, every = np.zeros(at.IO_SIZE), int(p[at.OUTER_EVERY])
    numbers = sum(max(each.length, 1) for each in ours.state.members)
    steps, apart = int(np.clip(MOST_NUMBERS // numbers, 2, STEPS)), APART * every
    size = sizes(ours.design)["command"]
    result = []
    for k in range((STRETCHES - 1) * apart + steps):
        if k % apart == 0:
            io[at.IN_COMMAND] = rng.uniform(-1.0, 1.0) * (size if 0.0 < size < BIG else 1.0)
        before = s.copy()
        tick(p, s, io)
        vector = before, seen_by(p, before, io)
        if not _is_moderate(ours, vector):
            break
        if k % apart < steps and _is_decided(ours, vector, rng, 1.0 if single_precision else _DOUBLE):
            result.append(vector)
    return result


def _is_moderate(ours: Controller, vector: Vector) -> bool:
    rows = ((ours.state, vector[0]), (ours.measured, vector[1]), (ours.out, after(ours, vector)))
    numbers = np.concatenate([each for struct, row in rows for each in values_in(ours, struct, row)])
    return bool(np.all(np.abs(numbers) < _LARGEST))


def _is_decided(ours: Controller, vector: Vector, rng: np.random.Generator, scale: float) -> bool:
    """Whether the whole numbers stay where all others are moved by random shares of the roundings."""
    whole = _all_places(ours.state, "int")
    plain, size = after(ours, vector)[whole], roundings(ours) * _MOVE * scale
    places = [_all_places(struct, "float") for struct in (ours.state, ours.measured)]
    for _ in range(_TRIED):
        moved = vector
        for which, place in enumerate(places):
            moved = _moved_at(ours, moved, which, place, size * rng.uniform(-1.0, 1.0, place.size))
        if not np.array_equal(after(ours, moved)[whole], plain):
            return False
    return True


def roundings(ours: Controller) -> int:
    """Roundings one behind the other: a law of one's own adds a sum over its states and inputs."""
    own = ours.design.controller.own_law
    return ROUNDINGS + (len(own[1].A) + len(own[1].inputs) if own else 0)


def _places(struct: Struct, member: Member) -> npt.NDArray[np.intp]:
    """Where the row of the state, or of inputs, has what a member is."""
    elsewhere = {"out": _OUT, "in": {at.ANGLE_START: at.IN_ANGLE, at.OUTPUT_START: at.IN_OUTPUT}}.get(
        struct.argument, {}
    )
    first = elsewhere.get(member.first, member.first)
    return np.arange(first, first + max(member.length, 1))


def _all_places(struct: Struct, kind: Kind) -> npt.NDArray[np.intp]:
    """The same of all members of a kind."""
    places = (_places(struct, each) for each in struct.members if each.kind == kind)
    return np.concatenate([np.zeros(0, np.intp), *places])


def seen_by(p: Floats, s: Floats, io: Floats) -> Floats:
    """What the controller has seen at a tick: the instruments' values, or the state before it."""
    inputs = io.copy()
    if p[at.HAS_INSTRUMENTS] <= 0.0:
        inputs[[at.IN_CURRENT, at.IN_SPEED, at.IN_ANGLE]] = s[[at.S_CURRENT, at.S_SPEED, at.S_ANGLE]]
    return inputs


def values_in(ours: Controller, struct: Struct, row: Floats) -> list[Floats]:
    """Numbers of each member of a structure, from the row that it stands for."""
    return [_value(ours, struct, each, row) for each in struct.members]


def _value(ours: Controller, struct: Struct, member: Member, row: Floats) -> Floats:
    p = ours.p
    if member.first == at.IO_FLAGS and struct is ours.out:
        return row[list(_FLAGS)].sum(keepdims=True)
    if struct is ours.measured and member.kind == "count":
        angle, per_rad = row[at.IN_OUTPUT], ours.counts_per_rad(member.first)
        if member.first == MOTOR_COUNTS:
            angle = row[at.IN_ANGLE]
        elif p[at.SPEED_SENSOR] > 0.0 and p[at.COUNTS_PER_RAD] > 0.0:  # rounded as the tick does
            angle, per_rad = p[at.RATIO] * angle, p[at.COUNTS_PER_RAD]
        return np.floor(np.array([angle]) * per_rad)
    values = row[_places(struct, member)]
    return np.rint(values * p[at.COUNTS_PER_RAD]) if member.kind == "count" else values


def after(ours: Controller, vector: Vector) -> Floats:
    s = vector[0].copy()
    control_tick(ours.p, s, vector[1].copy())
    return s


def rounding_bounds(ours: Controller, vectors: list[Vector], *, single_precision: bool) -> list[list[float]]:
    """How far rounding moves each member of output and state in one tick, to first order.

    Every number of input and state is moved by half an ulp, the effects are added up and taken
    `roundings` times, as many as there are operations one behind the other; the vector that is most is told.
    """
    scale, of_counts = (1.0, _DOUBLE) if single_precision else (_DOUBLE, 1.0)
    places = [_places(struct, each) for struct in (ours.out, ours.state) for each in struct.members]
    read = np.concatenate(places)
    size = np.where(read == at.S_OVERLOAD_REST, at.S_OVERLOAD, read)  # a sum's rest: of the sum's rounding
    worst = np.zeros(read.size)
    for vector in vectors:
        plain = after(ours, vector)
        total, plain = _MOVE * np.abs(plain[size]), plain[read]
        for moved, weight in _moved(ours, vector, of_counts):
            total += weight * np.abs(after(ours, moved)[read] - plain)
        worst = np.maximum(worst, roundings(ours) * scale * total)
    ends = np.cumsum([each.size for each in places])
    bounds = [float(each.max()) for each in np.split(worst, ends[:-1])]
    return [bounds[: len(ours.out.members)], bounds[len(ours.out.members) :]]


def _moved(ours: Controller, vector: Vector, of_counts: float) -> Iterator[tuple[Vector, float]]:
    """Vectors with one number moved, and the weight of each: counts are angles in the simulator alone."""
    for which, struct in enumerate((ours.state, ours.measured)):
        for each in struct.members:
            if each.kind == "int" or (each.kind == "count" and which):
                continue
            all_of = _places(struct, each)
            for place in [all_of] if each.length > LONG else np.split(all_of, all_of.size):
                yield _moved_at(ours, vector, which, place, _MOVE), of_counts if each.kind == "count" else 1.0


def _moved_at(
    ours: Controller, vector: Vector, which: int, place: npt.NDArray[np.intp], by: float | Floats
) -> Vector:
    """A vector with numbers moved, either way, so that no count goes on to the next."""
    counted = [each for each in ours.measured.members if which and each.kind == "count"]
    for way in (1.0, -1.0):
        state, seen = moved = vector[0].copy(), vector[1].copy()
        moved[which][place] *= 1.0 + way * by
        rows = (seen, vector[1])
        now, then = ([_value(ours, ours.measured, each, row) for each in counted] for row in rows)
        if now == then:
            return state, seen
    return vector


def vectors_text(ours: Controller, prefix: str, *, single_precision: bool) -> str:
    """``vectors.h``: the vectors, and what is compared with which bound."""
    vectors = vectors_of(ours, single_precision=single_precision)
    bounds = rounding_bounds(ours, vectors, single_precision=single_precision)
    structs, rows = (ours.state, ours.measured, ours.out, ours.state), []
    for vector in vectors:
        behind = after(ours, vector)
        parts = zip(structs, (*vector, behind, behind), strict=True)
        rows.append("    {" + ", ".join(_initialiser(ours, struct, row) for struct, row in parts) + "}")
    checks = []
    for struct, row in zip((ours.out, ours.state), bounds, strict=True):
        lines = ",\n".join(_check(struct, *each) for each in zip(struct.members, row, strict=True))
        checks.append(f"static const check {struct.argument}_checks[] = {{\n{lines}\n}};")
    counts = {"VECTORS": vectors, "OUT_CHECKS": ours.out.members, "STATE_CHECKS": ours.state.members}
    texts = {"prefix": prefix, "CHECKS": "\n".join(checks), "ROWS": ",\n".join(rows)}
    return filled("controller_vectors.h", {name: str(len(each)) for name, each in counts.items()} | texts)


def _check(struct: Struct, member: Member, bound: float) -> str:
    whole = member.kind != "float"
    name = f'"{member.name}", offsetof({struct.type}, {member.name})'
    return f"    {{{name}, {max(member.length, 1)}, {int(whole)}, {0.0 if whole else bound!r}}}"


def _initialiser(ours: Controller, struct: Struct, row: Floats) -> str:
    texts = []
    for member, values in zip(struct.members, values_in(ours, struct, row), strict=True):
        numbers = [c_float(float(x)) if member.kind == "float" else str(int(x)) for x in values]
        texts.append(f"{{{', '.join(numbers)}}}" if member.length else numbers[0])
    return f"{{{', '.join(texts)}}}"
