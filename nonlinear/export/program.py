"""The emitted program as two files, ``drive.h`` and ``drive.c``: the same for every design.

What each number of its rows is (name, words, unit) is the comment behind its name in ``_kernels/layout.py``;
units are SI, motor side (linear axis: read N for N m, m for rad, kg for kg m2).
"""

import hashlib
import inspect
import re
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from importlib.resources import files

from actuator_lti.compiled.kinds import FUNCTIONS, Kind
from actuator_lti.compiled.program import Program, emit_c
from actuator_lti.drive.signals import LIMITERS
from nonlinear._kernels import layout as at
from nonlinear._kernels.control import control_tick
from nonlinear._kernels.start import derive, init, part_of_tick, prepare_sizes, retune
from nonlinear._kernels.tick import get, set_state, tick

HEAD = '#include "drive.h"\n\n#include <math.h>\n#include <stdbool.h>\n#include <stdlib.h>\n'

_ROW: Kind = "row"
ENTRIES: dict[Callable[..., object], tuple[Kind, ...]] = {
    prepare_sizes: (_ROW,),
    derive: (_ROW, _ROW),
    init: (_ROW, _ROW),
    tick: (_ROW, _ROW, _ROW),
    control_tick: (_ROW, _ROW, _ROW),
    part_of_tick: (_ROW, _ROW, _ROW, _ROW, "float"),
    retune: (_ROW, _ROW),
    get: (_ROW, _ROW, _ROW),
    set_state: (_ROW, _ROW, _ROW),
}
STATUS = {
    "OK": "went well",
    "TOO_MANY_EVENTS": "more than MAX_EVENTS landings and breakaways in one segment of a tick",
    "NOT_FINITE": "the speed is not finite any more",
    "NO_ROOT": "no time was found for a zero crossing of the speed",
}
FLAGS = {
    **{(f"FLAG_{name.upper().replace('-', '_')}", bit): f"the {name} limit acted"
       for name, bit in zip(at.LIMITERS, at.LIMITER_BITS, strict=True)},
    ("FLAG_AT_REST", at.FLAG_STICK): "the rotor is held by friction",
}  # fmt: skip
_LINE = re.compile(
    r"^\s*(?P<name>[A-Z][A-Z_0-9]*)(?:,|(?:: \w+)? =[^#]*)\s*"
    r"(?:#\s*(?P<words>[^\[]*?)\s*(?:\[(?P<unit>.*)\])?)?$"
)
_SECTION = ("b0", "b1", "b2", "a1", "a2")
# places of a run's row without a name of their own: what, first, behind the last, parts of one
_GROUPS = (
    ("command signal", at.COMMAND, at.BIAS, ()),
    ("bias signal", at.BIAS, at.PROBES, ()),
    *((f"probe at {point}", at.PROBES + k * at.PROBE_SIZE, at.PROBES + (k + 1) * at.PROBE_SIZE, ())
      for k, point in enumerate(at.POINTS)),
    ("command filter", at.COMMAND_CHAIN, at.SPEED_CHAIN, _SECTION),
    ("speed filter", at.SPEED_CHAIN, at.TORQUE_CHAIN, _SECTION),
    ("torque filter", at.TORQUE_CHAIN, at.MAP, _SECTION),
    ("friction map", at.MAP, at.LIMITS, ("speed", "torque")),
    ("law of one's own, A, row by row,", at.OWN_A, at.OWN_B, ()),
    ("law of one's own, B, row by row,", at.OWN_B, at.OWN_C, ()),
    ("law of one's own, C", at.OWN_C, at.OWN_D, ()),
    ("law of one's own, D", at.OWN_D, at.OWN_L, ()),
    ("law of one's own, L", at.OWN_L, at.OWN_START, ()),
    ("law of one's own, start", at.OWN_START, at.SIZE, ()),
)  # fmt: skip


@cache
def _declared() -> dict[str, tuple[str, str]]:
    """Words and unit of each name of the layout, as they stand there; empty where they do not."""
    found = filter(None, map(_LINE.match, inspect.getsource(at).splitlines()))
    return {each["name"]: (each["words"] or "", each["unit"] or "") for each in found}


def said_of(name: str) -> tuple[str, str]:
    """What the layout says of a name beyond the name itself, and its unit; ``""`` where it says nothing."""
    return _declared().get(name, ("", ""))


@cache
def words() -> dict[str, str]:
    """Words and unit of each name of the layout; the name itself where there are no words."""
    texts = {name: said or name.removeprefix("S_").lower().replace("_", " ")
             for name, (said, _) in _declared().items()}  # fmt: skip
    return {name: f"{text} [{unit}]" if (unit := said_of(name)[1]) else text for name, text in texts.items()}


def names_of(first: int, last: int, begin: str = "") -> list[tuple[str, int]]:
    """Names of the layout whose value lies in ``first <= value < last``, in the order of the values."""
    known = [(name, value) for name, value in vars(at).items() if type(value) is int and name in words()]
    chosen = [(name, value) for name, value in known if first <= value < last and name.startswith(begin)]
    return sorted(chosen, key=lambda item: item[1])


def parameter_names() -> list[tuple[str, int]]:
    """The parameters of a run that stand alone, in the order of the row."""
    return [(name, place) for name, place in names_of(0, at.COMMAND) if name in at.COLUMN_NAMES]


