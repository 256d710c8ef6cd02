"""The run in the page is that of the simulator: every trace and command, under load, from a click."""

import json
import math

import numpy as np
import pytest
from live_page import AMBER, Page

from actuator_lti.design import with_values
from nonlinear import simulate
from nonlinear.commands import Command, ramp, sampled, sine, step


def ask(page: Page, kind: str, **values: float) -> dict[str, float]:
    """Choose a command and fill in its fields; gives the last values of the run."""
    if page.input_value(".run-kind") != kind:
        page.settled(lambda: page.select_option(".run-kind", kind))
    for label, value in values.items():
        field = page.locator(".run-keys label", has_text=label).locator("input")
        if field.input_value() not in (repr(value), f"{value:g}"):
            page.settled(lambda field=field, value=value: (field.fill(repr(value)), field.press("Enter")))
    return last(page)


def last(page: Page) -> dict[str, float]:
    page.done()
    return json.loads(page.get_attribute(".hands-run", "data-last") or "{}")


def agree(found: dict[str, float], command: Command, load_Nm: float = 0.0, **changes: float) -> None:
    """Run the same command in the simulator as long, and compare the end of every trace."""
    design, ticks = with_values(AMBER, changes), int(found["ticks"])
    run = simulate(design, command, load_Nm=load_Nm, duration_s=ticks * design.controller.period_s)
    output = math.degrees(run.output_angle_rad[ticks - 1])
    assert found["output"] == pytest.approx(output, rel=1e-9, abs=1e-12)
    traces = {"speed": run.motor_speed_rad_s, "current": run.current_A, "voltage": run.voltage_V}
    for name, trace in traces.items():
        assert found[name] == pytest.approx(trace[ticks - 1], rel=1e-7, abs=1e-9), name


def test_step_sine_and_ramp_are_those_of_the_simulator(page: Page) -> None:
    agree(ask(page, "step", Size=4.0, Duration=0.05), step(math.radians(4.0)))
    agree(ask(page, "sine", Size=2.0, Frequency=7.0, Duration=0.2), sine(math.radians(2.0), 7.0))
    agree(ask(page, "ramp", Size=3.0, Rate=25.0, Duration=0.1), ramp(math.radians(25.0)))


def test_the_load_and_the_changed_design_are_in_the_run(page: Page) -> None:
    page.type_value("control.position.gain", 80.0)
    found = ask(page, "step", Size=4.0, Duration=0.05, Load=5.0)
    agree(found, step(math.radians(4.0)), 5.0, **{"control.position.gain": 80.0})
    ask(page, "step", Load=0.0)


def test_a_step_of_a_drive_that_moves_is_that_of_the_simulator(page: Page) -> None:
    """The motion goes on from rest until it is steady; then the step comes on top of it."""
    found = ask(page, "step", Size=1.0, Moving=12.0, Duration=0.05)
    before, ticks, period = int(found["before"]), int(found["ticks"]), AMBER.controller.period_s
    k = np.arange(before + ticks)
    command = sampled(k * period, np.radians(12.0 * k * period + (k >= before)))
    run = simulate(AMBER, command, duration_s=k.size * period)
    output = math.degrees(run.output_angle_rad[k[-1]]) - 12.0 * before * period
    assert before > 100
    assert found["output"] == pytest.approx(output, rel=1e-7)
    assert found["speed"] == pytest.approx(run.motor_speed_rad_s[k[-1]], rel=1e-6)
    ask(page, "step", Moving=0.0)


def test_the_drive_is_drawn_as_it_stands_at_a_time(page: Page) -> None:
    """Played to the end, by key and by the run's cursor: motor and load have turned by the same angle."""
    found = ask(page, "step", Size=2.0, Duration=0.05)
    slider = page.locator(".playback input")
    slider.focus()
    page.keyboard.press("End")
    assert f"output {found['output']:.3f} deg" in page.inner_text(".play-keys")
    turned = page.eval_on_selector_all(
        ".playback [transform]", "all => all.map(n => +n.getAttribute('transform').match(/[-.\\d]+/)[0])"
    )
    assert turned == [pytest.approx(-60.0, rel=1e-3)] * 2
    page.locator('[data-chart="run"] .plots').focus()
    for _ in range(20):
        page.keyboard.press("ArrowLeft")
    told = page.inner_text('[data-chart="run"] .readout').split("time\t")[1].split(" ms")[0]
    assert abs(float(page.inner_text(".play-keys").split("\n")[-1].split(" ms")[0]) - float(told)) < 0.2
    page.click(".playback button")
    page.wait_for_function("() => document.querySelector('.playback button').textContent === 'Play'")
    assert slider.input_value() == "1000"


