"""`actuator-lti export controller`: the controller alone for firmware, with test vectors of the simulator."""

import hashlib
import re
from functools import partial
from struct import calcsize

from actuator_lti.compiled.kinds import c_float
from actuator_lti.compiled.program import Program
from actuator_lti.compiled.structs import Member, struct_text
from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.writing import design_hash
from actuator_lti.start.extras import package_version
from nonlinear._kernels import layout as at
from nonlinear.export.c_files import amperes_words, plain, refuse_prefix
from nonlinear.export.controller_cut import ENTRIES, Controller, begins, controller_of
from nonlinear.export.controller_names import SIGNAL_AT, member_words
from nonlinear.export.controller_vectors import roundings, vectors_text
from nonlinear.export.program import FLAGS, c_text, declared, filled, single

_LIBRARY = re.compile(r"\b(sqrt|floor|fabs|exp|log|sin|cos|tan)\(")


def controller_export(
    design: AnyDesign, *, single_precision: bool = True, prefix: str = "drive_", vectors: bool = True
) -> dict[str, str]:
    """Files of the controller of a design, by name.

    ``single_precision``: ``float`` in place of ``double``; coefficients are worked out in double precision
    all the same.
    ``prefix``: in front of every symbol, so that controllers of several designs fit into one program.
    ``vectors``: with test vectors and the program that runs them.

    Raises `InputError`: for a prefix that no name in C begins with.
    """
    design = as_design(design)
    refuse_prefix(prefix)
    ours = controller_of(design, prefix, single_precision=single_precision)
    source = _source(ours.program, prefix)
    called = ", ".join(f"`{name}`" for name in sorted({*_LIBRARY.findall(source)}))
    values = {
        "PREFIX": prefix.upper(), "prefix": prefix, "namespace": prefix.removesuffix("_"),
        "NAME": plain(design.name), "TITLE": plain(design.title), "VERSION": package_version(),
        "C_NAME": c_text(design.name), "C_REVISION": c_text(design.revision or ""),
        "DESIGN_HASH": design_hash(design), "REAL": "float" if single_precision else "double",
        "PRECISION": "single" if single_precision else "double",
        "CONSTANTS": _constants(ours, prefix.upper()), "FLAGS": _flags(prefix.upper()),
        "STRUCTS": _structs(ours), "SIZES": _sizes(ours, "f" if single_precision else "d"),
        "DECLARATIONS": "\n\n".join(declared(ours.program, ENTRIES)), "ANGLES": _angles(ours, prefix.upper()),
        "ROUNDINGS": str(roundings(ours)), "AMPERES": f" {amperes_words(design)}".rstrip(),
        "SOURCE_HASH": hashlib.sha256(source.encode()).hexdigest(),
    }  # fmt: skip
    values["LIBRARY"] = f"{called} of the mathematical library" if called else "no function of any library"
    texts = {
        "controller.h": filled("controller.h", values),
        "controller.c": source,
        "controller.hpp": filled("controller.hpp", values),
    }
    if vectors:
        texts["vectors.h"] = vectors_text(ours, prefix, single_precision=single_precision)
        texts["main.c"] = filled("controller_main.c", values)
    if single_precision:
        typed = {"controller.h", "controller.c", "vectors.h"} & set(texts)
        texts |= {name: single(texts[name]) for name in typed}
    return {**texts, "README.md": filled("controller_readme.txt", values)}


def _source(program: Program, prefix: str) -> str:
    """``controller.c``: no library but mathematical functions, and these where they are called."""
    upper = prefix.upper()
    body = "\n".join([*program.helpers, "", program.types, "", program.functions])
    head = ['#include "controller.h"', ""]
    if _LIBRARY.search(body):
        head += ["#include <math.h>", ""]
    if re.search(r"\bbool\b", body):
        head += ["#include <stdbool.h>", ""]
    words = {"DESIGN": "actuator-lti controller ", "REVISION": " revision "}
    words |= dict.fromkeys(("DESIGN_HASH", "SOURCE_HASH"), " ")
    parts = " ".join(f'"{word}" {upper}CONTROLLER_{name}' for name, word in words.items())
    return "\n".join([*head, f"const char {prefix}controller_version[] = {parts};", "", body])


def _flags(upper: str) -> str:
    items = [(name, bit, words) for (name, bit), words in FLAGS.items() if bit != at.FLAG_STICK]
    return "\n".join(
        f"    {upper}CONTROLLER_{name} = {bit}{',' if bit != items[-1][1] else ''} /* {words} */"
        for name, bit, words in items
    )


def _constants(ours: Controller, upper: str) -> str:
    """Numbers of the configuration that the program around the controller wants."""
    lines = [f"#define {upper}CONTROLLER_PERIOD_S {c_float(float(ours.p[at.PERIOD]))} /* of a step, s */"]
    for each in ours.measured.members:
        if each.kind == "count":
            value = c_float(ours.counts_per_rad(each.first))
            lines.append(f"#define {_per_unit(ours, each.name, upper)} {value} /* of {each.name} */")
    return "\n".join(lines)


def _per_unit(ours: Controller, counts: str, upper: str) -> str:
    unit = "M" if ours.design.axis == "linear" else "RAD"
    return f"{upper}CONTROLLER_{counts.removeprefix('motor_').upper()}_PER_{unit}"


def _structs(ours: Controller) -> str:
    names = begins(ours.p)
    state = struct_text(ours.state, lambda each: member_words(names[each.first]))
    return "\n\n".join(
        [state, *(struct_text(each, partial(_signal_words, ours)) for each in (ours.measured, ours.out))]
    )


def _signal_words(ours: Controller, member: Member) -> str:
    """A count of which only differences are taken may go round; one that is read as an angle may not."""
    if member.first in SIGNAL_AT:
        return member_words(SIGNAL_AT[member.first])
    return f"count of the encoder; it may {'not ' * (member.first in ours.angles)}go round at 2**32"


def _angles(ours: Controller, upper: str) -> str:
    """What to give for an angle where the encoder is all there is."""
    named, unit = (
        {each.name for each in ours.measured.members},
        "m" if ours.design.axis == "linear" else "rad",
    )
    return "".join(
        f" Where the encoder is all there is, give `{side}_angle_{unit}` as `{side}_counts / "
        f"{_per_unit(ours, f'{side}_counts', upper)}`."
        for side in ("motor", "output")
        if {f"{side}_angle_{unit}", f"{side}_counts"} <= named
    )


def _sizes(ours: Controller, real: str) -> str:
    """Bytes of each structure in C, with what is left free before a wider member and at the end."""
    texts = []
    for text, struct in (("state", ours.state), ("input", ours.measured), ("output", ours.out)):
        codes = [(max(each.length, 1), real if each.kind == "float" else "i") for each in struct.members]
        widest = max((code for _, code in codes), key=calcsize, default="i")
        size = calcsize("".join(f"{count}{code}" for count, code in codes) + f"0{widest}")
        texts.append(f"{text} {size} bytes")
    return ", ".join(texts)
