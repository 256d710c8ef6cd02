"""Random design files for the property tests: any stages, any spelling of units, any pedigree."""

from typing import Any

from hypothesis import strategies as st

from actuator_lti.design.field import BIG, Field, Structure
from actuator_lti.design.fields import fields_in

_SPELLINGS = {
    "kg*m^2": ("kg*m^2", "g*cm^2", "gcm²"),
    "ohm": ("ohm", "mohm"),
    "H": ("H", "uH"),
    "rad/s": ("rad/s", "rpm", "Hz"),
    "rad": ("rad", "deg"),
    "s": ("s", "us", "ms"),
    "N*m": ("N*m", "mNm", "ozf*in"),
    "A": ("A", "mA"),
}
_texts = st.text(st.characters(min_codepoint=32, max_codepoint=0x24F, exclude_categories=("C",)), max_size=20)
_factors = st.floats(0.25, 4.0).map(lambda x: float(f"{x:.6g}"))


@st.composite
def written_value(draw: st.DrawFn, unit: str, number: float) -> Any:
    """A number near one given, in some spelling, with or without a pedigree."""
    spelling = draw(st.sampled_from(_SPELLINGS.get(unit, (unit,))))
    text = number if unit == "1" else f"{number!r} {spelling}"
    if draw(st.booleans()):
        return text
    pedigree: dict[str, Any] = {"value": text}
    pedigree |= draw(
        st.fixed_dictionaries({}, optional={"source": _texts, "grade": st.sampled_from("ABCDX")})
    )
    width = st.sampled_from(["5 %", {"kind": "normal", "std": "1 %"}, {"half_width": "0.5 %"}])
    return pedigree | draw(st.fixed_dictionaries({}, optional={"tolerance": width}))


@st.composite
def _section(draw: st.DrawFn, title: str, structure: Structure, fixed: dict[str, Any]) -> dict[str, Any]:
    section = dict(fixed)
    for field in fields_in(title):
        if field.key in section or not (field.required or draw(st.booleans())):
            continue
        section[field.key] = draw(_value(field, structure))
    return {key: value for key, value in section.items() if value is not None}


def _value(field: Field, structure: Structure) -> st.SearchStrategy[Any]:
    if field.kind == "choice":
        return st.sampled_from(field.choices)
    if field.kind == "text":
        return _texts
    if field.kind == "flag":
        return st.booleans()
    if field.kind == "integer":
        return st.integers(1, int(min(4, field.high)))
    unit = field.unit(structure)
    middle = 1.0 if field.high == BIG else min(1.0, field.high / 5)  # four times that, and 5 % more, fits
    if field.low < 0.0 and field.high < 1.0:  # a coefficient that is negative as a rule
        middle = -middle / 100
    if field.kind == "quantities":
        items = _factors.map(lambda x: x * middle if unit == "1" else f"{x * middle!r} {unit}")
        return st.lists(items, min_size=1, max_size=4)
    low = 4 * field.low if field.low >= 1.0 else 0.0
    return _factors.flatmap(lambda x: written_value(unit, max(x * middle, low)))


_windup = st.sampled_from(
    [
        {"anti_windup": "conditional", "tracking_time": None},
        {"anti_windup": "clamped", "tracking_time": None, "integral_time": "10 ms"},
        {"anti_windup": "back-calculation", "tracking_time": "3 ms", "integral_time": "10 ms"},
    ]
)
_NO_OVERLOAD = {"speed": None, "continuous_current": None, "peak_time": None}
_overload = st.sampled_from(
    [_NO_OVERLOAD, {"speed": None, "peak_current": "12 A", "continuous_current": "4 A", "peak_time": "1 s"}]
)
_filter_times = st.sampled_from([None, "0 s", "3 ms", {"value": "0.5 s", "grade": "A", "tolerance": "5 %"}])
_FILTERS: list[dict[str, Any]] = [
    {"kind": "lowpass", "frequency": "20 Hz", "order": 2, "damping": 0.7},
    {"kind": "lowpass", "frequency": {"value": "30 Hz", "source": "tuned", "tolerance": "5 %"}},
    {"kind": "notch", "frequency": "200 rad/s", "width": "50 rad/s", "depth": 0.1},
    {"kind": "skewed-notch", "zero": "40 Hz", "pole": "50 Hz", "width": "30 Hz", "depth": 0.1},
    {"kind": "leadlag", "zero": "10 rad/s", "pole": "100 rad/s", "on": "speed"},
    {"kind": "biquad", "b": [0.5, 0.1, 0.2], "a": [-0.4, 0.2]},
]


def _bends(torque: str, angle: str) -> st.SearchStrategy[dict[str, Any]]:
    """A spring of one piece, of two, of three."""
    keys = ("torque_1", "stiffness_2", "torque_2", "stiffness_3")
    values = (f"2 {torque}", f"40 {torque}/{angle}", f"5.5 {torque}", f"70 {torque}/{angle}")
    pieces = [dict(zip(keys, (*values[:n], *[None] * (4 - n)), strict=True)) for n in (0, 2, 4)]
    return st.sampled_from(pieces)


