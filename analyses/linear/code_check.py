"""Predictions held against the compiled code: its own derivative, its steps and runs beside the margins.

The C of an export is compiled with the options of its README and put in the simulator's place; then every
prediction is judged on it as `analyses.validation` judges it.
"""

import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

from actuator_lti.asked.verdict import Verdict
from actuator_lti.compiled import compiler
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError
from analyses.validation import CHECKS, validate
from analyses.validation.row import Row
from nonlinear.native import LIBRARY


@dataclass(frozen=True)
class CodeCheck:
    """What the compiled code shows of the predictions."""

    entries: tuple[Row, ...] = ()  # predictions that are judged, with what the compiled code shows
    compiler: str = ""  # command and options; empty where nothing was run
    reason: str = ""  # why nothing was measured; empty where it was

    @property
    def failed(self) -> tuple[Row, ...]:
        return tuple(entry for entry in self.entries if entry.verdict is Verdict.NOT_MET)

    def largest(self, *quantities: str) -> Row | None:
        """The entry of these quantities with the largest difference; ``None`` where none is measured."""
        return max((e for e in self.entries if e.name in quantities), key=lambda e: e.error, default=None)


def check_code(design: Design) -> CodeCheck:
    """Measure the small-signal predictions of a design on the emitted C.

    A reason stands in place of entries where there is no C compiler, or the design cannot be tested.
    """
    command = compiler.system_compiler()
    if command is None or not sys.platform.startswith(("linux", "darwin")):
        return CodeCheck(reason="no C compiler on the machine of the export")
    exported = replace(LIBRARY, forms=tuple)  # an export holds no second forms of the loop
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.so"
        try:
            texts, flags = {"run.c": exported.text()}, ("-shared", "-fPIC")
            made = compiler.compile_files(texts, path.name, "this machine", flags, command=[command])
            path.write_bytes(made)
            with LIBRARY.borrowed(path):
                validation = validate(design, CHECKS)
        except (InputError, NumericalError) as error:
            return CodeCheck(reason=str(error))
    if not validation.rows:
        return CodeCheck(reason="; ".join(validation.notes) or "nothing is judged of this design")
    return CodeCheck(validation.rows, " ".join([Path(command).name, *compiler.FLAGS]))
