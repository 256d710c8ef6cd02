"""A result as plain data: fields and properties by their Python names, SI, designs by name and hash."""

import re
from dataclasses import fields
from functools import reduce
from math import degrees
from pathlib import PurePath
from typing import Any

import numpy as np

from actuator_lti.design import design_hash
from actuator_lti.design.model import Design
from actuator_lti.files.reading import Tree, shown_path
from analyses.linear.loop_figures import HELD, LoopFigures
from reports.document import plain

_LINEAR = (
    (re.compile(r"_Nms_rad$"), "_Ns_m"),
    (re.compile(r"_Nm_rad$"), "_N_m"),
    (re.compile(r"_Nm$"), "_N"),
    (re.compile(r"_kgm2$"), "_kg"),
    (re.compile(r"(acceleration\w*)_rad_s2$"), r"\1_m_s2"),
    (re.compile(r"((?:speed|rate|ripple|slowest)\w*)_rad_s$"), r"\1_m_s"),
    (re.compile(r"(?<!phase)_rad$"), "_m"),
)
"""What a result's names end with, and on a linear axis."""


def as_json(value: Any) -> Any:
    """Turn a result into what JSON knows; NaN and infinity become ``None``.

    >>> as_json([1j, float("inf")])
    [{'size': 1.0, 'phase_deg': 90.0}, None]
    """
    return plain(value, _known)


def _known(value: Any) -> Any:
    """A result by its names, but the fields that ``repr`` leaves out; of a loop the figures."""
    if isinstance(value, complex):
        return {"size": abs(value), "phase_deg": degrees(np.angle(value))}
    if isinstance(value, PurePath):
        return shown_path(value)
    if isinstance(value, Design):
        return {"name": value.name, "hash": design_hash(value)}
    if isinstance(value, LoopFigures):
        return loop_json(value)
    names = [each.name for each in fields(value) if each.repr]
    for kind in type(value).__mro__:
        names += [name for name, one in vars(kind).items() if isinstance(one, property)]
    return {name: getattr(value, name) for name in dict.fromkeys(names)}


def on_a_line(data: Any) -> Any:
    """Plain data of a linear axis: its names say m, N and kg; frequencies in rad/s, phases in rad stay.

    >>> on_a_line({"amplitude_rad": 0.1, "simulated_Nm_rad": [{"speed_rad_s": 1.0, "frequency_rad_s": 2.0}]})
    {'amplitude_m': 0.1, 'simulated_N_m': [{'speed_m_s': 1.0, 'frequency_rad_s': 2.0}]}
    """
    if isinstance(data, list):
        return [on_a_line(item) for item in data]
    if not isinstance(data, dict):
        return data
    named = {reduce(lambda name, one: one[0].sub(one[1], name), _LINEAR, key): key for key in data}
    return {name: on_a_line(data[key]) for name, key in named.items()}


_OF_MARGINS = (
    "stable", "verdict", "evidence", "evidence_reason", "gain_margin_db", "phase_margin_deg",
    "delay_margin_s", "modulus_margin", "modulus_frequency_rad_s",
)  # fmt: skip
_OF_STEP = ("rise_time_s", "overshoot_percent", "settling_time_s")


def _fields(of: Any, *names: str) -> Tree:
    return {name: getattr(of, name) for name in names}


def loop_json(figures: LoopFigures) -> Tree:
    """Give everything known of one loop; a figure that does not exist is null."""
    m, peaks = figures.margins, figures.peaks
    others: tuple[tuple[str, Tree, LoopFigures | None], ...] = (
        ("judged", {"how": HELD.get(figures.loop.name)}, figures.held),
        ("rotor_locked", {}, figures.locked),
        ("to_reference", {}, figures.reference),
    )
    return {
        **_fields(m, *_OF_MARGINS),
        "disk_margin": m.disk_margin.alpha if m.disk_margin else None,
        "gain_margins": [_fields(one, "ratio", "db", "frequency_rad_s") for one in m.gain_margins],
        "phase_margins": [_fields(one, "deg", "frequency_rad_s") for one in m.phase_margins],
        "delay_margins": [_fields(one, "seconds", "samples", "frequency_rad_s") for one in m.delay_margins],
        **_response_json(figures),
        "sensitivity_peak_db": m.sensitivity_peak_db,
        "complementary_peak_db": peaks.complementary_db if peaks else None,
        "period_s": m.period_s,
        "band_rad_s": list(m.band_rad_s),
        "notes": [*m.notes, *figures.notes],
        **({"rotor": figures.loop.rotor} if figures.loop.name == "current" else {}),
        **{key: more | loop_json(other) for key, more, other in others if other is not None},
    }


def _response_json(figures: LoopFigures) -> Tree:
    """Bandwidths and step; those of a position loop are to the command, else ``feedback_`` says so."""
    band, step = figures.bandwidth, figures.step
    found = {
        "bandwidth_hz": band.minus3db_hz if band else None,
        "bandwidth_90deg_hz": band.minus90deg_hz if band else None,
        "resonance_peak_db": band.resonance_peak_db if band else None,
        "resonance_hz": (band.resonance_hz or None) if band else None,
        **{name: getattr(step, name, None) for name in _OF_STEP},
    }
    alone = figures.loop.name == "position" and figures.of_feedback
    return {f"feedback_{name}": value for name, value in found.items()} if alone else found
