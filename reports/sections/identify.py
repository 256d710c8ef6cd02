"""An identification of any kind: its section, and the design that it writes; a plan, a frequency response."""

from collections.abc import Callable
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from actuator_lti.files.atomic import write_text
from analyses.estimation.parameters import parameter
from analyses.identification.bench import BenchResult
from analyses.identification.frequency_bench import FrequencyResult
from analyses.identification.measured_response import ResponseResult
from analyses.identification.plan import Plan
from analyses.identification.run import CampaignAnswer
from analyses.identification.two_mass import NAMES, angle_responses, response
from analyses.identification.verdict import Identified
from reports import document as doc
from reports.charts import style
from reports.sections import identified, identify_campaign, identify_records
from reports.sections.measured import decibels_and_degrees


def section(result: Identified | Plan) -> doc.Section:
    made: dict[type, Callable[[Any], doc.Section]] = {
        BenchResult: identify_records.section, CampaignAnswer: identify_campaign.section, Plan: _plan,
        FrequencyResult: _two_mass, ResponseResult: _of_loop,
    }  # fmt: skip
    return made[type(result)](result)


def write(result: Identified | Plan, folder: Path | None) -> list[str]:
    """Write the identified design, where all checks pass or it was accepted; of a plan the command."""
    if folder is None or not (isinstance(result, Plan) or result.passed or result.accepted):
        return []
    if isinstance(result, Plan):
        path = folder / f"{result.design.name}-plan.csv"
        name = "position_reference_m" if result.design.axis == "linear" else "reference_rad"  # as in a record
        rows = zip(result.time_s.tolist(), result.command.tolist(), strict=True)
        text = f"time_s,{name}\n" + "".join(f"{t:.3f},{value:.9g}\n" for t, value in rows)
    else:
        path, text = folder / f"{result.design.name}-identified.toml", result.text
    write_text(path, text)
    return [str(path)]


NEXT = "What the records at hand tell is counted; these motions are what to measure next."


def _plan(plan: Plan) -> doc.Section:
    axis = plan.design.axis
    unit, rate = ("m", "m/s") if axis == "linear" else ("rad", "rad/s")
    drive = "V" if plan.design.effective_motor.torque_constant_Nm_A is None else "A"
    columns = [
        doc.of(lambda row: row[1], "times", "Times", format="int"),
        doc.of(lambda row: row[0].shape, "shape", "Motion of 4 s"),
        doc.of(lambda row: row[0].cycles / 4.0, "frequency", "Frequency", "Hz", format="sig:3"),
        doc.of(lambda row: row[0].amplitude, "amplitude", "Amplitude, output", unit, format="sig:3"),
        doc.of(lambda row: row[0].speed, "speed", "Largest motor speed", rate, format="sig:3"),
        doc.of(lambda row: row[0].drive_rms, "rms", "Drive signal, rms", drive, format="sig:3"),
    ]
    share = doc.of(plan.half_widths.get, "share", "Half interval", "%", scale=100.0, format="sig:3")
    note = "Half interval: over the value; of the offset over the dry friction."
    lasts, within = f"{len(plan.command) * 1e-3:g} s of motion are", f"{100.0 * plan.within:g} %"
    worst = max(plan.half_widths, key=lambda name: plan.half_widths[name])
    found = f"{100.0 * plan.half_widths[worst]:.3g} % of the {parameter(worst, axis).label.lower()}"
    words = f"{lasts} not enough: {found} is told, {within} asked."
    if plan.passed:
        words = f"{lasts} expected to tell every value within {within} (95 %); the least closely {found}."
    groups = [(next(same), 1 + sum(1 for _ in same)) for _, same in groupby(plan.segments, key=id)]
    expected = "Intervals to be expected, at the design's values"
    blocks = [
        identified.parameter_table(expected, plan.expected, note, axis=axis, more=[share]),
        doc.listing("Motions, in this order", groups, columns),
    ]
    if plan.segments:
        rows = style.kept_rows([plan.command])
        chart, panel = style.plot(260.0, "time, s", f"command at the output, {unit}")
        panel.curve(plan.time_s[rows], plan.command[rows], "command", colour=style.BLUE)
        blocks.append(doc.figure("plan", chart, "Command of all motions, one after the other"))
    intro = (
        f"Motions from rest to rest, as large as the limits of {plan.design.name} allow in simulation, "
        f"chosen one by one (A-optimal); recorded at 1 kHz with white noise of {plan.noise:g} {drive} (rms). "
        f"The covariance is that of the fit itself. {NEXT if plan.measured else ''}"
    )
    status: doc.Status = "pass" if plan.passed else "fail"
    return doc.section("plan", "Plan of motions", blocks, result=words, intro=intro.strip(), status=status)


