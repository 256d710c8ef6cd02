"""The plant of a drive as data (units: `actuator_lti.design.model`), and the keys of the file."""

from dataclasses import dataclass, replace
from math import inf, pi, sqrt
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np

from actuator_lti.design.field import choice, degrees, not_negative, positive, quantity, text, unit_on
from actuator_lti.design.over_angle import OverAngle, Wave
from actuator_lti.drive.choice import where

if TYPE_CHECKING:
    from actuator_lti.design.model import Design

# fmt: off
FrictionLaw = Literal["coulomb", "tanh"]
LoadPath = Literal["self-locking", "back-drivable"]
Direction = Literal["both", "forward", "reverse"]
MotorConstants = Literal["dc", "rms-line", "peak-phase"]
DC_PER_A: dict[MotorConstants, float] = {"dc": 1.0, "rms-line": sqrt(1.5), "peak-phase": sqrt(3.0) / 2.0}
"""Current of the equivalent DC motor per ampere of a data sheet (docs/model.md, section 1)."""
STANDARD_GRAVITY_m_s2 = 9.80665


@dataclass(frozen=True, kw_only=True)
class Motor:
    """The motor: either R, L, kM, kE, or an ideal torque source with a gain.

    ``L di/dt = u - R i - kE w`` and torque ``kM i`` (paper, equations 1 and 2); without electrical
    dynamics the torque is ``source_gain_Nm_V * u``.  Cogging is a torque over the angle besides, whose mean,
    none, is the slope of a drive in motion.
    """

    rotor_inertia_kgm2: Annotated[float, positive("inertia of the rotor (linear axis: moving mass)",
        "J_motor", example="9.2 g*cm^2")]
    resistance_ohm: Annotated[float | None, positive("phase-phase resistance", "R", example="55 mohm")] = None
    inductance_H: Annotated[float | None, positive("phase-phase inductance", "L", example="6 uH")] = None
    torque_constant_Nm_A: Annotated[float | None, positive("torque per ampere", "kM",
        example="5.9 mN*m/A")] = None
    back_emf_constant_Vs_rad: Annotated[float | None, positive("back-EMF per rad/s; a speed constant, 83.4 "
        "rpm/V, is turned over (of peak-phase it is line-line); default kM in SI where constants is stated",
        "kE", example="5.9 mV*s/rad")] = None
    source_gain_Nm_V: Annotated[float | None, positive("gain of an ideal torque source, instead of R, L, "
        "kM, kE", "g", example="35.15 N/V")] = None
    cogging_Nm: Annotated[float, not_negative("cogging or torque ripple: peak of a torque sin(Z angle + "
        "phase) that the motor makes by itself", example="5 mN*m")] = 0.0
    cogging_periods: Annotated[float, positive("periods of the cogging per revolution of the motor (linear "
        "axis: rad per m)", "Z", unit="rad/{angle}",
        most=lambda design: _most_order(design, design.motor.over_angle.waves[0], 1.0), example="84")] = 1.0
    cogging_phase_rad: Annotated[float, quantity("phase of the cogging at motor angle zero; 180 deg: it "
        "holds there, 0: it pushes the motor away", unit="rad", low=-7.0, high=7.0, example="180 deg")] = 0.0
    constants: Annotated[MotorConstants, choice("how the data sheet gives kM, kE, R and L: dc (phase-phase; "
        "a stepper per phase), rms-line (N m/A rms, V rms line-line, R and L line-line), peak-phase (dq: A "
        "and V peak of a phase, R and L per phase)")] = "dc"

    @property
    def has_electrical_dynamics(self) -> bool:
        return self.source_gain_Nm_V is None

    @property
    def without_current(self) -> "Motor":
        """The motor with its winding open: inertia and cogging stay, and at 0 V it gives no torque."""
        return replace(
            self, resistance_ohm=None, inductance_H=None, torque_constant_Nm_A=None,
            back_emf_constant_Vs_rad=None, source_gain_Nm_V=self.source_gain_Nm_V or 1.0,
        )  # fmt: skip

    @property
    def over_angle(self) -> OverAngle:
        cogging = Wave(self.cogging_Nm, self.cogging_periods, self.cogging_phase_rad, averages=True)
        return OverAngle(waves=(cogging,))

    def straight(self) -> "Motor":
        """The same without what bends with the angle."""
        return replace(self, cogging_Nm=0.0)


