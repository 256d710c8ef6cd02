"""The picture of a unit: every part of the design is in it, and every design has one."""

import io
import zipfile
from dataclasses import replace
from importlib.util import find_spec
from typing import Any

import matplotlib.image
import pytest
from programs import needs_compiler

import reports.model_picture as model_picture
from actuator_lti.design import load_design, shipped_designs
from nonlinear.export import fmu_bytes
from reports.model_picture import HEIGHT, WIDTH, model_png, model_svg, train_boxes

needs_typesetter = pytest.mark.skipif(find_spec("typst") is None, reason="typst is not installed")


@pytest.mark.parametrize("name", shipped_designs())
def test_every_stage_and_gear_has_its_box(name: str) -> None:
    design = load_design(name)
    svg = model_svg(design)
    stages = {s for s in ("position", "velocity", "current") if getattr(design.controller, s) is not None}
    for word in (design.name, "motor", "load", *stages, *(gear.name for gear in design.gears)):
        assert f">{word}</text>" in svg
    assert (">coupling</text>" in svg) == (design.coupling is not None)
    assert "inf" not in svg.replace("information", "")


def test_the_coupling_stands_behind_its_gear() -> None:
    design = load_design("fin")
    assert [title for title, _ in train_boxes(design)] == ["motor", "spur", "coupling", "load"]
    inside = replace(design, gears=(*design.gears, replace(design.gears[0], name="belt")))
    inside = replace(inside, coupling=replace(inside.coupling, after="spur"))
    assert [title for title, _ in train_boxes(inside)] == ["motor", "spur", "coupling", "belt", "load"]
    motor = replace(inside, gears=(), coupling=replace(inside.coupling, after=None))
    assert [title for title, _ in train_boxes(motor)] == ["motor", "coupling", "load"]


@needs_typesetter
def test_names_cannot_break_the_picture() -> None:
    design = replace(load_design("fin"), name='a<b>&"c', title="x" * 300)
    made = matplotlib.image.imread(io.BytesIO(model_png(design)))
    assert made.shape[:2] == (2 * HEIGHT, 2 * WIDTH)
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