def place_words() -> dict[int, str]:
    """What each place of the row of a run is, for every place from 0 to ``layout.SIZE``."""
    table = {place: f"{name}: {words()[name]}" for name, place in parameter_names()}
    for what, first, behind, parts in _GROUPS:
        for k in range(behind - first):
            number, part = divmod(k, max(len(parts), 1))
            table[first + k] = f"{what} {number + 1}" + (f", {parts[part]}" if parts else "")
    own = [(name, limiter) for name, limiter in LIMITERS.items() if at.LIMIT[name] >= at.LIMITS]
    return table | {at.LIMIT[name]: f"{limiter.words} [{limiter.unit()}]" for name, limiter in own}


@cache
def program() -> Program:
    return emit_c(ENTRIES)


def template(name: str) -> str:
    return files("nonlinear.export").joinpath("templates", name).read_text(encoding="utf-8")


def filled(name: str, values: Mapping[str, str]) -> str:
    """A file of the templates folder, what ``@KEY@`` stands for in its place."""
    return replaced(template(name), values)


def replaced(text: str, values: Mapping[str, str]) -> str:
    """A text with what ``@KEY@`` stands for in its place; what is put in is not looked at again."""
    return re.sub(r"@(\w+)@", lambda found: values.get(found[1], found[0]), text)


@cache
def header_text() -> str:
    """``drive.h``: lengths, places in the rows with units and words, prototypes."""
    outputs = [(n, v) for n, v in names_of(at.IO_REFERENCE, at.IO_SIZE, "IO_") if n != "IO_SIZE"]
    derived = [(n, getattr(at, n)) for n in ("DELAY_LINE", "LOAD_VARIES", "STATE_SIZE", "PARAMETER_SIZE")]
    groups = (
        ("Parameters p: of a run, then what drive_derive derives from them", parameter_names()),
        ("Derived parameters that a program may want", derived),
        ("State s", names_of(0, at.S_NOISE, "S_")),
        ("Inputs of a tick, in io", names_of(0, at.IN_PROBE, "IN_")),
        ("Outputs of a tick, in io: what was at its beginning", outputs),
        ("Status", [(name, getattr(at, name)) for name in STATUS]),
        ("Bits of io[DRIVE_IO_FLAGS]", list(FLAGS)),
    )
    blocks = "\n".join(_enum(title, items) for title, items in groups)
    sizes = f"enum {{\n    DRIVE_RUN_SIZE = {at.SIZE}, /* parameters of a run */\n"
    sizes += f"    DRIVE_IO_LENGTH = {at.IO_SIZE}\n}};"
    functions = "\n".join(declared(program(), ENTRIES))
    return filled("drive.h", {"BLOCKS": blocks, "FUNCTIONS": functions, "SIZES": sizes})


def declared(emitted: Program, functions: Iterable[Callable[..., object]]) -> list[str]:
    """Declarations of functions, each below the first line of what it says of itself."""
    about = {each.__name__: (inspect.getdoc(each) or "").partition("\n")[0] for each in functions}
    return [f"/* {about[name]} */\n{text}" for name, text in emitted.declarations.items()]


def _enum(title: str, items: list[tuple[str, int]]) -> str:
    lines = [f"/* {title} */", "enum {"]
    for name, value in items:
        said = STATUS.get(name) or FLAGS.get((name, value)) or words().get(name, "")
        end = "," if (name, value) != items[-1] else ""
        said = said.replace("*/", "* /").replace("/*", "/ *")
        lines.append(f"    DRIVE_{name} = {value}{end}" + (f" /* {said} */" if said else ""))
    return "\n".join([*lines, "};", ""])


@cache
def source_text() -> str:
    """``drive.c``: constants, helpers, types, functions."""
    emitted = program()
    parts = [emitted.constants_text(words()), "", *emitted.helpers, "", emitted.types, "", emitted.functions]
    return template("drive_head.c") + "\n".join([HEAD, *parts])


def source_hash() -> str:
    """SHA-256 of header and source."""
    return hashlib.sha256((header_text() + source_text()).encode()).hexdigest()


def c_text(text: str) -> str:
    """A C string in ASCII; other characters as octal escapes of their UTF-8."""
    plain = "".join(
        chr(byte) if 32 <= byte < 127 and byte not in b'"\\?' else f"\\{byte:03o}" for byte in text.encode()
    )
    return f'"{plain}"'


_NUMBER = re.compile(r"(?<![\w.])(\d+\.\d*(?:e[+-]?\d+)?|\d+e[+-]?\d+)(?![\w.])")
_SAME = {"abs", "isfinite", "isnan", "isinf"}  # type-generic, or of whole numbers
_CALLS = re.compile(rf"\b({'|'.join(sorted({*FUNCTIONS.split()} - _SAME, key=len, reverse=True))})\(")
_KEPT = re.compile(r'(/\*.*?\*/|"[^"\n]*")', re.DOTALL)  # comments and texts


_LARGEST, _SMALLEST = 3e38, 1e-37  # of single precision, rounded inwards


def _literal(result: re.Match[str]) -> str:
    """A literal in single precision; one beyond its range stands for never, or for almost nothing."""
    value = float(result[1])
    if value > _LARGEST:
        return f"{_LARGEST!r}f"
    return f"{_SMALLEST!r}f" if 0.0 < value < _SMALLEST else f"{result[1]}f"


def single(text: str) -> str:
    """The same source in single precision: types, literals and functions of the C library."""
    parts = _KEPT.split(text)
    for k in range(0, len(parts), 2):  # these stay
        code = parts[k].replace("(double)", "(float)")
        code = re.sub(r"\bdouble\b", "float", code)
        parts[k] = _CALLS.sub(r"\1f(", _NUMBER.sub(_literal, code))
    return "".join(parts)
