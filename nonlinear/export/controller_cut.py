"""The controller cut out of the tick of one design: what the kernels leave where its parameters are known."""

import ast
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial

from actuator_lti.compiled.form import number
from actuator_lti.compiled.kernel import kernel
from actuator_lti.compiled.kinds import Kind
from actuator_lti.compiled.program import Program
from actuator_lti.compiled.residual import Leftover, Residual
from actuator_lti.compiled.structs import Member, Rows, Struct, emit_structs, split_index
from actuator_lti.compiled.unread import without_unread
from actuator_lti.design.law import LAW_INPUTS
from actuator_lti.design.model import Design
from actuator_lti.types import Floats
from nonlinear._kernels import layout
from nonlinear._kernels.blocks import counted, measured_speed
from nonlinear._kernels.control import control
from nonlinear._kernels.state_kinds import COUNTER, state_kinds
from nonlinear._kernels.tick import init_command, init_controller, init_estimate
from nonlinear.export.c_files import exported_row
from nonlinear.export.controller_names import SIGNAL_AT, member_name
from nonlinear.native import parameters

MOTOR_COUNTS, OUTPUT_COUNTS = layout.IO_SIZE, layout.IO_SIZE + 1  # places of inputs that are whole numbers
_SINGLE = {"STANDING": 1e-6}  # what is no change of a reference but rounding, in single precision


@kernel
def controller_step(p, s, io, to):  # type: ignore[no-untyped-def]
    """One tick of the controller: measured values in, voltage out; call it every period."""
    if p[layout.SUPPLY] > 0.0:
        s[layout.S_VOLTAGE_LIMIT] = io[layout.IN_BUS]
    control(p, s, io, io[layout.IN_CURRENT], io[layout.IN_SPEED], io[layout.IN_ANGLE])
    to[layout.IO_VOLTAGE] = s[layout.S_VOLTAGE]
    if p[layout.HAS_CURRENT] > 0.0:
        to[layout.IO_CURRENT_COMMAND] = s[layout.S_CURRENT_REFERENCE]
    if p[layout.HAS_VELOCITY] > 0.0:
        to[layout.IO_SPEED_COMMAND] = s[layout.S_SPEED_REFERENCE]
    to[layout.IO_FLAGS] = s[layout.S_FLAGS_OUTER] + s[layout.S_FLAGS_VELOCITY] + s[layout.S_FLAGS_CURRENT]


@kernel
def controller_start(p, s):  # type: ignore[no-untyped-def]
    """State before the first tick: at rest at the measured angle."""
    init_controller(p, s)
    init_estimate(p, s)
    init_command(p, s)


ENTRIES = (controller_start, controller_step)
_NAMES = tuple(each.__name__ for each in ENTRIES)


@dataclass(frozen=True, kw_only=True)
class Controller:
    """The controller of a design as C in double precision."""

    design: Design
    p: Floats  # the parameters of the design with all that is derived from them
    program: Program
    # What it remembers, is given and gives
    state: Struct
    measured: Struct
    out: Struct
    angles: frozenset[int]  # places of counts that are read as angles, not in differences alone

    def counts_per_rad(self, place: int) -> float:
        """Of the motor's sensor or the output's, as `MOTOR_COUNTS` and `OUTPUT_COUNTS` are counted."""
        p, at_output = self.p, place == OUTPUT_COUNTS
        speed = p[layout.COUNTS_PER_RAD] if at_output == (p[layout.SPEED_SENSOR] > 0.0) else 0.0
        angle = p[layout.POSITION_COUNTS] if at_output == (p[layout.OUTPUT_SENSOR] > 0.0) else 0.0
        own = p[layout.OWN_OUTPUT_COUNTS if at_output else layout.OWN_COUNTS]
        of_output = p[layout.RATIO] if at_output else 1.0
        return float(angle or own or speed * of_output)


