"""An outer loop around a drive: an airframe with its controller, given as a linear system, closed and judged.

With T the drive from its command to what its outermost loop moves, and G the outer loop from there to what is
added to the command with the sign ``s`` (-1: negative feedback), the loop is broken at the command:

    L = -s G T,   the command is  r + s G y.

In the sampled form the command is held over ``k`` updates of the drive's outermost loop, which takes the mean
of the last of them where its jerk is limited, and the outer loop reads ``y`` at these instants; all are
exact.  A continuous G becomes the sampled system that takes ``y`` as held over its period. Read from a JSON
file: coefficients or matrices, sampling, sign, names.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isfinite
from os import PathLike
from typing import Any

import control
import numpy as np

from actuator_lti.drive.profile import command_mean
from actuator_lti.drive.signals import SIGNALS
from actuator_lti.drive.wiring import COMMANDS
from actuator_lti.errors import InputError
from actuator_lti.files.reading import read_json, shown_path
from actuator_lti.loops.result import Loop, Loops

_SAME_TIME = 1e-9


@dataclass(frozen=True)
class OuterLoop:
    """A linear system around a drive."""

    name: str  # what it is; what it reads and gives
    input: str
    output: str
    system: control.StateSpace  # one input, one output; ``dt`` 0 where continuous
    sampling_period_s: float | None = None  # of a continuous system, its output held; ``None``: not said
    sign: int = -1  # with which the output is added to the command

    @property
    def continuous(self) -> bool:
        return self.system.dt == 0


def loop_around(loops: Loops, outer: OuterLoop) -> Loop:
    """The loop of an outer system around a drive, broken at the drive's command.

    Raises `InputError`: for a sampled system around continuous loops, one without a sampling period around
    sampled ones, a period that is no whole multiple of that of the drive's outermost loop, or a mean of the
    command's samples in a form that has none.

    >>> import control
    >>> from actuator_lti import assemble_loops
    >>> airframe = control.ss([[-2.0]], [[60.0]], [[0.5]], [[0.0]])
    >>> loop_around(assemble_loops("ilr33-amber"), OuterLoop("roll rate", "fin", "command", airframe, 1e-3))
    Loop(roll rate, broken at command, in rad, every 1 ms)
    """
    drive, system, period = loops.reference_to_output, outer.system, None
    mean = command_mean(loops.design)
    if drive is None:
        raise InputError("--around: these loops have no response to a command", where=loops.design.name)
    if loops.form == "sampled":
        system, period = _sampled(outer, float(drive.dt))
        drive = held(control.ss(drive), round(period / float(drive.dt)), 1 if mean is None else mean.samples)
    elif mean is not None:
        what = f"command.jerk: the mean of {mean.samples} samples that it makes of the command"
        raise InputError(f"{what} is a sampled one; allowed with --around: --form sampled", where=outer.name)
    elif not outer.continuous:
        message = f"dt: a sampled outer loop; allowed with --form {loops.form}: a continuous one (dt = 0)"
        raise InputError(message, where=outer.name)
    around = drive * (-outer.sign * system)
    if isinstance(around, control.StateSpace):
        one = control.ss([], [], [], [[1.0]], around.dt)
    else:
        one = type(around).from_system(control.ss([], [], [], [[1.0]]))
    unit = SIGNALS[COMMANDS[loops.design.controller.outermost]].unit_for(loops.design.axis)
    closed, sensitivity = around.feedback(1), one.feedback(around)
    return Loop(outer.name, "command", around, closed, sensitivity, period, unit_in=unit, unit_out=unit)


def _sampled(outer: OuterLoop, drive_s: float) -> tuple[control.StateSpace, float]:
    """The outer system at its instants, and their period."""
    period = outer.sampling_period_s if outer.continuous else float(outer.system.dt)
    if period is None:
        message = "sampling_period: missing; allowed: a time in s, as the drive is sampled (or --form ideal)"
        raise InputError(message, where=outer.name)
    times = round(period / drive_s)
    if times < 1 or abs(times * drive_s - period) > _SAME_TIME * period:
        key = "sampling_period" if outer.continuous else "dt"
        allowed = f"whole multiples of {drive_s:g} s, the period of the command"
        raise InputError(f"{key} = {period:g} s: allowed: {allowed}", where=outer.name)
    if outer.continuous:
        return control.ss(control.sample_system(outer.system, period, method="zoh")), period
    return outer.system, period


def held(system: control.StateSpace, times: int, mean: int) -> control.StateSpace:
    """A sampled system at every ``times``-th instant, behind a mean of samples of its input, held so long.

    Its states are followed by the inputs before this one that the mean still takes, the last first.
    """
    older, ages = -(-(mean - 1) // times), np.arange(mean)
    shares = [np.bincount(-((j - ages) // times), minlength=older + 1) / mean for j in range(times)]
    A, B = np.eye(len(system.A)), np.zeros((len(system.A), older + 1))
    for share in shares:
        A, B = system.A @ A, system.A @ B + system.B * share
    whole = np.block([[A, B[:, 1:]], [np.zeros((older, len(A))), np.eye(older, k=-1)]])
    first, direct = np.vstack([B[:, :1], np.eye(older, 1)]), system.D * shares[0]
    return control.ss(whole, first, np.hstack([system.C, direct[:, 1:]]), direct[:, :1], times * system.dt)


COEFFICIENTS, MATRICES = ("num", "den"), ("A", "B", "C", "D")
_TIMES = ("dt", "sampling_period")
_WORDS = {"name": "outer loop", "input": "output of the drive", "output": "command of the drive"}
_ALLOWED = "num and den, or A, B, C and D; dt, sampling_period, sign, name, input, output"
MOST_STATES = 200


def read_outer_loop(path: str | PathLike[str]) -> OuterLoop:
    """Read an outer loop from a JSON file: one object with these keys.

    ``num`` and ``den`` (coefficients, highest power first), or ``A``, ``B``, ``C``, ``D`` (lists of rows);
    ``dt`` in s, 0 for a continuous system; ``sampling_period`` in s of a continuous one that a sampled drive
    is closed around; ``sign`` -1 (usual) or 1; ``name``, ``input``, ``output``.

    Raises `InputError`: for anything else, naming file, key and what is allowed.
    """
    return outer_loop(read_json(path, "JSON file of an outer loop"), shown_path(path))


def outer_loop(table: Any, where: str) -> OuterLoop:
    """An outer loop from the object of a file, see `read_outer_loop`."""
    if not isinstance(table, dict):
        raise InputError(f"an outer loop is one object; allowed keys: {_ALLOWED}", where=where)
    for key, value in table.items():
        if key not in _KEYS:
            raise InputError(f"{key}: no such key; allowed: {_ALLOWED}", where=where)
        allowed, fits = _KEYS[key]
        if not fits(value):
            raise InputError(f"{key}: allowed: {allowed}", where=where)
    dt, sampling = (None if table.get(key) is None else float(table[key]) for key in _TIMES)
    if dt is None:
        raise InputError("dt: missing; allowed: the sampling period in s, or 0 for continuous", where=where)
    if sampling == 0.0 or (sampling is not None and dt > 0.0):
        message = "sampling_period: allowed: a time > 0 in s, for a continuous system (dt = 0)"
        raise InputError(message, where=where)
    words = {key: table.get(key, usual) for key, usual in _WORDS.items()}
    system, sign = _system(table, dt, where), int(table.get("sign", -1))
    return OuterLoop(system=system, sampling_period_s=sampling, sign=sign, **words)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)


def _is_list(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(map(_is_number, value))


def _is_matrix(value: Any) -> bool:
    return isinstance(value, list) and all(map(_is_list, value)) and len({len(row) for row in value}) == 1


_KEYS: dict[str, tuple[str, Callable[[Any], bool]]] = {
    **dict.fromkeys(COEFFICIENTS, ("a list of numbers, all finite", _is_list)),
    **dict.fromkeys(MATRICES, ("a list of rows of as many numbers each, all finite", _is_matrix)),
    **dict.fromkeys(
        _TIMES,
        (
            "a time in s, at least 0",
            lambda value: value is None or (_is_number(value) and 0.0 <= value < 1e6),
        ),
    ),
    **dict.fromkeys(_WORDS, ("a text", lambda value: isinstance(value, str) and bool(value.strip()))),
    "sign": ("-1 (negative feedback) or 1", lambda value: _is_number(value) and value in (-1, 1)),
}


def _system(table: Mapping[str, Any], dt: float, where: str) -> control.StateSpace:
    given = {key for key in (*COEFFICIENTS, *MATRICES) if key in table}
    if given == set(COEFFICIENTS):
        num, den = (np.trim_zeros(np.array(table[key], dtype=float), "f") for key in COEFFICIENTS)
        if den.size == 0 or num.size == 0:
            raise InputError("num, den: all zero; allowed: one coefficient that is not", where=where)
        if num.size > den.size:
            raise InputError("num: of a higher degree than den; allowed: a proper system", where=where)
        if den.size - 1 > MOST_STATES:
            raise InputError(f"den: more than {MOST_STATES} poles; allowed: fewer", where=where)
        return control.ss(control.tf(num, den, dt))
    if given != set(MATRICES):
        raise InputError(f"allowed: {_ALLOWED}", where=where)
    A, B, C, D = (np.array(table[key], dtype=float) for key in MATRICES)
    n = A.shape[0]
    if A.shape != (n, n) or B.shape != (n, 1) or C.shape != (1, n) or D.shape != (1, 1) or n > MOST_STATES:
        message = f"A, B, C, D: allowed: n by n, n by 1, 1 by n and 1 by 1, n at most {MOST_STATES}"
        raise InputError(message, where=where)
    return control.ss(A, B, C, D, dt)
