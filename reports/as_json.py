"""A result as plain data: fields and properties by their Python names, SI, designs by name and hash."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from math import degrees
from pathlib import PurePath
from typing import Any

import numpy as np

from actuator_lti.files.reading import shown_path
from reports.document import plain


def as_json(value: Any) -> Any:
    """Turn a result into what JSON knows; NaN and infinity become ``None``.

    Examples
    --------
    >>> as_json(1j), as_json(np.array([1.0, np.inf]))
    ({'size': 1.0, 'phase_deg': 90.0}, [1.0, None])
    """
    from actuator_lti.design.model import Design

    if isinstance(value, Design):
        from actuator_lti.design import design_hash

        return {"name": value.name, "hash": design_hash(value)}
    if is_dataclass(value) and not isinstance(value, type):
        return _named(value)
    if isinstance(value, complex | np.complexfloating):
        return plain({"size": abs(value), "phase_deg": degrees(np.angle(value))})
    if isinstance(value, Mapping):
        return {str(key): as_json(item) for key, item in value.items()}
    if isinstance(value, np.ndarray) and not np.iscomplexobj(value):
        return plain(value)
    if isinstance(value, PurePath):
        return shown_path(value)
    if isinstance(value, tuple | list | np.ndarray):
        return [as_json(item) for item in value]
    return plain(value)


def _named(value: Any) -> Any:
    """A result by its names, but the fields that ``repr`` leaves out; of a loop the figures."""
    from analyses.linear.loop_figures import LoopFigures
    from reports.loop_json import loop_json

    if isinstance(value, LoopFigures):
        return plain(loop_json(value))
    names = [each.name for each in fields(value) if each.repr]
    for kind in type(value).__mro__:
        names += [name for name, one in vars(kind).items() if isinstance(one, property)]
    return {name: as_json(getattr(value, name)) for name in dict.fromkeys(names)}