def controller_of(design: Design, prefix: str, *, single_precision: bool = False) -> Controller:
    """Cut the controller out of the tick."""
    p = parameters(exported_row(design))[0]
    functions = _followed(p, single_precision)
    structs = _structs(design, p, prefix, functions.values())
    rows = Rows(structs, float(p[layout.COUNTS_PER_RAD]))
    _zeroed(functions["controller_start"], structs["s"])
    entries: dict[str, list[Kind]] = {name: ["row"] * len(functions[name].arguments) for name in _NAMES}
    program = emit_structs(functions, entries, prefix, rows)
    measured = {each.name: each for row in ("p", "io") for each in structs[row].members}
    structs["io"] = replace(structs["io"], members=tuple(measured.values()))
    state, seen, out = (structs[row] for row in ("s", "io", "to"))
    angles = frozenset(_angles(functions.values()))
    return Controller(design=design, p=p, program=program, state=state, measured=seen, out=out, angles=angles)


def _followed(p: Floats, single_precision: bool) -> dict[str, Leftover]:
    """What is left of step and start, with the numbers of the state that never change in their places."""
    bounds, named = begins(p), _SINGLE if single_precision else {}
    constant: dict[int, float] = {}
    while True:
        residual = Residual(partial(_look, p, constant), {counted: partial(_counts, p)}, named)
        residual.follow(controller_step).arguments = ("s", "io", "to")
        residual.follow(controller_start).arguments = ("s", "p")
        functions = without_unread(residual.functions, _NAMES, partial(_owner, bounds))
        found = constant | _never_changed(functions, bounds)
        if found == constant:
            return functions
        constant = found


def _look(p: Floats, constant: dict[int, float], row: str, place: int) -> float | None:
    if row == "s":
        return constant.get(place)
    return float(p[place]) if row == "p" and place not in (layout.ANGLE_START, layout.OUTPUT_START) else None


def _counts(p: Floats, arguments: list[ast.expr], caller: Leftover) -> ast.expr | None:
    """The count that stands for an angle as counted."""
    angle, scale = arguments
    if not isinstance(scale, ast.Constant) or number(scale) <= 0.0:
        return None
    speed = caller.python in (measured_speed, init_estimate)  # made of differences of counts
    output = p[layout.SPEED_SENSOR] > 0.0 if speed else isinstance(angle, ast.Subscript)
    place = OUTPUT_COUNTS if output else MOTOR_COUNTS
    row = ast.Name("io" if "io" in caller.arguments else "p", ast.Load())
    count = ast.Subscript(row, ast.Constant(place), ast.Load())
    if speed:
        return count
    return ast.BinOp(ast.Call(ast.Name("float", ast.Load()), [count], []), ast.Div(), scale)


def _angles(functions: Iterable[Leftover]) -> Iterator[int]:
    """Places of the counts that `_counts` made an angle of."""
    for node in (node for left in functions for node in ast.walk(left.tree)):
        match node:
            case ast.Call(func=ast.Name("float"), args=[ast.Subscript(ast.Name("io" | "p"), index)]):
                yield _begin(index)


def begins(p: Floats) -> dict[int, str]:
    """Name of each part of the state by its first place."""
    places = {name: value for name, value in vars(layout).items() if type(value) is int}
    result = {value: name for name, value in places.items() if name.startswith("S_")}
    result |= {int(p[value]): name for name, value in places.items() if name.startswith("AT_")}
    if p[layout.OWN_STAGE] > 0.0:
        own, work = int(p[layout.AT_OWN]), int(p[layout.AT_WORK])
        result |= {work + j: f"LAW_{name.upper()}" for j, name in enumerate(LAW_INPUTS)}
        result[work + layout.OWN_INPUTS] = "LAW_NEXT"
        if p[layout.OWN_STATES] > 0.0:
            result[own] = "LAW_STATES"
    return dict(sorted(result.items()))


def _owner(bounds: dict[int, str], row: str, index: ast.expr) -> str | None:
    """The part of the state that an element belongs to; None in other rows."""
    place = _begin(index)
    return bounds[max(begin for begin in bounds if begin <= place)] if row == "s" else None


