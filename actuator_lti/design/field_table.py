"""The table of all keys of a design file: key, attribute, SI unit, symbol, meaning, range, example."""

from __future__ import annotations

from typing import get_args

from actuator_lti.design.field import BIG, SMALL, Field
from actuator_lti.design.model import FilterKind


def _positive(path: str, attribute: str, unit: str, symbol: str, text: str, **more: object) -> Field:
    return _quantity(path, attribute, unit, symbol, text, **{"low": SMALL, **more})


def _not_negative(path: str, attribute: str, unit: str, symbol: str, text: str, **more: object) -> Field:
    return _quantity(path, attribute, unit, symbol, text, **{"low": 0.0, **more})


def _quantity(path: str, attribute: str, unit: str, symbol: str, text: str, **more: object) -> Field:
    settings: dict[str, object] = {"low": -BIG, "high": BIG, **more}
    return Field(
        path=path,
        attribute=attribute,
        kind="quantity",
        unit_template=unit,
        symbol=symbol,
        description=text,
        **settings,  # type: ignore[arg-type]
    )


def _integer(path: str, attribute: str, high: int, symbol: str, text: str) -> Field:
    return Field(
        path=path, attribute=attribute, kind="integer", symbol=symbol, description=text, low=1, high=high
    )


def _choice(path: str, attribute: str, choices: tuple[str, ...], text: str, required: bool = False) -> Field:
    return Field(
        path=path, attribute=attribute, kind="choice", choices=choices, description=text, required=required
    )


def _flag(path: str, attribute: str, text: str) -> Field:
    return Field(path=path, attribute=attribute, kind="flag", description=text)


def _degrees(path: str, attribute: str, text: str, example: str) -> Field:
    return _quantity(path, attribute, "degC", "", text, low=-273.15, high=1000.0, example=example)


def _text(path: str, text: str, required: bool = False) -> Field:
    key = path.rpartition(".")[2]
    return Field(path=path, attribute=key, kind="text", description=text, required=required)


