"""The table of all keys of a design file: key, attribute, SI unit, symbol, meaning, range, example."""

from __future__ import annotations

from actuator_lti.design.field import BIG, SMALL, Field


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


def _choice(path: str, attribute: str, choices: tuple[str, ...], text: str) -> Field:
    return Field(path=path, attribute=attribute, kind="choice", choices=choices, description=text)


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
              "back-EMF per rad/s", example="5.9 mV*s/rad"),
    _positive("motor.source_gain", "source_gain_Nm_V", "{torque}/V", "g",
              "gain of an ideal torque source, instead of R, L, kM, kE", example="35.15 N/V"),
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
    _not_negative("load.inertia", "inertia_kgm2", "{inertia}", "J_canard", "inertia at the output shaft",
                  example="2e-4 kg*m^2"),
    _choice("load.path", "path", ("self-locking", "back-drivable"),
            "whether the load moment only adds friction, or also drives the motor"),
    _not_negative("load.moment_max", "moment_max_Nm", "{torque}", "M_ext",
                  "largest load moment at the output", example="8 N*m"),
    _quantity("load.moment_slope", "moment_slope_Nm_rad", "{torque}/{angle}", "",
              "load moment per output deflection", example="0 N*m/rad"),
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
_ENCODER = (
    _integer("encoder.counts_per_rev", "counts_per_rev", 2**32, "",
             "counts per motor revolution after quadrature (linear axis: per metre)"),
    _choice("encoder.speed", "speed", ("ideal", "difference"),
            "the speed itself, or a difference of angles"),
    _integer("encoder.difference_samples", "difference_samples", 64, "m",
             "velocity periods that the difference spans"),
    _not_negative("encoder.filter_time", "filter_time_s", "s", "T_F", "first-order filter of the speed",
                  example="0 us"),
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
    _positive("control.velocity.gain", "gain", "{drive}*s/{angle}", "Kp_w", "gain of the velocity PI",
              required=True, example="0.12 A*s/rad"),
    _positive("control.velocity.integral_time", "integral_time_s", "s", "Tn_w",
              "integral time of the velocity PI; without it a P controller", example="15 ms"),
    _integer("control.velocity.every", "every", 1000, "n_v", "the velocity loop runs every so many ticks"),
    _positive("control.position.gain", "gain", "{drive}/{angle}", "Kv",
              "gain of the position P controller", required=True, example="120 1/s"),
    _integer("control.position.every", "every", 10000, "n_p",
             "the position loop runs every so many ticks, a multiple of control.velocity.every"),
    _not_negative("control.position.feedforward", "feedforward", "1", "k_ff",
                  "share of the reference's rate added to the speed command", high=10.0, example="0"),
)
_VALIDATION = (
    _positive("validation.full_deflection", "full_deflection_rad", "{angle}", "",
              "largest amplitude to look at, output side", required=True, example="10 deg"),
    Field(path="validation.amplitude_fractions", attribute="amplitude_fractions", kind="quantities",
          low=1e-09, high=1.0, description="amplitudes as fractions of the full deflection"),
    Field(path="validation.loads", attribute="loads_Nm", kind="quantities", unit_template="{torque}",
          low=-BIG, high=BIG, description="load moments to look at"),
)
# fmt: on

ALL_FIELDS: tuple[Field, ...] = (
    *_DESIGN, *_MOTOR, *_GEAR, *_LOAD, *_FRICTION, *_ENCODER, *_LIMITS, *_CONTROL, *_VALIDATION,
)  # fmt: skip
"""Every key, in the order of a design file."""
