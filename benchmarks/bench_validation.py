"""What a validation costs, in processor time, and what it finds on the shipped drives."""

from __future__ import annotations

import time
from collections.abc import Iterable
from functools import partial

from benchmarks.bench_simulator import best_of
from benchmarks.row import Row

SMALL_S, ALL_S = 0.5, 3.0
SLOWER = {"joint": 5.0, "ballscrew": 5.0}


def rows(quick: bool = False) -> Iterable[Row]:
    """Validate the shipped drives, their small signals alone and in full, compiled code warm."""
    from actuator_lti.design import load_design, shipped_designs
    from actuator_lti.design.model import Design
    from analyses.validation import CHECKS, validate
    from analyses.validation.places import Bench
    from analyses.validation.small_signal import small_signal

    def small(design: Design) -> list[object]:
        """The rows that the tangents of all places judge."""
        bench = Bench(design, design)
        return [small_signal(place) for place in (*map(bench.place, bench.names), *bench.onsets())]

    names = ("ilr33-amber",) if quick else shipped_designs()
    validate(load_design(names[0]), CHECKS)
    for name in names:
        design = load_design(name)
        taken = best_of(partial(small, design), 3, time.process_time)
        yield Row(f"{name}, small signals", taken, "s", SMALL_S, note="best of 3")
        started = time.process_time()
        found = validate(design)
        note = str(found)
        yield Row(
            f"{name}, everything", time.process_time() - started, "s", SLOWER.get(name, ALL_S), note=note
        )
