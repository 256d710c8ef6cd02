"""Records of random drives whose truth is known, and what is done to them."""

from __future__ import annotations

import numpy as np

from actuator_lti.design import load_design, with_values
from actuator_lti.design.model import Design
from analyses.records.record import Record, RowCounts
from nonlinear import commands, simulate

KINDS = (
    "with its command",
    "without a command",
    "1024 counts a turn",
    "current 1 ms late",
    "60 s",
    "several records",
)
VALUES = ("inertia", "viscous", "dry", "offset")

TONES_HZ = ((0.7, 1.9, 4.3), (0.5, 3.1), (2.3,))
SECONDS = (4.0, 8.0, 2.0)
AMPLITUDES_RAD = (0.02, 0.008, 0.003)
NOISE_A = (0.02, 0.05, 0.01)


def random_records(kind: str, seed: int) -> tuple[Design, dict[str, float], tuple[Record, ...]]:
    """A design to start from, the truth, and records of a drive of other inertia and friction at 1 kHz.

    Several are of different information: other tones, lengths, amplitudes and noise each.
    """
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
    count = len(SECONDS) if kind == "several records" else 1
    seconds = (60.0,) if kind == "60 s" else SECONDS
    truth = {
        "inertia": drive.inertia_kgm2,
        "viscous": drive.friction.viscous_Nms_rad,
        "dry": drive.friction.dry_torque_Nm,
        "offset": 0.0,
    }
    return base, truth, tuple(_record(kind, drive, seed, k, seconds[k], rng) for k in range(count))


def _record(kind: str, drive: Design, seed: int, k: int, seconds: float, rng: np.random.Generator) -> Record:
    command = commands.multisine(AMPLITUDES_RAD[k], TONES_HZ[k], seconds, 1e-4, seed=seed)
    run = simulate(drive, command, seconds, record_every=10)
    time, angle = run.time_s, run.motor_angle_rad
    late = 1e-3 if "late" in kind else 0.0
    current = np.interp(time - late, time, run.current_A) + NOISE_A[k] * rng.standard_normal(len(time))
    if "counts" in kind:
        step = 2.0 * np.pi / 1024
        angle = step * np.floor(angle / step)
    signals = {"reference": run.reference_rad, "angle": angle, "current": current}
    if "without" in kind:
        del signals["reference"]
    rows = RowCounts(rows_in=len(time), rows_out=len(time))
    return Record(name=f"r{k + 1}", time_s=time, signals=signals, units={}, counts=rows)
