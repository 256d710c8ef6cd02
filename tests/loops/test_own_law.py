"""A law of one's own (model.md section 10): both writings, what it does at limits, sources, refusals."""

from dataclasses import replace
from functools import partial
from math import floor, inf, nan, pi
from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
import scipy.signal
import tomli_w
from loop_designs import controlled
from own_laws import PlainLaw, as_law, drawn, linear, same_run, stepped

from actuator_lti import InputError, assemble_loops, load_design, stability_margins
from actuator_lti.design import Design, design_hash, design_tree, model, warnings_of
from actuator_lti.design.model import Command, Encoder, Limits, OutputEncoder
from actuator_lti.loops.assemble import loops_at
from nonlinear import Drive, State, commands, simulate, tangent
from nonlinear.bench.loop_setup import loop_setup
from tests.changed import changed
from tests.refusals import refused


@pytest.mark.parametrize("part", range(4))
def test_both_writings_agree_on_random_laws(part: int) -> None:
    """Any stage, order, inputs, estimate of the speed, rates and delay; loops that grow too."""
    cases = [drawn(case) for case in range(24 * part, 24 * part + 24)]
    stages = set()
    for case, found in enumerate(cases):
        if found is None:
            continue
        design, stage = found
        stages.add(stage)
        same_run(design, (part, case), np.random.default_rng(case))
    assert stages == {"current", "velocity", "position"}


@pytest.mark.parametrize("every", [1, 2, 10])
@pytest.mark.parametrize("encoder", [Encoder(speed="difference", difference_samples=3),
                                     Encoder(speed="tracking", bandwidth_rad_s=600.0)])  # fmt: skip
def test_a_position_law_takes_the_speed_that_is_measured_every_tick(encoder: Encoder, every: int) -> None:
    """Without a velocity stage the speed is measured every tick, the law updated every so many."""
    loops = {"velocity": None, "position": model.PositionLoop(gain=1.0, every=every)}
    design = linear(changed(load_design("ilr33-amber"), encoder=encoder, controller=loops))
    T = design.controller.period_s * every
    law = ([], [], [], [[0.5, -0.5, -2e-3]], T)
    same_run(design.with_law("position", law, ["command", "angle", "speed"]), every, np.random.default_rng(1))


@pytest.mark.parametrize("case", [c for c in range(60) if drawn(c) is not None][:12])
def test_the_tangent_is_the_linear_loop_at_every_place(case: int) -> None:
    design, _ = drawn(case, stable=True)
    for place in (*design.controller.stages, *assemble_loops(design).break_points):
        setup = loop_setup(design, place, limits_on=False)
        loops = loops_at(design, setup.bias.operating(design))
        loop = {**loops.present, **loops.break_points}[place]
        if loop.periodic:
            continue
        model = tangent(design, place, setup=setup)
        z = np.exp(1j * np.geomspace(1e-3, 3.0, 40))
        theirs, ours = loop.closed_loop(z), model.closed(z)
        most = np.abs(theirs).max()
        assert np.abs(ours - theirs).max() <= 1e-9 * most + 1e-12, (case, place, most)


FED = {"current": {"back_emf_feedforward": 0.8, "resistance_feedforward": 0.5}}
ACCELERATED = FED | {"position": {"acceleration_feedforward": 0.7}}


