"""Small signals judged by the running drive: onsets of limits, effects over the angle, margins at 0 Hz."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import control
import numpy as np
import pytest

from actuator_lti import Design, assemble_loops, load_design, onset
from actuator_lti.asked.drive_figure import drive_figure
from actuator_lti.asked.verdict import Verdict
from actuator_lti.design import shipped_designs
from actuator_lti.design.model import Gravity
from actuator_lti.drive import operating
from actuator_lti.loops import ExactMargins
from analyses.validation import CHECKS, places, validate
from analyses.validation.design_values import design_value_rows
from analyses.validation.places import Bench
from analyses.validation.row import Row
from analyses.validation.small_signal import Place, small_signal
from nonlinear import tangent
from tests.changed import changed
from tests.loops.loop_designs import drive_e
from tests.validation.random_drives import full_drive

INTEGRAL_TIME_S = 100.0  # so slow that the pole passes 1 by 1e-6 of a relative change of the gain


def rows(design: Design, model: Design | None = None) -> dict[str, Row]:
    onsets = Bench(design, design if model is None else model).onsets()
    return {row.name: row for place in onsets for row in small_signal(place)}


SLOPED = changed(
    load_design("ilr33-amber-multirate"), name="a slope of the current", limits={"current_rate_A_s": 1e3},
    controller={"position": {"feedforward": 0.9}},
)  # fmt: skip


@pytest.mark.parametrize("design", [*map(load_design, shipped_designs()), SLOPED], ids=lambda one: one.name)
def test_every_limit_of_a_drive(design: Design) -> None:
    """Each limiter that the limit of linear validity lists has its row, and it is met."""
    border = onset(Bench(design, design).loops("command"), [10.0])
    wanted = {f"{each}_onset".replace("-", "_") for each, at in border.each_rad.items() if np.isfinite(at[0])}
    found = rows(design)
    assert set(found) == wanted
    assert {row.verdict for row in found.values()} == {Verdict.MET}
    assert max(row.allowed for row in found.values()) < 1e-5


@pytest.mark.parametrize("seed", [730_010, 730_018, 730_037, 730_051])
def test_speed_drives_and_clamped_integrals(seed: int) -> None:
    found = rows(full_drive(seed))
    assert {row.verdict for row in found.values()} == {Verdict.MET}
    assert seed != 730_037 or "voltage_onset_integral" in found


@pytest.mark.parametrize("name", ["ilr33-amber-multirate", "joint"])
def test_one_per_cent_of_the_linear_side_is_not_met(name: str) -> None:
    """Of every limiter: its response scaled, and a gain that all of them feel."""
    design = load_design(name)
    for place in Bench(design, design).onsets():
        (row,) = small_signal(replace(place, predicted=lambda z, place=place: 1.01 * place.predicted(z)))
        assert row.verdict is Verdict.NOT_MET, row
        assert row.error == pytest.approx(0.01, rel=0.02)
    gain = 1.01 * design.controller.position.gain
    seen = rows(design, changed(design, controller={"position": {"gain": gain}}))
    assert {row.verdict for row in seen.values()} == {Verdict.NOT_MET}


def cogging(design: Design, share: float = 1.0) -> Design:
    waves = {"cogging_Nm": 4e-3 * share, "cogging_periods": 12.0, "cogging_phase_rad": 2.5}
    return changed(design, motor=waves)


def gear_error(design: Design, share: float = 1.0) -> Design:
    waves = {"gear_error_Nm": 0.3 * share, "gear_error_periods": 3.0, "gear_error_phase_rad": 2.5}
    return changed(design, load=waves)


def verdicts(design: Design, model: Design, place: str) -> set[Verdict]:
    return {row.verdict for row in small_signal(Bench(design, model).place(place))}


@pytest.mark.parametrize(
    ("name", "effect"),
    [("ilr33-amber", cogging), ("fin", cogging), ("fin", gear_error)],
    ids=lambda value: getattr(value, "__name__", value),
)
def test_green_with_it_red_where_one_side_is_one_per_cent_wrong(name: str, effect: Callable[..., Design]):
    plain = load_design(name)
    design, wrong = effect(plain), effect(plain, 1.01)
    for place in ("velocity", "u"):
        assert verdicts(design, design, place) == {Verdict.MET}
        for one, other in ((design, wrong), (wrong, design), (design, plain)):
            assert Verdict.NOT_MET in verdicts(one, other, place)


def test_cogging_in_front_of_a_coupling_with_play() -> None:
    """Every row of the whole drive, not of a place alone."""
    plain = load_design("ilr33-amber-compliant")
    result = validate(changed(plain, motor={"cogging_Nm": 2e-3, "cogging_periods": 5.0}), CHECKS)
    assert plain.coupling.play_rad > 0.0
    assert result.tally.met == result.tally.total > 90
    assert result.passed


def test_the_outermost_loop_is_listed_once(monkeypatch) -> None:
    """The drive of one loop has its delay margin at the voltage; what a wrong break point says is kept."""
    found = {name: validate(name, CHECKS) for name in ("joint", "ctms-motor-position")}
    rows = {name: one.rows for name, one in found.items()}
    limits = ("overload", "torque_command", "acceleration", "speed", "current", "voltage")
    assert {row.name for row in rows["joint"] if row.loop == "command"} >= {f"{x}_onset" for x in limits}
    assert all(one.passed for one in found.values())
    seen = {name: {row.loop for row in of} - {"command", "load", "drive"} for name, of in rows.items()}
    assert seen == {
        "joint": {"current", "velocity", "position", "u", "i_ref"},
        "ctms-motor-position": {"position", "u"},
    }
    assert [row.name for row in rows["ctms-motor-position"] if row.loop == "u"] == ["delay_margin"]
    design = load_design("joint")
    bench = Bench(design, design)
    assert [name for name in bench.names if bench.repeats(name)] == ["w_ref", "output"]
    truly = places.periodic_loop

    def wrong(loops: Any, name: str) -> Any:
        loop = truly(loops, name)
        return replace(loop, systems=[(A, 1.01 * B, C) for A, B, C in loop.systems])

    monkeypatch.setattr(places, "periodic_loop", wrong)
    contradicted = {row.loop for row in validate(design, CHECKS).rows if row.verdict is Verdict.NOT_MET}
    assert contradicted == {"u", "i_ref", "w_ref", "output"}


@pytest.mark.parametrize("name", ["ilr33-amber", "ilr33-amber-tanh"])
def test_friction_by_load_has_two_slopes_at_no_load_and_the_response_to_one_none_of_them(name: str) -> None:
    drive = changed(load_design(name), load={"path": "back-drivable"})
    assert drive.friction.load_coefficient > 0.0
    assert {row.verdict for row in small_signal(Bench(drive, drive).place("load"))} == {Verdict.MET}


@pytest.mark.parametrize("more", ["", "angle", "output_angle", "output_speed", "twist"])
def test_the_output_is_the_outermost_loop_where_its_angle_is_all_that_is_taken(more: str) -> None:
    """By name, held against the responses: joint's sensor is the output's."""
    joint = load_design("joint")
    gains = [joint.controller.position_loop.gain, *([-1e-3] if more else [])]
    law = control.ss([], [], [], [gains], assemble_loops(joint).position.period_s)
    design = joint.with_law("position", law, ["error", *([more] if more else [])])
    loops, z = assemble_loops(design), np.exp(1j * np.array([1e-3, 0.03, 0.3, 2.0]))
    here, there = (loop.closed_loop(z) for loop in (loops.break_points["output"], loops.position))
    assert Bench(design, design).repeats("output") is bool(np.allclose(here, there, rtol=1e-7))
    assert Bench(design, design).repeats("w_ref")


def test_every_number_of_a_spring_that_bends_is_confronted() -> None:
    """K1 to T1, K2 to T2, K3 beyond, as the data sheet of a strain wave gear of size 25 has them."""
    keys = {"coupling.torque_1": 14.0, "coupling.stiffness_2": 3.5e4, "coupling.torque_2": 48.0,
            "coupling.stiffness_3": 4.1e4}  # fmt: skip
    design = load_design("joint").with_values(keys)
    assert {row.verdict for row in design_value_rows(design)} == {Verdict.MET}
    for key, value in {**keys, "coupling.stiffness": 2.2e4}.items():
        for drive, model in ((1.0, 1.01), (1.01, 1.0)):
            one, other = (design.with_values({key: factor * value}) for factor in (drive, model))
            assert Verdict.NOT_MET in {row.verdict for row in design_value_rows(one, other)}, key


def test_gravity_twists_a_spring_that_bends_and_the_validator_stands_there(monkeypatch) -> None:
    """A level arm of 3 N m, its slope none: K2 by itself, K1 where the load lifts it, K3 with 4 N m more."""
    bends = {"torque_1_Nm": 2.0, "stiffness_2_Nm_rad": 600.0, "torque_2_Nm": 5.0, "stiffness_3_Nm_rad": 900.0}
    level = Gravity(mass_kg=3.0 / 9.80665, arm_m=1.0, offset_rad=np.pi / 2)
    design = changed(drive_e(), coupling=bends, load={"gravity": level})
    for load_Nm, k in ((0.0, 600.0), (-3.0, design.coupling.stiffness_Nm_rad), (4.0, 900.0), (-9.0, 900.0)):
        assert drive_figure(design, "static_stiffness", load_Nm) == pytest.approx(k, rel=1e-6)
    assert verdicts(design, design, "position") <= {Verdict.MET}
    seen = changed(design, encoder={"speed": "difference"}, controller={"velocity": {"sensor": "output"}})
    for one in (design, seen):  # a drive that differences the output's angle stands as well
        calm = Bench(one, one).setup("velocity").rows().running()
        before = calm.value("OUTPUT")
        calm.run(500)
        assert calm.value("OUTPUT") == pytest.approx(before, rel=1e-9, abs=1e-12)
    monkeypatch.setattr(operating, "carried_Nm", lambda _, at: -at.load_Nm)  # as if there were no gravity
    assert Verdict.NOT_MET in verdicts(design, design, "position")


def pendulum(falls_Nm_rad: float) -> Design:
    """A shipped drive without its position loop, on a load that falls over."""
    control = {"position": None, "velocity": {"integral_time_s": INTEGRAL_TIME_S}}
    load = {"path": "back-drivable", "moment_slope_Nm_rad": falls_Nm_rad}
    return changed(load_design("ilr33-amber"), controller=control, load=load)


def least_gain(design: Design) -> float:
    """k/(N^2 kM Kp/Tn): where the torque of the integral only just outweighs that of the load."""
    law, slope = design.controller.velocity, design.load.moment_slope_Nm_rad
    held = design.effective_motor.torque_constant_Nm_A * law.gain / law.integral_time_s
    return slope / design.total_ratio**2 / held


@pytest.mark.parametrize("falls_Nm_rad", [1e-3, 1.0, 50.0])  # at the output
def test_the_least_gain_is_that_of_the_integral(falls_Nm_rad: float) -> None:
    """The mode at rest of integral and angle stood beside the pole at some gains: 0.0140 for 0.0250 once."""
    design = pendulum(falls_Nm_rad)
    place = Bench(design, design).place("velocity")
    (row,) = (row for row in small_signal(place) if row.name == "gain_margin" and row.because[:4] == "0 Hz")
    assert row.verdict is Verdict.MET
    assert [row.predicted, row.found] == pytest.approx(2 * [least_gain(design)], rel=1e-6)
    assert "by +" in row.because  # outside the circle below that gain
    beside, found = 1.0 + 1e-3 * np.random.default_rng(1).normal(size=200), place.tangent
    assert {len(found.poles_at(gain)[0]) for gain in least_gain(design) * beside} == {len(found.A) - 1}


def test_a_gain_that_moves_a_pole_by_less_than_rounding_proves_nothing() -> None:
    """A pole at 1 - 1e-20 (K - 1): at 1 in every double whatever the gain."""
    one, none = np.ones((1, 1)), np.zeros((2, 2))
    known = tangent("ilr33-amber", "velocity")
    still = replace(known, A=one, B=1e-20 * one, C=one, D=0.0 * one, entry_errors=none)
    place = Place(
        name="u", condition="", tangent=still, predicted=still.closed, poles=np.empty(0, complex),
        exact=ExactMargins(True, 2.0, 0.0, None, 1.0), critical=lambda gain: np.ones(1, complex),
    )  # fmt: skip
    _, row = small_signal(place)
    assert (row.name, row.verdict) == ("gain_margin_up", Verdict.NOT_PROVEN)
    assert "less than rounding" in row.because
