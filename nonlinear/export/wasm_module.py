"""The drive as WebAssembly, built by ``make wasm`` and kept in the package with the hash of its sources.

The module is a wasi reactor without imports: the tick of the drive, its loops found by running that tick
(`nonlinear.export.linear_loops`), and the figures of a loop by the kernels of `actuator_lti.batch`. Rows lie
in its memory; functions that end in ``_at`` say where. A host writes the row of a run
(`nonlinear.row.parameters.design_row`) at ``p_at()``. Then ``start()`` and ``tick()`` run it, with inputs and
outputs at ``io_at()``, places as in ``nonlinear._kernels.layout``; ``loop(stage, timed)`` computes a loop,
its figures at ``figures_at(stage)`` (`actuator_lti.batch._quoted`) and ``row_at(stage)``
(`actuator_lti.batch._figures`), ``respond(stage, count)`` its response at the angles of ``x_at()``, and
``step_of(stage, count)`` its step response, both at ``y_at()``; ``limiters(count)`` the gains from the
command to what stands in front of the limits (`nonlinear.export.linear_loops`).
"""

import hashlib
import json
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from actuator_lti.batch import _figures, _quoted, _response, _run, _withheld
from actuator_lti.compiled.compiler import compile_files
from actuator_lti.compiled.kinds import Kind
from actuator_lti.compiled.program import Program, emit_c
from actuator_lti.files.reading import Tree
from nonlinear.export import linear, linear_loops
from nonlinear.export.program import ENTRIES, HEAD, header_text, template

MOST_BYTES = 100_000
_NAME, _RECORD = "drive.wasm", "drive.wasm.json"
_FLAGS = ("-Os", "-mexec-model=reactor", "-s", "-Wl,--strip-all", "-Wl,--gc-sections")


_ROW: Kind = "row"
_LINEAR: dict[Any, tuple[Kind, ...]] = {
    linear_loops.assembled: (*(_ROW,) * 4, "int", *(_ROW,) * 7),
    linear.interval: (_ROW, "int"),
    linear.repeats: (_ROW, "int"),
    linear_loops.lead_of: (_ROW, "int"),
    linear_loops.figures: ("int", _ROW, _ROW, _ROW, "float", "int", *(_ROW,) * 12),
    linear_loops.responded: ("int", _ROW, _ROW, _ROW, "int", *(_ROW,) * 5),
    linear_loops.limiters_assembled: (_ROW,) * 11,
    linear_loops.limiter_sizes: (_ROW, "int", _ROW, _ROW, _ROW, "int", "int", *(_ROW,) * 4),
    linear_loops.stepped: ("int", _ROW, _ROW, _ROW, "float", "int", *(_ROW,) * 3),
    _withheld.rounding_decides: ("int", *(_ROW,) * 8),
    _quoted.quoted: (_ROW, "float", _ROW),
}
_SIZES = {
    **{name: getattr(linear, name) for name in ("MOST", "MOST_TICKS", "SEEN", "POSITION", "COMMAND")},
    **{name: getattr(linear_loops, name) for name in ("MOST_STATES", "MOST_PHASES", "BLOCK")},
    **{name: getattr(_response, name) for name in ("DEEPEST", "CAPACITY")},
    "SHOWN": linear_loops.SHOWN,
    "ANSWER": linear.ANSWER,
    "STAGES": linear.ANSWER + 1,
    "COLUMNS": _figures.COLUMNS,
    "FIRST_CLOSED": _figures.PEAK_T,
    "LAST_CLOSED": _figures.FINAL,
    "QUOTED": _quoted.QUOTED,
    "POINTS": _run.POINTS,
}


@cache
def program() -> Program:
    """Tick, loops and figures as one program."""
    return emit_c({**ENTRIES, **_LINEAR})


def sources() -> dict[str, str]:
    """The C files of the module; ``linear.h`` has prototypes and lengths beyond those of ``drive.h``."""
    emitted, known = program(), {function.__name__ for function in _LINEAR}
    heads = [text for name, text in emitted.declarations.items() if name in known]
    sizes = [f"enum {{ {name} = {size} }};" for name, size in _SIZES.items()]
    parts = [HEAD, emitted.constants_text(), *emitted.helpers, emitted.types, emitted.functions]
    return {
        "drive.h": header_text(),
        "linear.h": "\n".join(["#include <stdbool.h>", *sizes, *heads, ""]),
        "drive.c": "\n".join(parts),
        "wasm.c": template("wasm.c"),
    }


def sources_hash() -> str:
    """SHA-256 of the sources and the flags."""
    text = "\0".join(f"{name}\0{text}" for name, text in sorted(sources().items()))
    return hashlib.sha256((text + " ".join(_FLAGS)).encode()).hexdigest()


def build_wasm() -> bytes:
    """Compile the module with ziglang; raises `InputError` without it."""
    return compile_files(sources(), _NAME, "wasm", _FLAGS)


def kept_wasm() -> bytes:
    return files("nonlinear.export").joinpath("wasm", _NAME).read_bytes()


def record() -> Tree:
    """What is known of the kept module: hash of its sources and of itself, compiler."""
    text = files("nonlinear.export").joinpath("wasm", _RECORD).read_text(encoding="utf-8")
    known: Tree = json.loads(text)
    return known


def main() -> None:
    """Build the module into the package (``make wasm``)."""
    from importlib.metadata import version

    from actuator_lti.files.atomic import write_together

    data = build_wasm()
    about = {
        "sources_sha256": sources_hash(),
        "module_sha256": hashlib.sha256(data).hexdigest(),
        "compiler": f"ziglang {version('ziglang')}",
        "bytes": len(data),
    }
    folder = Path(__file__).with_name("wasm")
    text = json.dumps(about, indent=2) + "\n"
    write_together({folder / _NAME: data, folder / _RECORD: text.encode()})


if __name__ == "__main__":
    main()
