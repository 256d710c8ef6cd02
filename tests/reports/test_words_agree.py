"""Two places of a report that speak of one thing say the same."""

import re
from dataclasses import replace
from math import pi
from typing import Any

import numpy as np
import pytest

from actuator_lti import assemble_loops, stability_margins
from actuator_lti.design import load_design, with_values
from actuator_lti.design.model import Coupling
from analyses.large_signal.result import LimitShift
from analyses.limit_cycles import LimitCycles
from analyses.linear.loop_survey import operating_points
from analyses.margins import Asked as MarginsAsked
from analyses.margins import margins
from analyses.motion.settling import Settling
from analyses.specification.requirements import which_response
from analyses.specification.weakest import spread
from analyses.validation.places import Bench
from analyses.validation.row import Row, judged
from nonlinear.settling.rest import Rest
from reports import document as doc
from reports.as_json import as_json
from reports.build import further_sections
from reports.sections import validation
from reports.sections.answer import believed
from reports.sections.cycles import section as cycles_section
from reports.sections.large_signal import _shift_table
from reports.sections.margins import DOWNWARDS, brief, margin_table, result, spread_table
from reports.sections.names import Unit
from reports.terminal import print_blocks
from tests.changed import changed

SHAPED = {"filter_time": 0.01, "rate": 0.3, "acceleration": 10.0, "jerk": 100.0}
SHAPED = {f"command.{key}": value for key, value in SHAPED.items()}
INCLUDED = {"": {}, ": feed-forward included": {"control.position.feedforward": 1.0}}
INCLUDED |= {": mean of its profile and filter included": SHAPED}


def test_a_margin_that_goes_with_the_hold_of_a_torque_says_what_it_is_in_the_motor() -> None:
    """The continuous form, with the delays of the controller and no held torque, is its other writing."""
    cogging = {"cogging_Nm": 0.02, "cogging_periods": 100.0, "cogging_phase_rad": pi}
    design = changed(load_design("fin"), motor=cogging, load={"moment_slope_Nm_rad": 0.0})
    known = margins(design).loops["velocity"]
    note = next(one for one in known.notes if "acted at every instant" in one)
    there = float(re.search(r"phase margin (\S+) deg if cogging", note)[1])
    held = known.margins.phase_margin_deg
    continuous = stability_margins(assemble_loops(design, form="continuous").velocity.open_loop)
    assert there == pytest.approx(continuous.phase_margin_deg, abs=0.1)
    assert held < continuous.phase_margin_deg - 3.0
    slack = {"cogging_Nm": 5e-4}
    assert not any("instant" in one for one in margins(changed(design, motor=slack)).loops["position"].notes)


def test_margins_that_the_smoothing_of_dry_friction_decides_say_those_without_it() -> None:
    """Over 1e9 rad/s it has no slope left: then rest is as sliding, and the note's margin that at rest."""
    amber, rest = load_design("ilr33-amber"), MarginsAsked(operating_point="rest")
    (note,) = (one for one in brief(margins(amber)).notes if "smoothing_speed (not given)" in one)
    wide = margins(with_values(amber, {"friction.smoothing_speed": 1e9}), rest)
    for name, said in re.findall(r"(\w+) loop (\S+) deg", note) or pytest.fail(note):
        assert float(said) == pytest.approx(wide.loops[name].margins.phase_margin_deg, abs=0.006)
    assert not any("smoothing" in one for one in brief(margins(load_design("ilr33-amber-tanh"))).notes)


def test_a_gain_margin_has_one_sign_in_all_tables() -> None:
    """A slow position integral: held by the load's friction, the gain may fall by 3.6 dB, not rise."""
    design = with_values(load_design("ilr33-amber"), {"control.position.integral_time": 0.12})
    loop = assemble_loops(design, operating_point="rest", load_Nm=8.0).position
    downwards = stability_margins(loop.open_loop).gain_margin_db
    assert downwards == pytest.approx(-3.64, abs=0.005)
    points = operating_points(design, [], described=False, certify=False)
    held_at = "at rest, dry friction over 1 rad/s, load 8 N m"
    found = spread(points)["position"]["gain_margin"]
    assert (found.least, found.where) == (pytest.approx(downwards), held_at)
    held = next(one for one in points if one.place == held_at).figures
    table, quoted = spread_table(points, points[0].figures), margin_table(held)
    row, own = (next(r for r in one["rows"] if r["loop"] == "position") for one in (table, quoted))
    assert row["gain"] == f"down to −3.64 ({held_at}) to 43.3"
    assert own["gain_margin_db"] == pytest.approx(downwards)
    assert "the smallest gain margin is down to −3.6 dB (position loop)" in result(held)
    told = (table, quoted, margin_table(points[0].figures))
    assert [one["note"].endswith(DOWNWARDS) for one in told] == [True, True, False]