@pytest.mark.parametrize(
    ("stage", "fed"),
    [*((stage, {}) for stage in ("current", "velocity", "position")), ("position", FED)]
    + [(stage, ACCELERATED) for stage in ("current", "velocity")],
)
def test_a_pi_written_as_a_law_is_the_pi(stage: str, fed: dict[str, Any]) -> None:
    """The same margins from a loop that is cut elsewhere, in every form, and the same run to rounding.

    What feed-forward adds to it, back-EMF above all, stays closed.
    """
    design = replace(load_design("ilr33-amber"), encoder=Encoder())  # a law takes counted angles
    design = changed(design, controller=fed)
    loop, T = getattr(design.controller, stage), design.controller.period_of(stage)
    gain = loop.gain_V_A if stage == "current" else loop.gain
    rate = None if loop.integral_time_s is None else gain / loop.integral_time_s
    same = ([], [], [], [[gain]]) if rate is None else ([[0.0]], [[rate]], [[1.0]], [[gain]])
    mine = as_law(design, stage, continuous=same)
    for form in ("sampled", "continuous", "ideal"):
        ours, theirs = (assemble_loops(each, form) for each in (mine, design))
        omega = np.geomspace(1.0, 0.9 * pi / T, 60)
        for name, loop in {**theirs.present, **theirs.break_points}.items():
            other = {**ours.present, **ours.break_points}[name]
            point = 1j * omega if loop.period_s is None else np.exp(1j * omega * loop.period_s)
            np.testing.assert_allclose(other.open_loop(point), loop.open_loop(point), rtol=1e-9, err_msg=name)
    for one, two in zip(*(stability_margins(getattr(assemble_loops(each), stage).open_loop).gain_margins
                          for each in (mine, design)), strict=True):  # fmt: skip
        assert one.ratio == pytest.approx(two.ratio, rel=1e-9)
    runs = [stepped(each, 2000, 0.01, limits_on=False).output_angle_rad for each in (mine, design)]
    np.testing.assert_allclose(runs[0], runs[1], rtol=0, atol=1e-9 * 0.01)


@pytest.mark.parametrize("name", ["ilr33-amber", "ilr33-amber-multirate"])
def test_back_emf_feedforward_stays_closed_in_the_loop_of_a_current_law(name: str) -> None:
    """Its gain margin is the factor on the law that brings a pole to the unit circle; the tangent's as well.

    Of a slower measured speed the loop is periodic, and its closed poles are those over a whole period.
    """
    design = changed(linear(load_design(name)), controller=FED)
    mine = as_law(design, "current")
    loops = [assemble_loops(each).current for each in (mine, design)]
    z = np.exp(1j * np.geomspace(1e-3, 3.0, 40))
    np.testing.assert_allclose(*(loop.open_loop(z) for loop in loops), rtol=1e-9)
    if loops[0].periodic:
        return
    ratio = stability_margins(loops[0].open_loop).gain_margins[-1].ratio
    for gain, side in ((ratio * (1 - 1e-6), -1), (ratio * (1 + 1e-6), 1)):
        closed = assemble_loops(mine.with_values({"control.current.law.gain": gain})).current.plain_closed
        assert np.sign(np.abs(closed.poles()).max() - 1.0) == side
    for each, loop in zip((mine, design), loops, strict=True):
        measured = tangent(each, "current", hold=False).closed(z)
        np.testing.assert_allclose(measured, loop.closed_loop(z), rtol=1e-6)


def test_a_run_starts_from_states_of_the_law() -> None:
    """Those of a PI written as a law are its integral."""
    design = replace(load_design("ilr33-amber"), encoder=Encoder())
    starts = State(velocity_integral=0.3), State(law=(0.3,))
    runs = [
        simulate(each, commands.step(0.01), 0.1, initial=start, limits_on=False).output_angle_rad
        for each, start in zip((design, as_law(design, "velocity")), starts, strict=True)
    ]
    rested = simulate(design, commands.step(0.01), 0.1, limits_on=False).output_angle_rad
    assert np.ptp(runs[0] - rested) > 1e-6
    np.testing.assert_allclose(runs[1], runs[0], rtol=0, atol=1e-11)
    run = partial(simulate, as_law(design, "velocity"), commands.step(0.01), 0.1)
    for wrong in ((1.0, 2.0), (np.inf,)):
        refused(run, initial=State(law=wrong), match=r"initial\.law = .*allowed: 1 numbers")


