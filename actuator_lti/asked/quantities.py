"""The registry of figures that a requirement may limit: each declared once, what reads them loops over it.

Those of a loop are read from ``margins``, ``bandwidth`` and ``step``, or a column of `LinearFigures` (many).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import degrees, radians, sin
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from actuator_lti.design.model import Axis


def unit_words(unit: str) -> str:
    """A unit as it is printed: of a ratio none, and N m where a file has N*m.

    >>> unit_words("N*m/rad"), unit_words("deg/s^2"), unit_words("1")
    ('N m/rad', 'deg/s²', '')
    """
    return "" if unit == "1" else unit.replace("*", " ").replace("^2", "²")


def shown_unit(unit: str) -> tuple[str, float]:
    """The unit in which reports write figures and limits of a unit, and the factor to it: times are ms."""
    return ("ms", 1e3) if unit == "s" else (unit_words(unit), 1.0)


def with_unit(value: float, unit: str, format: str = "g") -> str:
    """A figure or limit as reports write it.

    >>> with_unit(0.0123, "s"), with_unit(-0.5, "1")
    ('12.3 ms', '-0.5')
    """
    name, factor = shown_unit(unit)
    return f"{value * factor:{format}} {name}".rstrip()


@dataclass(frozen=True)
class Quantity:
    """A figure of merit."""

    name: str  # as a requirement names it
    unit: str  # in reports
    scope: Literal["loop", "drive", "analysis"]  # of an analysis: one design at a time, studies leave it out
    description: str  # how it is defined, for people who write requirements
    words: str  # what reports call it
    reader: str  # "margins.gain_margin_db", or an attribute of what `source` names; empty where `cornered`
    better: Literal[1, -1]  # whether larger or smaller is better
    linear_unit: str = ""  # in reports of a linear axis, where that differs
    absolute: bool = False  # whether its magnitude counts: a gain margin down as one up, a lead as a lag
    signed: bool = False  # whether it may be negative, and with it a limit on it
    timed: bool = False  # whether it is one of the step response: stairs of samples, without a slope
    size: float = 1.0  # its usual size: what a distance to a limit of 0 is measured by
    # What has it: the figures of a loop, `actuator_lti.drive.facts.Capability`,
    # `actuator_lti.loops.stiffness.StiffnessFigures`, or `analyses.specification.asked_figures.AskedFigures`
    source: Literal["loop", "capability", "stiffness", "analysis"] = "loop"
    heading: str = ""  # what the tables of a report call its column; empty where they have none
    title: str = ""  # what stands beside its number elsewhere; `words` with a capital where left out
    at_a_glance: str = ""  # how the first screen of a report writes it, such as ``fix:1``; empty: not
    followed: bool = False  # whether the table of the live page shows it
    cornered: str = ""  # the figure of a loop whose least over loops and corners it is (`analyses.corners`)
    tolerance: float = 1e-9  # in its unit: nights that differ by less, or by a part in a thousand, are equal

    @property
    def label(self) -> str:
        return self.title or self.words[0].upper() + self.words[1:]

    @property
    def shown(self) -> tuple[str, float]:
        """The unit in which reports write it, and the factor from its own."""
        return shown_unit(self.unit)

    @property
    def direction(self) -> int:
        """+1 or -1 where more or less of it is better, twice that where its magnitude counts."""
        return self.better * (2 if self.absolute else 1)

    @property
    def of_response(self) -> bool:
        """Whether it is taken of a response to a command, which a loop cut at a break point has not."""
        return self.reader.startswith(("bandwidth.", "step."))

    def unit_for(self, axis: Axis) -> str:
        return self.linear_unit if axis == "linear" and self.linear_unit else self.unit

    def raw(self, result: Any) -> Any:
        """What its reader finds; ``None`` where there is none."""
        for part in self.reader.split("."):
            result = getattr(result, part, None)
            if result is None:
                return None
        return result

    def read(self, result: Any, axis: Axis = "rotary") -> Any:
        """The figure in its unit, from figures of a loop or a `Capability`; ``None`` where there is none."""
        value = self.raw(result)
        if value is None:
            return None
        if self.absolute:
            return abs(value)
        angular = self.scope != "loop" and self.unit_for(axis).startswith("deg") and "_rad" in self.reader
        return value * degrees(1.0) if angular else value


_LIST = (
    Quantity("gain_margin", "dB", "loop", "smallest gain margin, up or down", "gain margin",
             "margins.gain_margin_db", 1, absolute=True, size=6.0,
             heading="Gain margin", at_a_glance="gain:1", followed=True, tolerance=0.01),
    Quantity("phase_margin", "deg", "loop", "smallest phase margin", "phase margin",
             "margins.phase_margin_deg", 1, absolute=True, size=45.0,
             heading="Phase margin", at_a_glance="fix:1", followed=True, tolerance=0.05),
    Quantity("delay_margin", "s", "loop", "smallest delay margin", "delay margin",
             "margins.delay_margin_s", 1, heading="Delay margin", at_a_glance="sig:3", followed=True,
             tolerance=1e-07),
    Quantity("modulus_margin", "1", "loop", "smallest distance of L from -1", "modulus margin",
             "margins.modulus_margin", 1, size=0.5, heading="Modulus margin"),
    Quantity("sensitivity_peak", "dB", "loop", "peak of |S|", "peak of S",
             "margins.sensitivity_peak_db", -1, signed=True, size=6.0, heading="Peak of S",
             at_a_glance="fix:2", followed=True, tolerance=0.01),
    Quantity("bandwidth", "Hz", "loop", "closed loop -3 dB", "bandwidth (\N{MINUS SIGN}3 dB)",
             "bandwidth.minus3db_hz", 1, heading="\N{MINUS SIGN}3 dB",
             title="\N{MINUS SIGN}3\N{NO-BREAK SPACE}dB bandwidth", at_a_glance="sig:3", followed=True),
    Quantity("bandwidth_90deg", "Hz", "loop", "closed loop -90 deg", "bandwidth (\N{MINUS SIGN}90°)",
             "bandwidth.minus90deg_hz", 1, heading="\N{MINUS SIGN}90°"),
    Quantity("resonance_peak", "dB", "loop", "peak of |T| over its value at DC", "resonance peak",
             "bandwidth.resonance_peak_db", -1, size=6.0, heading="Resonance", tolerance=0.01),
    Quantity("overshoot", "%", "loop", "of the step of the closed loop", "overshoot",
             "step.overshoot_percent", -1, timed=True, size=10.0, heading="Overshoot",
             followed=True, tolerance=0.05),
    Quantity("rise_time", "s", "loop", "10 % to 90 %", "rise time", "step.rise_time_s", -1, timed=True,
             heading="Rise 10–90 %", tolerance=1e-07),
    Quantity("settling_time", "s", "loop", "to within 2 %", "settling time",
             "step.settling_time_s", -1, timed=True, heading="Settling 2 %", followed=True,
             tolerance=1e-07),
    Quantity("output_rate", "deg/s", "drive",
             "largest speed of the output at a load, its command's profile aside", "output rate",
             "output_rate_rad_s", 1, "m/s", source="capability"),
    Quantity("motor_current", "A", "drive", "motor current at top speed and a load",
             "motor current at top speed", "motor_current_A", -1, signed=True, source="capability"),
    Quantity("acceleration", "deg/s^2", "drive",
             "largest acceleration of the output at a load, its command's profile aside", "acceleration",
             "acceleration_rad_s2", 1, "m/s^2", source="capability"),
    Quantity("torque_margin", "1", "drive", "motor torque at rest over what it takes to start against a load",
             "torque margin", "torque_margin", 1, source="capability"),
    Quantity("static_stiffness", "N*m/rad", "drive", "torque over deflection at 0 Hz, powered",
             "static stiffness", "static_stiffness_Nm_rad", 1, "N/m", source="stiffness"),
    Quantity("least_stiffness", "N*m/rad", "drive", "least torque over deflection, 0.1 to 1000 Hz",
             "least dynamic stiffness", "least_stiffness_Nm_rad", 1, "N/m", source="stiffness"),
    Quantity("lost_motion", "deg", "drive", "between the middles of hysteresis at +-3 % of load.moment_max",
             "lost motion", "lost_motion_rad", -1, "m", size=0.1, source="stiffness"),
    Quantity("hard_over_time", "s", "analysis", "from the hard-over of the power stage to failure.stop",
             "time from hard-over to the stop", "failures.hard_over_time_s", 1, source="analysis"),
    Quantity("failure_deflection", "deg", "analysis", "largest until detection, all failures",
             "deflection until a failure is detected", "failures.failure_deflection_rad", -1, "m",
             source="analysis"),
    Quantity("failure_moment", "N*m", "analysis", "largest in the drive train, over all failures",
             "torque in the train at a failure", "failures.failure_moment_Nm", -1, "N", source="analysis"),
    Quantity("duty_current", "A", "analysis", "rms of the motor current under [duty]",
             "rms current of the duty", "duty.rms_A", -1, source="analysis"),
    Quantity("winding_temperature", "degC", "analysis", "winding under [duty], in the long run",
             "winding temperature of the duty", "duty.heating.final_degC", -1,
             signed=True, source="analysis"),
    Quantity("limit_cycle", "deg", "analysis", "largest swing, peak, that a step ends in; judges rest",
             "swing after a step", "limit_cycle_rad", -1, "m", size=0.01, source="analysis"),
    Quantity("corner_gain_margin", "dB", "analysis", "smallest hot, cold, at the worst tolerances",
             "gain margin at the corners", "", 1, size=6.0, source="analysis", cornered="gain_margin"),
    Quantity("corner_phase_margin", "deg", "analysis", "smallest hot, cold, at the worst tolerances",
             "phase margin at the corners", "", 1, size=45.0, source="analysis", cornered="phase_margin"),
)  # fmt: skip

QUANTITIES: dict[str, Quantity] = {quantity.name: quantity for quantity in _LIST}
"""Every quantity that a requirement may name."""
LOOP_QUANTITIES = {name: each for name, each in QUANTITIES.items() if each.scope == "loop"}
DRIVE_QUANTITIES = {name: each for name, each in QUANTITIES.items() if each.scope == "drive"}
ANALYSIS_QUANTITIES = {name: each for name, each in QUANTITIES.items() if each.scope == "analysis"}
AT_A_GLANCE = tuple(each for each in LOOP_QUANTITIES.values() if each.at_a_glance)
"""Figures of loops on the first screen of a report."""
CORNERED = {each.cornered: each for each in ANALYSIS_QUANTITIES.values() if each.cornered}
"""Figures of loops whose worst over all corners is a figure of its own, with that figure."""
CUSTOMARY = {"gain_margin": 6.0, "phase_margin": 30.0, "modulus_margin": 0.5}
"""What custom asks of margins where no requirement does: each keeps L about half away from -1."""
LOOPS = ("current", "velocity", "position")  # the loops that a requirement may name, innermost first
MOST_RESONANCE_DB = 100.0
"""Over more than that the value at zero frequency is nothing that a resonance or a fall is measured from."""


def drive_cases(loads_Nm: Iterable[float]) -> tuple[tuple[str, float], ...]:
    """Every figure of the whole drive with the loads at which it is told: stiffness at none.

    >>> [case for case in drive_cases((0.0, 8.0)) if case[0] in ("output_rate", "lost_motion")]
    [('output_rate', 0.0), ('output_rate', 8.0), ('lost_motion', 0.0)]
    """
    loads = tuple(loads_Nm)
    return tuple(
        (name, load)
        for name, quantity in DRIVE_QUANTITIES.items()
        for load in (loads if quantity.source == "capability" else (0.0,))
    )


def judged_loops(loop: str | None, present: Iterable[str]) -> tuple[str, ...]:
    """The loops that a requirement on a figure of loops holds for: the one that it names, else every one.

    >>> judged_loops(None, ("velocity", "position")), judged_loops("position", ("velocity", "position"))
    (('velocity', 'position'), ('position',))
    """
    return tuple(present) if loop in (None, "every") else (str(loop),)


def distance_from_minus_one(quantity: str, value: float) -> float | None:
    """How far from -1 a margin keeps L: ``1 - 1/g``, ``2 sin(phi/2)``, the modulus; ``None`` for others.

    >>> [round(distance_from_minus_one(name, limit), 3) for name, limit in CUSTOMARY.items()]
    [0.499, 0.518, 0.5]
    """
    name = quantity.removeprefix("corner_")
    if name == "gain_margin":
        return 1.0 - 10.0 ** (-abs(value) / 20.0)
    if name == "phase_margin":
        return 2.0 * sin(0.5 * radians(min(abs(value), 180.0)))
    if name == "sensitivity_peak":
        return 10.0 ** (-value / 20.0)
    return value if name == "modulus_margin" else None


def reserve(quantity: str, value: float, limit: float, distance: float) -> float:
    """What is left to a limit as a share of it, negative beyond; of margins by their distance from -1.

    ``distance`` to the limit is positive on the good side.

    >>> round(reserve("gain_margin", 12.0, 6.0, 6.0), 2), round(reserve("phase_margin", 60.0, 30.0, 30.0), 2)
    (0.5, 0.93)
    >>> reserve("bandwidth", 12.0, 10.0, 2.0), reserve("overshoot", 12.0, 10.0, -2.0)
    (0.2, -0.2)
    """
    found, wanted = (distance_from_minus_one(quantity, each) for each in (value, limit))
    if found is not None and wanted:
        return found / wanted - 1.0
    return distance / (abs(limit) or 1.0)
