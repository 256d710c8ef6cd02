"""Every slot of the controller against a plain writing of its equations; what each number of its state is."""

import numpy as np
import pytest
from controller_reference import Controller

from actuator_lti import load_design
from actuator_lti.design import model, shipped_designs
from actuator_lti.errors import InputError
from nonlinear import Drive, Rows
from nonlinear._kernels import elastic_layout, layout
from nonlinear._kernels.state_kinds import CONTINUOUS, KINDS, NOTE, WORK, state_kinds
from tests.changed import changed
from tests.validation.rich_drives import rich_drive, sizes

TICKS = 240
CASES = 120


def some_drive(case: int) -> model.Design:
    """Any options of a controller, and each stage left out now and then: no plant, and no noise, matters."""
    design = rich_drive(500 + case, own_law=False)
    left_out = [name for k, name in enumerate(("position", "velocity", "current")) if case % (5 + k) == 0]
    plain = {"coupling": None, "supply": None, "instruments": model.Instruments()}
    plain |= {"limits": {"peak_time_s": None}} if "current" in left_out else {}
    return changed(design, controller=dict.fromkeys(left_out), **plain)


def some_measurements(rng: np.random.Generator, design: model.Design) -> np.ndarray:
    """Command, current, speed, angle and output angle at every tick: smooth, large enough to reach limits."""
    t, N, limits = np.arange(TICKS), design.total_ratio, design.limits
    waves = [
        np.sin(t * rng.uniform(0.01, 0.3) + rng.uniform(0, 6)) - np.sin(rng.uniform(0, 6)) for _ in "ciwy"
    ]
    command = sizes(design)[0] * (waves[0] + (t > 60) * rng.uniform(-1, 1))
    amperes = min(limits.peak_current_A, limits.voltage_V / design.effective_motor.resistance_ohm)
    w = 0.5 * limits.voltage_V / design.effective_motor.back_emf_constant_Vs_rad * waves[2]
    th = np.cumsum(w) * design.controller.period_s
    y = th / N + 1e-4 * design.validation.full_deflection_rad * waves[3]
    return np.column_stack([command, amperes * waves[1], w, th + 0.3, y])


@pytest.mark.parametrize("part", range(4))
def test_random_controllers(part: int) -> None:
    limited = 0
    for case in range(part * CASES // 4, (part + 1) * CASES // 4):
        design = some_drive(case)
        drive, plain = Drive(design), Controller(design)
        rows = some_measurements(np.random.default_rng(case), design)
        result = np.array([drive.control(*row) for row in rows])
        expected = np.array([plain.tick(*row) for row in rows])
        scale = np.abs(expected).max()
        assert np.abs(result - expected).max() <= 1e-9 * scale, (case, design)
        assert drive.value("speed_command") == pytest.approx(plain.w_ref, rel=1e-9, abs=1e-9)
        at_limit = np.abs(result) == design.limits.voltage_V
        limited += bool(at_limit.any()) and not at_limit.all()
    assert limited > CASES / 16  # the limits and what follows them were seen


STATE_TICKS, MORE_THAN_A_BLOCK = 60, layout.BLOCK + 44


def drives() -> list[model.Design]:
    """Every shipped drive, and random ones: play with stick on both sides, supplies, noise among them."""
    return [*map(load_design, shipped_designs()), *map(rich_drive, range(60))]


def command(tick: int) -> float:
    return 0.3 * np.sin(0.2 * tick) + 0.01 * tick


def test_every_number_has_a_kind_and_nothing_goes_on_from_notes_and_work_space() -> None:
    """NaN in all of them before every tick, and then in a drive begun anew: not one bit is different."""
    assert elastic_layout.ES_END - layout.ELASTIC_STATE == layout.ELASTIC_STATE_SIZE
    for design in drives():
        plain, spoilt = Drive(design), Drive(design)
        kinds = state_kinds(plain._p)
        assert kinds.shape == plain.get().shape
        assert set(kinds) <= set(KINDS)
        lines = slice(layout.S_QUEUE, int(plain._p[layout.AT_WORK]))  # delay line, angles, average, rings
        assert set(kinds[lines]) == {CONTINUOUS}
        held = np.isin(kinds, (NOTE, WORK))
        held &= design.instruments == model.Instruments()  # noise goes on from what counts as a note
        for k in range(STATE_TICKS):
            state = spoilt.get()
            state[held] = np.nan
            spoilt = Drive(design) if k == STATE_TICKS // 2 else spoilt
            spoilt.set(state)
            for drive in (plain, spoilt):
                drive.step(command(k))
            assert np.array_equal(plain.get()[~held], spoilt.get()[~held])
        with pytest.raises(InputError, match="this drive has"):
            spoilt.set(np.zeros(3))
        ticks = STATE_TICKS if design.instruments == model.Instruments() else MORE_THAN_A_BLOCK
        for k in range(STATE_TICKS, ticks):
            plain.step(command(k))
        rows = Rows.of(design)
        rows["ticks"] = ticks
        rows.series("command", np.array([command(k) for k in range(ticks)]))
        assert rows.trajectory().final.motor_angle_rad == plain.value("angle")