def test_what_a_law_sees_and_how_it_is_limited() -> None:
    """The controller alone against a plain writing: counted angles, limits of each stage, anti-windup."""
    base = replace(
        load_design("joint"), command=Command(),
        encoder=Encoder(counts_per_rev=4096, speed="difference", difference_samples=2),
        output_encoder=OutputEncoder(counts_per_rev=1 << 14),
        limits=Limits(voltage_V=24.0, speed_rad_s=30.0, acceleration_rad_s2=4e4, peak_current_A=2.0,
                      current_rate_A_s=4e3),
    )  # fmt: skip
    base = controlled(base, period_s=1e-4, computing_delay_s=1e-4)
    inputs = ["command", "error", "speed", "angle", "current", "output_angle", "output_speed"]
    for stage, size in (("current", 0.1), ("velocity", 0.1), ("position", 1.0)):
        rng = np.random.default_rng(7)
        A, B, C, D = (rng.standard_normal(shape) for shape in ((3, 3), (3, 7), (1, 3), (1, 7)))
        T = base.controller.period_of(stage)
        system, L = (0.4 * A, B, size * C, size * D, T), [0.3, -0.1, 0.2]
        design = base.with_law(stage, system, inputs, L=L, gain=0.7)
        control_, drive = design.controller, Drive(design)
        law, N = PlainLaw(getattr(control_, stage).law), design.total_ratio
        n_v, every = control_.velocity.every, getattr(getattr(control_, stage), "every", 1)
        line, last, speed, limited = [0.0, 0.0], 0.0, 0.0, 0
        for k in range(300):
            i, w, th, W = (float(value) for value in rng.standard_normal(4) * (1.0, 5.0, 0.5, 0.1))
            y, command = th / N + 1e-3 * float(rng.standard_normal()), 0.3 * float(np.sin(0.05 * k))
            u = drive.control(command, i, w, th, y, None, W)
            q, qo = 4096 / (2 * pi), (1 << 14) / (2 * pi)
            counted, out = floor(th * q) / q, floor(y * qo) / qo
            if k % n_v == 0:
                speed, line = (counted - line[0]) / (2 * n_v * 1e-4), [line[1], counted]
            if k % every:
                continue
            place = counted if control_.position.sensor == "motor" else N * out
            amperes = drive.value("current_reference")
            reference, own, top, step, ours = {
                "position": (N * command, place, 30.0, 4e4 * T, drive.value("speed_command")),
                "velocity": (drive.value("speed_reference"), speed, 2.0, 4e3 * T, amperes),
                "current": (amperes, i, 24.0, inf, u),
            }[stage]
            seen = {"speed": speed, "angle": counted, "current": i, "output_angle": out, "output_speed": W}
            v = law.output(seen | {"command": reference, "error": reference - own})
            last = float(np.clip(np.clip(v, -top, top), last - step, last + step))
            limited += last != v
            law.step(last)
            assert ours == pytest.approx(last, rel=1e-12, abs=1e-12)
        assert 5 < limited < 290, (stage, limited)


def _with_file(design: Design, name: str, folder: Path) -> None:
    """The design file with the velocity's matrices in another file."""
    tree = design_tree(design)
    stage = tree["control"]["velocity"]
    stage["law"] = {"inputs": stage["law"]["inputs"], "file": name}
    (folder / "mine.toml").write_text(tomli_w.dumps(tree))


