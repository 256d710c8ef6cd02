"""Every shipped design has sliders that act on its loops: elastic, with play, multirate, friction map."""

import json
from dataclasses import replace

import numpy as np
import pytest
from live_page import (
    AMBER,
    LIVE,
    Page,
    agree,
    command_line,
    done,
    field,
    read,
    same_figures,
    saved,
    settled,
    type_value,
    verdicts_agree,
)

from actuator_lti import assemble_loops, stability_margins
from actuator_lti.batch import Population, linear_figures
from actuator_lti.design import load_design, parameter_value, shipped_designs, with_values
from actuator_lti.design.model import Friction, FrictionPoint, Requirement
from analyses.large_signal.classify import CAUSES, causes
from nonlinear import Rows
from reports.live import live_model

CHANGES = {  # in the units of the page; the last restores no design
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
}  # fmt: skip


@pytest.fixture(params=sorted(CHANGES))
def shown(request, opens) -> tuple[str, Page]:
    """The page of a shipped design."""
    return request.param, opens(load_design(request.param))


def test_no_shipped_design_is_left_out() -> None:
    assert sorted(CHANGES) == sorted(shipped_designs())


def test_figures_are_those_of_margins_on_the_saved_file(shown: tuple[str, Page], tmp_path) -> None:
    name, page = shown
    assert page.evaluate("document.documentElement.scrollHeight") <= 6 * 900  # six screens open
    agree(read(page), command_line(saved(page, tmp_path / "same.toml")))
    verdicts_agree(page, command_line(tmp_path / "same.toml", "requirements"))
    before = read(page)
    for key, value in CHANGES[name].items():
        type_value(page, key, value)
    assert page.inner_text(".state")
    assert "Refused" not in page.inner_text(".state")
    changed = saved(page, tmp_path / "changed.toml")
    after = read(page)
    assert after != before
    agree(after, command_line(changed))
    verdicts_agree(page, command_line(changed, "requirements"))
    for key in CHANGES[name]:
        assert parameter_value(load_design(changed), key) != parameter_value(load_design(name), key)


def test_periodic_break_points_follow_once_nothing_moves(opens) -> None:
    """Their fundamental has the margins of the command line's; while a value moves the row says so."""
    design, key = load_design("ilr33-amber-multirate"), "control.current.gain"
    page = opens(design)
    type_value(page, key, 2e-2)
    done(page)
    factor = next(each["factor"] for each in page.evaluate(f"{LIVE}.keys") if each["path"] == key)
    changed = with_values(design, {key: 2e-2 * factor}, check=False)
    wanted = stability_margins(assemble_loops(changed).break_points["i_ref"].open_loop)
    ours = read(page)["at i_ref"]
    assert ours["gain_margin"] == pytest.approx(wanted.gain_margin_db, rel=1e-9)
    assert ours["phase_margin"] == pytest.approx(wanted.phase_margin_deg, rel=1e-9)
    assert ours["delay_margin"] == pytest.approx(wanted.delay_margin_s, rel=1e-9)
    assert "fundamental" in page.inner_text('.now th[data-loop="at u"]')


def test_where_rounding_decides_no_figure_is_shown(opens, tmp_path) -> None:
    """An unstable current loop between slow updates: the command line withholds, so does the page."""
    page, key = opens(load_design("ilr33-amber-multirate")), "control.current.gain"
    type_value(page, key, 60.0 * field(page, key))
    type_value(page, "control.position.every", 20)
    file = saved(page, tmp_path / "hot.toml")
    assert linear_figures(Population(load_design(file), {}, 1)).withheld("position")[0]
    assert "Stability not known" in page.inner_text(".state")
    assert "position" not in read(page)
    assert "stability not known" in page.inner_text("table.now")
    assert page.get_attribute(".state", "class") == "state fail"