# fmt: off
_DESIGN = (
    _text("design.name", "short name, used in file names", required=True),
    _text("design.title", "one line for the title page"),
    _text("design.revision", "revision of this file"),
    _text("design.description", "what the drive is and where its figures come from"),
    _choice("design.axis", "axis", ("rotary", "linear"), "rotary (rad, N m, kg m2) or linear (m, N, kg)"),
)
_MOTOR = (
    _positive("motor.rotor_inertia", "rotor_inertia_kgm2", "{inertia}", "J_motor",
              "inertia of the rotor (linear axis: moving mass)", required=True, example="9.2 g*cm^2"),
    _positive("motor.resistance", "resistance_ohm", "ohm", "R", "phase-phase resistance",
              example="55 mohm"),
    _positive("motor.inductance", "inductance_H", "H", "L", "phase-phase inductance", example="6 uH"),
    _positive("motor.torque_constant", "torque_constant_Nm_A", "{torque}/A", "kM", "torque per ampere",
              example="5.9 mN*m/A"),
    _positive("motor.back_emf_constant", "back_emf_constant_Vs_rad", "V*s/{angle}", "kE",
              "back-EMF per rad/s; a speed constant, 83.4 rpm/V, is turned over", example="5.9 mV*s/rad"),
    _choice("motor.constants", "constants", ("dc", "rms-line", "peak-phase"),
            "how the data sheet gives kM, kE, R and L: dc (phase-phase), rms-line (N m/A rms, V rms "
            "line-line, R and L line-line), peak-phase (dq: A and V peak of a phase, R and L per phase)"),
    _positive("motor.source_gain", "source_gain_Nm_V", "{torque}/V", "g",
              "gain of an ideal torque source, instead of R, L, kM, kE", example="35.15 N/V"),
)
_SCREW = (
    _positive("screw.lead", "lead_m", "m", "p",
              "travel per revolution of the screw: with it the motor's values may stand in N m, rad and "
              "kg m2, and encoder.counts_per_rev is per revolution", required=True, example="10 mm"),
)
_GEAR = (
    _positive("gear.*.ratio", "ratio", "1", "i", "input speed over output speed", required=True,
              example="66"),
    _not_negative("gear.*.input_inertia", "input_inertia_kgm2", "{inertia}", "J_in",
                  "inertia turning with the input shaft of the stage", example="1 g*cm^2"),
    _not_negative("gear.*.output_inertia", "output_inertia_kgm2", "{inertia}", "J_out",
                  "inertia turning with the output shaft of the stage", example="5 g*cm^2"),
)
_LOAD = (
    _not_negative("load.inertia", "inertia_kgm2", "{inertia}", "J_load", "inertia at the output shaft",
                  example="2e-4 kg*m^2"),
    _choice("load.path", "path", ("self-locking", "back-drivable"),
            "whether the load moment only adds friction, or also drives the motor"),
    _not_negative("load.moment_max", "moment_max_Nm", "{torque}", "M_ext",
                  "largest load moment at the output", example="8 N*m"),
    _quantity("load.moment_slope", "moment_slope_Nm_rad", "{torque}/{angle}", "",
              "load moment per output deflection", example="0 N*m/rad"),
)
_COUPLING = (
    _text("coupling.after", "name of the gear whose output shaft it is on; default the last gear"),
    _positive("coupling.stiffness", "stiffness_Nm_rad", "{torque}/{angle}", "k",
              "stiffness at the coupling's own shaft", required=True, example="400 N*m/rad"),
    _not_negative("coupling.damping", "damping_Nms_rad", "{torque}*s/{angle}", "c",
                  "damping at the coupling's own shaft", example="0.02 N*m*s/rad"),
    _not_negative("coupling.play", "play_rad", "{angle}", "2b", "total play (backlash) at its own shaft",
                  example="2 mrad"),
)
_LOAD_FRICTION = (
    _not_negative("load.friction.dry_torque", "dry_torque_Nm", "{torque}", "C0_l",
                  "dry friction behind the coupling, at its shaft", example="0.1 N*m"),
    _not_negative("load.friction.viscous", "viscous_Nms_rad", "{torque}*s/{angle}", "Cv_l",
                  "viscous friction behind the coupling, at its shaft", example="0.01 N*m*s/rad"),
    _quantity("load.friction.breakaway_ratio", "breakaway_ratio", "1", "",
              "breakaway torque over dry friction of the load side", low=1.0, high=100.0, example="1"),
    _quantity("load.friction.offset_torque", "offset_torque_Nm", "{torque}", "",
              "constant torque that opposes positive motion of the load", example="0 N*m"),
)
_GRAVITY = (
    _positive("load.gravity.mass", "mass_kg", "kg", "m", "mass of the pendulum", required=True,
              example="2 kg"),
    _positive("load.gravity.arm", "arm_m", "m", "l", "distance of its centre of mass from the axis",
              required=True, example="0.3 m"),
    _quantity("load.gravity.offset", "offset_rad", "rad", "", "angle from upright at output angle zero",
              low=-7.0, high=7.0, example="180 deg"),
)
_FRICTION = (
    _choice("friction.law", "law", ("coulomb", "tanh"), "dry friction with stick, or smoothed by tanh"),
    _not_negative("friction.dry_torque", "dry_torque_Nm", "{torque}", "C0", "dry friction at the motor",
                  example="2.25e-3 N*m"),
    _not_negative("friction.viscous", "viscous_Nms_rad", "{torque}*s/{angle}", "Cv", "viscous friction",
                  example="5.25e-6 N*m*s/rad"),
    _not_negative("friction.load_coefficient", "load_coefficient", "{torque}/({torque})", "CM",
                  "dry friction at the motor per load moment at the output", example="1.34 mN*m/(N*m)"),
    _quantity("friction.breakaway_ratio", "breakaway_ratio", "1", "", "breakaway torque over dry friction",
              low=1.0, high=100.0, example="1"),
    _positive("friction.smoothing_speed", "smoothing_speed_rad_s", "{angle}/s", "w_s",
              "speed scale of the tanh law", example="1 rad/s"),
    _not_negative("friction.dry_torque_reverse", "dry_torque_reverse_Nm", "{torque}", "C0-",
                  "dry friction backward, where it differs", example="2.3e-3 N*m"),
    _not_negative("friction.viscous_reverse", "viscous_reverse_Nms_rad", "{torque}*s/{angle}", "Cv-",
                  "viscous friction backward, where it differs", example="5.3e-6 N*m*s/rad"),
    _quantity("friction.offset_torque", "offset_torque_Nm", "{torque}", "",
              "constant torque that opposes positive motion", example="0 N*m"),
)
_FRICTION_POINT = (
    _not_negative("friction.point.*.speed", "speed_rad_s", "{angle}/s", "|w|", "speed at the motor",
                  required=True, example="10 rad/s"),
    _not_negative("friction.point.*.torque", "torque_Nm", "{torque}", "T", "friction at that speed",
                  required=True, example="2 mN*m"),
    _choice("friction.point.*.direction", "direction", ("both", "forward", "reverse"),
            "direction of motion for which the point holds"),
)
_ENCODER = (
    _integer("encoder.counts_per_rev", "counts_per_rev", 2**32, "",
             "counts per motor revolution after quadrature (linear axis without a screw: per metre)"),
    _choice("encoder.speed", "speed", ("ideal", "difference", "tracking"),
            "the speed itself, a difference of angles, or a tracking loop (observer)"),
    _integer("encoder.difference_samples", "difference_samples", 64, "m",
             "velocity periods that the difference spans"),
    _not_negative("encoder.filter_time", "filter_time_s", "s", "T_F", "first-order filter of the speed",
                  example="0 us"),
    _positive("encoder.bandwidth", "bandwidth_rad_s", "rad/s", "w0",
              "natural frequency of the tracking loop", example="300 Hz"),
)
_OUTPUT_ENCODER = (
    _integer("output_encoder.counts_per_rev", "counts_per_rev", 2**32, "",
             "counts per output revolution after quadrature (linear axis: per metre)"),
)
_INSTRUMENTS = (
    _not_negative("instruments.current_resolution", "current_resolution_A", "A", "",
                  "step of the measured current", example="5 mA"),
    _not_negative("instruments.current_noise", "current_noise_A", "A", "", "noise of the current, rms",
                  example="2 mA"),
    _not_negative("instruments.angle_noise", "angle_noise_rad", "{angle}", "",
                  "noise of the motor's angle, rms", example="0.1 mrad"),
    _not_negative("instruments.output_angle_noise", "output_angle_noise_rad", "{angle}", "",
                  "noise of the output's angle, rms", example="0.01 mrad"),
    _not_negative("instruments.jitter", "jitter_s", "s", "", "deviation of the sampling instant, rms",
                  high=1.0, example="1 us"),
    Field(path="instruments.seed", attribute="seed", kind="integer", low=0, high=2**31,
          description="seed of the noise, so that a run can be repeated"),
)
_LIMITS = (
    _positive("limits.voltage", "voltage_V", "V", "U_bus", "supply, and so the largest motor voltage",
              required=True, example="12 V"),
    _positive("limits.speed", "speed_rad_s", "{angle}/s", "w_max", "largest speed command at the motor",
              example="9000 rpm"),
    _positive("limits.acceleration", "acceleration_rad_s2", "{angle}/s^2", "a_max",
              "largest change of the speed command", example="30000 rev/s^2"),
    _positive("limits.peak_current", "peak_current_A", "A", "i_peak", "clamp of the current command",
              example="12 A"),
    _positive("limits.continuous_current", "continuous_current_A", "A", "i_cont",
              "current allowed for ever (no clamp)", example="4 A"),
    _positive("limits.peak_time", "peak_time_s", "s", "t_peak",
              "time that the peak current is allowed for, from cold; then the overload protection (I2t) acts",
              high=1e6, example="1 s"),
    _positive("limits.release", "release", "1", "", "overload state below which the peak is allowed again",
              high=1.0, example="0.9"),
    _choice("limits.overload", "overload", ("thermal", "excess"),
            "what the peak time means: a thermal model, or (i_peak^2 - i_cont^2) t"),
)
_SUPPLY = (
    _not_negative("supply.resistance", "resistance_ohm", "ohm", "R_s", "resistance of supply and leads",
                  example="50 mohm"),
    _flag("supply.regenerative", "regenerative", "whether the source takes braking energy back"),
    _positive("supply.capacitance", "capacitance_F", "F", "C", "capacitance of the bus", example="2 mF"),
    _positive("supply.brake_voltage", "brake_voltage_V", "V", "U_brake",
              "bus voltage at which the brake resistor holds it", example="60 V"),
)
_TEMPERATURE = (
    _degrees("temperature.winding", "winding_degC", "temperature of the winding in this design", "80 degC"),
    _degrees("temperature.magnet", "magnet_degC", "temperature of the magnets in this design", "60 degC"),
    _degrees("temperature.reference", "reference_degC", "temperature that the sheet holds for", "25 degC"),
    _quantity("temperature.resistance_coefficient", "resistance_per_K", "1/K", "",
              "change of R per kelvin (copper 0.393 %/K)", low=0.0, high=0.02, example="0.393 %/K"),
    _quantity("temperature.magnet_coefficient", "magnet_per_K", "1/K", "",
              "change of kM and kE per kelvin (NdFeB -0.11 %/K)", low=-0.05, high=0.05, example="-0.11 %/K"),
    _degrees("temperature.ambient", "ambient_degC", "temperature around the motor", "25 degC"),
    _degrees("temperature.winding_limit", "winding_limit_degC", "largest temperature of the winding",
             "125 degC"),
    _positive("temperature.thermal_resistance", "thermal_resistance_K_W", "K/W", "R_th",
              "winding to ambient", example="5 K/W"),
    _positive("temperature.thermal_time", "thermal_time_s", "s", "", "thermal time constant of the winding",
              example="20 s"),
)
_COMMAND = (
    _not_negative("command.filter_time", "filter_time_s", "s", "", "time constant of the command filter",
                  high=1e4, example="5 ms"),
    _integer("command.filter_order", "filter_order", 2, "", "order of the command filter, 1 or 2"),
    _positive("command.filter_damping", "filter_damping", "1", "", "damping of a filter of order 2",
              high=10.0, example="1"),
    _positive("command.rate", "rate_rad_s", "{angle}/s", "", "largest rate of the command, output side",
              example="20 deg/s"),
    _positive("command.acceleration", "acceleration_rad_s2", "{angle}/s^2", "",
              "largest acceleration of the command, output side", example="400 deg/s^2"),
    _positive("command.jerk", "jerk_rad_s3", "{angle}/s^3", "", "largest jerk of the command, output side",
              example="8000 deg/s^3"),
)
_CONTROL = (
    _positive("control.period", "period_s", "s", "Ts", "tick of the fastest loop", required=True,
              low=1e-07, high=10.0, example="100 us"),
    _not_negative("control.computing_delay", "computing_delay_s", "s", "d",
                  "time from sampling to the voltage acting", required=True, high=10.0, example="100 us"),
    _positive("control.current.gain", "gain_V_A", "V/A", "Kp_i", "gain of the current PI", required=True,
              example="20 mohm"),
    _positive("control.current.integral_time", "integral_time_s", "s", "Tn_i",
              "integral time of the current PI; without it a P controller", example="150 us"),
    _quantity("control.current.back_emf_feedforward", "back_emf_feedforward", "1", "",
              "share of the back-EMF kE w added to the voltage", low=0.0, high=2.0, example="1"),
    _quantity("control.current.resistance_feedforward", "resistance_feedforward", "1", "",
              "share of R i_ref added to the voltage", low=0.0, high=2.0, example="1"),
    _choice("control.current.anti_windup", "anti_windup", ("conditional", "clamped", "back-calculation"),
            "what the integral does while the output is at its limit"),
    _positive("control.current.tracking_time", "tracking_time_s", "s", "Tt",
              "time constant of back-calculation; default the integral time", example="10 ms"),
    _positive("control.velocity.gain", "gain", "{drive}*s/{angle}", "Kp_w", "gain of the velocity PI",
              required=True, example="0.12 A*s/rad"),
    _positive("control.velocity.integral_time", "integral_time_s", "s", "Tn_w",
              "integral time of the velocity PI; without it a P controller", example="15 ms"),
    _integer("control.velocity.every", "every", 1000, "n_v", "the velocity loop runs every so many ticks"),
    _choice("control.velocity.sensor", "sensor", ("motor",), "where the speed is measured"),
    _choice("control.velocity.anti_windup", "anti_windup", ("conditional", "clamped", "back-calculation"),
            "what the integral does while the output is at its limit"),
    _positive("control.velocity.tracking_time", "tracking_time_s", "s", "Tt",
              "time constant of back-calculation; default the integral time", example="10 ms"),
    _positive("control.position.gain", "gain", "{drive}/{angle}", "Kv",
              "gain of the position P controller", required=True, example="120 1/s"),
    _integer("control.position.every", "every", 10000, "n_p",
             "the position loop runs every so many ticks, a multiple of control.velocity.every"),
    _not_negative("control.position.feedforward", "feedforward", "1", "k_ff",
                  "share of the reference's rate added to the speed command", high=10.0, example="0"),
    _choice("control.position.sensor", "sensor", ("motor", "output"), "whose angle is fed back"),
    _positive("control.position.integral_time", "integral_time_s", "s", "Ti",
              "integral time of the position controller; without it no integral", example="0.5 s"),
    _not_negative("control.position.derivative_time", "derivative_time_s", "s", "Td",
                  "derivative time of the position controller", high=100.0, example="1 ms"),
    _not_negative("control.position.derivative_filter", "derivative_filter_s", "s", "TD",
                  "filter time of the derivative", high=100.0, example="0.2 ms"),
    _not_negative("control.position.acceleration_feedforward", "acceleration_feedforward", "1", "k_aff",
                  "share of J/kM times the command's acceleration added to the torque command", high=10.0,
                  example="1"),
    _not_negative("control.position.friction_feedforward", "friction_feedforward", "{drive}", "i_fr",
                  "added to the torque command in the direction of the command's motion", example="0.4 A"),
)
_FILTER = (
    _choice("control.velocity.filter.*.kind", "kind", get_args(FilterKind),
            "what the filter does", required=True),
    _choice("control.velocity.filter.*.on", "on", ("torque", "speed"),
            "whether it filters the torque command or the measured speed"),
    _positive("control.velocity.filter.*.frequency", "frequency_rad_s", "rad/s", "w0",
              "corner of a low-pass, centre of a notch", example="100 Hz"),
    _integer("control.velocity.filter.*.order", "order", 2, "", "order of a low-pass, 1 or 2"),
    _positive("control.velocity.filter.*.damping", "damping", "1", "", "damping of a low-pass of order 2",
              high=10.0, example="0.7"),
    _positive("control.velocity.filter.*.width", "width_rad_s", "rad/s", "", "width of a notch",
              example="50 Hz"),
    _quantity("control.velocity.filter.*.depth", "depth", "1", "",
              "gain of a notch at its centre: width of its zeros over that of its poles", low=0.0, high=1.0,
              example="0.1"),
    _positive("control.velocity.filter.*.zero", "zero_rad_s", "rad/s", "", "zero, or frequency of a pair",
              example="50 rad/s"),
    _positive("control.velocity.filter.*.pole", "pole_rad_s", "rad/s", "", "pole, or frequency of a pair",
              example="500 rad/s"),
    Field(path="control.velocity.filter.*.b", attribute="b", kind="quantities", low=-BIG, high=BIG,
          description="numerator of a biquad in z^-1, b0 b1 b2"),
    Field(path="control.velocity.filter.*.a", attribute="a", kind="quantities", low=-BIG, high=BIG,
          description="denominator of a biquad in z^-1 after the leading 1, a1 a2"),
)
_VALIDATION = (
    _positive("validation.full_deflection", "full_deflection_rad", "{angle}", "",
              "largest amplitude to look at, output side", required=True, example="10 deg"),
    Field(path="validation.amplitude_fractions", attribute="amplitude_fractions", kind="quantities",
          low=1e-09, high=1.0, description="amplitudes as fractions of the full deflection"),
    Field(path="validation.loads", attribute="loads_Nm", kind="quantities", unit_template="{torque}",
          low=-BIG, high=BIG, description="load moments to look at"),
)
_FAILURE = (
    _positive("failure.stop", "stop_rad", "{angle}", "", "mechanical stop; default the full deflection",
              example="25 deg"),
    _positive("failure.deflection", "deflection_rad", "{angle}", "",
              "deflection to which the time is taken; default a tenth of the stop", example="2 deg"),
    _positive("failure.detection_time", "detection_s", "s", "",
              "from a failure to its detection; default 0.1 s", high=1e4, example="50 ms"),
    _quantity("failure.load", "load_Nm", "{torque}", "",
              "moment that pushes the output forward; default none", example="4 N*m"),
)
_DUTY = (
    _positive("duty.amplitude", "amplitude_rad", "{angle}", "",
              "peak of the sine, output side; default half the full deflection", example="5 deg"),
    _positive("duty.frequency", "frequency_rad_s", "rad/s", "", "of the sine; default 1 Hz",
              example="0.5 Hz"),
    _quantity("duty.load", "load_Nm", "{torque}", "",
              "moment at the output, all the time; default the largest of validation.loads", example="4 N*m"),
    _positive("duty.share", "share", "1", "", "share of the time in motion; default 1", high=1.0,
              example="0.4"),
    _positive("duty.cycle", "cycle_s", "s", "", "one motion and one rest together; default 10 s",
              high=1e6, example="60 s"),
)
# fmt: on

ALL_FIELDS: tuple[Field, ...] = (
    *_DESIGN, *_MOTOR, *_SCREW, *_GEAR, *_COUPLING, *_LOAD, *_LOAD_FRICTION, *_GRAVITY, *_FRICTION,
    *_FRICTION_POINT, *_ENCODER, *_OUTPUT_ENCODER, *_INSTRUMENTS, *_LIMITS, *_SUPPLY, *_TEMPERATURE,
    *_COMMAND, *_CONTROL, *_FILTER, *_VALIDATION, *_FAILURE, *_DUTY,
)  # fmt: skip
"""Every key, in the order of a design file."""
