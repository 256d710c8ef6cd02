"""A whole run in C: what the package itself calls where it was built at installation."""

from __future__ import annotations

from nonlinear._kernels.run import run
from nonlinear.emit import emit_c
from nonlinear.emit.kinds import Kind
from nonlinear.export.entries import derive, init, prepare_sizes
from nonlinear.export.program import helpers_of

_ROW: Kind = "row"


def run_sources() -> dict[str, str]:
    """The one C file."""
    rows: list[Kind] = [_ROW] * 6
    kinds: dict[object, list[Kind]] = {
        prepare_sizes: [_ROW],
        derive: [_ROW, _ROW],
        init: [_ROW, _ROW],
        run: [*rows, "bytes", _ROW, _ROW, "float"],
    }
    emitted = emit_c(kinds)
    parts = [
        "#include <math.h>\n#include <stdbool.h>\n#include <stdlib.h>\n",
        "typedef struct { unsigned short *at; int length; } drive_bytes;",
        emitted.constants_text(),
        *helpers_of(emitted.functions),
        emitted.types,
        *emitted.declarations.values(),
        emitted.functions,
    ]
    return {"run.c": "\n".join(parts)}