def _two_mass(result: FrequencyResult) -> doc.Section:
    """Parameters, and motor angle (and load angle) over motor torque: measured lines and the model."""
    fit, lines = result.fit, result.lines
    blocks = [identified.parameter_table("Identified two-mass drive", result.found)]
    values = {name: fit[name] for name in NAMES}
    model = angle_responses(lines.omega_rad_s, values, fit.reduction, fit.reaction)
    hertz = lines.omega_rad_s / (2.0 * np.pi)
    for k, label in enumerate(("motor angle", "load angle")[: len(lines.names) - 1], 1):
        chart, panel = style.plot(320.0, "frequency, Hz", f"{label} over torque, rad/(N m)", "xy")
        panel.points(hertz, np.abs(response(lines, k)[0]), "measured", colour=style.BLUE)
        panel.curve(hertz, np.abs(model[k - 1]), "two-mass model", **style.series(1))
        caption = f"Response of the {label} to the motor's torque: measured lines and the fitted model"
        blocks.append(doc.figure("response", chart, caption))
    blocks.append(identified.input_table(f"Inputs: {result.record.name}", result.inputs))
    blocks += [identified.finding_table(name, rows) for name, rows in result.findings.items()]
    intro = (
        f"{fit.lines} lines of a period of {result.period_s:g} s, means over {lines.periods} periods; "
        "two-mass drive by maximum likelihood with the noise of every line from the spectrum beside it. "
        f"Misfit {fit.misfit:.2f} (1: the noise explains the residuals)."
    )
    low, high = fit.antiresonance_rad_s[0] / (2.0 * np.pi), fit.resonance_rad_s[0] / (2.0 * np.pi)
    stiffness = identified.value_words(fit, "stiffness")
    words = f"Antiresonance {low:.4g} Hz, resonance {high:.4g} Hz, stiffness {stiffness}"
    words += "" if result.play is None else f", play {2e3 * result.play.half_rad:.3g} mrad"
    words += f"{identified.constant_words(fit)}."
    id, title = "frequency-identification", "Two-mass drive"
    return identified.judged(id, title, result, blocks, result=words, intro=intro)


SEEN = {"L": "open loop", "T": "closed loop L/(1+L)", "S": "sensitivity", "closed": "command to output"}


def _of_loop(result: ResponseResult) -> doc.Section:
    fit, measured, read = result.fit, result.measured, result.measured.read_as
    noise = "no deviations were measured: errors are those of the residual"
    if np.isfinite(measured.coherence).any():
        noise = f"the coherence is not read without --averages N, {noise}"
    if fit.misfit is not None:
        noise = f"misfit {fit.misfit:.2f} (1: the measured deviations explain the residual)"
    intro = (
        f"{measured.name}: {len(measured.frequency_hz)} frequencies from {measured.frequency_hz[0]:.4g} to "
        f"{measured.frequency_hz[-1]:.4g} Hz, {SEEN[result.of]} of {result.loop}; least squares of the exact "
        f"sampled loop, {noise}.{f' {read[:1].upper()}{read[1:]}.' if read else ''}"
    )
    own, axis = result.own, result.design.axis
    more = [
        doc.of(own.__getitem__, "own", "Design", format="sig:5"),
        doc.of(lambda key: own[key] and fit[key] / own[key], "ratio", "Over it", format="sig:3"),
    ]
    blocks = [identified.parameter_table("Identified values", fit, axis=axis, more=more)]
    both = decibels_and_degrees(measured.response, result.modelled)
    for label, found, fitted in zip(("magnitude, dB", "phase, deg"), *both, strict=True):
        chart, panel = style.plot(280.0, "frequency, Hz", label, "x")
        panel.points(measured.frequency_hz, found, "measured", colour=style.BLUE)
        panel.curve(measured.frequency_hz, fitted, "identified design", **style.series(1))
        what = label.partition(",")[0].capitalize()
        words = f"{what} of the {SEEN[result.of]} of {result.loop}, measured and fitted"
        blocks.append(doc.figure("response", chart, caption=words, alt=f"{words}, against frequency"))
    found = (f"{parameter(name).key} {identified.value_words(fit, name, axis)}" for name in fit.names)
    values = "; ".join(found) + identified.constant_words(fit, axis)
    id, title = "response-identification", "Measured response"
    return identified.judged(id, title, result, blocks, result=f"{values}.", intro=intro)
