"""How long a validation takes, and how the time divides."""

from __future__ import annotations

import time
from collections.abc import Iterable

from benchmarks.row import Row

TARGET_S = 6.0


def rows(quick: bool = False) -> Iterable[Row]:
    """Validate the shipped drives in full, compiled code warm: three loops of 40 frequencies and the rest."""
    from actuator_lti.design import load_design
    from analyses.validation import QUICK, Settings, validate

    names = ("ilr33-amber",) if quick else ("ilr33-amber", "ilr33-amber-multirate")
    validate(load_design(names[0]), QUICK)
    for name in names:
        design = load_design(name)
        started = time.perf_counter()
        validation = validate(design, Settings())
        taken = time.perf_counter() - started
        swept = ", ".join(
            f"{loop} {item.measured.sweep.frequency_hz.size}"
            for loop, item in validation.loops.items()
            if item.measured
        )
        held = sum(row.passed is True for row in validation.ledger)
        note = f"points: {swept}; {held} predictions hold, {len(validation.failed)} fail; map 25 x 40"
        yield Row(
            group="validation",
            name=f"{name}, everything",
            measured=taken,
            unit="s",
            target=TARGET_S,
            note=note,
        )
        for part, seconds in validation.seconds.items():
            yield Row(group="validation", name=f"{name}: {part}", measured=seconds, unit="s")
