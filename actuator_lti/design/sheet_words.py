"""Data sheets' and controllers' words for what a design file has under another name, by the table of both."""

import re
from collections.abc import Iterable

_STALL = (
    "resistance = voltage/stall current, torque_constant = stall torque/(stall current - no-load current)"
)
_MULTIPLE = "every, so many ticks of control.period"
_PERIOD = 'period, which takes "16 kHz" too'
_VOLTAGE = "nominal_voltage rated_voltage supply_voltage bus_voltage vbus un"
_CONTINUOUS = (
    "nominal_current rated_current continuous_current_at_standstill continuous_stall_current rms_current"
)
_PEAK = "max_current current_max current_peak peak_stall_current"
_RATED = "rated_torque nominal_torque continuous_torque continuous_stall_torque"
_OF_PHASE = ', as it stands with motor.constants = "peak-phase" or of a stepper, else twice it'
_FACT = "not needed; it may stand as a [[fact]]"
_FRICTION = "friction friction_force friction_torque frictional_torque"
_LINES = "lines lines_per_revolution counts_per_turn"
_PULSES = "cpr cpt ppr ppt pulses pulses_per_revolution pulses_per_rev"
_COUNTED = {
    "counts": "counts_per_rev",
    f"{_LINES} sin_cos_periods": 'counts_per_rev, in counts, four of each line, which takes "1024 lines" too',
    _PULSES: "counts_per_rev, in counts, of some makers four of each line",
}
_INTEGRAL = "integral_time = gain/integral gain; of one in Hz 1/(2 pi f)"
_SPEED = "nominal_speed rated_speed max_speed"
_WORDS: dict[str, dict[str, str]] = {
    "": {
        "feedback sensor resolver": "encoder",
        "controller drive amplifier": "control",
        "gearbox gearhead belt pulley transmission": "a [[gear]]",
        "spindle ballscrew leadscrew": "screw",
        "thermal": "temperature",
        "gravity": "the table [load.gravity]",
        "current velocity speed position loop": "a table of control, as [control.position]",
        "filter notch lowpass": "a [[control.velocity.filter]]",
    },
    "motor": {
        "km kt torque_sensitivity": "torque_constant",
        "motor_constant": "not needed: it follows from R and kM",
        "ki current_constant": "torque_constant, one over it",
        "ke back_emf backemf bemf voltage_constant ac_voltage_constant emf_constant": "back_emf_constant",
        "flux_linkage psi lambda": "back_emf_constant, times the pole pairs, and torque_constant, "
        '1.5 times that, of constants = "peak-phase"',
        "kn speed_constant": 'back_emf_constant, which takes "317 rpm/V" too',
        "kv": 'back_emf_constant, which takes "480 KV"',
        "r rm ra terminal_resistance": "resistance",
        "l lm la terminal_inductance": "inductance",
        "phase_resistance resistance_phase resistance_per_phase": f"resistance{_OF_PHASE}",
        "phase_inductance inductance_phase inductance_per_phase": f"inductance{_OF_PHASE}",
        "j jm inertia moment_of_inertia": "rotor_inertia",
        "gd2 gd flywheel_effect": "rotor_inertia, GD2 over 4",
        "brake_inertia": "added to rotor_inertia",
        "mass moving_mass": "rotor_inertia, in kg on a linear axis",
        "moment_of_inertia_output_side output_inertia": "rotor_inertia, at the motor: over ratio^2",
        "force_constant": "torque_constant, in N/A on a linear axis",
        "io i0": "no_load_current",
        "no n0": "no_load_speed",
        "tf friction friction_torque friction_torque_static static_friction": "dry_torque of [friction]",
        "kvisc damping damping_constant viscous friction_torque_dynamic": "viscous of [friction]",
        f"voltage {_VOLTAGE}": "voltage of [limits]",
        f"continuous_current {_CONTINUOUS}": "continuous_current of [limits]",
        "peak_current max_current peak_stall_current": "peak_current of [limits]",
        _RATED: "continuous_current of [limits], the torque over torque_constant",
        "torque": "peak_current of [limits], the torque over torque_constant",
        "type motor_type": "constants, of an AC motor rms-line or peak-phase, else dc",
        "weight power": _FACT,
        "step_angle": "counts_per_rev of [encoder], one revolution over it",
        "magnet_pitch pole_pitch": 'cogging_periods, which takes "24 mm" too',
        "stall_current stall_torque": f"not asked for, but what follows: {_STALL}",
        f"speed {_SPEED}": "speed of [limits]",
        "cogging_torque": "cogging",
        "torque_ripple": "not in the model; motor.cogging is a torque in N*m, without a current too",
        "detent_torque": 'cogging, with cogging_phase = "180 deg", as a stepper rests at its angle 0',
        "holding_torque": "torque_constant, over the current that holds",
        "thermal_resistance": "thermal_resistance of [temperature], the sum of a sheet's two",
        "thermal_time_constant": "thermal_time of [temperature]",
        "speed_torque_gradient": "not needed: it follows from R and kM",
        "mechanical_time_constant electrical_time_constant": "not needed: it follows from R, L, J and kM",
        "pole_pairs poles pole_number": "not needed: constants are per mechanical radian",
    },
    "gear": {
        "teeth i reduction": 'ratio, which takes "60/20" too',
        "inertia": "input_inertia",
        "gd2 gd flywheel_effect": "input_inertia, GD2 over 4",
        "type model part_number": "name",
        "backlash lost_motion play": "play of [coupling], beside its stiffness; without one left out",
        "stiffness rigidity": "stiffness of [coupling]",
        "starting_torque no_load_starting_torque running_torque no_load_torque back_driving_torque": (
            "dry_torque of [friction], at the motor: what is stated at the output over ratio"
        ),
        f"max_torque peak_torque {_RATED}": _FACT,
        "transmission_error": "gear_error of [load], a torque at the output: the angle times the stiffness",
        "self_locking": 'path = "self-locking" of [load]',
    },
    "screw": {
        "pitch": "lead",
        "backlash lost_motion play": "play of [coupling], beside its stiffness; without one left out",
        "stiffness rigidity axial_stiffness": "stiffness of [coupling]",
        "inertia": "rotor_inertia of [motor], with the motor's; or input_inertia of a [[gear]] of ratio 1",
        "efficiency": "that of a [[gear]], ratio 1 for a screw alone",
    },
    "coupling": {
        "k1": "stiffness",
        "k2": "stiffness_2",
        "k3": "stiffness_3",
        "t1": "torque_1",
        "t2": "torque_2",
        "backlash lost_motion": "play",
        "hysteresis hysteresis_loss": "play, or dry_torque of [load.friction]",
    },
    "load": {
        "j jl": "inertia",
        "mass": "inertia, in kg on a linear axis",
        "gd2 gd flywheel_effect": "inertia, GD2 over 4",
        "inertia_ratio": "inertia, the ratio times rotor_inertia and the gears' ratio squared",
        "force torque moment max_torque force_max torque_max": "moment_max",
        _FRICTION: "dry_torque of [load.friction] behind a coupling, else of [friction]",
        "damping": "moment_damping, per output speed",
        "imbalance unbalance": "the table [load.gravity]",
        "self_locking": 'path = "self-locking"',
    },
    ".gravity": {"m": "mass", "l length radius": "arm", "angle phase": "offset, 0 upright"},
    "friction": {
        "no_load_starting_torque starting_torque": "dry_torque, with breakaway_ratio",
        "c0 co dry coulomb static_friction coulomb_friction friction_torque": "dry_torque",
        "cv viscous_friction damping": "viscous",
    },
    "temperature": {"winding_max max_winding_temperature maximum_winding_temperature": "winding_limit"},
    "encoder": {
        **_COUNTED,
        "resolution bits step_angle": 'counts_per_rev, 4096 or "17 bit"; one revolution over a step in angle '
        "(linear axis without a screw: one metre over a step)",
        "type interface accuracy poles pole_pairs": _FACT,
        "hall_sensors": "counts_per_rev, 6 for each pole pair",
    },
    "output_encoder": {
        **_COUNTED,
        "resolution bits step_angle": 'counts_per_rev, 4096 or "17 bit"; one revolution of the output over a '
        "step in angle (linear axis: one metre over a step)",
        "type interface accuracy poles pole_pairs": _FACT,
    },
    "limits": {
        f"supply {_VOLTAGE} dc_bus": "voltage",
        f"i_cont i_rms {_CONTINUOUS} stall_current": "continuous_current",
        f"i_peak i_max current {_PEAK} current_limit current_lim": "peak_current",
        "i2t": "peak_time, for which peak_current may flow before continuous_current is the limit",
        "velocity velocity_limit vel_limit speed_limit": "speed",
        "accel accel_limit": "acceleration",
        _RATED: "continuous_current, the torque over torque_constant and ratio",
        "torque max_torque peak_torque": "peak_current, the torque over torque_constant and ratio",
        _SPEED: "speed",
        "rate max_rate slew_rate": "speed, at the motor: that of the output times ratio",
    },
    "control": {
        "speed speed_loop": "velocity",
        "current_loop velocity_loop position_loop": "that name without _loop",
        "cycle cycle_time sample_rate sample_time sampling_rate sampling_time ts": _PERIOD,
        "frequency sampling_frequency": _PERIOD,
        "pwm pwm_frequency pwm_period switching_frequency": "not needed, part of computing_delay",
        "delay deadtime dead_time": "computing_delay",
    },
    "control.": {  # a loop of it
        "kp kv kvp kpp vp p p_gain kv_factor proportional proportional_gain": "gain",
        "ki kvi i_gain integral integral_gain integrator_gain": _INTEGRAL,
        "kd d_gain derivative_gain": "derivative_time = derivative gain/gain",
        "tn ti reset_time integral_time_constant integral_action_time": "integral_time",
        "pff kff pfg velocity_feedforward": "feedforward",
        "notch lowpass low_pass": "a [[control.velocity.filter]] with its kind",
        "frequency period cycle cycle_time sample_rate sample_time ts": _MULTIPLE,
        "bandwidth": 'gain, which takes "40 Hz" too',
        "observer": 'encoder.speed = "tracking", or a law of one\'s own, [control.velocity.law]',
    },
    ".filter": {
        "bandwidth": "width",
        "time_constant": "frequency, 1/(2 pi time constant), where it is that of a low-pass",
        "q": "width, the frequency over Q",
    },
    ".law": {
        "num numerator den denominator": "A, B, C and D, in MATLAB [A,B,C,D] = tf2ss(num,den), at the period "
        "of the stage; in Python with_law(stage, control.tf(num, den, T))",
        "kp ki kd p i d tn ti": "a number of D; or, without a law, gain, integral_time, derivative_time "
        "of the stage",
    },
}
_AFTER = re.compile(
    r"(?<=.)(?:_(?:line|phase_(?:to_)?phase|terminal|to|l_l|ll|pp|typ|nom))+\Z"
)  # resistance_line_to_line
_HINTS = {
    table: {word: hint for words, hint in hints.items() for word in words.split()}
    for table, hints in _WORDS.items()
}


