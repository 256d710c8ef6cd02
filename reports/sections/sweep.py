"""Measured and linear frequency responses over one another: loops on a constant speed, and from rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from analyses.validation.at_rest import RestSweep
from analyses.validation.result import LoopValidation, PointValidation, Validation
from analyses.validation.tolerance import allowed
from reports import document as doc
from reports.document import abscissa, rounded
from reports.document_schema import Block, Row, Section
from reports.figures import overlay_sweep as overlay_sweep_figure
from reports.figures import rest_sweep as rest_sweep_figure
from reports.numbers import significant

NAMES = {"current": "Current loop", "velocity": "Velocity loop", "position": "Position loop"}


def sections(validation: Validation) -> list[Section]:
    """Make the section of the loops, and that from rest where there is dry friction."""
    made = [_injection(validation.loops, validation.points)]
    sweep = validation.rest_sweep
    if sweep is not None and np.isfinite(sweep.described).any():
        made.append(_from_rest(sweep, validation.design.axis))
    return made


def worst_below_third(loop: LoopValidation) -> tuple[float, float]:
    """Largest differences of the open loop in dB and deg, up to a third of Nyquist."""
    assert loop.measured is not None
    assert loop.open_errors is not None
    low = _low(loop)
    gain, phase = (np.abs(x[low]) for x in (loop.open_errors.gain_db, loop.open_errors.phase_deg))
    return float(gain.max(initial=0.0)), float(phase.max(initial=0.0))


def allowed_below_third(loop: LoopValidation) -> tuple[float, float]:
    """What the measurement itself may be off by there, in dB and deg (`analyses.validation.tolerance`)."""
    assert loop.measured is not None
    may = float(allowed(loop.measured.point_error["open_loop"][_low(loop)].max(initial=0.0), 1.0))
    return 20.0 * may / np.log(10.0), float(np.degrees(may))


def agrees(loop: LoopValidation) -> bool:
    """Whether the open loop agrees up to a third of Nyquist."""
    return all(x <= y for x, y in zip(worst_below_third(loop), allowed_below_third(loop), strict=True))


def _low(loop: LoopValidation) -> np.ndarray:
    """Which points are measured and lie below a third of Nyquist."""
    assert loop.measured is not None
    sweep = loop.measured.sweep
    return np.asarray(sweep.valid & (sweep.frequency_hz <= 0.5 / sweep.period_s / 3.0))


def has_points(loop: LoopValidation) -> bool:
    """Whether any point was measured that the agreement can be judged by."""
    return loop.measured is not None and bool(_low(loop).any())


def _injection(loops: Mapping[str, LoopValidation], points: Mapping[str, PointValidation]) -> Section:
    """Make the section of the loops measured by injection."""
    shown = {name: loop for name, loop in loops.items() if has_points(loop)}
    blocks: list[Block] = [_overlay(name, loop) for name, loop in shown.items()]
    blocks.append(_agreement(shown, points))
    intro = (
        "A sine is added at the break point while the drive runs at constant speed. Fundamentals are "
        "correlated "
        "over whole periods, once two windows agree. One run gives open loop, closed loop and plant. The "
        "limits "
        "of the drive are active; the amplitudes stay below them. A loop that is slow against its tick is "
        "measured by one long step there instead, of which the Fourier sum is taken."
    )
    good = all(agrees(loop) for loop in shown.values())
    worst = [worst_below_third(loop) for loop in shown.values()]
    gain, phase = (max((pair[k] for pair in worst), default=0.0) for k in (0, 1))
    result = (
        "No loop could be measured."
        if not shown
        else (
            "Up to a third of the Nyquist frequency, model and simulation differ by at most "
            f"{significant(gain, 2)} dB "
            f"and {significant(phase, 2)} deg."
        )
    )
    return doc.section(
        "injection", "Frequency response by injection", blocks, result=result, intro=intro,
        status=("pass" if good else "fail") if shown else "info",
    )  # fmt: skip


def _overlay(name: str, loop: LoopValidation) -> Block:
    """Make the overlay of one loop."""
    assert loop.measured is not None
    sweep = loop.measured.sweep
    f = sweep.frequency_hz
    panels: list[overlay_sweep_figure.Response] = [
        _panel("open loop L", loop.open_loop, sweep.open_loop),
        _panel("closed loop T", loop.closed_loop, sweep.closed_loop),
    ]
    third, may = 0.5 / sweep.period_s / 3.0, allowed_below_third(loop)
    data: overlay_sweep_figure.Data = {
        "frequency_hz": abscissa(f),
        "valid_to_hz": third,
        "panels": panels,
        "tolerance_db": abscissa([may[0]], 3)[0],
        "tolerance_deg": abscissa([may[1]], 3)[0],
    }
    gain, phase = worst_below_third(loop)
    caption = (
        f"{NAMES[name]}: linear model (line), nonlinear simulation (circles), and the magnitude of their "
        f"difference. Up to a third of the Nyquist frequency ({third:.4g} Hz, dotted) it is at most "
        f"{significant(gain, 2)} dB and {significant(phase, 2)} deg."
    )
    chart = overlay_sweep_figure.draw(doc.plain(data))
    return doc.figure("overlay_sweep", chart, caption=caption, alt=caption)


def _panel(title: str, linear: Any, measured: Any) -> overlay_sweep_figure.Response:
    """One response: magnitudes, phases, differences."""
    ratio = measured / linear
    phase = np.degrees(np.unwrap(np.angle(linear)))
    seen = phase + np.degrees(np.angle(ratio))
    return {
        "title": title,
        "linear_db": rounded(20.0 * np.log10(np.abs(linear))),
        "linear_deg": rounded(phase),
        "measured_db": rounded(20.0 * np.log10(np.abs(measured))),
        "measured_deg": rounded(seen),
        "error_db": rounded(np.abs(20.0 * np.log10(np.abs(ratio))), 3),
        "error_deg": rounded(np.abs(np.degrees(np.angle(ratio))), 3),
    }


def _agreement(loops: Mapping[str, LoopValidation], points: Mapping[str, PointValidation]) -> Block:
    """List how well each response is met, and how clean the measurement was."""
    columns = [
        doc.column("name", "Response"),
        doc.column("points", "Points", format="int"),
        doc.column("gain", "Largest gain difference", "dB", format="sig:2"),
        doc.column("phase", "Largest phase difference", "deg", format="sig:2"),
        doc.column("distortion", "Distortion", "%", format="sig:2", better=-1),
        doc.column("unsteady", "Difference of the last two windows", format="sig:2"),
        doc.column("tones", "Multisine: gain difference", "dB", format="sig:2"),
        doc.column("coherence", "1 − coherence", format="sig:2"),
        doc.column("left_out", "Left out"),
    ]
    rows = [_loop_row(name, loop) for name, loop in loops.items()]
    rows += [_point_row(name, point) for name, point in points.items() if point.sweep is not None]
    note = (
        "Largest values over all points up to Nyquist. A point whose last two windows differ by more than "
        "10⁻⁵ is not reported as steady. Distortion at u and i_ref of a multirate drive holds the images of "
        "its periodic loop."
    )
    return doc.table("Agreement of measured and assembled loops", columns, rows, note)


def _loop_row(name: str, loop: LoopValidation) -> Row:
    assert loop.measured is not None
    assert loop.open_errors is not None
    tones = loop.tones
    return {
        "name": f"{NAMES[name]}, open",
        **_quality(loop.measured.sweep, loop.open_errors),
        "tones": None if loop.tone_errors is None else loop.tone_errors.worst_gain_db,
        "coherence": None if tones is None else float(1.0 - tones.coherence.min()),
    }


def _point_row(name: str, point: PointValidation) -> Row:
    return {"name": f"at {name}, all loops closed", **_quality(point.sweep, point.open_errors)}


def _quality(sweep: Any, errors: Any) -> Row:
    good = sweep.valid
    left = sorted({text for text in sweep.reason if text})
    return {
        "points": int(good.sum()),
        "gain": errors.worst_gain_db,
        "phase": errors.worst_phase_deg,
        "distortion": 100.0 * float(sweep.distortion[good].max(initial=0.0)),
        "unsteady": float(sweep.unsteadiness[good].max(initial=0.0)),
        "left_out": "; ".join(left) if left else "none",
    }


def _decibels(values: np.ndarray) -> np.ndarray:
    """Magnitude in dB; nothing where the output does not move."""
    size = np.abs(values)
    return 20.0 * np.log10(np.where(size > 0.0, size, np.nan))


def _described_agreement(sweep: RestSweep) -> str:
    """How far the describing function is from the simulation, where there is motion in both."""
    both = (sweep.measured != 0.0) & np.isfinite(sweep.measured) & np.isfinite(sweep.described)
    off = sweep.measured[both] / sweep.described[both]
    if not off.size:
        return "is not compared: dry friction holds the rotor"
    gain, phase = 20.0 * np.log10(np.abs(off)), np.degrees(np.angle(off))
    return f"agrees with the simulation within {np.abs(gain).max():.2g} dB and {np.abs(phase).max():.2g} deg"


def _from_rest(sweep: RestSweep, axis: str) -> Section:
    """Make the section of the sweep from rest."""
    scale, unit = (1e3, "mm") if axis == "linear" else (57.29577951308232, "deg")
    moved = np.abs(sweep.described) > 0.0  # of NaN, too: no
    sweep = replace(sweep, described=np.where(moved, sweep.described, np.nan))
    series = [
        ("measured from rest", sweep.measured, True),
        ("sliding loop", sweep.sliding, False),
        ("describing function of dry friction", sweep.described, False),
    ]
    data: rest_sweep_figure.Data = {
        "frequency_hz": abscissa(sweep.frequency_hz),
        "series": [
            {
                "label": label,
                "magnitude_db": rounded(_decibels(values)),
                "phase_deg": rounded(np.degrees(np.unwrap(np.angle(values)))),
                "points": points,
            }
            for label, values, points in series
        ],
    }
    low, high = sweep.amplitude_rad.min() * scale, sweep.amplitude_rad.max() * scale
    agrees = _described_agreement(sweep)
    clear = "" if any(sweep.limiter) else ", below every limit"
    caption = (
        f"Command to output without bias motion, amplitudes of {low:.3g} to {high:.3g} {unit}{clear}. "
        f"The describing function at the measured speed amplitude {agrees}. The sliding loop does not "
        "include the reversals."
    )
    intro = "Dry friction has no small-signal gain where the speed changes sign: it depends on the amplitude."
    block = doc.figure("rest_sweep", rest_sweep_figure.draw(doc.plain(data)), caption=caption, alt=caption)
    result = f"The describing function of dry friction {agrees}."
    return doc.section("from-rest", "From rest: effect of dry friction", [block], result=result, intro=intro)