@dataclass(frozen=True, kw_only=True)
class Gear:
    """One reduction stage; the inertias are those of its own input and output shafts."""

    name: str
    ratio: Annotated[float, positive("input speed over output speed", "i", example="66")]
    input_inertia_kgm2: Annotated[float, not_negative("inertia turning with the input shaft of the stage",
        "J_in", example="1 g*cm^2")] = 0.0
    output_inertia_kgm2: Annotated[float, not_negative("inertia turning with the output shaft of the stage",
        "J_out", example="5 g*cm^2")] = 0.0


@dataclass(frozen=True, kw_only=True)
class Screw:
    """A screw, rack or belt between a rotary motor and a linear axis.

    With p = lead/2 pi a torque T is the force T/p, an angle x the travel p x, an inertia J the mass J/p^2.
    Gears before the screw keep their ratios.
    """

    lead_m: Annotated[float, positive("travel per revolution of the screw: with it the motor's values may "
        "stand in N m, rad and kg m2, and encoder.counts_per_rev is per revolution", "p", example="10 mm")]

    @property
    def travel_m_rad(self) -> float:
        """p, travel per radian."""
        return self.lead_m / (2.0 * pi)


@dataclass(frozen=True, kw_only=True)
class Coupling:
    """The elastic coupling between the motor's side and the load's side (model.md section 6).

    Its own shaft is the output shaft of the gear ``after`` (``None``: of the last gear, or of the motor where
    there are no gears).
    """

    stiffness_Nm_rad: Annotated[float, positive("stiffness at the coupling's own shaft; of a strain wave "
        "gear K1, up to torque_1", "k", example="400 N*m/rad")]
    torque_1_Nm: Annotated[float | None, positive("torque at which the stiffness becomes stiffness_2", "T1",
        example="14 N*m")] = None
    stiffness_2_Nm_rad: Annotated[float | None, positive("stiffness beyond torque_1", "K2",
        example="25000 N*m/rad")] = None
    torque_2_Nm: Annotated[float | None, positive("torque at which the stiffness becomes stiffness_3", "T2",
        example="48 N*m")] = None
    stiffness_3_Nm_rad: Annotated[float | None, positive("stiffness beyond torque_2", "K3",
        example="29000 N*m/rad")] = None
    damping_Nms_rad: Annotated[float, not_negative("damping at the coupling's own shaft", "c",
        example="0.02 N*m*s/rad")] = 0.0
    play_rad: Annotated[float, not_negative("total play (backlash) at its own shaft", "2b",
        example="2 mrad")] = 0.0
    after: Annotated[str | None, text("name of the gear whose output shaft it is on; default the last "
        "gear")] = None

    @property
    def bends(self) -> tuple[tuple[Any, Any], ...]:
        return (self.torque_1_Nm, self.stiffness_2_Nm_rad), (self.torque_2_Nm, self.stiffness_3_Nm_rad)

    @property
    def pieces(self) -> tuple[tuple[Any, Any, Any], ...]:
        """Torque and twist without play from which on each piece of the spring holds, and its stiffness."""
        made = [(0.0, 0.0, self.stiffness_Nm_rad)]
        for torque, stiffness in self.bends:
            if torque is not None and stiffness is not None:
                before, twist, k = made[-1]
                made.append((torque, twist + (torque - before) / k, stiffness))
        return tuple(made)

    def stretch_rad(self, torque_Nm: Any) -> Any:
        """Twist without play that carries a torque at its own shaft, with the sign of the torque.

        >>> strain_wave = Coupling(stiffness_Nm_rad=10.0, torque_1_Nm=2.0, stiffness_2_Nm_rad=20.0)
        >>> strain_wave.stretch_rad(-6.0), strain_wave.stiffness_at(0.25)
        (-0.4, 20.0)
        """
        size, result = abs(torque_Nm), abs(torque_Nm) / self.stiffness_Nm_rad
        for torque, twist, k in self.pieces[1:]:
            result = where(size > torque, twist + (size - torque) / k, result)
        return where(torque_Nm < 0.0, -result, result)

    def twist_rad(self, torque_Nm: Any) -> Any:
        """The same with the half play; in the middle of it where there is no torque."""
        side = where(torque_Nm > 0.0, 0.5, where(torque_Nm < 0.0, -0.5, 0.0))
        return self.stretch_rad(torque_Nm) + side * self.play_rad

    def stiffness_at(self, twist_rad: Any) -> Any:
        result: Any = self.stiffness_Nm_rad
        for _, twist, k in self.pieces[1:]:
            result = where(abs(twist_rad) - 0.5 * self.play_rad > twist, k, result)
        return result


