"""Margins of the compiled code: the injected sweep and the margins in time, run on the emitted C.

The C of an export is compiled with the options of its README and put in the simulator's place; then every
small-signal prediction of the linear loops is measured on it as `analyses.validation` measures it.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError
from analyses.validation import QUICK, Settings, validate
from analyses.validation.ledger import Entry

SETTINGS: Settings = replace(QUICK, large_signals=False, rest_frequencies=2)


@dataclass(frozen=True)
class CodeCheck:
    """What the compiled code shows of the predictions.

    Attributes
    ----------
    entries : tuple of Entry
        Predictions that are judged, with what the compiled code shows.
    compiler : str
        Command and options; empty where nothing was run.
    reason : str
        Why nothing was measured; empty where it was.
    """

    entries: tuple[Entry, ...] = ()
    compiler: str = ""
    reason: str = ""

    @property
    def failed(self) -> tuple[Entry, ...]:
        """Predictions that the compiled code does not meet."""
        return tuple(entry for entry in self.entries if entry.passed is False)

    def largest(self, *quantities: str) -> Entry | None:
        """The entry of these quantities with the largest difference; ``None`` where none is measured."""
        known = [e for e in self.entries if e.quantity in quantities and e.difference is not None]
        return max(known, key=lambda e: abs(e.difference or 0.0), default=None)


def check_code(design: Design, settings: Settings = SETTINGS) -> CodeCheck:
    """Measure the small-signal predictions of a design on the emitted C.

    Parameters
    ----------
    design : Design
    settings : Settings
        Extent of the measurement.

    Returns
    -------
    CodeCheck
        With a reason in place of entries where there is no C compiler, or the design cannot be tested.
    """
    from nonlinear.export.build import FLAGS, compile_files, system_compiler
    from nonlinear.export.run_library import run_sources
    from nonlinear.native import borrowed

    compiler = system_compiler()
    if compiler is None or not sys.platform.startswith(("linux", "darwin")):
        return CodeCheck(reason="no C compiler on the machine of the export")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.so"
        try:
            flags = ("-shared", "-fPIC")
            path.write_bytes(
                compile_files(run_sources(), path.name, "this machine", flags, command=[compiler])
            )
            with borrowed(path):
                validation = validate(design, settings)
        except (InputError, NumericalError) as error:
            return CodeCheck(reason=str(error))
    # an unstable loop is a finding on the design: nothing is measured of it, so the code misses nothing
    judged = (entry for entry in validation.ledger if entry.passed is not None)
    entries = tuple(entry for entry in judged if entry.quantity != "stability")
    if not entries:
        return CodeCheck(reason="; ".join(validation.notes) or "nothing is judged of this design")
    return CodeCheck(entries, " ".join([Path(compiler).name, *FLAGS]))