def test_a_limit_that_acts_is_shaded_where_it_acts(page: Page) -> None:
    """A step of 8 deg runs at the speed limit: shaded in the panel of the speed, for as long as it acts."""
    ticks = int(ask(page, "step", Size=8.0, Duration=0.6)["ticks"])
    run = simulate(AMBER, step(math.radians(8.0)), duration_s=ticks * AMBER.controller.period_s)
    acting = run.limit_active("speed").mean()
    script = "all => all.filter(r => r.textContent === 'speed limit').map(r => +r.getAttribute('width'))"
    boxes = page.eval_on_selector_all('[data-chart="run"] .panel:nth-of-type(2) .cells rect', script)
    ends = page.locator('[data-chart="run"] .panel').nth(1).get_attribute("data-x")
    left, right = map(float, ends.split(" ")[3:])
    assert 0.1 < acting < 0.99
    assert sum(boxes) / (right - left) == pytest.approx(acting, abs=0.01)
    assert "speed limit" in page.inner_text(".acting")


def test_a_click_on_the_map_plays_that_sine(page: Page) -> None:
    ask(page, "step", Duration=0.0)
    page.settled(lambda: page.mouse.click(*page.spot('[data-chart="linear-limit"] .plot', 0.35, 0.4)))
    assert page.input_value(".run-kind") == "sine"
    trial = page.evaluate(
        "() => Object.fromEntries([...document.querySelectorAll('.run-keys label')]"
        ".map(l => [l.textContent.split(',')[0], l.querySelector('input,select').value]))"
    )
    hertz, size = float(trial["Frequency"]), float(trial["Size"])
    assert 1.0 < hertz < 300.0
    found = ask(page, "sine", Size=size * 1.001, Frequency=hertz * 1.001)
    agree(found, sine(math.radians(size * 1.001), hertz * 1.001))


def test_what_is_no_number_is_said_beside_its_field(page: Page) -> None:
    before = ask(page, "step", Size=4.0, Duration=0.05)
    for label, words in (("Size", "0"), ("Size", "x"), ("Duration", "-1")):
        field = page.locator(".run-keys label", has_text=label)
        field.locator("input").fill(words)
        field.locator("input").press("Enter")
        assert f'"{words}": a number' in field.inner_text()
    assert last(page) == before


def test_growth_of_an_unstable_drive_is_seen(page: Page) -> None:
    page.type_value("control.position.gain", 3600.0)
    ask(page, "step", Size=4.0, Duration=0.5)
    assert "unstable" in page.inner_text("table.now")
    cells = page.locator('table.now tr:has(th[data-loop="position"]) td b').all_inner_texts()
    assert set(cells[:4]) == {"–"}
    swings = []
    for path in page.locator('[data-chart="run"] .panel').first.locator(".curve").all()[-2:]:
        points = (path.get_attribute("d") or "")[1:].split("L")
        swings.append(np.ptp([float(point.split(" ")[1]) for point in points[len(points) // 2 :]]))
    assert swings[1] > 5.0 > 10.0 * swings[0]  # as changed it goes on, as designed it rests
    page.does("reset")
    usual = ask(page, "step", Size=4.0, Duration=0.0)["ticks"]
    # so little beyond its limit that a run of usual length still decays
    gain = 120.0 * 10.0 ** (page.read()["position"]["gain_margin"] / 20.0) * 1.002
    page.type_value("control.position.gain", gain)
    assert "unstable" in page.inner_text("table.now")
    assert last(page)["ticks"] > usual