@dataclass(frozen=True, kw_only=True)
class LoadFriction:
    """Friction behind the coupling, at its shaft: C0_l, Cv_l, breakaway ratio and constant offset."""

    dry_torque_Nm: Annotated[float, not_negative("dry friction behind the coupling, at its shaft", "C0_l",
        example="0.1 N*m")] = 0.0
    viscous_Nms_rad: Annotated[float, not_negative("viscous friction behind the coupling, at its shaft",
        "Cv_l", example="0.01 N*m*s/rad")] = 0.0
    breakaway_ratio: Annotated[float, quantity("breakaway torque over dry friction of the load side", low=1.0,
        high=100.0, example="1")] = 1.0
    offset_torque_Nm: Annotated[float, quantity("constant torque that opposes positive motion of the load",
        example="0 N*m")] = 0.0


@dataclass(frozen=True, kw_only=True)
class Gravity:
    """A pendulum at the output shaft: M_ext = m g l sin(angle + offset); angle + offset = 0 is upright."""

    mass_kg: Annotated[float, positive("mass of the pendulum", "m", example="2 kg")]
    arm_m: Annotated[float, positive("distance of its centre of mass from the axis", "l", example="0.3 m")]
    offset_rad: Annotated[float, quantity("angle from upright at output angle zero", unit="rad", low=-7.0,
        high=7.0, example="180 deg")] = 0.0

    @property
    def peak_Nm(self) -> float:
        return self.mass_kg * STANDARD_GRAVITY_m_s2 * self.arm_m


MOST_PHASE_rad = 0.5  # of a wave in a tick over which it is held


def no_load_speed(design: "Design") -> float:
    """Speed at which the back-EMF equals the supply, U/kE; infinite for an ideal source."""
    kE = design.effective_motor.back_emf_constant_Vs_rad
    return inf if kE is None else design.limits.voltage_V / kE


def reachable_speed(design: "Design") -> float:
    """What limit and supply leave of the motor's speed in rad/s: the smaller of limits.speed and U/kE."""
    return min(design.limits.speed_rad_s, no_load_speed(design))


def torque_per_command(design: "Design") -> Any:
    """Motor torque at rest per ampere that a current loop is asked for, or per volt where there is none."""
    motor = design.effective_motor
    if motor.source_gain_Nm_V is not None:
        return motor.source_gain_Nm_V
    kM: Any = motor.torque_constant_Nm_A
    return kM if design.controller.current is not None else kM / motor.resistance_ohm


def _most_order(design: "Design", wave: Wave, ratio: float) -> tuple[float, str]:
    """Largest order of a wave over an angle that turns at the top speed of the motor over ``ratio``."""
    if not wave.peak_Nm:
        return inf, ""
    speed, Ts = reachable_speed(design) / ratio, design.controller.period_s
    if speed == inf:
        return 0.0, "held over a tick, it needs a bound of the speed, limits.speed"
    most = MOST_PHASE_rad / (speed * Ts)
    unit, share = unit_on(design.axis, "{angle}/s"), 0.9995 * most / wave.order  # within it in four digits
    turn = f"{wave.order * speed * Ts:.3g} rad at {speed:.4g} {unit}, more than {MOST_PHASE_rad}"
    slower = f"limits.speed = {share * speed * ratio:.4g} {unit}"
    takes = f"control.period = {1e6 * share * Ts:.4g} us or {slower} takes {wave.order:.4g}"
    return most, f"held over a tick, in which it passes {turn}; {takes}"


def _largest_damping(design: "Design") -> tuple[float, str]:
    """J/Ts, J all that turns with the output (with a coupling: behind it), at the output shaft."""
    inertia = design.inertia_kgm2 * design.total_ratio**2
    if design.coupling is not None:
        inertia = design.load_side_inertia_kgm2 * design.ratio_behind_coupling**2
    return inertia / design.controller.period_s, "held over a tick it would reverse the motion"


