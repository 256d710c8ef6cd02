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
    whole, law = chirp_prediction.whole, chirp_prediction.law
    speeds = ", ".join(f"{speed / (2.0 * pi):.3f} turns/s" for speed in motor.steady_speeds_rad_s)
    intro = (
        f"Step: settles at {speeds}; gain {motor.gain_rad_sV:.2f} rad/(s V) (standard error "
        f"{motor.gain_std:.2f}), time constant {1e3 * motor.time_constant_s:.2f} ms "
        f"({1e3 * motor.time_constant_std_s:.2f} ms), behind a speed estimator of {motor.estimator_rad_s:g} "
        f"rad/s. Chirp {record}: {law.start_hz:.2f} Hz growing by "
        f"exp({law.rate_per_s:.4f} t), followed until {law.end_s:.2f} s."
    )
    columns = [
        doc.of(lambda band: band[0], "low", "From", "Hz", format="sig:3"),
        doc.of(lambda band: band[1], "high", "to", "Hz", format="sig:3"),
        doc.of(
            lambda band: 100.0 * band[2].relative_error, "error", "Error of the speed", "%", format="fix:2"
        ),
        doc.of(lambda band: band[2].fit_percent, "fit", "Fit", "%", format="fix:2"),
    ]
    bands = [*chirp_prediction.bands, (law.start_hz, law.frequency_hz(law.end_s), whole)]
    made = doc.listing(
        "Prediction of the chirp by the motor fitted to the step; last row: all of it", bands, columns
    )
    result = (
        f"Speed over the chirp predicted within {100.0 * whole.relative_error:.3g} % by the motor fitted to "
        f"the step, up to {law.frequency_hz(law.end_s):.3g} Hz."
    )
    figure = signal_figure(whole)
    return doc.section("chirp", f"Prediction of {record}", [made, figure], result=result, intro=intro)
