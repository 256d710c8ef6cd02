"""The data of the live page: plain JSON, made once with the report."""

import math
from collections.abc import Mapping

from actuator_lti.asked.quantities import (
    DRIVE_QUANTITIES,
    LOOP_QUANTITIES,
    LOOPS,
    QUANTITIES,
    Quantity,
    judged_loops,
    shown_unit,
)
from actuator_lti.design.model import Design, Requirement
from actuator_lti.design.units import ampere_unit
from actuator_lti.drive.profile import command_mean
from actuator_lti.drive.signals import LIMITERS
from actuator_lti.errors import InputError
from actuator_lti.files.reading import Tree
from analyses.large_signal.classify import FRICTION_DB, FRICTION_DEG, STICK_FRACTION
from analyses.large_signal.tones import LEAST_UPDATES, full_command
from analyses.linear.loop_figures import HELD
from analyses.monte_carlo.judging import in_populations, loops_of
from nonlinear.export import linear, page
from nonlinear.export.c_files import exported_row
from nonlinear.export.relations import relation_statements
from reports.live.charts import ONSETS
from reports.live.keys import Figure, followed
from reports.live.text import patches
from reports.sections.limits import COLOURS, WORDS
from reports.sections.names import command_unit
from reports.sections.requirements import limit_words

CONTACT = 'The coupling of the loops is in contact, its torque in the direction of motion ("driving").'
MEAN = "Bandwidth and step of the position loop are those behind the mean and the filter of the command."
MAP = "The friction of the loops has the slope of the first piece of its map."
OPEN = "The drive has no loop."
COLUMNS, LEVELS = 18, 12  # cells of the map
LOWEST = 1.0 / 200.0  # of full deflection
LONGEST_TICKS = 20_000  # before a cell is looked at
POINTS = {"at w_ref": linear.AT_SPEED, "at i_ref": linear.AT_CURRENT, "at u": linear.AT_VOLTAGE}


def live_model(design: Design, source: str | None = None) -> Tree:
    """Give the page's data, or why there is none under ``refused``."""
    if not design.controller.stages:
        return {"refused": OPEN}
    try:
        row = exported_row(design)
    except InputError as refused:
        return {"refused": f"{refused}."}
    limited = [one for one in design.requirements if one.quantity in DRIVE_QUANTITIES]
    result = followed(design, [(one.quantity, one.load_Nm or 0.0) for one in limited])
    relations = relation_statements(design, {key["path"]: key["value"] for key in result.free})
    text, places = patches(design, result.free, source)
    requirements, apart = _judged(design, result.figures)
    ampere = ampere_unit("limits.", "A", design.motor.constants)
    outer = page.EVERY_POSITION if design.controller.position else page.EVERY_VELOCITY
    return {
        "name": design.name,
        "axis": design.axis,
        "keys": result.free,
        "fixed": result.fixed,
        "lines": result.lines,
        "row": [value if math.isfinite(value) else str(value) for value in map(float, row)],
        "places": {**page.PLACES, "outer": outer},
        "loops": loops_of(design),
        "stages": {name: k for k, name in enumerate(LOOPS)},
        "points": POINTS,
        "point": _point(design),
        "slopes": page.SLOPES,
        "turned": page.turned_rows(design),
        "held": HELD,
        "relations": [[statement.data for statement in check] for check in relations],
        "ampere": ampere * design.motor.has_electrical_dynamics,
        "limiters": [[name, bit, LIMITERS[name].words, LIMITERS[name].signal] for name, bit in page.LIMITERS],
        "quantities": list(LOOP_QUANTITIES),
        "figures": [_column(each) for each in LOOP_QUANTITIES.values() if each.followed],
        "requirements": requirements,
        "apart": apart,
        "step": _step(design),
        "limits": [list(limit) for limit in page.limits_seen(design)],
        "onsets": list(ONSETS),
        "map": _map(design),
        "text": text,
        "patches": [list(place) for place in places],
    }


def _column(of: Quantity) -> Tree:
    """A column of the table of loops; ``factor`` is from the figure's own unit to that shown."""
    unit, factor = of.shown
    about = {name: getattr(of, name) for name in ("name", "label", "timed")}
    return {"unit": unit, "factor": factor, **about, "response": of.of_response}


def _point(design: Design) -> str:
    """Say at which operating point the loops of the page are linear, where there is a choice."""
    words = [CONTACT] * (design.coupling is not None) + [MAP] * bool(design.friction.points)
    words += [MEAN] * (command_mean(design) is not None)
    return " ".join(words)


def _limit(item: Requirement) -> Tree:
    """Give a requirement as the page judges it: of the whole drive where no ``loop`` is put in."""
    quantity, (unit, factor) = QUANTITIES[item.quantity], shown_unit(item.unit)
    return {
        **{name: getattr(item, name) for name in ("id", "quantity", "minimum", "maximum")},
        **{name: getattr(quantity, name) for name in ("words", "absolute", "timed")},
        "loop": None,
        "unit": unit,
        "factor": factor,
        "limit": limit_words(item),
    }


def _judged(
    design: Design, figures: Mapping[Figure, list[list[str | float]]]
) -> tuple[list[Tree], list[Tree]]:
    """Give the requirements that the page judges, one for each loop, and what the others limit.

    ``figures``: those of the whole drive that follow, each with its statements.
    """
    stages, followed = loops_of(design), list[Tree]()
    apart: list[Tree] = []
    for item in design.requirements:
        words, load = QUANTITIES[item.quantity].words, item.load_Nm or 0.0
        if (lines := figures.get((item.quantity, load))) is not None:
            followed.append({**_limit(item), "load": load, "lines": lines})
        elif item.quantity not in LOOP_QUANTITIES:
            apart.append({"id": item.id, "words": words})
        elif not in_populations(item, design):
            which = "rotor locked" if item.rotor == "locked" else f"to the {item.to or 'command'}"
            apart.append({"id": item.id, "words": f"{words}, {which}"})
        else:
            of = judged_loops(item.loop, stages)
            followed += [{**_limit(item), "loop": loop} for loop in of if loop in stages]
    return followed, apart


def _step(design: Design) -> Tree:
    """Give the command of the step (a tenth of the largest), and what it is a step of."""
    full, (scale, unit) = full_command(design), command_unit(design)
    of = {"position": "output", "velocity": "speed"}.get(design.controller.outermost, "current")
    size = 0.1 * full if math.isfinite(full) else 1.0
    return {"size": size, "unit": unit, "factor": 1.0 / scale, "of": of}


def _map(design: Design) -> Tree | None:
    if design.controller.position is None:
        return None
    return {
        "columns": COLUMNS, "levels": LEVELS, "updates": LEAST_UPDATES, "lowest": LOWEST,
        "longest": LONGEST_TICKS, "full": design.validation.full_deflection_rad, "stick": STICK_FRACTION,
        "decibel": FRICTION_DB, "degrees": FRICTION_DEG, "words": WORDS, "colours": COLOURS,
    }  # fmt: skip