def test_a_loop_that_is_not_known_to_be_stable_somewhere_is_not_called_unstable_there() -> None:
    points = operating_points(load_design("ilr33-amber"), [], described=False, certify=False)
    name = next(iter(points[-1].figures))
    for point, stable in zip(points[:2], (False, None), strict=True):
        figures = point.figures[name]
        point.figures[name] = replace(figures, margins=replace(figures.margins, stable=stable))
    row = spread_table(points, points[-1].figures)["rows"][0]
    places = [point.place or "sliding" for point in points[:2]]
    assert row["gain"] == f"not stable {places[0]}; stability not known {places[1]}"


@pytest.mark.parametrize(("point", "other"), [("rest", True), ("sliding", False)])
def test_requirements_beside_other_loops_say_on_which_they_are_judged(point: str, other: bool, cli) -> None:
    """At rest under 8 N m the loop has 3.6 dB and 5.3 deg; sliding, as it is judged, 27 dB and 75 deg."""
    slow = ["--set", "control.position.integral_time=0.12 s"]
    said = cli.text("margins", "ilr33-amber", *slow, "--operating-point", point, "--load", "8")
    wanted = "12 of 12 requirements met. Judged on the sampled loops with sliding friction, without a load."
    assert (wanted in " ".join(said.split())) is other


def test_all_that_is_said_sliding_is_of_one_load_where_that_bends_a_spring() -> None:
    """Requirements beside it are those of the piece without a load, K1; the load presses it onto K3."""
    keys = {"coupling.torque_1": 14.0, "coupling.stiffness_2": 3.5e4, "coupling.torque_2": 48.0}
    design = load_design("joint").with_values({**keys, "coupling.stiffness_3": 6e4})
    found = margins(design, MarginsAsked(load_Nm=60.0))
    stiff = margins(replace(design, coupling=Coupling(stiffness_Nm_rad=6e4, damping_Nms_rad=11.0)))
    for loops in (found.loops, found.operating_points[0].figures):
        one, other = (each["position"].margins.gain_margin_db for each in (loops, stiff.loops))
        assert one == pytest.approx(other, rel=1e-9)
    judged, plain = ([one.value for one in each.requirements] for each in (found, margins(design)))
    assert judged == pytest.approx(plain, rel=1e-9)
    assert "with sliding friction, without a load." in brief(found).words


def test_a_bandwidth_says_by_its_name_of_which_response_it_is() -> None:
    """Behind a filter of 1 s the command is followed to 1/(2 pi) Hz; the loop does not know of the filter."""
    design = with_values(load_design("ilr33-amber"), {"command.filter_time": 1.0})
    to_command = as_json(margins(design))["loops"]["position"]
    tested = as_json(Bench(design, design).figures)["position"]
    alone = as_json(Bench(load_design("ilr33-amber"), load_design("ilr33-amber")).figures)["position"]
    assert to_command["bandwidth_hz"] == pytest.approx(1.0 / (2.0 * pi), rel=1e-3)
    assert tested["feedback_bandwidth_hz"] == alone["feedback_bandwidth_hz"] > 10.0
    assert ("bandwidth_hz" in tested, "feedback_bandwidth_hz" in to_command) == (False, False)
    assert {name for name in tested if name.startswith("feedback_")} == {
        f"feedback_{name}" for name in set(to_command) - set(tested) - {"to_reference"}
    }


@pytest.mark.parametrize("parts", INCLUDED)
def test_a_response_to_the_command_names_what_the_drive_has(parts: str) -> None:
    design = with_values(load_design("ilr33-amber"), INCLUDED[parts])
    said = which_response("bandwidth", "position", "command", design)
    assert said == f"of the response to the command{parts}"


def test_a_section_that_a_drive_cannot_have_says_why_in_one_sentence() -> None:
    (made,) = further_sections(load_design("emps"), ["duty"])
    assert made["result"] == "Not for this drive: an ideal torque source has no current."


def test_a_current_loop_says_how_its_rotor_stands() -> None:
    """With a locked rotor no friction and no load acts: one loop, on the bench and in margins."""
    design = load_design("ilr33-amber")
    free = as_json(margins(design))["loops"]["current"]
    tested = as_json(Bench(design, design).figures)["current"]
    assert (free["rotor"], free["rotor_locked"]["rotor"], tested["rotor"]) == ("free", "locked", "locked")
    assert tested["phase_margin_deg"] == pytest.approx(free["rotor_locked"]["phase_margin_deg"], abs=1e-9)
    assert free["phase_margin_deg"] != pytest.approx(tested["phase_margin_deg"], abs=1e-3)


