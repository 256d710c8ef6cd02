"""What a unit says of itself: units and sizes, worked out from the data sheets by hand; its picture."""

import io
import xml.etree.ElementTree as ET
import zipfile
from dataclasses import replace
from importlib.util import find_spec
from math import pi, sqrt
from typing import Any

import matplotlib.image
import pytest
from programs import needs_compiler

import reports.model_picture as model_picture
from actuator_lti import Design, load_design
from actuator_lti.design import shipped_designs, with_values
from nonlinear.export import fmu_bytes
from reports.model_picture import controller_boxes, model_png, train_boxes
from tests.changed import changed

# full deflection, ratio, top speed of the motor, its torque, current, voltage, largest load; None: unbounded
SIZES = {
    "ilr33-amber": (10 * pi / 180, 66 * 36, 942.5, 5.9e-3 * 4, 4.0, 12.0, 8.0),
    "joint": (30 * pi / 180, 100.0, 300.0, 0.12 * 6, 6.0, 48.0, 60.0),
    # 0.5 N m per A rms, and 4.4 A rms as the DC motor's 5.4 A; a lead of 10 mm
    "ballscrew": (0.05, 1.0, 3000 / 60 * 0.01, 0.5 / sqrt(1.5) * 5.4 * 2 * pi / 0.01, 5.4, 320.0, 800.0),
    "emps": (0.2, 1.0, None, 35.15065 * 10, None, 10.0, None),  # a force source of 35.15 N/V
    "ctms-motor-position": (pi / 2, 1.0, 12 / 0.0274, 0.0274 * 3, 12 / 4, 12.0, None),  # stalled: U/R
}
# exponents of kg, m, s, A, rad; what one rad, m, ... is in the unit that is shown
BASE = ("kg", "m", "s", "A", "rad")
UNITS = {
    "rad": (0, 0, 0, 0, 1), "rad/s": (0, 0, -1, 0, 1), "m": (0, 1, 0, 0, 0), "m/s": (0, 1, -1, 0, 0),
    "A": (0, 0, 0, 1, 0), "V": (1, 2, -3, -1, 0), "N": (1, 1, -2, 0, 0), "N*m": (1, 2, -2, 0, 0),
    "ohm": (1, 2, -3, -2, 0), "H": (1, 2, -2, -2, 0), "kg*m^2": (1, 2, 0, 0, 0), "kg": (1, 0, 0, 0, 0),
    "N*m/A": (1, 2, -2, -1, 0), "V*s/rad": (1, 2, -2, -1, -1), "N/A": (1, 1, -2, -1, 0), "s": (0, 0, 1, 0, 0),
    "A*s/rad": (0, 0, 1, 1, -1), "N*m*s/rad": (1, 2, -1, 0, -1), "1/s": (0, 0, -1, 0, 0),
}  # fmt: skip
SHOWN = {"deg": 180 / pi, "deg/s": 180 / pi, "rpm": 30 / pi, "mm": 1000.0}


def described(design: Design, version: int) -> ET.Element:
    with zipfile.ZipFile(io.BytesIO(fmu_bytes(design, version, ()))) as archive:
        return ET.fromstring(archive.read("modelDescription.xml"))


def variables(root: ET.Element) -> dict[str, dict[str, str]]:
    """Attributes of each variable by its name; of FMI 2 those of its type are an element of their own."""
    listed = root.find("ModelVariables")
    return {each.attrib["name"]: each.attrib | (each[0].attrib if len(each) else {}) for each in listed}


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("name", SIZES)
def test_sizes_and_units_are_those_of_the_data_sheet(name: str, version: int) -> None:
    known = variables(described(load_design(name), version))
    angle, ratio, speed, torque, current, voltage, load = SIZES[name]
    linear = name in ("ballscrew", "emps")
    turn, shown = ("m", "mm") if linear else ("rad", "deg")
    rate = (f"{turn}/s", None) if linear else ("rad/s", "deg/s")
    moment = "N" if linear else "N*m"
    spin, of_motor = ("m/s", None) if linear else ("rad/s", "rpm")
    wanted = {
        "motor.angle": (angle * ratio, turn, shown),
        "motor.speed": (speed, spin, of_motor),
        "motor.torque": (torque, moment, None),
        "motor.current": (current, "A", None),
        "motor.voltage": (voltage, "V", None),
        "output.angle": (angle, turn, shown),
        "output.rate": (speed and speed / ratio, *rate),
        "command": (angle, turn, shown),
        "hinge_moment": (load, moment, None),
        "supply_voltage": (voltage, "V", None),
        "control.current_command": (current, "A", None),
        "control.speed_command": (speed, spin, of_motor),
        "initial.angle": (None, turn, shown),
    }
    limit = known.get("limits.peak_current", {"description": ""})["description"]
    assert ("equivalent DC motor" in limit) == (name == "ballscrew")
    for each, (size, *units) in wanted.items():
        about = known[each]
        assert [about["unit"], about.get("displayUnit")] == units, each
        alternating = name == "ballscrew" and about["unit"] in ("A", "V")
        assert about["description"].endswith(", of the equivalent DC motor") == alternating
        nominal = float(about["nominal"]) if "nominal" in about else None
        assert nominal == (None if size is None else pytest.approx(size, rel=1e-6)), each


