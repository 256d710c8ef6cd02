"""Many designs of one structure: a nominal design and arrays of changed values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator_lti.design.access import located, paths_of, stacked
from actuator_lti.errors import InputError
from actuator_lti.start.public_arguments import asked
from actuator_lti.systems.sampling import split_delay

if TYPE_CHECKING:
    from actuator_lti.design.model import Design

Values = Mapping[str, np.ndarray]


def variable_paths(design: Design) -> tuple[str, ...]:
    """Every dotted key of a design that is a continuous number and that may vary over many designs."""
    return tuple(
        path
        for path in paths_of(design)
        if located(design, path)[0].kind == "quantity"
        and not path.startswith(("validation.", "failure.", "duty."))
    )


@asked
@dataclass(frozen=True)
class Population:
    """Many designs of one structure: a nominal design and, for some keys, an array of SI values."""

    design: Design
    values: Values  # shape (count,), by dotted key; a key that is not there has its nominal value
    count: int

    def __post_init__(self) -> None:
        known = set(variable_paths(self.design))
        for path, array in self.values.items():
            if path not in known:
                raise InputError(f"{path}: not a number of this design that can vary")
            if np.shape(array) != (self.count,):
                raise InputError(f"{path}: {np.shape(array)} values where ({self.count},) are needed")
            if not np.all(np.isfinite(array)):
                raise InputError(f"{path}: values must be finite")

    @cached_property
    def stacked(self) -> Design:
        """The design with arrays of shape (count,) in place of the numbers that vary."""
        made = stacked(self.design, {p: np.asarray(v, dtype=float) for p, v in self.values.items()})
        return replace(made, nominal=self.design.nominal or self.design)

    def part(self, chosen: Any) -> Population:
        """Some of the designs, by a slice or by their numbers."""
        values = {path: np.asarray(array)[chosen] for path, array in self.values.items()}
        return Population(self.design, values, len(np.arange(self.count)[chosen]))

    def kinds(self) -> Iterator[np.ndarray]:
        """Numbers of designs with the same states: the same values are 0, as many ticks of delay."""
        control = self.stacked.controller
        whole, fraction = split_delay(control.computing_delay_s, control.period_s)
        marks = [np.broadcast_to(each, self.count) for each in (whole, np.asarray(fraction) > 0)]
        marks += [np.asarray(array) == 0 for array in self.values.values()]
        kinds, place = np.unique(np.column_stack(marks), axis=0, return_inverse=True)
        for kind in range(len(kinds)):
            yield np.flatnonzero(place.reshape(-1) == kind)
