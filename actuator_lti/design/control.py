"""Measurement, control, limits and supply of a drive as data, and the keys that they are read from."""

from dataclasses import dataclass
from functools import cached_property
from math import inf, pi
from typing import Annotated, Any, Literal

import numpy as np

from actuator_lti.design.field import choice, flag, integer, not_negative, positive, quantities, quantity
from actuator_lti.design.law import Law
from actuator_lti.errors import InputError

# fmt: off
SpeedSource = Literal["ideal", "difference", "tracking"]
Sensor = Literal["motor", "output"]
AntiWindup = Literal["conditional", "clamped", "back-calculation"]
FilterKind = Literal["lowpass", "notch", "skewed-notch", "leadlag", "biquad"]
FILTER_KEYS: dict[FilterKind, tuple[set[str], set[str]]] = {
    "lowpass": ({"frequency_rad_s"}, {"order", "damping"}),
    "notch": ({"frequency_rad_s", "width_rad_s"}, {"depth"}),
    "skewed-notch": ({"zero_rad_s", "pole_rad_s", "width_rad_s"}, {"depth"}),
    "leadlag": ({"zero_rad_s", "pole_rad_s"}, set()),
    "biquad": ({"b", "a"}, set()),
}
"""What each kind of filter needs, and what it may have besides."""
FilterPlace = Literal["torque", "speed"]
Overload = Literal["thermal", "excess"]
Stage = Literal["position", "velocity", "current", "voltage"]
AntiWindupKey = Annotated[AntiWindup, choice("what the integral does while the output is at its limit")]
TrackingTime = Annotated[float | None, positive("time constant of back-calculation; default the integral "
    "time", "Tt", example="10 ms")]
ABSENT = 0.0  # gain of a stage that has a law of one's own in its place


@dataclass(frozen=True, kw_only=True)
class Encoder:
    """The measurement of angle and speed at the motor (model.md section 7); unquantised without counts."""

    counts_per_rev: Annotated[int | None, integer("counts per motor revolution after quadrature (linear "
        "axis without a screw: per metre): of the measured speed unless it is ideal, and of a law's angle; "
        "the position controller sees the motor's angle uncounted", 2**32)] = None
    speed: Annotated[SpeedSource, choice("the speed itself, a difference of angles, or a tracking loop "
        "(observer)")] = "ideal"
    difference_samples: Annotated[int, integer("velocity periods that the difference spans", 64, "m")] = 1
    filter_time_s: Annotated[float, not_negative("first-order filter of the speed", "T_F",
        example="0 us")] = 0.0
    bandwidth_rad_s: Annotated[float | None, positive("natural frequency of the tracking loop (damping 1)",
        "w0", unit="rad/s", example="300 Hz")] = None


@dataclass(frozen=True, kw_only=True)
class OutputEncoder:
    """The angle sensor at the output shaft; counts per output revolution (linear axis: per metre)."""

    counts_per_rev: Annotated[int | None, integer("counts per output revolution after quadrature (linear "
        "axis: per metre)", 2**32)] = None


@dataclass(frozen=True, kw_only=True)
class Instruments:
    """Errors of the drive's own measurements; noise is white, normal, new at every sample."""

    current_resolution_A: Annotated[float, not_negative("step of the measured current", example="5 mA")] = 0.0
    current_noise_A: Annotated[float, not_negative("noise of the current, rms", example="2 mA")] = 0.0
    angle_noise_rad: Annotated[float, not_negative("noise of the motor's angle, rms",
        example="0.1 mrad")] = 0.0
    output_angle_noise_rad: Annotated[float, not_negative("noise of the output's angle, rms",
        example="0.01 mrad")] = 0.0
    jitter_s: Annotated[float, not_negative("deviation of the sampling instant, rms", high=1.0,
        example="1 us")] = 0.0
    seed: Annotated[int, integer("seed of the noise, so that a run can be repeated", 2**31, low=0)] = 0


def stable_pair(a1: float, a2: float) -> bool:
    """Whether the roots of z^2 + a1 z + a2 are inside the unit circle (the triangle of stability)."""
    return abs(a2) < 1.0 and abs(a1) < 1.0 + a2


