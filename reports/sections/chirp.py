"""A motor fitted to voltage steps, and its prediction of a chirp."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING

from reports import document as doc
from reports.document_schema import Section
from reports.sections.correlation import signal_figure

if TYPE_CHECKING:
    from analyses.correlation.chirp import ChirpPrediction
    from analyses.correlation.voltage_motor import VoltageMotor


def section(motor: VoltageMotor, chirp_prediction: ChirpPrediction, record: str) -> Section:
    """Make the section of one prediction."""
    speeds = ", ".join(f"{speed / (2.0 * pi):.3f} turns/s" for speed in motor.steady_speeds_rad_s)
    intro = (
        f"Step: settles at {speeds}; gain {motor.gain_rad_sV:.2f} rad/(s V) (standard error "
        f"{motor.gain_std:.2f}), "
        f"time constant {1e3 * motor.time_constant_s:.2f} ms ({1e3 * motor.time_constant_std_s:.2f} ms), "
        f"behind a speed estimator of {motor.estimator_rad_s:g} rad/s. "
        f"Chirp {record}: {chirp_prediction.law.start_hz:.2f} Hz growing by "
        f"exp({chirp_prediction.law.rate_per_s:.4f} t), followed until {chirp_prediction.law.end_s:.2f} s."
    )
    columns = [
        doc.column("low", "From", "Hz", format="sig:3"),
        doc.column("high", "to", "Hz", format="sig:3"),
        doc.column("error", "Relative error of the speed", "%", format="fix:2"),
        doc.column("fit", "Fit", "%", format="fix:2"),
    ]
    rows = [
        {"low": low, "high": high, "error": 100.0 * c.relative_error, "fit": c.fit_percent}
        for low, high, c in chirp_prediction.bands
    ]
    whole = chirp_prediction.whole
    rows.append(
        {
            "low": chirp_prediction.law.start_hz,
            "high": chirp_prediction.law.frequency_hz(chirp_prediction.law.end_s),
            "error": 100.0 * whole.relative_error,
            "fit": whole.fit_percent,
        }
    )
    made = doc.table(
        "Prediction of the chirp by the motor fitted to the step; last row: all of it", columns, rows
    )
    result = (
        f"Speed over the chirp predicted within {100.0 * whole.relative_error:.3g} % by the motor fitted to "
        f"the step, up to {chirp_prediction.law.frequency_hz(chirp_prediction.law.end_s):.3g} Hz."
    )
    figure = signal_figure(whole)
    return doc.section("chirp", f"Prediction of {record}", [made, figure], result=result, intro=intro)
