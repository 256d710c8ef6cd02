"""The drive as WebAssembly, built by ``make wasm`` and kept in the package with the hash of its sources.

The module is a wasi reactor without imports.  It exports ``memory``, ``p_at``, ``s_at``, ``io_at`` (where
the rows lie), ``p_most``, ``s_most``, ``io_length``, ``start``, ``retune``, ``tick`` and ``run``.  A host
writes the row of a run (`nonlinear.parameters.design_row`) at ``p_at()``, calls ``start()``, and then
``tick()`` with inputs and outputs at ``io_at()``; the places are those of ``nonlinear._kernels.layout``.
"""

from __future__ import annotations

import hashlib
import json
from importlib.resources import files
from pathlib import Path
from typing import Any

from nonlinear.export.build import compile_files
from nonlinear.export.program import header_text, source_text, template

MOST_BYTES = 100_000
_NAME, _RECORD = "drive.wasm", "drive.wasm.json"
_FLAGS = ("-mexec-model=reactor", "-s", "-Wl,--strip-all", "-Wl,--gc-sections")


def sources() -> dict[str, str]:
    """The C files of the module."""
    return {"drive.h": header_text(), "drive.c": source_text(), "wasm.c": template("wasm.c")}


def sources_hash() -> str:
    """SHA-256 of the sources and the flags."""
    text = "\0".join(f"{name}\0{text}" for name, text in sorted(sources().items()))
    return hashlib.sha256((text + " ".join(_FLAGS)).encode()).hexdigest()


def build_wasm() -> bytes:
    """Compile the module with ziglang.

    Raises
    ------
    InputError
        Without ziglang.
    """
    return compile_files(sources(), _NAME, "wasm", _FLAGS)


def kept_wasm() -> bytes:
    """The module in the package."""
    return files("nonlinear.export").joinpath("wasm", _NAME).read_bytes()


def record() -> dict[str, Any]:
    """What is known of the kept module: hash of its sources and of itself, compiler."""
    text = files("nonlinear.export").joinpath("wasm", _RECORD).read_text(encoding="utf-8")
    known: dict[str, Any] = json.loads(text)
    return known


def main() -> None:
    """Build the module into the package (``make wasm``)."""
    from importlib.metadata import version

    from actuator_lti.atomic import write_together

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