def test_every_system_gives_the_same_law() -> None:
    base = load_design("ilr33-amber-multirate")
    T = base.controller.period_of("velocity")
    A, B, C, D = [[0.5, 0.1], [0.0, 0.9]], [[1e-3, 0.0], [2e-3, 1e-4]], [[1.0, 0.5]], [[0.1, -1e-3]]
    inputs = ["error", "speed"]
    want = base.with_law("velocity", (A, B, C, D, T), inputs)
    assert want.with_law("velocity", control.ss(A, B, C, D, T, inputs=inputs)) == want
    assert base.with_law("velocity", scipy.signal.StateSpace(A, B, C, D, dt=T), inputs) == want
    z = np.exp(1j * np.geomspace(1e-3, 3.0, 30))
    tf = control.tf([0.2, -0.15], [1.0, -0.9], T)
    mine = base.with_law("velocity", tf, ["error"]).controller.velocity.law.sampled
    made = control.ss(mine.A, mine.B, mine.C[None], mine.D[None], T)
    np.testing.assert_allclose(made(z), tf(z), rtol=1e-12)
    slow = base.with_law("velocity", control.tf([2.0, 30.0], [1.0, 100.0]), ["error"], method="tustin")
    law = slow.controller.velocity.law
    made = control.ss(law.sampled.A, law.sampled.B, law.sampled.C[None], law.sampled.D[None], T)
    s = 2 / T * (z - 1) / (z + 1)
    np.testing.assert_allclose(made(z), (2 * s + 30) / (s + 100), rtol=1e-9)
    assert len(assemble_loops(slow, "continuous").present) == 3


def test_hash_tolerance_and_values_follow() -> None:
    base = load_design("ilr33-amber")
    mine = as_law(base, "velocity")
    assert design_hash(mine) != design_hash(base)
    more = mine.with_values({"control.velocity.law.gain": {"value": 1.2, "tolerance": "10 %"}})
    assert more.parameters["control.velocity.law.gain"].tolerance.half_width == pytest.approx(0.12)
    nominal, up = (stability_margins(assemble_loops(each).velocity.open_loop) for each in (mine, more))
    assert up.gain_margins[-1].ratio == pytest.approx(nominal.gain_margins[-1].ratio / 1.2, rel=1e-9)
    assert "control.velocity.gain" not in {item.path for item in mine.parameters.values()}


def test_a_law_unstable_of_itself_is_allowed_and_said() -> None:
    base = load_design("ilr33-amber")
    mine = base.with_law("velocity", ([[1.05]], [[0.01]], [[0.01]], [[0.1]], 1e-4), ["error"])
    assert any("unstable of itself, a pole of size 1.05" in line for line in warnings_of(mine))
    assert stability_margins(assemble_loops(mine).velocity.open_loop) is not None


