"""Every figure by its name; the module that draws it is imported when it is first drawn.

A figure module has ``draw(data) -> Chart``, a chart as data; how it is written is the same for all.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from types import ModuleType
from typing import Any

from actuator_lti.errors import InputError

MODULES: dict[str, str] = {
    "bode": "reports.figures.bode",
    "closed_bode": "reports.figures.closed_bode",
    "nyquist": "reports.figures.nyquist",
    "nichols": "reports.figures.nichols",
    "sensitivity": "reports.figures.sensitivity",
    "step": "reports.figures.step",
    "stiffness": "reports.figures.stiffness",
    "failures": "reports.figures.failures",
    "duty": "reports.figures.duty",
    "forms": "reports.figures.forms",
    "onset": "reports.figures.onset",
    "delay_budget": "reports.figures.delay_budget",
    "curves": "reports.figures.curves",
    "identification_window": "reports.figures.identification_window",
    "identification_surface": "reports.figures.identification_surface",
    "identification_residuals": "reports.figures.identification_residuals",
    "identification_region": "reports.figures.identification_region",
    "correlation_signal": "reports.figures.correlation_signal",
    "distribution": "reports.figures.distribution",
    "tornado": "reports.figures.tornado",
    "trajectory": "reports.figures.trajectory",
    "overlay": "reports.figures.overlay",
    "trade_off": "reports.figures.trade_off",
    "overlay_sweep": "reports.figures.overlay_sweep",
    "confirmation": "reports.figures.confirmation",
    "rest_sweep": "reports.figures.rest_sweep",
    "map": "reports.figures.map",
    "amplitude_bode": "reports.figures.amplitude_bode",
    "sawtooth": "reports.figures.sawtooth",
    "torque_speed": "reports.figures.torque_speed",
    "hysteresis": "reports.figures.hysteresis",
}


def figure_module(name: str) -> ModuleType:
    """Import the module that draws a figure.

    Raises
    ------
    InputError
        If no figure has that name.
    """
    if name not in MODULES:
        raise InputError(f"no figure is called {name!r}: known are {', '.join(sorted(MODULES))}")
    return import_module(MODULES[name])


def draw_svg(
    name: str, data: Mapping[str, Any], *, prefix: str = "f", page: bool = True, alt: str = ""
) -> str:
    """Draw a figure as SVG.

    Parameters
    ----------
    prefix : str
        Put in front of the ids inside, so that several figures can stand in one page.
    page : bool
        For a page: a picture a column, colours as CSS variables with the light ones as fallback, the
        legend as a list.  Otherwise one picture with plain colours.
    alt : str
        What stands for it where it cannot be seen.
    """
    from reports.charts.svg import page_svg, paper_svg

    chart = figure_module(name).draw(data)
    return page_svg(chart, prefix, alt) if page else paper_svg(chart, prefix)
