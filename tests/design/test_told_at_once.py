"""Mistakes of all kinds are told in one run: what cannot be read hides no relation that does not need it."""

import copy
from typing import Any

import pytest
from test_fuzz import leaves

from actuator_lti.design import design_tree, load_design
from actuator_lti.design.loader import design_from_tree, design_text
from actuator_lti.design.writing import override
from actuator_lti.errors import InputError, Mistakes
from analyses.studies.study import load_study
from tests.refusals import mistakes

AMBER = load_design("ilr33-amber")
RATIO = {"gear.planetary.ratio", "gear.worm.ratio"}
TOP_SPEED = {"limits.speed", "limits.voltage"}  # kE is as kM has it where it is not read
FILTER = "control.velocity.filter"
LAW = {"inputs": ["error"], "D": [60.0], "period": "1 ms"}

# what is written, what is then refused, and all keys that decide it (docs/model.md)
RELATIONS: list[tuple[dict[str, Any], str, set[str]]] = [
    ({"control.velocity.every": 2, "control.position.every": 3}, "control.position.every",
     {"control.velocity.every", "control.position.every"}),
    ({"control.computing_delay": "20 ms"}, "control.computing_delay",
     {"control.computing_delay", "control.period"}),
    ({"limits.continuous_current": "14 A"}, "limits.continuous_current",
     {"limits.continuous_current", "limits.peak_current"}),
    ({"limits.peak_time": "1 s"}, "limits.peak_time",
     {"limits.peak_time", "limits.continuous_current", "limits.peak_current"}),
    ({"load.gear_error": "1 N*m", "load.gear_error_periods": 1e6}, "load.gear_error_periods",
     {"load.gear_error", "load.gear_error_periods", "control.period", *TOP_SPEED, *RATIO}),
    ({"command.rate": "900 deg/s"}, "command.rate", {"command.rate", "limits.speed", *RATIO}),
    ({"command.jerk": "1 rad/s^3"}, "command.jerk", {"command.jerk"}),
    ({"command.filter_time": "31 us"}, "command.filter_time",
     {"command.filter_time", "control.position.every", "control.period"}),
    ({"supply.brake_voltage": "5 V"}, "supply.brake_voltage", {"supply.brake_voltage", "limits.voltage"}),
    ({"supply.regenerative": False}, "supply.regenerative", {"supply.regenerative"}),
    ({"encoder.speed": "tracking", "encoder.bandwidth": "9 kHz"}, "encoder.bandwidth",
     {"encoder.speed", "encoder.bandwidth", "control.velocity.every", "control.period"}),
    ({FILTER: [{"kind": "lowpass", "frequency": "10 kHz"}, {"kind": "notch", "frequency": "1 Hz"}]},
     f"{FILTER}.1.frequency",
     {f"{FILTER}.1.frequency", f"{FILTER}.1.kind", "control.velocity.every", "control.period"}),
    ({}, f"{FILTER}.2.width", {f"{FILTER}.2.kind"}),
    ({"instruments.jitter": "50 us"}, "instruments.jitter", {"instruments.jitter", "control.period"}),
    ({"coupling.stiffness": "100 N*m/rad", "friction.load_coefficient": 1e-9}, "friction.load_coefficient",
     {"friction.load_coefficient", "load.path", *RATIO}),
    ({"coupling.torque_1": "1 N*m"}, "coupling.torque_1", {"coupling.torque_1"}),
    ({"control.position.law": LAW}, "control.position.law.period",
     {"control.position.law.period", "control.position.every", "control.period"}),
]  # fmt: skip


def _told(tree: Any) -> set[str]:
    with pytest.raises(InputError) as caught:
        design_from_tree(tree, "my.toml")
    errors = caught.value.mistakes if isinstance(caught.value, Mistakes) else (caught.value,)
    return {error.message.partition(" = ")[0].partition(":")[0] for error in errors}