def test_what_is_no_law_is_refused_in_words(tmp_path: Path) -> None:
    base, T = load_design("ilr33-amber"), 1e-4
    unit = ([[0.5]], [[1.0]], [[1.0]], [[0.0]], T)

    def made(system: Any, inputs: Any = ("error",), stage: str = "velocity", **more: Any) -> str:
        return refused(base.with_law, stage, system, inputs, **more)

    assert "0.0001 s, that of its stage" in made((*unit[:4], 2e-4))
    assert "continuous; allowed: a sampled one of dt = 0.0001 s" in made(control.ss(*unit[:4]))
    assert "of no stated period" in made(control.ss(*unit[:4], True))
    assert "sampled already" in made(unit, method="zoh")
    assert "dt: must be real" in made((*unit[:4], "T"))
    assert "tustin or zoh" in made(unit[:4], method=["zoh"])
    assert "tustin or zoh" in made(unit[:4], method="euler")
    assert "current, velocity, position" in made(unit, stage="torque")
    for system, inputs in ((unit, ["sped"]), (unit, None), (control.ss(*unit), None), (unit, "error")):
        assert "allowed: a list of command, error, speed" in made(system, inputs)
    with pytest.raises(InputError, match=r"B = other sizes: allowed: 1 x 2, with 2 inputs\n.*D = other"):
        base.with_law("velocity", unit, np.array(["error", "speed"]))
    assert 'inputs = "omega": allowed' in made(unit, ["error", "omega"])
    assert "continuous: sampled, dt = 0.0001" in made(unit, continuous=unit)
    assert "continuous: allowed: without method" in made(unit[:4], method="tustin", continuous=unit[:4])
    assert "one row, a law has one output" in made(([[0.5]], [[1.0]], [[1.0], [1.0]], [[0.0], [0.0]], T))
    assert "as many rows as columns" in made(([[0.5, 1.0]], [[1.0]], [[1.0]], [[0.0]], T))
    assert "real numbers" in made(([["a"]], [[1.0]], [[1.0]], [[0.0]], T))
    assert "real numbers" in made(([[1j]], [[1.0]], [[1.0]], [[0.0]], T))
    for bad in (nan, inf):
        sheet = ([[bad]], [[1.0]], [[1.0]], [[0.0]])
        said = [
            made((*sheet, T)),
            made(sheet, method="zoh"),
            made(unit, continuous=sheet),
            made(unit, L=[bad]),
        ]
        said += [made(unit, gain=bad), made(unit, every=bad), made((*unit[:4], bad))]
        assert all("finite" in words and "allowed" in words for words in said)
    assert made(unit, gian=1).startswith('gian = 1: unknown (nearest known: "gain"); allowed: L, gain, every')
    assert "continuous = nan: allowed: a state space" in made(unit, continuous=nan)
    assert "at most 16" in made((np.eye(17), np.ones((17, 1)), np.ones((1, 17)), [[0.0]], T))
    assert "one a state" in made(unit, L=[1.0, 2.0])
    for none in ("k.mat", lambda e: e, 3.0, (1, 2)):
        assert "of python-control or scipy.signal" in made(none)
    assert "each at most once" in made(unit, ["error", "error"])
    twice = base.with_law("velocity", unit, ["error"])
    assert "at one stage" in refused(twice.with_law, "position", unit, ["error"])
    for key, value in (("gain", "0.1 A*s/rad"), ("gain", "5 1/s"), ("integral_time", "1 ms")):
        said = refused(twice.with_values, {f"control.velocity.{key}": value})
        assert said.split("control.velocity.", 1)[1].startswith(key)
        own = ", whose own gain is control.velocity.law.gain" * (key == "gain")
        assert said.endswith(f"not allowed beside control.velocity.law{own}")
    notch = {"kind": "notch", "frequency": "120 Hz", "width": "60 Hz"}
    for bad in (nan, inf):
        words = f'.frequency = "{bad} rad/s": must be finite; allowed: a number with a unit like rad/s'
        assert words in refused(base.add_filter, "velocity", **{**notch, "frequency": bad})
    assert "not allowed beside" in refused(twice.add_filter, "velocity", **notch)
    beside = "encoder.filter_time = 0.001 s: not allowed beside control.velocity.law, which may have it"
    assert refused(twice.with_values, {"encoder.filter_time": "1 ms"}).endswith(beside)
    speed = base.with_law("velocity", ([[0.5]], [[1.0, 0.0]], [[1.0]], [[1.0, 0.0]], T), ["error", "speed"])
    assert "without encoder.filter_time" in refused(speed.with_values, {"encoder.filter_time": "1 ms"})
    force, slow = load_design("emps"), (*unit[:4], load_design("emps").controller.period_s)
    assert "without a coupling" in made(unit, ["twist"])
    assert "no current" in refused(force.with_law, "position", slow, ["current"])
    assert "form: control.velocity.law is a sampled one" in refused(assemble_loops, twice, "continuous")
    assert "law.gain = 0: the law gives nothing; allowed: not 0" in made(unit, gain=0)
    volts = controlled(base, current=None, velocity={"every": 1}, position=None)
    said = refused(volts.with_law, "current", unit, ["error"])
    assert said.startswith('stage = "current": the drive has none')
    assert said.endswith("allowed: velocity")
    (tmp_path / "k.csv").write_text("1")
    (tmp_path / "k.mat").write_text("x")
    wrong = (("none.mat", "no such file"), ("k.csv", ".mat up to version 7"), ("k.mat", "cannot be read"))
    for name, words in wrong:
        _with_file(twice, name, tmp_path)
        assert words in refused(load_design, tmp_path / "mine.toml")