def test_the_first_screen_counts_what_is_not_met() -> None:
    items = [doc.verdict(str(passed), "check", passed=passed) for passed in (True, False, None)]
    part = doc.section("any", "Any", [doc.verdicts(items, what="checks")])
    assert believed([part]) == "1 of 3 checks by simulation met; 1 not met; 1 not proven."


def test_terminal_and_page_round_a_number_once(capsys: pytest.CaptureFixture[str]) -> None:
    """10.05503 Hz has five certain digits, 10.055; four of these are 10.05, of all of it 10.06."""
    block = doc.table("Resonance", [doc.column("resonance_hz", "at", "Hz", format="sig:4")], [(10.05503,)])
    page = doc.certain(block)["rows"][0]["resonance_hz"]
    print_blocks([block])
    assert f"{page:.2f}" in capsys.readouterr().out


def predicted(*rows: Row) -> list[Any]:
    return validation.table(list(rows), "")["rows"]


def test_predictions_tell_seconds_and_decibels_as_elsewhere() -> None:
    times = predicted(*(judged("time", "drive", t, t, 1e-6, unit="s") for t in (67.8295, 0.0023)))
    assert [(row["predicted"], row["unit"]) for row in times] == [(67.8295, "s"), (2.3, "ms")]
    gains = (judged("gain_margin", "velocity", of, of, 1e-9, unit="1") for of in (4.0, 0.5))
    names = [row["quantity"] for row in predicted(*gains)]
    assert names == ["gain margin, 12.04 dB", "gain margin, down to −6.02 dB"]  # 20 log10 4, 20 log10 1/2


@pytest.mark.parametrize(("error", "allowed"), [(0.0, 9.112e-11), (1.3e-10, 1.35e-10), (2e-10, 1e-10)])
def test_what_bounds_an_error_does_not_contradict_its_verdict(error: float, allowed: float) -> None:
    """A value of 1 N m: rounding of 1e-9 of it would pass what is allowed."""
    (row,) = predicted(judged("coupling_torque", "drive", 1.0, 1.0 + error, allowed, unit="N*m"))
    assert (row["error"] <= row["allowed"]) == (row["verdict"] == "met") == (error < allowed)


def test_friction_is_not_blamed_for_another_limit() -> None:
    """At the second frequency the protection was predicted and the current limit came first: no shift."""
    sizes = map(np.array, ([1.0, 5.0], [0.1, 0.2], [0.11, 0.3]))
    shift = LimitShift(*sizes, ("current", "overload"), ("current", "current"), 1e-3)
    table = _shift_table(shift, load_design("ilr33-amber"), Unit(1.0, "rad"))
    assert [row["shift"] for row in table["rows"]] == [pytest.approx(10.0), None]
    assert "overload protection takes longer" in table["note"]


def test_a_drive_that_stands_still_unproven_is_not_said_to_rest_after_every_step() -> None:
    size = dict.fromkeys(("error", "amplitude", "motor_amplitude"), 0.0)
    about = {"frequency_hz": None, "periods": 0, "limited": (), "after_s": 319000.0, "work": 1}
    rest = Rest(verdict="still moving", **size, **about)
    steps = (Settling(1e-3, 0.0, rest), Settling(0.1, 0.0, replace(rest, verdict="at rest")))
    made = cycles_section(LimitCycles(load_design("ilr33-amber"), (), steps, ()))
    assert made["result"] == (
        "The drive as it is comes to rest after every step, but after 57.3 mdeg it stands still 319000 s "
        "later; whether it stays is not known; no cycle is predicted."
    )
    ends = [row["end"] for row in made["blocks"][-1]["rows"]]
    assert ends == ["stands still, not known for how long", "at rest"]


def test_a_linear_axis_is_told_in_metres_and_newtons(cli) -> None:
    """Angles, torques and inertias are no names of what a force moves; frequencies stay in rad/s."""
    for name, *more in (("failures", "--duration", "0.1"), ("cycles",), ("stiffness",), ("margins",)):
        names = re.findall(r'"(\w+)":', cli(name, "ballscrew", *more, "--json").out)
        turning = re.compile(r"(?<!frequency)(?<!band)_rad(_s2?)?$|Nm|kgm2")
        assert not any(map(turning.search, names)), name
    words = cli("validate", "emps").out
    assert "steady force" in words
    assert "torque" not in words.lower()
