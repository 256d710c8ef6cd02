"""A declared analysis: its options are the fields of the request, its JSON the names of the result."""

import cmath
import json
from dataclasses import fields, is_dataclass

import pytest

from actuator_lti.design import design_hash, load_design
from analyses.request import flag, options
from analyses.stiffness import Stiffness, stiffness
from reports.analyses import ANALYSES, FURTHER, Analysis
from reports.as_json import as_json
from reports.cli.app import PANELS
from reports.document import load
from tests.command_line import commands

COMMANDS = commands()


@pytest.mark.parametrize("one", ANALYSES, ids=lambda one: one.name)
def test_every_field_of_a_request_is_an_option_of_the_command(one: Analysis) -> None:
    given = {parameter.name: parameter for parameter in COMMANDS[one.name].params}
    common = {"as_json", "quiet", *(["example"] if one.example else [])}
    common |= set() if one.alone else {"design", "changes"} | ({"out"} if one.page else set())
    if one.request is None:
        assert set(given) == common
        return
    assert is_dataclass(one.request)
    asked = options(one.request)
    assert set(asked) == {field.name for field in fields(one.request)} == set(given) - common
    for name, (_, option) in asked.items():
        own = given[name]
        assert own.help.startswith(option.words)
        if not option.argument:
            assert own.opts == [f"--{(option.flag or flag(name)).partition('/')[0]}"]


def test_a_declared_analysis_stands_in_its_group_and_in_the_report() -> None:
    for one in ANALYSES:
        assert one.name.split()[0] in PANELS[one.group]
    also = next(parameter for parameter in COMMANDS["report"].params if parameter.name == "also")
    assert all(name in also.help for name in FURTHER)


def test_the_json_of_a_result_is_its_fields_and_properties() -> None:
    design = load_design("emps")
    result = stiffness(design)
    told, derived = as_json(result), {"verdict", "passed", "lost_motion_difference"}
    assert set(told) == {field.name for field in fields(Stiffness)} | derived
    assert told["design"] == {"name": "emps", "hash": design_hash(design)}
    own, seen = told["checks"][0], result.checks[0]
    size, phase_deg = (own["foreseen_Nm_rad"][key] for key in ("size", "phase_deg"))
    number = cmath.rect(size, cmath.pi * phase_deg / 180.0)
    assert number == pytest.approx(seen.foreseen_Nm_rad, rel=1e-12)
    assert own["difference"] == seen.difference
    json.dumps(told, allow_nan=False)


def test_the_page_of_a_command_is_its_section(tmp_path, cli) -> None:
    shown = cli.text("stiffness", "emps", "--out", tmp_path, "--quiet")
    first = load(tmp_path / "stiffness.json")["sections"][0]
    assert shown.splitlines()[0] == f"PASS  emps: {first['result']}"
    assert "<svg" in (tmp_path / "stiffness.html").read_text(encoding="utf-8")
    for block in first["blocks"]:
        if block["kind"] == "table":
            assert block["caption"] in shown