@dataclass(frozen=True, kw_only=True)
class Filter:
    """One filter of the velocity loop, at its period, discretised by Tustin, prewarped (model.md section 7).

    ``lowpass``: frequency, order 1 or 2, damping; ``notch``: frequency w0, width (rad/s), depth (gain at w0);
    ``skewed-notch``: zeros at zero, depth width wide, poles at pole, width wide; gain 1 at DC;
    ``leadlag``: zero and pole, (s/zero + 1)/(s/pole + 1); ``biquad``: sampled coefficients ``b``, ``a``.
    """

    kind: Annotated[FilterKind, choice("what the filter does")]
    on: Annotated[FilterPlace, choice("whether it filters the torque command or the measured "
        "speed")] = "torque"
    frequency_rad_s: Annotated[float | None, positive("corner of a low-pass, centre of a notch", "w0",
        unit="rad/s", example="100 Hz")] = None
    order: Annotated[int, integer("order of a low-pass, 1 or 2", 2)] = 1
    damping: Annotated[float, positive("damping of a low-pass of order 2", high=10.0,
        example="0.7")] = 0.7071067811865476
    width_rad_s: Annotated[float | None, positive("width of a notch", unit="rad/s", example="50 Hz")] = None
    depth: Annotated[float, quantity("gain of a notch at its centre: width of its zeros over that of its "
        "poles", low=0.0, high=1.0, example="0.1")] = 0.0
    zero_rad_s: Annotated[float | None, positive("zero, or frequency of a pair", unit="rad/s",
        example="50 rad/s")] = None
    pole_rad_s: Annotated[float | None, positive("pole, or frequency of a pair", unit="rad/s",
        example="500 rad/s")] = None
    b: Annotated[tuple[float, ...], quantities("numerator of a biquad in z^-1, b0 b1 b2")] = ()
    a: Annotated[tuple[float, ...], quantities("denominator of a biquad in z^-1 after the leading 1, a1 a2 "
        "(a = [0] for none)")] = ()

    @property
    def polynomials(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Numerator and denominator of a biquad in falling powers of z, of equal length; the 1 leads.

        ``(b0 + b1 z^-1 + b2 z^-2)/(1 + a1 z^-1 + a2 z^-2)``, where ``a`` is a1 a2, without the 1.  Roots at
        z = 0 of both are left out, and so are the poles of a filter that is a mere gain.

        An InputError for other than one to three numbers in ``b``, more than two in ``a``, or a pole on or
        outside the unit circle.

        >>> Filter(kind="biquad", b=(0.5,), a=(-0.5, 0.0)).polynomials
        ((0.5, 0.0), (1.0, -0.5))
        """
        given = f"control.velocity.filter: biquad: b = {list(self.b)}, a = {list(self.a)}"
        if not 1 <= len(self.b) <= 3 or len(self.a) > 2:
            raise InputError(f"{given}: allowed: b0 b1 b2 and, after a leading 1, a1 a2")
        b, a = (*self.b, 0.0, 0.0)[:3], (1.0, *self.a, 0.0, 0.0)[:3]
        if not stable_pair(a[1], a[2]):
            raise InputError(f"{given}: allowed: poles inside the unit circle")
        if b == tuple(b[0] * value for value in a):
            return b[:1], a[:1]
        size = max(n for n in (2, 3) if n == 2 or b[2] != 0.0 or a[2] != 0.0)
        return b[:size], a[:size]


@dataclass(frozen=True, kw_only=True)
class CurrentLoop:
    """Current PI, every tick: V = gain (e + integral of e / integral_time) + feed-forward."""

    gain_V_A: Annotated[float, positive("gain of the current PI; of a dq controller in V/A phase; a "
        "bandwidth, 500 Hz, is taken times L", "Kp_i", example="20 mohm", required=True)] = ABSENT
    integral_time_s: Annotated[float | None, positive("integral time of the current PI; without it a P "
        "controller", "Tn_i", example="150 us")] = None
    back_emf_feedforward: Annotated[float, quantity("share of the back-EMF kE w added to the voltage; w as "
        "measured in the last update of the velocity stage, behind its filters of the speed; without one in "
        "every tick",
        low=0.0, high=2.0, example="1")] = 0.0
    resistance_feedforward: Annotated[float, quantity("share of R i_ref added to the voltage", low=0.0,
        high=2.0, example="1")] = 0.0
    anti_windup: AntiWindupKey = "conditional"
    tracking_time_s: TrackingTime = None
    law: Law | None = None


@dataclass(frozen=True, kw_only=True)
class VelocityLoop:
    """Velocity PI; its gain is in A s/rad where a current loop follows, in V s/rad where the voltage does."""

    gain: Annotated[float, positive("gain of the velocity PI; in N*m*s/rad it is taken over kM, a "
        "bandwidth, 40 Hz, times J/kM", "Kp_w", unit="{drive}*s/{angle}",
        example="0.12 A*s/rad", required=True)] = ABSENT
    integral_time_s: Annotated[float | None, positive("integral time of the velocity PI; without it a P "
        "controller", "Tn_w", example="15 ms")] = None
    every: Annotated[int, integer("the velocity loop runs every so many ticks", 1000, "n_v")] = 1
    sensor: Annotated[Sensor, choice("where the speed is measured")] = "motor"
    anti_windup: AntiWindupKey = "conditional"
    tracking_time_s: TrackingTime = None
    filters: tuple[Filter, ...] = ()
    law: Law | None = None

    def filters_on(self, place: FilterPlace) -> tuple[Filter, ...]:
        """The filters of the measured speed or of the torque command, in order."""
        return tuple(item for item in self.filters if item.on == place)


FEED_FORWARD = ("feedforward", "acceleration_feedforward", "friction_feedforward")
"""What a position loop takes of the command itself, past its error."""


@dataclass(frozen=True, kw_only=True)
class PositionLoop:
    """Position P, PI or PID (model.md section 7).

    The gain is in 1/s where a velocity loop follows, else in A/rad or V/rad (motor side); the friction
    feed-forward in A, without a current loop in V.
    """

    gain: Annotated[float, positive("gain of the position P controller; without a velocity loop in A or V "
        "per rad of the motor (an output sensor's angle counts times the ratio)", "Kv",
        unit="{drive}/{angle}", example="120 1/s", required=True)] = ABSENT
    every: Annotated[int, integer("the position loop runs every so many ticks, a multiple of "
        "control.velocity.every", 10000, "n_p")] = 1
    feedforward: Annotated[float, not_negative("share of the reference's rate added to the speed command",
        "k_ff", high=10.0, example="0")] = 0.0
    sensor: Annotated[Sensor, choice("whose angle is fed back")] = "motor"
    integral_time_s: Annotated[float | None, positive("integral time of the position controller; without it "
        "no integral", "Ti", example="0.5 s")] = None
    derivative_time_s: Annotated[float, not_negative("derivative time of the position controller", "Td",
        high=100.0, example="1 ms")] = 0.0
    derivative_filter_s: Annotated[float, not_negative("filter time of the derivative", "TD", high=100.0,
        example="0.2 ms")] = 0.0
    acceleration_feedforward: Annotated[float, not_negative("share of J/kM times the command's acceleration "
        "added to the torque command", "k_aff", high=10.0, example="1")] = 0.0
    friction_feedforward: Annotated[float, not_negative("added to the torque command in the direction of "
        "the command's motion", "i_fr", unit="{drive}", example="0.4 A")] = 0.0
    law: Law | None = None

    @property
    def kicks(self) -> bool:
        """Whether a step's own change acts at once, by a derivative or a feed-forward."""
        return any(getattr(self, name) > 0.0 for name in ("derivative_time_s", *FEED_FORWARD))

    @property
    def feeds_back_its_angle(self) -> bool:
        """Whether the angle of its sensor is all that it takes of the drive."""
        own = "output_angle" if self.sensor == "output" else "angle"
        return self.law is None or {*self.law.inputs} <= {"error", "command", own}


@dataclass(frozen=True, kw_only=True)
class Command:
    """What the drive makes of a command before its outermost loop: a profile, then a low-pass filter."""

    filter_time_s: Annotated[float, not_negative("time constant of the command filter", high=1e4,
        example="5 ms")] = 0.0
    filter_order: Annotated[int, integer("order of the command filter, 1 or 2", 2)] = 1
    filter_damping: Annotated[float, positive("damping of a filter of order 2", high=10.0, example="1")] = 1.0
    rate_rad_s: Annotated[float, positive("largest rate of the command, output side",
        example="20 deg/s")] = inf
    acceleration_rad_s2: Annotated[float, positive("largest acceleration of the command, output side",
        example="400 deg/s^2")] = inf
    jerk_rad_s3: Annotated[float, positive("largest jerk of the command, output side: its mean over "
        "2 acceleration/jerk, as the acceleration may reverse at once",
        example="8000 deg/s^3")] = inf

    def lowpass(self, period_s: Any, where: str = "") -> Filter:
        """The filter, w0 = 1/`filter_time_s` below pi/T, for the period T of the outermost stage in s."""
        w0 = 1.0 / self.filter_time_s
        if np.any(w0 * np.asarray(period_s) >= pi):
            message = f"command.filter_time = {np.min(self.filter_time_s):g} s"
            raise InputError(f"{message}: must be above T/pi = {np.max(period_s) / pi:g} s", where=where)
        return Filter(
            kind="lowpass", frequency_rad_s=w0, order=self.filter_order, damping=self.filter_damping
        )


@dataclass(frozen=True, kw_only=True)
class Controller:
    """Sampling and the cascade; an absent loop is ``None``; any stage may be the outermost."""

    period_s: Annotated[float, positive("tick of the fastest loop", "Ts", low=1e-07, high=10.0,
        example="100 us")]
    computing_delay_s: Annotated[float, not_negative("time from sampling to the voltage acting", "d",
        high=10.0, example="100 us")]
    position: PositionLoop | None = None
    velocity: VelocityLoop | None = None
    current: CurrentLoop | None = None

    @cached_property
    def stages(self) -> tuple[Stage, ...]:
        """The loops that there are, outermost first; empty for an open-loop voltage drive."""
        names: tuple[Stage, ...] = ("position", "velocity", "current")
        return tuple(name for name in names if getattr(self, name) is not None)

    @cached_property
    def own_law(self) -> tuple[Stage, Law] | None:
        """The stage that has a law of one's own, and the law; None where no stage has."""
        laws = ((stage, getattr(self, stage).law) for stage in self.stages)
        return next(((stage, law) for stage, law in laws if law is not None), None)

    @property
    def sampled_only(self) -> bool:
        """Whether a law of one's own leaves the forms in continuous time out."""
        return self.own_law is not None and self.own_law[1].continuous is None

    @property
    def position_loop(self) -> PositionLoop:
        """The position loop, for questions that need one; an InputError where the drive has none."""
        if self.position is None:
            raise InputError("control.position: missing; this needs a drive with a position loop")
        return self.position

    def period_of(self, stage: str) -> Any:
        """Time between two updates of a stage, s."""
        return self.period_s * getattr(getattr(self, stage, None), "every", 1)

    @property
    def outermost(self) -> Stage:
        """The stage that takes the command; ``"voltage"`` for a drive without a loop."""
        return self.stages[0] if self.stages else "voltage"


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Limits of the stages, motor side; ``inf`` where there is none.

    The continuous current is no clamp unless ``peak_time_s`` is given: then the overload protection (I2t)
    falls back to it after that time at the peak (model.md section 6), until its state is below ``release``.
    """

    voltage_V: Annotated[float, positive("supply, and so the largest motor voltage", "U_bus", example="12 V")]
    speed_rad_s: Annotated[float, positive("largest speed command at the motor", "w_max",
        example="9000 rpm")] = inf
    acceleration_rad_s2: Annotated[float, positive("largest change of the speed command", "a_max",
        example="30000 rev/s^2")] = inf
    peak_current_A: Annotated[float, positive("clamp of the current command", "i_peak", example="12 A")] = inf
    current_rate_A_s: Annotated[float, positive("largest change of the current command (torque slope)",
        example="2000 A/s")] = inf
    continuous_current_A: Annotated[float, positive("current allowed continuously (no clamp)", "i_cont",
        example="4 A")] = inf
    peak_time_s: Annotated[float | None, positive("time that the peak current is allowed for, from cold; "
        "then the overload protection (I2t) acts", "t_peak", high=1e6, example="1 s")] = None
    release: Annotated[float, positive("overload state below which the peak is allowed again", high=1.0,
        example="0.9")] = 0.9
    overload: Annotated[Overload, choice("what the peak time means: a thermal model, or (i_peak^2 - "
        "i_cont^2) t")] = "thermal"

    @property
    def overload_time_s(self) -> Any:
        """tau of the overload state, of one design or stacked ones; None without overload protection."""
        if self.peak_time_s is None:
            return None
        r2 = (self.peak_current_A / self.continuous_current_A) ** 2
        excess = self.overload == "excess"
        return self.peak_time_s * (r2 - 1) if excess else self.peak_time_s / np.log(r2 / (r2 - 1))


@dataclass(frozen=True, kw_only=True)
class Supply:
    """The supply behind ``limits.voltage``: resistance, and where braking energy goes (section 6)."""

    resistance_ohm: Annotated[float, not_negative("resistance of supply and leads", "R_s",
        example="50 mohm")] = 0.0
    regenerative: Annotated[bool, flag("whether the source takes braking energy back")] = True
    capacitance_F: Annotated[float | None, positive("capacitance of the bus", "C", example="2 mF")] = None
    brake_voltage_V: Annotated[float | None, positive("bus voltage at which the brake resistor holds it",
        "U_brake", example="60 V")] = None
