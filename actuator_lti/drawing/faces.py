"""How results are drawn, and shown in a notebook: what draws registers here, a result only asks.

No result imports what draws it; that is loaded when the first picture or table is asked for.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any, TypeVar

Face = TypeVar("Face", bound=Callable[..., Any])
_DRAWN_BY = ("actuator_lti.drawing.plotting", "actuator_lti.drawing.notebook")
_FACES: dict[str, Callable[..., Any]] = {}


def face(function: Face) -> Face:
    """Register a function that draws a result or writes it as HTML, by its name."""
    _FACES[function.__name__] = function
    return function


def draw(name: str, *arguments: Any, **options: Any) -> Any:
    """What the face of that name makes of a result.

    Examples
    --------
    >>> from actuator_lti import load_design
    >>> draw("design_html", load_design("emps")).startswith("<table")
    True
    """
    if name not in _FACES:
        for module in _DRAWN_BY:
            import_module(module)
    return _FACES[name](*arguments, **options)