@pytest.fixture(scope="module")
def contradicted() -> Any:
    tree = design_tree(AMBER)
    for written, *_ in RELATIONS:
        for path, value in written.items():
            override(tree, path, value, AMBER)
    del tree["control"]["position"]["gain"]
    assert _told(tree) == {path for _, path, _ in RELATIONS}
    with pytest.raises(Mistakes) as caught:
        design_from_tree(tree, "my.toml")
    assert all(words in str(caught.value) for words in (
        "every = 3: allowed: a multiple of control.velocity.every = 2", "at most 100 ticks of",
        "limits.peak_current = 12 A", "peak_current above continuous", "faster than limits.speed",
        "needs command.acceleration",
        "filter_time = 31 us: allowed: 0, or above T/pi of the outermost loop, 9.5493e-05 s",  # 3 ticks
        "needs supply.capacitance", "too fast for its period", "a tenth of a tick",
    ))  # fmt: skip
    return tree


@pytest.mark.parametrize("manner", ["unreadable", "misspelled"])
def test_what_is_not_read_hides_what_needs_it_and_nothing_else(contradicted: Any, manner: str) -> None:
    for path, *_ in leaves(contradicted):
        tree = copy.deepcopy(contradicted)
        _, table, key = next(leaf for leaf in leaves(tree) if leaf[0] == path)
        wrong = key if manner == "unreadable" else f"{key}{key[-1]}"
        table[wrong] = table.pop(key) if manner == "misspelled" else [{}]
        others = {relation for _, relation, needs in RELATIONS if path not in needs}
        assert _told(tree) == {path.removesuffix(key) + wrong} | others, path


def test_three_unreadable_values_and_three_contradictions_are_told_in_one_run() -> None:
    text = design_text("ilr33-amber")
    wrong = {
        "motor.inductance": ('value = "6 uH"', 'value = "6 ohm"'),
        "gear.worm.ratio": ("value = 36", "value = -36"),
        "control.velocity.gain": ('"0.12 A*s/rad"', '"0.12 A"'),
        "motor.back_emf_constant": ('"5.9 mV*s/rad"', '"7 mV*s/rad"'),
        "limits.continuous_current": ('value = "4 A", source', 'value = "14 A", source'),
        "control.computing_delay": ('delay = { value = "100 us"', 'delay = { value = "20 ms"'),
    }
    for old, new in wrong.values():
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    lines = text.split("\n")
    told = mistakes(text).split("\n")
    assert {line.split(" = ")[0] for line in told} == {
        f"my.toml: line {next(k for k, line in enumerate(lines, 1) if new in line)}: {path}"
        for path, (_, new) in wrong.items()
    }
    assert told == sorted(told, key=lambda line: int(line.split(":")[1].split()[1]))


KE, KM = 'back_emf_constant = { value = "5.9 mV*s/rad"', 'torque_constant = { value = "5.9 mN*m/A"'


@pytest.mark.parametrize(("key", "old", "new", "top_rad_s"), [
    ("motor.back_emf_constant", KE, KE.replace("s/rad", "A"), 12 / 5.9e-3),
    ("motor.back_emf_constant", KE, f"#{KE}", 12 / 5.9e-3),
    ("motor.back_emf_constant", KE, KE.replace("mV", "V"), 12 / 5.9e-3),
    # 2/3 of kM, as the constants of a dq model are: kE is sqrt(3) as large, volts line-line (model.md)
    ("motor.back_emf_constant", KE, KE.replace("5.9", "3.93"), 12 / (3**0.5 * 3.93e-3)),
    ("motor.torque_constant", KM, f"#{KM}", 12 / 5.9e-3),
    ("motor.torque_constant", KM, KM.replace("/A", ""), 12 / 5.9e-3),
    ("motor.inductance", "inductance = ", "# inductance = ", 12 / 5.9e-3),
])  # fmt: skip
def test_a_motor_with_a_mistake_does_not_hide_what_its_top_speed_refuses(key, old, new, top_rad_s) -> None:
    """30 000 rpm are more than the supply gives; 3e5 periods over a turn are too many at what it gives."""
    text = design_text("ilr33-amber").replace('"942.5 rad/s"', '"30000 rpm"')
    text = text.replace("[load]", '[load]\ngear_error = "1 N*m"\ngear_error_periods = 300000')
    assert text.count(old) == 1
    wrong, periods = sorted(mistakes(text.replace(old, new)).split("\n"), key=lambda line: "periods" in line)
    assert key in wrong
    assert f" rad at {top_rad_s / AMBER.total_ratio:.4g} rad/s, " in periods