def key_for(table: str, word: str, known: Iterable[str] = ()) -> str:
    """The key that a word of a data sheet stands for in a table such as ``"control.position"``, or nothing.

    Of a word in several parts also what its end stands for, or which of the keys that are ``known`` it is.

    >>> key_for("motor", "Kt"), key_for("control.position", "Kv"), key_for("gear.worm", "i")
    ('torque_constant', 'gain', 'ratio, which takes "60/20" too')
    >>> key_for("motor", "rotor_moment_of_inertia"), key_for("gear.worm", "reduction ratio", ["ratio"])
    ('rotor_inertia', 'ratio')
    >>> key_for("motor", "Resistance (L-L)", ["resistance"])
    'resistance'
    """
    first, *rest = re.split(r"[.\[]", table)
    plain = _AFTER.sub("", re.sub(r"[- ()]+", "_", word.lower()).strip("_"))
    tables = (f"{first}.",) if first == "control" and rest else (first, f"{first}.")
    tables = (".law",) if "law" in rest else (*(f".{one}" for one in rest), *tables)
    own = {key: key for key in known}
    words = plain.split("_")
    ends = ("_".join(words[k:]) for k in range(len(words)))
    return next(
        (hints[end] for end in ends for one in tables if end in (hints := own | _HINTS.get(one, {}))), ""
    )
