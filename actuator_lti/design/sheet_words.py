"""Data sheets' and controllers' words for what a design file has under another name, by the table of both."""

from __future__ import annotations

import re

_STALL = (
    "resistance = voltage/stall current, torque_constant = stall torque/(stall current - no-load current)"
)
_MULTIPLE = "every, so many ticks of control.period"
_PERIOD = 'period, which takes "16 kHz" too'
_VOLTAGE = "nominal_voltage rated_voltage supply_voltage bus_voltage vbus un"
_CONTINUOUS = "nominal_current rated_current"
_SPEED = "nominal_speed rated_speed max_speed"
_WORDS: dict[str, dict[str, str]] = {
    "": {"feedback": "encoder", "controller drive": "control", "gearbox gearhead": "a [[gear]]"},
    "motor": {
        "km kt": "torque_constant",
        "ki current_constant": "torque_constant, one over it",
        "ke voltage_constant ac_voltage_constant emf_constant": "back_emf_constant",
        "kn speed_constant": 'back_emf_constant, which takes "317 rpm/V" too',
        "kv": 'back_emf_constant, which takes "480 KV"',
        "r rm ra phase_resistance terminal_resistance": "resistance",
        "l lm la phase_inductance terminal_inductance": "inductance",
        "j jm inertia moment_of_inertia": "rotor_inertia",
        "mass moving_mass": "rotor_inertia, in kg on a linear axis",
        "moment_of_inertia_output_side output_inertia": "rotor_inertia, at the motor: over ratio^2",
        "force_constant": "torque_constant, in N/A on a linear axis",
        "io i0": "no_load_current",
        "no n0": "no_load_speed",
        "tf friction_torque friction_torque_static static_friction": "dry_torque of [friction]",
        "kvisc damping viscous viscous_damping friction_torque_dynamic": "viscous of [friction]",
        f"voltage {_VOLTAGE}": "voltage of [limits]",
        f"continuous_current {_CONTINUOUS}": "continuous_current of [limits]",
        "peak_current max_current": "peak_current of [limits]",
        "stall_current stall_torque": f"not asked for, but what follows: {_STALL}",
        f"speed {_SPEED}": "speed of [limits]",
        "cogging_torque torque_ripple detent_torque": "cogging",
        "mechanical_time_constant electrical_time_constant": "not needed: it follows from R, L, J and kM",
        "pole_pairs poles": "not needed: constants are per mechanical radian",
    },
    "gear": {
        "teeth i": 'ratio, which takes "60/20" too',
        "inertia": "input_inertia",
        "backlash": "play of [coupling], beside its stiffness",
        "self_locking": 'path = "self-locking" of [load]',
    },
    "screw": {
        "pitch": "lead",
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
        "mass": "inertia, in kg on a linear axis",
        "force torque max_torque": "moment_max",
        "friction_force friction_torque": "dry_torque of [load.friction] behind a coupling; [friction]",
        "imbalance unbalance": "the table [load.gravity]",
        "self_locking": 'path = "self-locking"',
    },
    "friction": {
        "no_load_starting_torque starting_torque": "dry_torque, with breakaway_ratio",
        "static_friction coulomb_friction friction_torque": "dry_torque",
        "viscous_friction damping": "viscous",
    },
    "encoder": {
        "lines lines_per_revolution ppr cpt counts_per_turn": 'counts_per_rev, which takes "1024 lines"',
        "resolution cpr bits": 'counts_per_rev, 4096 or "17 bit"; without a screw per metre of a linear axis',
        "hall_sensors": "counts_per_rev, 6 for each pole pair",
    },
    "limits": {
        f"supply {_VOLTAGE}": "voltage",
        _CONTINUOUS: "continuous_current",
        "max_current stall_current": "peak_current",
        "torque max_torque peak_torque": "peak_current, the torque over torque_constant and ratio",
        _SPEED: "speed",
    },
    "control": {
        "frequency sampling_frequency cycle_time sample_time sampling_time ts": _PERIOD,
        "pwm pwm_frequency switching_frequency": "not needed; what it delays is part of computing_delay",
        "delay deadtime dead_time": "computing_delay",
    },
    "control.": {  # a loop of it
        "kp kv p proportional proportional_gain": "gain",
        "ki integral_gain": "integral_time = gain/integral gain",
        "kd derivative_gain": "derivative_time = derivative gain/gain",
        "tn ti reset_time": "integral_time",
        "frequency cycle_time sample_time": _MULTIPLE,
        "bandwidth": "gain: 2 pi f times L (current), J/kM (velocity) or 1 (position)",
    },
    ".law": {
        "num numerator den denominator": "A, B, C and D, in MATLAB [A,B,C,D] = tf2ss(num,den), at the period "
        "of the stage; in Python with_law(stage, control.tf(num, den, T))",
        "kp ki kd p i d tn ti": "a number of D; or, without a law, gain, integral_time, derivative_time "
        "of the stage",
    },
}
_HINTS = {
    table: {word: hint for words, hint in hints.items() for word in words.split()}
    for table, hints in _WORDS.items()
}


def key_for(table: str, word: str) -> str:
    """The key that a word of a data sheet stands for in a table such as ``"control.position"``, or nothing.

    Examples
    --------
    >>> key_for("motor", "Kt"), key_for("control.position", "Kv"), key_for("gear.worm", "i")
    ('torque_constant', 'gain', 'ratio, which takes "60/20" too')
    """
    first, *rest = re.split(r"[.\[]", table)
    plain = re.sub(r"[- ]", "_", word.lower())
    tables = (f"{first}.",) if first == "control" and rest else (first, f"{first}.")
    tables = (".law",) if "law" in rest else tables
    return next((_HINTS[one][plain] for one in tables if plain in _HINTS.get(one, {})), "")