def test_whole_numbers_stay_whole_and_multiples(opens, tmp_path) -> None:
    page = opens(load_design("ilr33-amber-multirate"))
    row = '.row[data-path="control.velocity.every"]'
    before = read(page)
    type_value(page, "control.velocity.every", 3)  # 10 is no multiple of 3
    assert "allowed: a multiple of control.velocity.every = 3" in page.inner_text(".state")
    type_value(page, "control.position.every", 9)
    assert "Refused" not in page.inner_text(".state")
    settled(page, lambda: page.locator(f"{row} input[type=range]").press("ArrowLeft"))
    assert page.input_value(f"{row} .field") == "2"
    settled(page, lambda: page.locator(f"{row} input[type=range]").press("ArrowRight"))
    agree(read(page), command_line(saved(page, tmp_path / "odd.toml")))
    assert read(page) != before
    page.fill(f"{row} .field", "2.5")
    page.press(f"{row} .field", "Enter")
    assert page.get_attribute(f"{row} input[type=range]", "aria-valuetext").strip() == "3"


def test_a_friction_map_has_sliders(opens, tmp_path) -> None:
    """The loops have the slope of the map's first piece, as the linear form has at rest."""
    map_Nm = ((0.0, 3e-3), (40.0, 2e-3), (900.0, 4e-3))
    points = tuple(FrictionPoint(speed_rad_s=speed, torque_Nm=torque) for speed, torque in map_Nm)
    page = opens(replace(AMBER, name="mapped", friction=Friction(points=points)))
    type_value(page, "control.velocity.gain", 1.3 * field(page, "control.velocity.gain"))
    file = saved(page, tmp_path / "mapped.toml")
    same_figures(page, load_design(file))
    assert "first piece" in page.inner_text("#hands-on")


@pytest.mark.parametrize("name", ["ilr33-amber", "fin"])
def test_cells_of_the_map_are_named_as_the_command_line_names_them(opens, tmp_path, name: str) -> None:
    """Every cell again, as a sine from rest, by the simulator and the rule of the large-signal map."""
    design = load_design(name)
    page = opens(design)
    page.locator('[data-chart="border"]').scroll_into_view_if_needed()
    drawn = "() => JSON.parse(document.querySelector('#hands-on').dataset.cells || '[]').length"
    page.wait_for_function(drawn)
    done(page, 60_000)
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


ASKED = (
    ("output_rate", "deg/s", 60.0, 20.0),
    ("motor_current", "A", None, None),
    ("acceleration", "deg/s^2", 1e3, 20.0),
    ("torque_margin", "1", 2.0, 20.0),
    ("lost_motion", "deg", None, None),
)


def test_requirements_on_the_whole_drive_follow(opens, tmp_path) -> None:
    """Rate, current, acceleration, torque margin and lost motion of a loaded drive as `margins` has them."""
    limits = tuple(
        Requirement(id=f"r{k}", quantity=name, unit=unit, load_Nm=load, minimum=low,
                    maximum=9.0 if low is None else None)
        for k, (name, unit, low, load) in enumerate(ASKED)
    )  # fmt: skip
    page = opens(replace(load_design("fin"), requirements=limits))
    verdicts_agree(page, command_line(saved(page, tmp_path / "a.toml"), "requirements"))
    values = ("table.demands tbody tr", "(all) => all.map((row) => row.dataset.value)")
    first = page.eval_on_selector_all(*values)
    changes = {"limits.peak_current": 0.6, "motor.resistance": 1.7, "load.inertia": 1.5, "coupling.play": 2.0,
               "friction.load_coefficient": 3.0, "limits.voltage": 0.8}  # fmt: skip
    for key, factor in changes.items():
        if page.locator(f'.row[data-path="{key}"] .field').count():
            type_value(page, key, factor * field(page, key))
    verdicts_agree(page, command_line(saved(page, tmp_path / "b.toml"), "requirements"))
    assert all(a != b for a, b in zip(first, page.eval_on_selector_all(*values), strict=True))


def test_a_requirement_that_needs_a_simulation_of_its_own_is_named() -> None:
    limits = (Requirement(id="swing", quantity="limit_cycle", unit="deg", maximum=0.1),)
    model = live_model(replace(AMBER, requirements=limits))
    assert (model["apart"], model["requirements"]) == ([{"id": "swing", "words": "swing after a step"}], [])
