"""Every shipped design has sliders that act on its loops: elastic, with play, multirate, friction map."""

import json
from dataclasses import replace

import numpy as np
import pytest
from live_page import AMBER, FIGURES, agree, answered_within_two_clicks, command_line, verdicts_agree

from actuator_lti import assemble_loops, stability_margins
from actuator_lti.batch import Population, linear_figures
from actuator_lti.design import load_design, parameter_value, shipped_designs, with_values
from actuator_lti.design.access import paths_of
from actuator_lti.design.asked import FrozenMap
from actuator_lti.design.model import Command, Friction, FrictionPoint, Requirement
from analyses.large_signal.classify import CAUSES, causes
from analyses.linear.loop_survey import operating_points
from nonlinear import Rows
from nonlinear.export.trace import Tape, reached
from reports.as_json import loop_json
from reports.live.charts import live_charts
from reports.live.model import live_model
from tests.reports import test_held_loops
from tests.validation.random_drives import full_drive

ASKED = (
    ("output_rate", "deg/s", 60.0, 20.0),
    ("motor_current", "A", None, None),
    ("acceleration", "deg/s^2", 1e3, 20.0),
    ("torque_margin", "1", 2.0, 20.0),
    ("lost_motion", "deg", None, None),
)
WHOLE_DRIVE = tuple(
    Requirement(id=f"r{k}", quantity=name, unit=unit, load_Nm=load, minimum=low,
                maximum=9.0 if low is None else None)
    for k, (name, unit, low, load) in enumerate(ASKED)
)  # fmt: skip
CHARTS = ["bode", "nyquist", "sensitivity", "step", "run", "linear-limit", "difference"]
EVERY = Requirement(id="pm", quantity="phase_margin", unit="deg", loop="every", minimum=10.0)
CURVE = ((0.0, 3e-3), (40.0, 2e-3), (900.0, 4e-3))
POINTS = tuple(FrictionPoint(speed_rad_s=speed, torque_Nm=torque) for speed, torque in CURVE)
BOTH = Command(rate_rad_s=0.3, acceleration_rad_s2=20.0, jerk_rad_s3=2000.0, filter_time_s=2e-3)
DESIGNS = {name: load_design(name) for name in shipped_designs()} | {
    "with a friction map": replace(AMBER, name="mapped", friction=Friction(points=POINTS)),
    "with requirements on the whole drive": replace(load_design("fin"), requirements=WHOLE_DRIVE),
    "with a filter of the command": with_values(AMBER, {"command.filter_time": 2e-3}),
    "behind a mean and a filter": replace(AMBER, command=BOTH),
    # the report judges its current and velocity loops held, the current loop, and none
    "with a load that pushes": replace(test_held_loops.p_velocity(1.0), requirements=(EVERY,)),
    "with falling friction": replace(test_held_loops.falling_friction(), requirements=(EVERY,)),
    "fed too much": replace(test_held_loops.overfed(), parameters=FrozenMap({})),
}
CHANGES = {  # in the units of the page
    "ilr33-amber": {"control.position.gain": 140.0, "control.computing_delay": 137.5,
                    "motor.resistance": 61.0, "encoder.filter_time": 0.4e-3},
    "ballscrew": {"coupling.stiffness": 60.0, "coupling.play": 3e-6, "load.inertia": 90.0},
    "ctms-motor-position": {"control.position.gain": 15.0},
    "emps": {"control.velocity.gain": 300.0, "encoder.difference_samples": 3},
    "fin": {"coupling.stiffness": 9000.0, "coupling.damping": 3.0},
    "ilr33-amber-compliant": {"coupling.stiffness": 300.0, "coupling.play": 0.2},
    "ilr33-amber-multirate": {"control.velocity.gain": 0.02, "control.position.every": 6},
    "ilr33-amber-tanh": {"friction.viscous": 2e-6},
    "joint": {"coupling.stiffness": 40000.0, "load.inertia": 2.0, "limits.peak_current": 11.0},
    "with a friction map": {"control.velocity.gain": 0.156},
    "with a filter of the command": {"control.position.gain": 140.0, "command.filter_time": 3e-3},
    "behind a mean and a filter": {"control.position.gain": 140.0, "command.filter_time": 9.0},
    "with a load that pushes": {"control.current.gain": 40.0, "load.moment_slope": 2.0},
    "with falling friction": {"control.current.gain": 40.0},
    "fed too much": {"control.current.gain": 40.0, "load.moment_slope": 2.0},
    "with requirements on the whole drive": {
        "motor.resistance": 1.7, "load.inertia": 1.2e-3, "coupling.play": 3.0, "limits.voltage": 22.4,
        "friction.load_coefficient": 5.1},
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(DESIGNS))
def test_figures_are_those_of_margins_on_the_saved_file(name: str, opens, tmp_path) -> None:
    """Every design, requirements on rate, current, acceleration, torque margin and lost motion among them."""
    page, filtered = opens(DESIGNS[name]), name == "with a filter of the command"
    assert page.evaluate("document.documentElement.scrollHeight") <= 6 * 900  # six screens open
    assert page.locator("figure.scroll.figure").evaluate_all("all => all.map(f => f.dataset.chart)") == CHARTS
    assert page.locator("[id^=missing]").count() == 0
    if name in shipped_designs():
        answered_within_two_clicks(page)
    told = command_line(page.saved(tmp_path / "same.toml"))
    agree(page.read(), told["loops"], filtered)
    verdicts_agree(page, told["requirements"])
    values = ("table.demands tbody tr", "(all) => all.map((row) => row.dataset.value)")
    before, judged = page.read(), page.eval_on_selector_all(*values)
    for key, value in CHANGES[name].items():
        page.type_value(key, value)
    assert page.inner_text(".state")
    assert "Refused" not in page.inner_text(".state")
    changed, after = page.saved(tmp_path / "changed.toml"), page.read()
    assert after != before
    told = command_line(changed)
    agree(after, told["loops"], filtered)
    verdicts_agree(page, told["requirements"])
    for key in CHANGES[name]:
        assert parameter_value(load_design(changed), key) != parameter_value(DESIGNS[name], key)
    moved = [a != b for a, b in zip(judged, page.eval_on_selector_all(*values), strict=True)]
    assert "whole drive" not in name or all(moved)
    assert "friction map" not in name or "first piece" in page.inner_text("#hands-on")
    assert ("behind the mean" in page.inner_text("#hands-on")) is ("mean" in name or name == "ballscrew")


