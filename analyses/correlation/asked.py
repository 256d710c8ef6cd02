"""What is asked of the model against records."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from actuator_lti.errors import InputError
from analyses.request import Option


@dataclass(frozen=True, kw_only=True)
class Asked:
    """Run the model with each record's own command, load and supply, and say how far off it is.

    For every signal that both have: relative error, fit, mean, rms and largest error, delay; over several
    records also all together, and the worst; with --out pictures of both and the difference. Where a record
    contradicts itself or the design's limits (a wrong unit, swapped columns, a clock that is off), or a
    signal is off by more than --error-limit of its motion, beyond its own noise, the status is 1.

    The outermost command that is recorded drives the model: reference of the output angle, speed, current
    (or torque), or voltage; loops outside it do not act. A recorded supply limits the voltage over time, and
    scales it where a loop sets the voltage itself.

    A CSV, Parquet or MATLAB file with columns such as time_s, reference_deg, Output angle [deg],
    motor_speed_rpm, current_A, load_Nm is read as it is, with commas, semicolons or tabs; so is what
    simulate writes, and the EMPS benchmark's file. Any other layout is told by a record file in TOML, a line
    for each: file = "log.csv", separator = ";", decimal = ",", time = { column = "t", unit = "ms" },
    signals.reference = { column = "cmd", unit = "deg" }.

    Try: actuator-lti correlate emps DATA_EMPS.mat
    """

    records: Annotated[list[Path], Option("CSV, .mat, or record files (TOML).", "RECORD...", argument=True)]
    command: Annotated[
        str | None,
        Option(
            "Signal that drives the model: a recorded command (default: the outermost), or voltage "
            "(the motor's measured one).",
            "SIGNAL",
        ),
    ] = None
    error_limit: Annotated[
        float, Option("Error, of the motion about its mean, above which a signal fails; 20.", "%")
    ] = 20.0

    def __post_init__(self) -> None:
        """Refuse a negative limit."""
        if not self.error_limit >= 0.0:
            raise InputError(f"error_limit = {self.error_limit:g}: must be 0 or more")
