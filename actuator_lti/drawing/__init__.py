"""How results are drawn, and shown in a notebook: a result names what draws it and imports none of it.

That is loaded when the first picture or table is asked for.
"""

from importlib import import_module
from typing import Any


def draw(name: str, *arguments: Any, **options: Any) -> Any:
    """What the function of that name in `drawing.plotting`, or in `drawing.notebook`, makes of a result.

    >>> from actuator_lti import load_design
    >>> draw("design_html", load_design("emps")).startswith("<table")
    True
    """
    room = "notebook" if name.endswith("_html") else "plotting"
    return getattr(import_module(f"{__name__}.{room}"), name)(*arguments, **options)