@pytest.mark.parametrize("seed", range(12))
def test_every_key_of_any_drive_is_followed_but_the_seed_of_its_noise(seed: int) -> None:
    design = full_drive(seed)
    unknown = {path for path in paths_of(design) if reached(design, path, Tape(interpreted=True)) is None}
    assert unknown <= {"instruments.seed"}


def test_periodic_break_points_follow_once_nothing_moves(shared) -> None:
    """Their fundamental has the margins of the command line's; while a value moves the row says so."""
    design, key = load_design("ilr33-amber-multirate"), "control.current.gain"
    page = shared(design)
    page.type_value(key, 2e-2)
    changed = with_values(design, {key: 2e-2 * page.sliders()[key]["factor"]}, check=False)
    wanted = stability_margins(assemble_loops(changed).break_points["i_ref"].open_loop)
    ours = page.read()["at i_ref"]
    for name in ("gain_margin", "phase_margin", "delay_margin"):
        assert ours[name] == pytest.approx(getattr(wanted, FIGURES[name]), rel=1e-9)
    assert "fundamental" in page.inner_text('.now th[data-loop="at u"]')


def test_cogging_is_seen_on_a_crest_in_a_notch_and_in_motion(opens, tmp_path) -> None:
    """The loops of `margins` there, of the values as moved; where a crest lets go, the first line says so."""
    steady = {"motor.cogging": 0.01, "motor.cogging_periods": 12.0, "motor.cogging_phase": 3.0}
    gear = {"load.gear_error": 2.0, "load.gear_error_periods": 2.0}
    page = opens(with_values(load_design("joint"), {**steady, **gear}, check=False))
    crest = "on a crest of the cogging and gear error"
    assert crest not in page.inner_text(".state")
    for moved in ({}, {"motor.cogging": 0.04, "motor.cogging_phase": 2.0, "control.position.gain": 9.0}):
        for key, value in moved.items():
            page.type_value(key, value / page.sliders()[key]["factor"])
        design, ours = load_design(page.saved(tmp_path / "moved.toml")), page.read()
        points = [one for one in operating_points(design, [], described=False, certify=False) if one.design]
        assert [one.label.split(" of ")[0] for one in points] == ["on a crest", "in a notch", "in motion"]
        rows = {f"{loop} {at.label}": one.judged for at in points for loop, one in at.figures.items()}
        for row, one in rows.items():
            stands = page.get_attribute(f'.now th[data-loop="{row}"]', "data-stable")
            assert stands == str(int(one.stable)), row
            for name in ("gain_margin", "phase_margin", "delay_margin", "bandwidth") if one.stable else ():
                wanted = loop_json(one)[FIGURES[name]]
                wanted = np.nan if wanted is None else wanted
                assert ours[row][name] == pytest.approx(wanted, rel=1e-8, nan_ok=True), (row, name)
    assert f"Unstable {crest}: current, velocity, position." in page.inner_text(".state")


