"""Identifications by a frequency response: of a two-mass drive by its lines, of a design by a loop's."""

from __future__ import annotations

import numpy as np

from analyses.estimation.parameters import parameter
from analyses.identification.frequency import response
from analyses.identification.frequency_bench import FrequencyResult
from analyses.identification.measured_response import ResponseResult
from analyses.identification.two_mass import NAMES, angle_responses
from reports import document as doc
from reports.charts import style
from reports.charts.style import Chart
from reports.document_schema import Block, Section
from reports.sections.identified import judged, parameter_table, value_words
from reports.sections.record_tables import finding_table, input_table


def section(result: FrequencyResult) -> Section:
    """Make the section of a frequency response's identification."""
    fit = result.fit
    blocks = [
        parameter_table("Identified two-mass drive", result.found),
        *response_figures(result),
        input_table(f"Inputs: {result.record.name}", result.inputs),
        *(finding_table(name, rows) for name, rows in result.findings.items()),
    ]
    intro = (
        f"{fit.lines} lines of a period of {result.period_s:g} s, means over {result.lines.periods} periods; "
        "two-mass drive by maximum likelihood with the noise of every line from the spectrum beside it. "
        f"Misfit {fit.misfit:.2f} (1: the noise explains the residuals)."
    )
    low, high = fit.antiresonance_rad_s[0] / (2.0 * np.pi), fit.resonance_rad_s[0] / (2.0 * np.pi)
    words = f"Antiresonance {low:.4g} Hz, resonance {high:.4g} Hz, stiffness {value_words(fit, 'stiffness')}"
    if result.play is not None:
        words += f", play {2e3 * result.play.half_rad:.3g} mrad"
    return judged(
        "frequency-identification", "Two-mass drive", result, blocks, result=f"{words}.", intro=intro
    )


SEEN = {"L": "open loop", "T": "closed loop L/(1+L)", "S": "sensitivity", "closed": "command to output"}


def of_loop(result: ResponseResult) -> Section:
    """Make the section of a design that was fitted to a measured response of one of its loops."""
    fit, measured = result.fit, result.measured
    noise = "no deviations were measured: errors are those of the residual"
    if fit.misfit is not None:
        noise = f"misfit {fit.misfit:.2f} (1: the measured deviations explain the residual)"
    intro = (
        f"{measured.name}: {len(measured.frequency_hz)} frequencies from {measured.frequency_hz[0]:.4g} to "
        f"{measured.frequency_hz[-1]:.4g} Hz, {SEEN[result.of]} of {result.loop}; least squares of the exact "
        f"sampled loop, {noise}."
    )
    blocks: list[Block] = [parameter_table("Identified values", fit)]
    for label, of in (("magnitude", np.abs), ("phase, deg", lambda z: np.degrees(np.angle(z)))):
        chart = Chart(width=style.WIDE, height=280.0)
        panel = chart.panel("frequency, Hz", label, "xy" if label == "magnitude" else "x")
        panel.points(measured.frequency_hz, of(measured.response), "measured", colour=style.BLUE)
        panel.curve(measured.frequency_hz, of(result.modelled), "identified design", **style.series(1))
        what = label.partition(",")[0].capitalize()
        words = f"{what} of the {SEEN[result.of]} of {result.loop}, measured and fitted"
        blocks.append(doc.figure("response", chart, caption=words, alt=f"{words}, against frequency"))
    found = "; ".join(f"{parameter(name).key} {value_words(fit, name)}" for name in fit.names)
    return judged(
        "response-identification", "Measured response", result, blocks, result=f"{found}.", intro=intro
    )


def response_figures(result: FrequencyResult) -> list[Block]:
    """Motor angle (and load angle) over motor torque: measured lines and the model."""
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
        panel = chart.panel("frequency, Hz", f"{label} over torque, rad/(N m)", "xy")
        panel.points(hertz, np.abs(measured), "measured", colour=style.BLUE)
        panel.curve(hertz, np.abs(model[k]), "two-mass model", **style.series(1))
        caption = f"Response of the {label} to the motor's torque: measured lines and the fitted model"
        figures.append(doc.figure("response", chart, caption))
    return figures
