"""`actuator-lti export c`: header, source, the design's parameters, an example and a README."""

import re

from actuator_lti.compiled.kinds import c_float
from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Design
from actuator_lti.design.plant import DC_PER_A
from actuator_lti.design.writing import design_hash
from actuator_lti.errors import InputError
from actuator_lti.start.extras import package_version
from actuator_lti.types import Floats
from nonlinear._kernels import elastic_layout as elastic
from nonlinear._kernels import layout as at
from nonlinear.export import program
from nonlinear.native import parameters
from nonlinear.row.elastic import is_elastic
from nonlinear.row.parameters import design_row

SPARE_LEVELS = 3  # halvings of the period beyond those of the design


def exported_row(design: Design) -> Floats:
    """Parameters of a run: the design at rest, its load torque an input."""
    row = design_row(design)
    row[at.LOAD_TABLE_LENGTH] = 1.0  # the load of a tick is looked at
    return row


def spare_parameters(p: Floats) -> int:
    """Numbers to keep free in p so that a coupling may become ``4**SPARE_LEVELS`` times as stiff."""
    if p[at.ELASTIC_DRIVE] <= 0.0:
        return 0
    modes = (p.size - elastic.EL_MODES) // int(p[elastic.EL_MODE_SIZE])
    return SPARE_LEVELS * modes * (1 + elastic.STEP_SIZE)


def c_export(design: AnyDesign, *, single_precision: bool = False, prefix: str = "drive_") -> dict[str, str]:
    """Files of an export, by name.

    ``single_precision``: ``float`` in place of ``double``.
    ``prefix``: in front of the design's own files and symbols, so that several designs share ``drive.c`` in
    one program.

    Raises `InputError`: in single precision, for a design with noise (its random streams need 53 bits) or an
    elastic drive train (its events are located to the rounding of double precision); for a prefix that no
    name in C begins with.
    """
    design = as_design(design)
    refuse_prefix(prefix)
    if single_precision:
        _refuse_single(design)
    row = exported_row(design)
    p, s = parameters(row)
    values = _values(design, row) | {"P": str(p.size), "S": str(s.size), "HASH": program.source_hash()}
    texts = {"drive.h": program.header_text(), "drive.c": program.source_text()}
    texts |= {f"{prefix}{name}": program.filled(name, values) for name in ("design.h", "design.c")}
    if single_precision:
        texts = {name: program.single(text) for name, text in texts.items()}
    texts["main.c"] = program.filled("main.c", {"REAL": "float" if single_precision else "double"})
    texts["README.md"] = program.filled("README.md", values | _readme(design, p, s, single_precision))
    names = {"prefix": prefix, "PREFIX": prefix.upper()}
    return {name: program.replaced(text, names) for name, text in texts.items()}


def refuse_prefix(prefix: str) -> None:
    """Refuse what no name in C begins with, by an `InputError` that says what is allowed."""
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*_", prefix):
        lacks = "no _ last; " * (not prefix.endswith("_"))
        raise InputError(f"prefix = {prefix!r}: {lacks}allowed: letters, digits, _; a letter first, _ last")


def _refuse_single(design: Design) -> None:
    seen, message = design.instruments, ""
    if any((seen.current_noise_A, seen.angle_noise_rad, seen.output_angle_noise_rad, seen.jitter_s)):
        message = "instruments: noise and jitter need double precision; allowed: none of them"
    elif is_elastic(design):
        elastic = design.coupling is not None
        key = "coupling: an elastic drive train" if elastic else "friction.point: a friction map"
        message = f"{key} needs double precision; allowed: a design without it"
    if message:
        raise InputError(f"{message}, or no --single", where=design.origin or design.name)


def amperes_words(design: Design) -> str:
    """What A and V of an AC motor are (docs/model.md, section 1); nothing of a DC motor's.

    >>> amperes_words(as_design("ballscrew"))
    'Of an equivalent DC motor: 1.225 A is 1 A rms, 0.866 A is 1 A peak of a phase, V is peak line-line.'
    """
    if design.motor.constants == "dc":
        return ""
    rms, peak = (f"{DC_PER_A[one]:.4g} A is 1 A" for one in ("rms-line", "peak-phase"))
    return f"Of an equivalent DC motor: {rms} rms, {peak} peak of a phase, V is peak line-line."


def stage_words(design: Design) -> tuple[str, str]:
    """What the command of the outermost stage is, and its unit."""
    angle, unit = ("output position", "m") if design.axis == "linear" else ("output angle", "rad")
    table = {
        "position": (angle, unit),
        "velocity": ("output speed", f"{unit}/s"),
        "current": ("motor current", "A"),
        "voltage": ("motor voltage", "V"),
    }
    return table[design.controller.outermost]


def _values(design: Design, row: Floats) -> dict[str, str]:
    """What stands for the words of ``design.h`` and ``design.c``."""
    known = program.place_words()
    lines = [
        f"    p[{place}] = {c_float(float(value))}; /* {plain(known[place])} */"
        for place, value in enumerate(row)
        if value != 0.0 or place < at.COMMAND  # signals, probes and chains only where they are set
    ]
    return {
        "DESIGN": plain(design.name), "TITLE": plain(design.title),
        "NAME": program.c_text(design.name), "REVISION": program.c_text(design.revision or ""),
        "DESIGN_HASH": design_hash(design), "VERSION": package_version(), "VALUES": "\n".join(lines),
    }  # fmt: skip


def plain(text: str) -> str:
    """A text as it may stand in a comment: it neither ends it nor begins one, nor turns the code round."""
    return _seen(text).replace("*/", "* /").replace("/*", "/ *").replace("\\", "/")


def _seen(text: str) -> str:
    """One line without control characters and marks of direction."""
    return "".join(c if c.isprintable() else " " for c in text)


def _readme(design: Design, p: Floats, s: Floats, single_precision: bool) -> dict[str, str]:
    """What stands for the words of the README, beside those of the design."""
    what, unit = stage_words(design)
    number, step = 4 if single_precision else 8, spare_parameters(p) // SPARE_LEVELS
    longer = f" A stiffer coupling needs a longer p: {step} numbers more for each factor of four."
    return {
        "NAME": _seen(design.name),
        "TITLE": _seen(design.title),
        "PRECISION": "single (float)" if single_precision else "double",
        "COMMAND": f"{what}, {unit}",
        "PERIOD": f"{p[at.PERIOD]:g}",
        "EVENTS": f"{int(p[at.MAX_EVENTS])}",
        "SEGMENTS": "2" if p[at.DELAY_FRACTION] > 0.0 else "1",
        "IO": str(at.IO_SIZE),
        "BYTES": str(number * (p.size + s.size + at.IO_SIZE)),
        "STIFFER": longer if step else "",
        "AMPERES": f" {amperes_words(design)}".rstrip(),
        "AXIS": "linear (m, N, kg)" if design.axis == "linear" else "rotary (rad, N m, kg m2)",
    }