@st.composite
def design_trees(draw: st.DrawFn) -> dict[str, Any]:
    """A tree of a design file that must be accepted."""
    axis = draw(st.sampled_from(["rotary", "linear"]))
    source, has_velocity = draw(st.booleans()), draw(st.booleans())
    has_current = not source and draw(st.booleans())
    structure = Structure(axis, has_velocity, has_current)
    torque, angle = ("N*m", "rad") if axis == "rotary" else ("N", "m")
    constant = draw(_factors)
    electrical: dict[str, Any] = {"source_gain": None, "torque_constant": f"{constant} {torque}/A",
                                  "back_emf_constant": f"{constant * 1.05:.6g} V*s/{angle}",
                                  "resistance": "1 ohm", "inductance": "1 mH", "constants": "dc",
                                  "cogging": None}  # fmt: skip
    ideal = {**dict.fromkeys(electrical), "source_gain": draw(written_value(f"{torque}/V", constant))}
    control = draw(_section("control", structure, {"period": "1 ms", "computing_delay": "1.5 ms"}))
    n_v = draw(st.integers(1, 3))
    no_feedforward = {} if has_velocity else {"feedforward": None}
    n_p = n_v * draw(st.integers(1, 3)) if has_velocity else 1
    if not has_velocity:
        no_feedforward |= {"acceleration_feedforward": None, "friction_feedforward": None}
    if draw(st.booleans()) or not (has_velocity or has_current):
        control["position"] = draw(_section("control.position", structure, {"every": n_p, **no_feedforward}))
    if has_velocity:
        control["velocity"] = draw(_section("control.velocity", structure, {"every": n_v, **draw(_windup)}))
        control["velocity"]["filter"] = draw(st.lists(st.sampled_from(_FILTERS), max_size=3))
    if has_current:
        control["current"] = draw(_section("control.current", structure, draw(_windup)))
    names = draw(
        st.lists(st.from_regex(r"[A-Za-z0-9][A-Za-z0-9_-]{0,8}", fullmatch=True), unique=True, max_size=3)
    )
    tree = {
        "design": draw(_section("design", structure, {"name": "d", "axis": axis})),
        "motor": draw(_section("motor", structure, ideal if source else electrical)),
        "gear": [{"name": name, **draw(_section("gear.*", structure, {}))} for name in names],
        "limits": draw(_section("limits", structure, draw(_overload) if has_current else _NO_OVERLOAD)),
        "control": control,
    }
    tracking = draw(st.sampled_from([{"speed": "ideal"}, {"speed": "tracking", "bandwidth": "10 Hz"}]))
    given = {
        "load": {"moment_damping": f"1e-12 {torque}*s/{angle}", "gear_error": None,
                 "locking_gear": None}, "friction": {},
        "encoder": {"bandwidth": None, **tracking}, "validation": {},
        "coupling": {"after": None, **draw(_bends(torque, angle))}, "output_encoder": {},
        "instruments": {"jitter": "20 us"},
    }  # fmt: skip
    if "position" in control:
        given["command"] = {"jerk": None, "acceleration": None, "rate": "1 urad/s",
                            "filter_time": draw(_filter_times)}  # fmt: skip
        given["command"] = given["command"] if axis == "rotary" else {**given["command"], "rate": "1 um/s"}
    if not source:
        given["temperature"] = {
            "winding_limit": None,
            "magnet_coefficient": "-0.11 %/K",
            "resistance_coefficient": "0.393 %/K",
        }
        given["supply"] = {"regenerative": False, "capacitance": "2 mF", "brake_voltage": "1e4 V"}
    for name, fixed in given.items():
        if draw(st.booleans()):
            tree[name] = draw(_section(name, structure, fixed))
    if "coupling" in tree:  # wants an inertia behind it, and a train that it can drive back
        inertia = "3 kg*m^2" if axis == "rotary" else "3 kg"
        tree["load"] = {**tree.get("load", {}), "path": "back-drivable", "inertia": inertia}
        if "friction" in tree:
            tree["friction"]["law"] = "coulomb"
    if "load" in tree and axis == "rotary" and draw(st.booleans()):
        tree["load"]["gravity"] = draw(_section("load.gravity", structure, {}))
    if "load" in tree and "coupling" in tree and draw(st.booleans()):
        tree["load"]["friction"] = draw(_section("load.friction", structure, {}))
    if draw(st.booleans()) and tree.get("friction", {}).get("law") != "tanh":
        points = [{"speed": 0.0, "torque": 2.0}, {"speed": 3.0, "torque": 3.0, "direction": "both"}]
        points = [
            {**p, "speed": f"{p['speed']} {angle}/s", "torque": f"{p['torque']} {torque}"} for p in points
        ]
        tree["friction"] = {**tree.get("friction", {}), "point": points}
        for key in ("dry_torque", "viscous"):
            tree["friction"].pop(key, None)
    tree["requirement"] = draw(_requirements(torque))
    tree["fact"] = draw(st.lists(st.fixed_dictionaries({"label": _texts, "value": _texts}), max_size=2))
    return tree


@st.composite
def _requirements(draw: st.DrawFn, torque: str) -> list[dict[str, Any]]:
    limits = {"gain_margin": "6.5 dB", "bandwidth": "90 rpm", "delay_margin": "3 ms", "overshoot": "12 %",
              "modulus_margin": 0.4, "motor_current": "400 mA"}  # fmt: skip
    result = []
    for i, quantity in enumerate(draw(st.lists(st.sampled_from(sorted(limits)), max_size=4))):
        item: dict[str, Any] = {"id": f"r{i}", "quantity": quantity, "source": draw(_texts)}
        item[draw(st.sampled_from(["minimum", "maximum"]))] = limits[quantity]
        if quantity == "motor_current":
            item["load"] = f"{draw(_factors)!r} {torque}"
        else:
            item["loop"] = "every"
        result.append(item)
    return result