@dataclass(frozen=True, kw_only=True)
class Load:
    """What hangs on the output shaft, and how its torque reaches the motor.

    M_ext = constant or series (given with the run) + ``moment_slope_Nm_rad`` * output angle
    - ``moment_damping_Nms_rad`` * output speed + gravity + the gear error, which a drive in motion passes so
    fast that its mean, none, is its slope.
    """

    inertia_kgm2: Annotated[float, not_negative("inertia at the output shaft", "J_load",
        example="2e-4 kg*m^2")] = 0.0
    path: Annotated[LoadPath, choice("whether the load torque only adds friction, or also drives the "
        "motor")] = "self-locking"
    locking_gear: Annotated[str | None, text("name of the gear that locks itself, which stands before the "
        "coupling; default the last gear")] = None
    moment_max_Nm: Annotated[float, not_negative("largest load torque at the output", "M_ext",
        example="8 N*m")] = 0.0
    moment_slope_Nm_rad: Annotated[float, quantity("load torque per output deflection: above 0 it pushes "
        "away, below 0 back to zero", example="0 N*m/rad")] = 0.0
    moment_damping_Nms_rad: Annotated[float, not_negative("load torque against the motion, per output speed",
        "D", most=_largest_damping, example="0.02 N*m*s/rad")] = 0.0
    gear_error_Nm: Annotated[float, not_negative("kinematic error of a gear as a torque on the output, A "
        "sin(n angle + phase)", "A", example="0.1 N*m")] = 0.0
    gear_error_periods: Annotated[float, positive("periods of the gear error per revolution of the output "
        "(linear axis: rad per m)", "n", unit="rad/{angle}",
        most=lambda design: _most_order(design, design.load.over_angle.waves[0], design.total_ratio),
        example="2")] = 1.0
    gear_error_phase_rad: Annotated[float, quantity("phase of the gear error at output angle zero",
        unit="rad", low=-7.0, high=7.0, example="0 deg")] = 0.0
    friction: LoadFriction | None = None
    gravity: Gravity | None = None

    def moment_Nm(self, angle_rad: Any, rate_rad_s: Any = 0.0) -> Any:
        """The load's own torque on the output shaft at an angle and a speed of it; floats or arrays."""
        return self.over_angle.at(angle_rad) - self.moment_damping_Nms_rad * rate_rad_s

    @property
    def over_angle(self) -> OverAngle:
        gear = Wave(self.gear_error_Nm, self.gear_error_periods, self.gear_error_phase_rad, averages=True)
        pendulum = () if self.gravity is None else (Wave(self.gravity.peak_Nm, 1.0, self.gravity.offset_rad),)
        return OverAngle(self.moment_slope_Nm_rad, (gear, *pendulum))

    def straight(self) -> "Load":
        """The same without what bends with the angle."""
        return replace(self, gear_error_Nm=0.0, gravity=None)

    def level(self) -> "Load":
        """The same without what depends on the angle."""
        return replace(self.straight(), moment_slope_Nm_rad=0.0)

    def acting(self) -> tuple[str, ...]:
        there = {
            "load.moment_slope": np.any(self.moment_slope_Nm_rad),
            "load.moment_damping": np.any(self.moment_damping_Nms_rad),
            "load.gear_error": np.any(self.gear_error_Nm),
            "load.gravity": self.gravity is not None,
        }
        return tuple(key for key, acts in there.items() if acts)

    def bare(self) -> "Load":
        return replace(self.level(), moment_damping_Nms_rad=0.0)


@dataclass(frozen=True, kw_only=True)
class FrictionPoint:
    """One point (|w|, T) of a friction map, motor side; for both directions of motion or one."""

    speed_rad_s: Annotated[float, not_negative("speed at the motor", "|w|", example="10 rad/s")]
    torque_Nm: Annotated[float, not_negative("friction at that speed", "T", example="2 mN*m")]
    direction: Annotated[Direction, choice("direction of motion for which the point holds")] = "both"


