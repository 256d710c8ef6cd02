"""The identification of a two-mass drive: parameters, resonances, play, and the response with its fit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reports import document as doc
from reports.charts import style
from reports.charts.style import Chart
from reports.document_schema import Block, Section, Status
from reports.numbers import show
from reports.sections.identification_inputs import (
    finding_table,
    input_table,
    verdict_block,
    verdict_words,
)

if TYPE_CHECKING:
    from analyses.identification.frequency_bench import FrequencyResult

LABELS = {
    "motor_inertia": ("Inertia before the coupling, at the motor", "kg m²"),
    "load_inertia": ("Inertia behind it, at its own shaft", "kg m²"),
    "stiffness": ("Stiffness", "N m/rad"),
    "damping": ("Damping", "N m s/rad"),
    "viscous": ("Viscous friction of the motor", "N m s/rad"),
    "load_viscous": ("Viscous friction of the load", "N m s/rad"),
}


def section(result: FrequencyResult) -> Section:
    """Make the section of a frequency response's identification."""
    blocks = [verdict_block(result.items), parameter_table(result), *response_figures(result)]
    blocks += [input_table(result.record, result.used)]
    blocks += [finding_table(name, rows) for name, rows in result.findings.items()]
    fit = result.fit
    intro = (
        f"{fit.lines} lines of a period of {result.period_s:g} s, means over {result.lines.periods} periods; "
        "two-mass drive by maximum likelihood with the noise of every line from the spectrum beside it. "
        f"Misfit {fit.misfit:.2f} (1: the noise explains the residuals)."
    )
    status: Status = "pass" if result.passed else "fail"
    words = _result(result)
    return doc.section(
        "frequency-identification", "Two-mass drive", blocks, result=words, intro=intro, status=status
    )


def _result(result: FrequencyResult) -> str:
    fit = result.fit
    low, high = fit.antiresonance_rad_s[0] / (2.0 * np.pi), fit.resonance_rad_s[0] / (2.0 * np.pi)
    stiffness = f"{show(fit['stiffness'], 'sig:4')} ± {show(fit.std('stiffness'), 'sig:2')} N m/rad"
    words = f"Antiresonance {low:.4g} Hz, resonance {high:.4g} Hz, stiffness {stiffness}"
    if result.play is not None:
        words += f", play {2e3 * result.play.half_rad:.3g} mrad"
    return verdict_words(result.items, f"{words}.")


def parameter_table(result: FrequencyResult) -> Block:
    """Values with 95 % intervals; resonance, antiresonance and play among them."""
    columns = [
        doc.column("name", "Parameter"),
        doc.column("value", "Value", format="sig:6"),
        doc.column("std", "Standard error", format="sig:2"),
        doc.column("low", "95 % from", format="sig:6"),
        doc.column("high", "to", format="sig:6"),
        doc.column("unit", "Unit"),
    ]
    rows = [
        {
            "name": label,
            "value": value,
            "std": std or None,
            "low": value - 1.96 * std if std else None,
            "high": value + 1.96 * std if std else None,
            "unit": unit,
        }
        for label, unit, value, std in values_of(result)
    ]
    note = "A value without an error was fixed: as asked, or at zero where it was within twice its error."
    return doc.table("Identified two-mass drive", columns, rows, note)


def values_of(result: FrequencyResult) -> list[tuple[str, str, float, float]]:
    """Label, unit, value and standard error of everything that was found."""
    fit = result.fit
    rows = [(*LABELS[name], fit[name], fit.std(name)) for name in LABELS]
    rows.append(("Antiresonance", "rad/s", *fit.antiresonance_rad_s))
    rows.append(("Resonance", "rad/s", *fit.resonance_rad_s))
    if result.play is not None:
        rows.append(("Play, total", "rad", 2.0 * result.play.half_rad, 2.0 * result.play.half_std_rad))
    return rows


def response_figures(result: FrequencyResult) -> list[Block]:
    """Motor angle (and load angle) over motor torque: measured lines and the model."""
    from analyses.identification.frequency import response
    from analyses.identification.two_mass import NAMES, angle_responses

    lines, fit = result.lines, result.fit
    own = {name: fit[name] for name in NAMES}
    model = angle_responses(lines.omega_rad_s, own, fit.reduction, fit.reaction)
    hertz = lines.omega_rad_s / (2.0 * np.pi)
    figures = []
    for k, (signal, label) in enumerate((("angle", "motor angle"), ("load_angle", "load angle"))):
        if signal not in lines.names:
            continue
        measured, _ = response(lines, signal, lines.names[0])
        chart = Chart(width=style.WIDE, height=320.0)
        panel = chart.panel()
        panel.x.log = panel.y.log = True
        panel.points(hertz, np.abs(measured), "measured", colour=style.BLUE)
        panel.curve(hertz, np.abs(model[k]), "two-mass model", **style.series(1))
        panel.x.label, panel.y.label = "frequency, Hz", f"{label} over torque, rad/(N m)"
        caption = f"Response of the {label} to the motor's torque: measured lines and the fitted model"
        alt = f"Magnitude of {label} over motor torque against frequency, measured and fitted"
        figures.append(doc.figure("response", chart, caption=caption, alt=alt))
    return figures