REQUIREMENTS = """
[[requirement]]
id = "a"
quantity = "phase_margn"
loop = "positon"
rotor = "locked"
minimum = "30 mm"
colour = "red"
[[requirement]]
id = ""
quantity = "overshoot"
loop = "spin"
maximum = "-3 %"
to = "reference"
[[requirement]]
quantity = "rise_time"
loop = "position"
minimum = "30 ms"
maximum = "20 ms"
rotor = "free"
"""
WRONG = {
    "quantity": (3, "phase_margin"), "loop": (4, "every, position"), "rotor": (5, "current loop only"),
    "minimum": (6, "deg"), "colour": (7, "unknown key"), "[2].id": (9, "allowed: a text"),
    "[2].loop": (11, "every, position"), "[2].maximum": (12, "at least 0 %"),
    "[2].to": (13, "position loop only"),
    "[3].id": (14, "missing"), "[3].minimum": (17, "at most maximum = 20 ms"),
    "[3].rotor": (19, "current loop only"),
}  # fmt: skip


@pytest.mark.parametrize("study", [False, True])
def test_all_mistakes_of_requirements_are_told_with_their_lines(study: bool, tmp_path: Any) -> None:
    head = '[study]\nbase = "emps"' if study else design_text("emps").partition("[[requirement]]")[0]
    path = tmp_path / "my.toml"
    path.write_text(head + REQUIREMENTS, encoding="utf-8")
    with pytest.raises(Mistakes) as caught:
        (load_study if study else load_design)(path)
    told, above = str(caught.value).split("\n"), head.count("\n") + 1
    assert len(told) == len(WRONG)
    for (key, (line, words)), said in zip(WRONG.items(), told, strict=True):
        assert f"my.toml: line {above + line}: requirement" in said
        assert f".{key}".replace(".[", "[") in said
        assert words in said


GEAR = "[[gear]]\nratio = 2\nefficiency = 0.8\n\n[limits]"


@pytest.mark.parametrize(("name", "old", "new", "only"), [
    ("emps", "[limits]", GEAR, "gear[1].name: missing"),
    ("ilr33-amber", "[limits]", "[temperature]\nmagnet = '1000 degC'\n[limits]", "temperature.magnet"),
    ("emps", 'axis = "linear"', 'axis = "lineare"', "design.axis"),
    ("ilr33-amber", "[control.current]", "[control.curent]", "control.curent"),
    ("ballscrew", "torque_constant", "torque_const", "motor.torque_const"),
])  # fmt: skip
def test_one_mistake_is_told_as_one(name: str, old: str, new: str, only: str) -> None:
    text = design_text(name)
    assert old in text
    lines = mistakes(text.replace(old, new, 1)).split("\n")
    assert [only in line for line in lines] == [True], lines


def test_no_mistake_hides_another_or_ends_in_a_traceback() -> None:
    """A pair where nothing has a tolerance; a coupling after no gear beside a load that is no table."""
    pair = {"first": "motor.resistance", "second": "motor.inductance", "coefficient": 0.5}
    with pytest.raises(Mistakes, match="no value has a tolerance"):
        load_design("ctms-motor-position").with_values({"correlation": [pair]})
    tree = {**design_tree(AMBER), "load": "heavy", "coupling": {"stiffness": "4 N*m/rad", "after": "x"}}
    with pytest.raises(Mistakes) as told:
        design_from_tree(tree, "f")
    assert [key in str(told.value) for key in ("load = ", "coupling.after = ")] == [True, True]
    # whether a gear without a name locks behind the coupling; a bandwidth where there is no motor's loop
    (line,) = mistakes(design_text("ilr33-amber-compliant") + "[[gear]]\nratio = 2\n").split("\n")
    assert "gear[3].name: missing" in line
    lines = mistakes(design_text("emps") + '[control.current]\ngain = "500 Hz"\n').split("\n")
    assert any("control.current = a table: not allowed with motor.source_gain" in line for line in lines)