def _begin(index: ast.expr) -> int:
    return split_index(index)[0]  # the known part of an index


def _elements(functions: Iterable[Leftover], row: str) -> list[ast.Subscript]:
    nodes = (node for left in functions for node in ast.walk(left.tree) if isinstance(node, ast.Subscript))
    return [node for node in nodes if isinstance(node.value, ast.Name) and node.value.id == row]


def _never_changed(functions: dict[str, Leftover], bounds: dict[int, str]) -> dict[int, float]:
    """Single numbers of the state that only the start writes, as a constant, or nobody."""
    start = {"controller_start", *(name for name in functions if name.startswith(("init_", "settle")))}
    running = _elements((left for name, left in functions.items() if name not in start), "s")
    changed = {_owner(bounds, "s", node.slice) for node in running if isinstance(node.ctx, ast.Store)}
    begun: dict[int, float | None] = {}
    for name in start & set(functions):
        for node in ast.walk(functions[name].tree):
            if isinstance(node, ast.Assign):
                value = float(number(node.value)) if isinstance(node.value, ast.Constant) else None
                begun |= {_begin(t.slice): value for t in node.targets if isinstance(t, ast.Subscript)}
    single = [node for node in _elements(functions.values(), "s") if isinstance(node.slice, ast.Constant)]
    read = {_begin(node.slice) for node in single if _owner(bounds, "s", node.slice) not in changed}
    return {place: value for place in read if (value := begun.get(place, 0.0)) is not None}


def _structs(design: Design, p: Floats, prefix: str, functions: Iterable[Leftover]) -> dict[str, Struct]:
    functions = list(functions)
    result = {"s": Struct(f"{prefix}controller_state", "state", tuple(_state(design, p, functions)))}
    for row, name, argument in (("p", "input", "in"), ("io", "input", "in"), ("to", "output", "out")):
        members = tuple(_members(design, functions, row))
        result[row] = Struct(f"{prefix}controller_{name}", argument, members)
    return result


def _state(design: Design, p: Floats, functions: list[Leftover]) -> Iterable[Member]:
    bounds = begins(p)
    ends = dict(zip(bounds, [*list(bounds)[1:], int(p[layout.STATE_SIZE])], strict=True))
    kinds = state_kinds(p)
    nodes = _elements(functions, "s")
    for begin, name in bounds.items():
        ours = [node.slice for node in nodes if _owner(bounds, "s", node.slice) == name]
        if not ours:
            continue
        places = [_begin(index) for index in ours]
        whole = all(isinstance(index, ast.Constant) for index in ours)
        length = (max(places) + 1 if whole else ends[begin]) - begin
        count = name == "AT_ANGLES" and p[layout.COUNTS_PER_RAD] > 0.0
        is_int = kinds[begin] == COUNTER or name.startswith("S_FLAGS_")
        kind: Kind = "count" if count else "int" if is_int else "float"
        several = ends[begin] - begin > 1 or name == "LAW_STATES"
        yield Member(member_name(design, name, counts=count), begin, length if several else 0, kind)


def _members(design: Design, functions: list[Leftover], row: str) -> Iterable[Member]:
    used = {_begin(node.slice) for node in _elements(functions, row)}
    for place in sorted(used):
        kind: Kind = "int" if place == layout.IO_FLAGS else "float"
        if name := {MOTOR_COUNTS: "motor_counts", OUTPUT_COUNTS: "output_counts"}.get(place):
            yield Member(name, place, 0, "count")
        else:
            yield Member(member_name(design, SIGNAL_AT[place]), place, 0, kind)


def _zeroed(start: Leftover, state: Struct) -> None:
    """Begin with zero in what the start itself leaves."""
    for each in reversed(state.members):
        text = f"for j in range({each.length}): s[{each.first} + j] = 0.0"
        start.tree.body[:0] = ast.parse(text if each.length else f"s[{each.first}] = 0.0").body