@pytest.mark.parametrize("version", [2, 3])
def test_the_command_is_that_of_the_outermost_stage_any_step_is_allowed_and_the_period_is_said(version: int):
    root = described(changed(load_design("ilr33-amber"), controller={"position": None}), version)
    command = variables(root)["command"]
    assert (command["unit"], command["displayUnit"]) == ("rad/s", "deg/s")
    assert float(command["nominal"]) == pytest.approx(942.5 / 2376, rel=1e-12)
    simulation = root.find("CoSimulation").attrib
    assert simulation["canHandleVariableCommunicationStepSize"] == "true"
    assert simulation.get("fixedInternalStepSize") == ("0.0001" if version == 3 else None)


@pytest.mark.parametrize("version", [2, 3])
def test_units_are_defined_by_the_base_units_of_si(version: int) -> None:
    seen: set[str] = set()
    for name in SIZES:
        root = described(load_design(name), version)
        defined = {unit.attrib["name"]: unit for unit in root.iter("Unit")}
        used = {v["unit"] for v in variables(root).values() if "unit" in v}
        assert used == set(defined)
        for unit in set(defined) & set(UNITS):
            base, *shown = defined[unit]
            assert tuple(int(base.attrib.get(each, "0")) for each in BASE) == UNITS[unit]
            assert float(base.attrib.get("factor", "1")) == 1.0
            for each in shown:
                assert float(each.attrib["factor"]) == pytest.approx(SHOWN[each.attrib["name"]], rel=1e-15)
            seen |= {unit, *(each.attrib["name"] for each in shown)}
    assert seen == {*UNITS, *SHOWN}


needs_typesetter = pytest.mark.skipif(find_spec("typst") is None, reason="typst is not installed")


@pytest.mark.parametrize("name", shipped_designs())
def test_every_stage_and_gear_has_its_box(name: str) -> None:
    design = load_design(name)
    boxes = dict(controller_boxes(design)) | dict(train_boxes(design))
    stages = {s for s in ("position", "velocity", "current") if getattr(design.controller, s) is not None}
    assert {"motor", "load", *stages, *(gear.name for gear in design.gears)} <= set(boxes)
    assert ("coupling" in boxes) == (design.coupling is not None)
    assert not [value for value in boxes.values() if "inf" in value]


def test_the_coupling_stands_behind_its_gear() -> None:
    design = load_design("fin")
    assert [title for title, _ in train_boxes(design)] == ["motor", "spur", "coupling", "load"]
    inside = replace(design, gears=(*design.gears, replace(design.gears[0], name="belt")))
    inside = replace(inside, coupling=replace(inside.coupling, after="spur"))
    assert [title for title, _ in train_boxes(inside)] == ["motor", "spur", "coupling", "belt", "load"]
    motor = replace(inside, gears=(), coupling=replace(inside.coupling, after=None))
    assert [title for title, _ in train_boxes(motor)] == ["motor", "coupling", "load"]
    sliding = with_values(load_design("ballscrew"), {"coupling.play": 1e-4})
    assert dict(train_boxes(sliding))["coupling"] == "play 0.1 mm"


@needs_typesetter
def test_names_cannot_break_the_picture() -> None:
    design = replace(load_design("fin"), name='a<b>&"c', title="x" * 300)
    made = matplotlib.image.imread(io.BytesIO(model_png(design)))
    assert made.shape[:2] == (512, 1280)
    assert made.std() > 0.05  # something is drawn


@needs_typesetter
@needs_compiler
@pytest.mark.parametrize(("version", "name"), [(2, "model.png"), (3, "documentation/diagram.png")])
def test_units_carry_it(version: Any, name: str) -> None:
    design = load_design("ctms-motor-position")
    data = fmu_bytes(design, version, ("linux64",), picture=model_png(design))
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        assert archive.read(name).startswith(b"\x89PNG")


def test_without_the_typesetter_there_is_none(monkeypatch) -> None:
    monkeypatch.setattr(model_picture, "find_spec", lambda _: None)
    assert model_png(load_design("fin")) is None
