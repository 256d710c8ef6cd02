"""Records of random drives whose truth is known, and what is done to them."""

from __future__ import annotations

import numpy as np

from actuator_lti.design import load_design, with_values
from actuator_lti.design.model import Design
from analyses.records.record import Record, RowCounts
from nonlinear import commands, simulate

KINDS = ("with its command", "without a command", "1024 counts a turn", "current 1 ms late")
VALUES = ("inertia", "viscous", "dry", "offset")
NOISE_A = 0.02


def random_record(kind: str, seed: int, seconds: float = 4.0) -> tuple[Design, dict[str, float], Record]:
    """A design to start from, the truth, and the record of a drive of other inertia and friction at 1 kHz."""
    rng = np.random.default_rng([KINDS.index(kind), seed])  # each kind has draws of its own
    base = load_design("ilr33-amber")
    friction, rotor = base.friction, base.motor.rotor_inertia_kgm2
    drive = with_values(
        base,
        {
            "motor.rotor_inertia": rotor * rng.uniform(0.6, 1.6),
            "friction.dry_torque": friction.dry_torque_Nm * rng.uniform(0.5, 2.0),
            "friction.viscous": friction.viscous_Nms_rad * rng.uniform(0.5, 2.0),
        },
    )
    run = simulate(drive, commands.multisine(0.02, [0.7, 1.9, 4.3], seconds, 1e-4, seed=seed), seconds)
    time = run.time_s[::10]
    late = 1e-3 if "late" in kind else 0.0
    current = np.interp(time - late, run.time_s, run.current_A) + NOISE_A * rng.standard_normal(len(time))
    angle = run.motor_angle_rad[::10]
    if "counts" in kind:
        step = 2.0 * np.pi / 1024
        angle = step * np.floor(angle / step)
    signals = {"reference": run.reference_rad[::10], "angle": angle, "current": current}
    if "without" in kind:
        del signals["reference"]
    rows = RowCounts(rows_in=len(time), rows_out=len(time))
    truth = {
        "inertia": drive.inertia_kgm2,
        "viscous": drive.friction.viscous_Nms_rad,
        "dry": drive.friction.dry_torque_Nm,
        "offset": 0.0,
    }
    return base, truth, Record(name="r", time_s=time, signals=signals, units={}, counts=rows)
