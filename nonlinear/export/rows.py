"""What each number of the flat rows is: name, unit and words, read from the layout of the kernels.

The words are the comments that stand behind each name in ``nonlinear/_kernels/layout.py``.
"""

from __future__ import annotations

import inspect
import re
from functools import cache

from actuator_lti.drive.signals import LIMITERS
from nonlinear._kernels import layout as at

_LINE = re.compile(r"^\s*(?P<names>[A-Z][A-Z_0-9]*)(?P<end>,|(?:: \w+)? =[^#]*)\s*(?:#\s*(?P<words>.*))?$")

# SI, motor side (linear axis: read N for N m, m for rad, kg for kg m2); what is not here has no unit
UNITS = {
    "s": "PERIOD DELAY_FRACTION JITTER",
    "ohm": "RESISTANCE SUPPLY_RESISTANCE",
    "H": "INDUCTANCE",
    "V s/rad": "BACK_EMF BACK_EMF_FEEDFORWARD",
    "N m/A": "TORQUE_CONSTANT",
    "N m/V": "SOURCE_GAIN",
    "kg m2": "INERTIA",
    "N m s/rad": "VISCOUS VISCOUS_REVERSE",
    "N m": "DRY DRY_REVERSE OFFSET LOAD MOMENT_PEAK MOMENT_PEAK_2 TORQUE_PEAK IN_LOAD IN_TORQUE S_LOAD S_DRY "
    "S_DRY_REVERSE S_TORQUE",
    "N m/rad": "LOAD_SLOPE TORQUE_SLOPE",
    "rad/s": "SMOOTHING SPEED_LIMIT SPEED_START SPEED_COMMAND_START IN_SPEED IO_SPEED IO_SPEED_COMMAND "
    "S_SPEED S_OUTPUT_SPEED S_SPEED_COMMAND S_SPEED_REFERENCE S_MEASURED_SPEED S_FILTERED_SPEED "
    "S_TRACKED_SPEED",
    "rad/s2": "ACCELERATION_LIMIT",
    "A": "CURRENT_LIMIT CURRENT_START CURRENT_COMMAND_START CONTINUOUS_CURRENT CURRENT_RESOLUTION "
    "CURRENT_NOISE IN_CURRENT IO_CURRENT IO_CURRENT_COMMAND S_CURRENT S_CURRENT_BEFORE "
    "S_CURRENT_REFERENCE S_CURRENT_LIMIT",
    "V": "VOLTAGE_LIMIT CURRENT_INTEGRATOR_START VOLTAGE_START SUPPLY_VOLTAGE BRAKE_VOLTAGE IN_BUS "
    "IO_VOLTAGE S_HELD S_CURRENT_INTEGRATOR S_VOLTAGE_BEFORE S_VOLTAGE S_VOLTAGE_LIMIT",
    "rad": "ANGLE_START ANGLE_NOISE OUTPUT_NOISE MOMENT_PHASE MOMENT_PHASE_2 TORQUE_PHASE IN_ANGLE IN_OUTPUT "
    "IO_OUTPUT IO_ANGLE S_ANGLE S_OUTPUT S_TRACKED_ANGLE",
    "V/A": "CURRENT_GAIN CURRENT_INTEGRAL",
    "ohm (share times R)": "RESISTANCE_FEEDFORWARD",
    "F": "CAPACITANCE",
    "1/rad": "COUNTS_PER_RAD POSITION_COUNTS OWN_COUNTS OWN_OUTPUT_COUNTS",
}
_OWN = (
    ("A, row by row,", at.OWN_A, at.OWN_B), ("B, row by row,", at.OWN_B, at.OWN_C), ("C", at.OWN_C, at.OWN_D),
    ("D", at.OWN_D, at.OWN_L), ("L", at.OWN_L, at.OWN_START), ("start", at.OWN_START, at.SIZE),
)  # fmt: skip
UNIT_OF = {name: unit for unit, names in UNITS.items() for name in names.split()}


@cache
def words() -> dict[str, str]:
    """Unit and words of each name of the layout, ``""`` where it says no more than its name."""
    result: dict[str, str] = {}
    for line in inspect.getsource(at).splitlines():
        match = _LINE.match(line)
        if match:
            said = match["words"] or match["names"].removeprefix("S_").lower().replace("_", " ")
            unit = UNIT_OF.get(match["names"], "")
            result[match["names"]] = f"{said} [{unit}]" if unit else said
    return result


def names_of(first: int, last: int, begin: str = "") -> list[tuple[str, int]]:
    """Names of the layout whose value lies in ``first <= value < last``, in the order of the values."""
    known = [(name, value) for name, value in vars(at).items() if type(value) is int and name in words()]
    chosen = [(name, value) for name, value in known if first <= value < last and name.startswith(begin)]
    return sorted(chosen, key=lambda item: item[1])


def parameter_names() -> list[tuple[str, int]]:
    """The parameters of a run that stand alone, in the order of the row."""
    ours = list(words())
    block = ours[: ours.index("COMMAND")]
    return [(name, getattr(at, name)) for name in block]


def place_words() -> dict[int, str]:
    """What each place of the row of a run is, for every place from 0 to ``layout.SIZE``."""
    table = {value: f"{name}: {words()[name]}" for name, value in parameter_names()}
    for part, begin in (("command signal", at.COMMAND), ("bias signal", at.BIAS)):
        table |= {begin + k: f"{part}, {k}" for k in range(at.SIGNAL_SIZE)}
    for k in range(4):
        begin = at.PROBES + k * at.PROBE_SIZE
        table |= {begin + j: f"probe at {at.POINTS[k]}, {j}" for j in range(at.PROBE_SIZE)}
    ends = (at.SPEED_CHAIN, at.TORQUE_CHAIN, at.MAP)
    chains = ((at.COMMAND_CHAIN, "command"), (at.SPEED_CHAIN, "speed"), (at.TORQUE_CHAIN, "torque"))
    for (begin, what), end in zip(chains, ends, strict=True):
        for place in range(begin, end):
            section, number = divmod(place - begin, at.SECTION)
            table[place] = f"{what} filter {section + 1}, {('b0', 'b1', 'b2', 'a1', 'a2')[number]}"
    for place in range(at.MAP, at.LIMITS):
        point, number = divmod(place - at.MAP, 2)
        table[place] = f"friction map, {('speed', 'torque')[number]} {point + 1}"
    for name, begin, end in _OWN:
        table |= {place: f"law of one's own, {name} {place - begin + 1}" for place in range(begin, end)}
    for name, limiter in LIMITERS.items():
        if at.LIMIT[name] >= at.LIMITS:
            table[at.LIMIT[name]] = f"{limiter.words} [{limiter.unit()}]"
    return table
