"""Play of a coupling from a record of both its sides under a torque that reverses."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import binary_erosion

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.types import Floats, Mask
from analyses.estimation.least_squares import identifiable, solve
from analyses.estimation.parameters import own_std
from analyses.identification.two_mass import TwoMass
from analyses.records.differentiation import filtered_motion
from analyses.records.record import Record
from analyses.records.single_rows import count_of

OF_THE_LOAD = ("stiffness", "load_inertia", "damping", "load_viscous")
CONTACT = 0.25  # rows whose torque is above this share of its largest (95 % point) are taken as in contact
LEAST_ROWS = 50
BEYOND = 0.9
ROUNDS = 8
GUARD = 1.5  # periods of the cut-off left out on both sides of a loss of contact: the filter smears over it


@dataclass(frozen=True, kw_only=True)
class Play:
    """Half of the play, and what the same rows tell of the load's friction."""

    half_rad: float  # at the coupling
    half_std_rad: float  # with the rows' correlation in time, and the encoders' steps, alike in each cycle
    middle_rad: float
    viscous_Nms_rad: float | None  # of the load at the coupling's shaft; None where the rows do not tell it
    dry_Nm: float | None  # the same
    rows: int  # that were in contact

    @property
    def determined(self) -> bool:
        """Whether the play is beyond twice its own error."""
        return self.half_rad > 2.0 * self.half_std_rad


def play_of(design: Design, record: Record, fit: TwoMass) -> Play:
    """The play, its error with what the errors of the frequency response make of it."""
    if not {"angle", "output_angle"} <= set(record.signals):
        raise InputError("the play needs the motor's angle and the output's", where=record.name)
    dry = 0.0 if design.load.friction is None else design.load.friction.dry_torque_Nm
    dry_std = own_std(design, "load.friction.dry_torque")
    own = {**{name: fit[name] for name in OF_THE_LOAD}, "load_dry": dry}
    play = _play_with(design, record, fit, own)

    def moved(name: str, step: float) -> float:
        """By how much one standard error of a value moves the play."""
        changed = {**own, name: own[name] + step}
        return _play_with(design, record, fit, changed).half_rad - play.half_rad if step > 0.0 else 0.0

    used = fit.renamed({name: name for name in OF_THE_LOAD if name in fit.names})
    g = np.array([moved(name, used.std(name)) for name in used.names])
    passed_on = max(float(g @ used.correlation @ g), 0.0) + moved("load_dry", dry_std) ** 2
    return replace(play, half_std_rad=float(np.sqrt(play.half_std_rad**2 + passed_on)))


def _play_with(design: Design, record: Record, fit: TwoMass, values: Mapping[str, float]) -> Play:
    """Fit ``twist = middle + b sgn(T) + T/k`` in contact, ``T`` by the load's inertia and friction."""
    behind, period, k = design.ratio_behind_coupling, record.period_s, values["stiffness"]
    cutoff = min(0.05 / period, 4.0 * fit.resonance_rad_s[0] / (2.0 * np.pi))
    motor = filtered_motion(record["angle"], period, cutoff_hz=cutoff, order=4)
    load = filtered_motion(behind * record["output_angle"], period, cutoff_hz=cutoff, order=4)
    needed = values["load_inertia"] * load.acceleration + values["load_dry"] * np.sign(load.velocity)
    if "torque" in record.signals:
        needed = needed - record["torque"] / behind
    needed = needed - values["damping"] * (motor.velocity / fit.reduction - load.velocity)
    edge = min(max(round(0.5 / (cutoff * period)), 10), len(needed) // 10)
    part = slice(edge, len(needed) - edge)
    inertial, speed = needed[part], load.velocity[part]
    twist = (motor.position / fit.reduction - load.position)[part]
    friction = np.column_stack([speed, np.sign(speed)])
    names = ("middle", "play", "viscous", "dry")
    own = {"viscous": values["load_viscous"], "dry": 0.0}
    low, high = np.quantile(twist, [0.02, 0.98])  # less the elastic part there, the ends of the gap
    elastic = float(np.quantile(np.abs(inertial), 0.9)) / k
    middle, half = float(0.5 * (low + high)), max(0.5 * float(high - low) - elastic, 0.0)
    for _ in range(ROUNDS):
        torque = inertial + friction @ np.array([own["viscous"], own["dry"]])
        touching = _in_contact(torque, twist - middle, half, round(GUARD / (cutoff * period)))
        w = np.column_stack([np.ones_like(torque), np.sign(torque), friction / k])[touching]
        kept, _ = identifiable(w, names)
        result = solve(w[:, kept], (twist - inertial / k)[touching])
        found = dict(zip((names[j] for j in kept), result.values.tolist(), strict=True))
        middle, half = found["middle"], found["play"]
        new = {name: max(found.get(name, own[name]), 0.0) for name in own}
        if all(abs(new[name] - own[name]) <= 1e-9 * abs(new[name]) for name in own):
            break
        own = new
    steps = count_of(record["angle"]) / fit.reduction, behind * count_of(record["output_angle"])
    coarse = _coarse(steps, touching, 0.5 / (cutoff * period))
    std = np.sqrt(result.correlated[kept.index(1), kept.index(1)])
    return Play(
        half_rad=half,
        half_std_rad=float(np.hypot(std, coarse)),
        middle_rad=middle,
        viscous_Nms_rad=found.get("viscous"),
        dry_Nm=found.get("dry"),
        rows=int(np.count_nonzero(touching)),
    )


def _coarse(steps: tuple[float, float], touching: Mask, smooth_samples: float) -> float:
    """Error from resolutions: uniform, averaged over the independent rows of one cycle (two contacts)."""
    visits = max(int(np.count_nonzero(np.diff(touching.astype(np.int8)) == 1)), 2)
    independent = np.count_nonzero(touching) / (0.5 * visits) / max(smooth_samples, 1.0)
    return float(np.hypot(*steps) / np.sqrt(12.0 * max(independent, 1.0)))


def _in_contact(torque_Nm: Floats, twist: Floats, half: float, guard_samples: int) -> Mask:
    """Rows beyond the gap on the side that the torque, well away from zero, pushes to."""
    side = np.sign(torque_Nm)
    pushed = np.abs(torque_Nm) > CONTACT * float(np.quantile(np.abs(torque_Nm), 0.95))
    touching = pushed & (side * twist > BEYOND * half)
    if guard_samples:
        touching = np.asarray(binary_erosion(touching, iterations=guard_samples))
    least = min(np.count_nonzero(side[touching] > 0.0), np.count_nonzero(side[touching] < 0.0))
    if least < LEAST_ROWS:
        why = f"{least} rows on the rarer flank, {LEAST_ROWS} wanted"
        raise InputError(f"{why}: the torque through the coupling must reverse and stay")
    return np.asarray(touching)