def test_where_rounding_decides_no_figure_is_shown(shared, tmp_path) -> None:
    """An unstable current loop between slow updates: the command line withholds, so does the page."""
    page, key = shared(load_design("ilr33-amber-multirate")), "control.current.gain"
    page.type_value(key, 60.0 * page.field(key))
    page.type_value("control.position.every", 20)
    file = page.saved(tmp_path / "hot.toml")
    assert linear_figures(Population(load_design(file), {}, 1)).withheld("position")[0]
    assert "position" not in page.read()
    for place in (".state", "table.now"):
        assert "stability not known" in page.inner_text(place).lower()
    assert page.get_attribute(".state", "class") == "state fail"


def test_whole_numbers_stay_whole_and_multiples(shared, tmp_path) -> None:
    page = shared(load_design("ilr33-amber-multirate"))
    row, before = '.row[data-path="control.velocity.every"]', page.read()
    page.type_value("control.velocity.every", 3)  # 10 is no multiple of 3
    assert "allowed: a multiple of control.velocity.every = 3" in page.inner_text(".state")
    page.type_value("control.position.every", 9)
    assert "Refused" not in page.inner_text(".state")
    page.settled(lambda: page.locator(f"{row} input[type=range]").press("ArrowLeft"))
    assert page.input_value(f"{row} .field") == "2"
    page.settled(lambda: page.locator(f"{row} input[type=range]").press("ArrowRight"))
    agree(page.read(), command_line(page.saved(tmp_path / "odd.toml"))["loops"])
    assert page.read() != before
    page.fill(f"{row} .field", "2.5")
    page.press(f"{row} .field", "Enter")
    assert page.get_attribute(f"{row} input[type=range]", "aria-valuetext").strip() == "3"


@pytest.mark.parametrize("name", ["ilr33-amber", "fin"])
def test_cells_of_the_map_are_named_as_the_command_line_names_them(opens, tmp_path, name: str) -> None:
    """Every cell again, as a sine from rest, by the simulator and the rule of the large-signal map."""
    design = load_design(name)
    page = opens(design)
    page.locator('[data-chart="linear-limit"]').scroll_into_view_if_needed()
    page.wait_for_selector("#hands-on[data-cells^='[[']")
    page.done(60_000)
    cells = json.loads(page.get_attribute("#hands-on", "data-cells") or "[]")
    assert len(cells) == 18 * 12
    every = design.controller.position_loop.every
    ticks, hertz, updates, amplitude = np.array([cell[1:5] for cell in cells], dtype=float).T
    rows = Rows.of(design, len(cells))
    rows.sine("command", amplitude, hertz)
    rows.window(every * updates, np.round(hertz * updates * every * design.controller.period_s), 1)
    rows["ticks"] = ticks + every * updates
    path = assemble_loops(design).reference_to_output
    linear = np.array([complex(path(np.exp(2j * np.pi * f * path.dt))) for f in hertz])
    wanted = [CAUSES[k] for k in causes(rows.run(), linear, amplitude)]
    assert [cell[0] for cell in cells] == wanted
    assert len(set(wanted)) > 2


def test_a_requirement_that_needs_a_simulation_of_its_own_is_named() -> None:
    limits = (Requirement(id="swing", quantity="limit_cycle", unit="deg", maximum=0.1),)
    model = live_model(replace(AMBER, requirements=limits))
    assert (model["apart"], model["requirements"]) == ([{"id": "swing", "words": "swing after a step"}], [])


@pytest.mark.parametrize(("name", "unit"), [("ballscrew", "A dc"), ("ilr33-amber", "A"), ("emps", "")])
def test_the_run_says_which_amperes_or_has_no_current(name: str, unit: str) -> None:
    drawn = live_charts("deg", "rotary", live_model(load_design(name))["ampere"])
    assert (f">current, {unit}<" in drawn["run"]) == ("current" in drawn["run"]) == bool(unit)


def test_a_speed_is_commanded_in_the_unit_of_simulate() -> None:
    """It was rad/s beside deg/s, of the same command at the output."""
    step = live_model(replace(AMBER, controller=replace(AMBER.controller, position=None)))["step"]
    assert (step["of"], step["unit"], step["factor"]) == ("speed", "deg/s", pytest.approx(np.pi / 180.0))