@dataclass(frozen=True, kw_only=True)
class Friction:
    """Friction at the motor shaft: dry ``Tc = C0 + CM |M_ext|`` plus viscous ``Cv w`` (paper, equation 9)."""

    law: Annotated[FrictionLaw, choice("dry friction with stick, or smoothed by tanh")] = "coulomb"
    dry_torque_Nm: Annotated[float, not_negative("dry friction at the motor", "C0",
        example="2.25e-3 N*m")] = 0.0
    viscous_Nms_rad: Annotated[float, not_negative("viscous friction", "Cv",
        example="5.25e-6 N*m*s/rad")] = 0.0
    load_coefficient: Annotated[float, not_negative("dry friction at the motor per load torque at the output",
        "CM", unit="{torque}/({torque})", example="1.34 mN*m/(N*m)")] = 0.0
    breakaway_ratio: Annotated[float, quantity("breakaway torque over dry friction", low=1.0, high=100.0,
        example="1")] = 1.0
    smoothing_speed_rad_s: Annotated[float, positive("speed scale of the tanh law; of loops at rest with "
        "either law", "w_s", example="1 rad/s")] = 1.0
    dry_torque_reverse_Nm: Annotated[float | None, not_negative("dry friction backward, where it differs",
        "C0-", example="2.3e-3 N*m")] = None
    viscous_reverse_Nms_rad: Annotated[float | None, not_negative("viscous friction backward, where it "
        "differs", "Cv-", example="5.3e-6 N*m*s/rad")] = None
    offset_torque_Nm: Annotated[float, quantity("constant torque that opposes positive motion",
        example="0 N*m")] = 0.0
    points: tuple[FrictionPoint, ...] = ()  # in place of C0 and Cv (section 6); CM and the offset add to them

    def map(self, direction: int = 1) -> tuple[FrictionPoint, ...]:
        """Points of the friction map for motion forward (1) or backward (-1), by rising speed.

        Of many designs at once, where a speed is an array, each design's points are in its own order.
        """
        other = "reverse" if direction > 0 else "forward"
        chosen = [point for point in self.points if point.direction != other]
        if all(np.ndim(point.speed_rad_s) == 0 for point in chosen):
            return tuple(sorted(chosen, key=lambda point: point.speed_rad_s))
        values = np.stack(np.broadcast_arrays(*(v for p in chosen for v in (p.speed_rad_s, p.torque_Nm))))
        order = np.argsort(values[::2], axis=0)
        speeds, torques = (np.take_along_axis(values[k::2], order, axis=0) for k in (0, 1))
        return tuple(
            replace(point, speed_rad_s=speed, torque_Nm=torque)
            for point, speed, torque in zip(chosen, speeds, torques, strict=True)
        )

    def dry_Nm(self, load_Nm: float, direction: int = 1) -> float:
        """Dry friction torque Tc at a load torque (either sign), for motion forward (1) or backward (-1)."""
        base = self.dry_torque_Nm
        if direction < 0 and self.dry_torque_reverse_Nm is not None:
            base = self.dry_torque_reverse_Nm
        return base + self.load_coefficient * abs(load_Nm)

    def viscous(self, direction: int = 1) -> float:
        """Viscous slope Cv in N m s/rad, for motion forward (1) or backward (-1)."""
        if direction < 0 and self.viscous_reverse_Nms_rad is not None:
            return self.viscous_reverse_Nms_rad
        return self.viscous_Nms_rad


@dataclass(frozen=True, kw_only=True)
class Temperature:
    """Winding and magnet temperature, in degrees Celsius, and how R, kM and kE follow them.

    ``R (1 + resistance_per_K (winding - reference))``, ``kM, kE (1 + magnet_per_K (magnet - reference))``.
    The thermal resistance and time constant of the winding serve the duty cycle.
    """

    winding_degC: Annotated[float, degrees("temperature of the winding in this design", "80 degC")] = 25.0
    magnet_degC: Annotated[float, degrees("temperature of the magnets in this design", "60 degC")] = 25.0
    reference_degC: Annotated[float, degrees("temperature that the sheet holds for", "25 degC")] = 25.0
    resistance_per_K: Annotated[float, quantity("change of R per kelvin (copper 0.393 %/K)",
        key="resistance_coefficient", low=0.0, high=0.02, example="0.393 %/K")] = 0.00393
    magnet_per_K: Annotated[float, quantity("change of kM and kE per kelvin (NdFeB -0.11 %/K)",
        key="magnet_coefficient", low=-0.05, high=0.05, example="-0.11 %/K")] = -0.0011
    ambient_degC: Annotated[float, degrees("temperature around the motor", "25 degC")] = 25.0
    winding_limit_degC: Annotated[float, degrees("largest temperature of the winding", "125 degC")] = inf
    thermal_resistance_K_W: Annotated[float | None, positive("winding to ambient", "R_th",
        example="5 K/W")] = None
    thermal_time_s: Annotated[float | None, positive("thermal time constant of the winding",
        example="20 s")] = None
