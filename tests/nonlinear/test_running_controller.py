"""Every slot of the controller against a plain writing of its equations; what each number of its state is."""

from dataclasses import replace
from math import inf, pi
from typing import Any

import numpy as np
import pytest
from controller_reference import Controller
from elastic_drive import two_mass

from actuator_lti import load_design
from actuator_lti.design import model, shipped_designs
from actuator_lti.errors import InputError
from nonlinear import Drive, Rows
from nonlinear._kernels import elastic_layout, layout
from nonlinear._kernels.state_kinds import CONTINUOUS, KINDS, NOTE, WORK, state_kinds
from tests.changed import changed

TICKS = 240
CASES = 120


class Some:
    """Values of a generator."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng

    def of(self, *values: Any) -> Any:
        return values[self.rng.integers(len(values))]

    def filters(self, T: float) -> tuple[model.Filter, ...]:
        w, other, width = (self.rng.uniform(0.02, 0.8, 3) * pi / T).tolist()
        depth, damping = self.rng.uniform(0.0, 0.5), self.rng.uniform(0.4, 1.2)
        pair, kinds = {"zero_rad_s": w, "pole_rad_s": other}, [{"kind": "biquad", "b": (0.5,), "a": (-0.5,)}]
        kinds += [{"kind": "lowpass", "frequency_rad_s": w, "order": n, "damping": damping} for n in (1, 2)]
        kinds += [{"kind": "notch", "frequency_rad_s": w, "width_rad_s": width, "depth": depth}]
        kinds += [{"kind": "leadlag", **pair}, {"kind": "biquad", "b": (0.3, 0.1, 0.05), "a": (-0.4, 0.15)}]
        kinds += [{"kind": "skewed-notch", **pair, "width_rad_s": width, "depth": depth}]
        return (model.Filter(on=self.of("torque", "speed"), **self.of(*kinds)),)

    def command(self, T: float, shaped: bool, rate: float) -> model.Command:
        own = {"filter_time_s": self.of(0.0, 3 * T, 0.4 * T), "filter_order": self.of(1, 2)}
        if not shaped:
            return model.Command(**own, filter_damping=0.8)
        own |= {"rate_rad_s": self.of(inf, rate)}
        if bend := self.of(0.0, 0.1 * rate / T):
            own |= {"acceleration_rad_s2": bend, "jerk_rad_s3": self.of(inf, bend / (4.3 * T))}
        return model.Command(**own, filter_damping=0.8)

    def limits(self, T: float, T_p: float, protected: float | None) -> model.Limits:
        own = {"speed_rad_s": self.of(inf, 300.0), "acceleration_rad_s2": self.of(inf, 20.0 / T_p)}
        own |= {"peak_current_A": self.of(inf, 5.0), "current_rate_A_s": self.of(inf, inf, 3.0 / T)}
        if protected is not None and own["peak_current_A"] < inf:
            own |= {"continuous_current_A": 2.0, "peak_time_s": self.of(None, protected), "release": 0.8}
            own |= {"overload": self.of("thermal", "excess")}
        return model.Limits(voltage_V=20.0, **own)

    def drive(self) -> model.Design:
        """Any stages, any options, on the motor of the baseline."""
        of, rng = self.of, self.rng
        Ts, n_v, wide = 10 ** rng.uniform(-5, -3), int(of(1, 2, 5)), 10 ** rng.uniform(-1, 1)
        with_position, with_velocity, with_current = (of(True, True, False) for _ in range(3))
        laws, T_p = ("conditional", "clamped", "back-calculation"), Ts * n_v * int(of(1, 3))
        current = {"gain_V_A": wide, "integral_time_s": of(None, 20 * Ts), "anti_windup": of(*laws)}
        current |= {"back_emf_feedforward": of(0.0, 0.7), "resistance_feedforward": of(0.0, 0.5)}
        current |= {"tracking_time_s": of(None, 7 * Ts)}
        filters = sum((self.filters(n_v * Ts) for _ in range(int(rng.integers(0, 5)))), ())
        velocity = {"gain": 0.05 * wide, "every": n_v, "sensor": of("motor", "motor", "output")}
        velocity |= {"integral_time_s": of(None, 50 * Ts), "anti_windup": of(*laws), "filters": filters}
        velocity |= {"tracking_time_s": of(None, 9 * Ts)}
        position = {"gain": 0.02 / Ts if with_velocity else 0.3, "every": round(T_p / Ts)}
        position |= {"feedforward": of(0.0, 0.6), "sensor": of("motor", "output")}
        position |= {"integral_time_s": of(None, 30 * T_p), "derivative_time_s": of(0.0, 3 * T_p)}
        position |= {"derivative_filter_s": of(0.0, 2 * T_p), "acceleration_feedforward": of(0.0, 0.5)}
        position |= {"friction_feedforward": of(0.0, 0.2)}
        T_o = T_p if with_position else (n_v * Ts if with_velocity else Ts)
        encoder = {"counts_per_rev": of(None, 4096), "speed": of("ideal", "difference", "tracking")}
        encoder |= {"difference_samples": int(of(1, 3)), "filter_time_s": of(0.0, 4 * Ts)}
        stages = {
            "position": model.PositionLoop(**position) if with_position else None,
            "velocity": model.VelocityLoop(**velocity) if with_velocity else None,
            "current": model.CurrentLoop(**current) if with_current else None,
        }
        return replace(
            load_design("ilr33-amber"),
            controller=model.Controller(period_s=Ts, computing_delay_s=0.0, **stages),
            limits=self.limits(T_o, T_p, 30 * Ts if with_current else None),
            encoder=model.Encoder(**encoder, bandwidth_rad_s=0.2 / (n_v * Ts)),
            command=self.command(T_o, with_position or with_velocity, 2e-4 / T_o if with_position else 0.4),
            output_encoder=model.OutputEncoder(counts_per_rev=of(None, 10**6)),
        )


def some_measurements(rng: np.random.Generator, design: model.Design) -> np.ndarray:
    """Command, current, speed, angle and output angle at every tick: smooth, large enough to reach limits."""
    t, N = np.arange(TICKS), design.total_ratio
    waves = [
        np.sin(t * rng.uniform(0.01, 0.3) + rng.uniform(0, 6)) - np.sin(rng.uniform(0, 6)) for _ in "ciwy"
    ]
    size = {"position": 0.05, "velocity": 1.0, "current": 4.0, "voltage": 25.0}[design.controller.outermost]
    command = size * waves[0] + size * (t > 60) * rng.uniform(-1, 1)
    w = 200.0 * waves[2]
    th = np.cumsum(w) * design.controller.period_s + 0.3
    return np.column_stack([command, 4.0 * waves[1], w, th, th / N + 1e-4 * waves[3]])


@pytest.mark.parametrize("part", range(4))
def test_random_controllers(part: int) -> None:
    limited = 0
    for case in range(part * CASES // 4, (part + 1) * CASES // 4):
        rng = np.random.default_rng(case)
        design = Some(rng).drive()
        drive, plain = Drive(design), Controller(design)
        rows = some_measurements(rng, design)
        result = np.array([drive.control(*row) for row in rows])
        expected = np.array([plain.tick(*row) for row in rows])
        scale = np.abs(expected).max()
        assert np.abs(result - expected).max() <= 1e-9 * scale, (case, design)
        assert drive.value("speed_command") == pytest.approx(plain.w_ref, rel=1e-9, abs=1e-9)
        limited += bool((np.abs(result) == 20.0).any()) and not (np.abs(result) == 20.0).all()
    assert limited > CASES / 16  # the limits and what follows them were seen


STATE_TICKS, MORE_THAN_A_BLOCK = 60, layout.BLOCK + 44
NOISE = {"current_noise_A": 0.01, "angle_noise_rad": 1e-4, "output_angle_noise_rad": 1e-6, "jitter_s": 1e-6}


def drives() -> list[model.Design]:
    """Every shipped drive, random cascades, two masses with play, stick on both sides, a supply, noise."""
    rubbing = {"dry_torque_Nm": 0.02, "load_coefficient": 0.01}
    play = two_mass(friction=rubbing, load_friction={"dry_torque_Nm": 0.1})
    play = changed(play, load={"moment_damping_Nms_rad": 0.01})
    supply = model.Supply(resistance_ohm=0.05, regenerative=False, capacitance_F=1e-3)
    feeding = {"position": {"acceleration_feedforward": 0.5}}
    weak = changed(load_design("ilr33-amber"), supply=supply, controller=feeding)
    noisy = changed(weak, instruments=NOISE, controller={"computing_delay_s": 1.3e-4})
    random = [Some(np.random.default_rng(case)).drive() for case in range(60)]
    return [*map(load_design, shipped_designs()), *random, play, weak, noisy]


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
