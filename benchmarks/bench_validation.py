"""What a validation costs, in processor time, and what it finds on the shipped drives."""

from __future__ import annotations

import time
from collections.abc import Iterable

from benchmarks.row import Row

CHECKS_S, ALL_S = 0.5, 3.0
SLOWER = {"joint": 5.0, "ballscrew": 5.0}


def rows(quick: bool = False) -> Iterable[Row]:
    """Validate the shipped drives, checks alone and in full, compiled code warm."""
    from actuator_lti.design import load_design, shipped_designs
    from analyses.validation import CHECKS, Settings, validate

    names = ("ilr33-amber",) if quick else shipped_designs()
    validate(load_design(names[0]), CHECKS)
    for name in names:
        design = load_design(name)
        for words, settings, target in (
            ("checks", CHECKS, CHECKS_S),
            ("everything", Settings(), SLOWER.get(name, ALL_S)),
        ):
            started = time.process_time()
            found = validate(design, settings)
            yield Row(
                group="validation",
                name=f"{name}, {words}",
                measured=time.process_time() - started,
                unit="s",
                target=target,
                note=str(found),
            )
