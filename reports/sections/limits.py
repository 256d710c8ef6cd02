"""What the linear model says about its own limits: the amplitude at which each limiter is reached."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.drive.signals import LIMITERS
from actuator_lti.loops.limiters import Onset
from nonlinear.runs.trajectory import COMMAND_UNITS
from reports import document as doc
from reports.charts import style
from reports.charts.style import Chart
from reports.document_schema import Block, Section
from reports.sections.names import hertz


def section(design: Design, border: Onset) -> Section:
    """Make the section from the onset amplitudes."""
    unit, scale = COMMAND_UNITS[design.axis, design.controller.outermost]
    where = ", at the output," if design.controller.outermost in ("position", "velocity") else ""
    caption = (
        f"Peak amplitude of a sine command{where} at which each limit is just reached. Below the "
        "lowest line every linear figure of this report holds, except for dry friction."
    )
    rows = _rows(design, border, scale)
    blocks = [doc.figure("onset", _chart(design, border, scale, unit), caption)]
    blocks += [_table(rows, unit)] if rows else []
    intro = "A linear prediction ends where a limit is reached. Which one, and when, depends on frequency."
    words = _result(rows, unit) if rows else _least(border, scale, unit)
    return doc.section(
        "limits", "Validity of the linear model", blocks, result=words, intro=intro, told="info"
    )


def _chart(design: Design, border: Onset, scale: float, unit: str) -> Chart:
    """Draw every limiter's line; below the lowest the linear model holds."""
    chart = Chart(width=style.WIDE, height=370.0, legend=True, legend_title="limit reached at this amplitude")
    panel = chart.panel(y=f"command amplitude, {unit}", log="y")
    hertz = border.omega_rad_s / (2.0 * np.pi)
    lines = {name: scale * np.asarray(values) for name, values in border.each_rad.items()}
    lines = {name: values for name, values in lines.items() if np.isfinite(values).any()}
    lowest = np.min([np.where(np.isfinite(v), v, np.inf) for v in lines.values()], axis=0)
    there = np.isfinite(lowest)
    full = _full(design) * scale
    top = 4.0 * max([full, *lowest[there][:1]]) if there.any() else 1.0
    bottom = max(0.6 * min(lowest[there], default=0.1), top / 1e6)
    panel.y.limits(bottom, top)
    style.frequency(panel, hertz)
    if there.any():
        x, y = hertz[there].tolist(), lowest[there].tolist()
        floor = bottom * 1e-3
        panel.shape([([*x, x[-1], x[0]], [*y, floor, floor])], colour=style.GREEN, opacity=0.1)
    for k, (name, values) in enumerate(lines.items()):
        values = np.where(np.isfinite(values), values, np.nan)
        panel.curve(hertz, values, LIMITERS[name].words, **style.series(k))
    panel.note("linear below the lowest line", corner="bottom left", colour=style.MUTED)
    if full:
        panel.rule_y(full, f"full deflection {full:g} {unit}", colour=style.INK, dash=2)
    return chart


def _full(design: Design) -> float:
    """Full deflection; 0 where the command is no position."""
    return design.validation.full_deflection_rad if design.controller.position is not None else 0.0


def _result(rows: Sequence[_Linear], unit: str) -> str:
    """Say how far the largest command of the table stays linear."""
    row = max(rows, key=lambda row: row.amplitude)
    part = "full deflection" if row.fraction == 1.0 else f"{100.0 * row.fraction:.0f} % of full deflection"
    size = f"{part} ({row.amplitude:.3g} {unit})"
    if row.hz is None:
        return f"A sine of {size} stays linear over the whole frequency range."
    return f"A sine of {size} stays linear up to {row.hz:.3g} Hz; above, the {_noun(row.limiter)} acts."


def _least(border: Onset, scale: float, unit: str) -> str:
    """Say of a drive whose command is no position where the least command reaches a limit."""
    if not np.isfinite(border.amplitude_rad).any():
        return "No limit is reached by a sine command over the whole frequency range."
    k = int(np.argmin(border.amplitude_rad))
    size, hz = scale * border.amplitude_rad[k], hertz(border.omega_rad_s[k])
    limit = _noun(words_of(border.active[k]))
    return f"Sines up to {size:.3g} {unit} stay linear; above, the {limit} acts first, at {hz:.3g} Hz."


def _noun(limiter: str) -> str:
    return limiter if "limit" in limiter or limiter == words_of("profile") else f"{limiter} limit"


def words_of(limiter: str) -> str:
    """Say which limiter acts, by its name; ``""`` is none."""
    return LIMITERS[limiter].words if limiter else "none"


@dataclass(frozen=True)
class _Linear:
    """Up to which frequency one command amplitude passes unlimited."""

    amplitude: float
    fraction: float
    hz: float | None
    limiter: str


def _rows(design: Design, border: Onset, scale: float) -> list[_Linear]:
    """List the highest frequency at which each command amplitude still passes unlimited."""
    rows: list[_Linear] = []
    for fraction in design.validation.amplitude_fractions if _full(design) else ():
        amplitude = fraction * _full(design)
        reached = np.nonzero(border.amplitude_rad < amplitude)[0]
        first = int(reached[0]) if len(reached) else None
        up_to = None if first is None else hertz(_crossing(border, first, amplitude))
        limiter = "none in this range" if first is None else words_of(border.active[first])
        rows.append(_Linear(amplitude * scale, fraction, up_to, limiter))
    return rows


def _table(rows: Sequence[_Linear], unit: str) -> Block:
    columns = [
        doc.of("amplitude", "amplitude", "Command amplitude", unit, format="short:3"),
        doc.of("fraction", "fraction", "Of full deflection", "%", scale=100.0, format="fix:0"),
        doc.of("hz", "hz", "Linear up to", "Hz", format="sig:3"),
        doc.of("limiter", "limiter", "Then limited by"),
    ]
    return doc.listing("How far the linear model reaches", rows, columns)


def _crossing(border: Onset, first: int, amplitude: float) -> float:
    """Interpolate, on logarithmic scales, where the border falls to an amplitude."""
    if first == 0 or not math.isfinite(border.amplitude_rad[first - 1]):
        return float(border.omega_rad_s[first])
    above, below = border.amplitude_rad[first - 1], border.amplitude_rad[first]
    part = math.log(above / amplitude) / math.log(above / below)
    low, high = border.omega_rad_s[first - 1], border.omega_rad_s[first]
    return float(low * (high / low) ** part)
