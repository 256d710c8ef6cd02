"""Tuning against closed forms and a dense grid, refusals that say by how much, what may be placed."""

import cmath
import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from toleranced import QUICK, need, toleranced

from actuator_lti import assemble_loops, load_design, read_design_text, stability_margins, write_design
from actuator_lti.bandwidth import closed_loop_bandwidth
from actuator_lti.batch import Population, linear_figures
from actuator_lti.design import model, with_values
from actuator_lti.design.model import Coupling, Gear, PositionLoop, VelocityLoop
from actuator_lti.design.objects import export_objects
from actuator_lti.errors import InputError
from analyses.monte_carlo.task import StepCheck, step_columns
from analyses.specification.requirements import evaluate_requirements
from analyses.studies.sampling import Factor
from analyses.tuning import TuningSettings, tune
from analyses.tuning import problem as problem_module
from analyses.tuning.problem import gain_requirements, problem_of, read_requirement
from analyses.tuning.solve import maximise
from analyses.tuning.start import (
    allowed_range,
    checked,
    magnitude_optimum,
    place,
    rule_gains,
    step_of_gain,
    symmetric_optimum,
)
from reports.sections.tune import summary
from tests.changed import changed
from tests.loops.loop_designs import source_drive
from tests.loops.own_laws import as_law
from tests.refusals import refused

PERIOD, DELAY, GAIN = 1e-3, 3e-3, "control.position.gain"


def integrator(*requirements, gain=5.0):
    """K T z^-3/(z - 1): a drag so strong that the speed follows the drive at once, four samples in all."""
    control = {"computing_delay_s": DELAY, "position": PositionLoop(gain=gain)}
    more = {"friction": {"viscous_Nms_rad": 1.0}, "requirements": requirements}
    return source_drive(1e-9, 1.0, PERIOD, 10.0, controller=control, **more)


def test_a_requirement_that_the_search_cannot_have_is_told_with_the_reason():
    """Not "no requirement on a loop", which is what is asked for."""
    command = {"rate_rad_s": 1.0, "acceleration_rad_s2": 10.0, "jerk_rad_s3": 400.0}
    asked = need("bandwidth", 9.0, loop="position")
    smooth = changed(integrator(asked, gain=5.0), command=command)
    reason = (
        f'not searched for is {asked.id}: .* lack the mean of command.jerk, which to = "reference" leaves out'
    )
    with pytest.raises(InputError, match=reason):
        tune(smooth, QUICK)
    both = replace(smooth, requirements=(asked, need("phase_margin", 60.0, loop="position")))
    assert re.search(reason, " ".join(tune(both, QUICK).notes))
    behind = replace(smooth, requirements=(replace(asked, to="reference", minimum=1.0),))
    assert tune(behind, QUICK).feasible


@pytest.mark.parametrize("margin", [30.0, 45.0, 60.0])
def test_an_integrator_with_delay_gets_its_known_gain(margin):
    """Of K T z^-q/(z - 1) with L = q T: crossover at sin(w T/2) = K T/2, PM = 90 deg - w (L + T/2)."""
    design = integrator(need("phase_margin", margin, loop="position"))
    problem = problem_of(design, gain_requirements(design), {"control.position.gain": 20.0})
    corners = problem.all_corners
    gains = maximise(
        problem, problem.start,
        lambda x: problem.distances(np.exp(x), corners).reshape(len(x), -1),
        lambda x: np.exp(x) / 100.0,
    )  # fmt: skip
    omega = math.radians(90.0 - margin) / (DELAY + 0.5 * PERIOD)
    assert gains[0] == pytest.approx(2.0 * math.sin(0.5 * omega * PERIOD) / PERIOD, rel=1e-3)


@pytest.mark.parametrize(("text", "width", "most"), [
    ("10 %", 20.0, lambda bound: bound / 1.1), ("7 1/s", 7.0, lambda bound: bound - 7.0),
])  # fmt: skip
@pytest.mark.parametrize("aim", ["least-change", "reserve"])
def test_a_gain_that_is_searched_for_keeps_its_tolerance(text, width, most, aim):
    """Its upper end gets the known gain, from 200 1/s: a share of the gain, or as far above it."""
    design = integrator(need("phase_margin", 60.0, loop="position"), gain=200.0)
    wide = model.Tolerance(kind="uniform", half_width=width, text=text)
    stated = model.Parameter(path=GAIN, text="200 1/s", value=200.0, unit="1/s", tolerance=wide)
    tuned = tune(replace(design, parameters={GAIN: stated}), TuningSettings(curve=False, aim=aim))
    omega = math.radians(30.0) / (DELAY + 0.5 * PERIOD)
    bound, gain = 2.0 * math.sin(0.5 * omega * PERIOD) / PERIOD, tuned.design.controller.position.gain
    if aim == "least-change":
        assert gain == pytest.approx(most(bound), rel=1e-4)
    upper = gain * 1.1 if "%" in text else gain + 7.0
    assert tuned.requirements[0].corner == {GAIN: pytest.approx(upper)}
    assert (tuned.feasible, tuned.corners, len(tuned.confirmed), upper <= bound) == (True, 3, 2, True)


@pytest.mark.parametrize(("lower", "upper", "least"), [(130.0, 250.0, 134.46), (190.0, 210.0, 190.0)])
def test_a_gain_stays_within_the_limits_of_its_tolerance(lower, upper, least):
    """From 200 1/s: the known gain, 149.46 1/s, less 3 std; the nearest limit where that is beyond.

    The worst corner is 3 std above the gain that was found, or the limit, as `corners` of it has them.
    """
    wide = model.Tolerance(kind="truncated-normal", std=5.0, lower=lower, upper=upper, text="5 1/s")
    stated = model.Parameter(path=GAIN, text="200 1/s", value=200.0, unit="1/s", tolerance=wide)
    design = integrator(need("phase_margin", 60.0, loop="position"), gain=200.0)
    tuned = tune(replace(design, parameters={GAIN: stated}), TuningSettings(curve=False))
    gain = tuned.design.parameters[GAIN]
    most = Factor(GAIN, gain.value, gain.tolerance).box[1]
    assert gain.value == pytest.approx(least, rel=1e-4)
    assert tuned.requirements[0].corner[GAIN] == pytest.approx(most)
    assert tuned.feasible == (least < 149.46)


def test_no_step_is_followed_that_no_requirement_is_on(monkeypatch):
    """The joint's current loop settles in thousands of samples; the position's figures are the same bits."""
    seen = []

    def noted(*asked, **more):
        seen.append((asked, more, linear_figures(*asked, **more)))
        return seen[-1][-1]

    monkeypatch.setattr(problem_module, "linear_figures", noted)
    asked = replace(need("settling_time", None, loop="position", unit="s"), maximum=1.0)
    design = replace(load_design("joint"), requirements=(asked,))
    problem = problem_of(design, (asked,), {})
    distances = problem.exact_distances(problem.present[None, :], problem.all_corners[:2])
    (population,), more, found = seen[-1]
    assert np.isnan(found.quantity("settling_time", "current")).all()
    whole = linear_figures(population, **more | {"time_figures": True})
    assert np.isfinite(whole.quantity("settling_time", "current")).all()
    assert np.array_equal(distances[0, :, 0], 1.0 - whole.quantity("settling_time", "position"))


def test_all_that_is_asked_of_the_same_designs_is_one_look_at_them():
    """With a look at each question the joint's trade-off ended at its bound, two points not met."""
    problem = problem_of(load_design("joint"), load_design("joint").requirements, {})
    gains, corners = np.stack([problem.start, problem.present, problem.start]), problem.all_corners[:4]
    chosen = problem.evaluations  # to choose the factors
    width, _ = problem.figure("bandwidth", "position", gains, corners), problem.distances(gains, corners)
    margin = problem.figure("phase_margin", "velocity", gains, corners)
    assert problem.evaluations - chosen == 3 * 4
    turned = gains[::-1][1:]  # others of these are another question
    assert np.array_equal(problem.figure("phase_margin", "velocity", turned, corners), margin[::-1][1:])
    assert np.array_equal(problem.figure("bandwidth", "position", gains[:2], corners[:2]), width[:2, :2])
    assert problem.evaluations - chosen == 3 * 4 + 2 * 4 + 2 * 2


def test_the_step_of_a_speed_drive_is_judged_by_its_speed():
    """w[k] = r (1 - (1 - a)^k) with a = K T/J: its levels lie on straight lines from tick to tick."""
    K, J, size, ticks = 1.0, 0.1, 0.5, 400
    design = source_drive(J, 1.0, PERIOD, 10.0, controller={"velocity": VelocityLoop(gain=K)})
    found = step_columns(StepCheck(size, ticks * PERIOD), Population(design, {}, 1))
    k = np.arange(ticks + 1)
    y = 1.0 - (1.0 - K * PERIOD / J) ** k
    ten, ninety = np.interp([0.1, 0.9], y, k) * PERIOD
    assert found["nonlinear.rise_time"][0] == pytest.approx(ninety - ten, rel=1e-9)
    assert found["nonlinear.settling_time"][0] == pytest.approx(PERIOD * k[y >= 0.98][0])
    assert found["nonlinear.overshoot"][0] == 0.0
    assert found["nonlinear.final_error"][0] == pytest.approx(100.0 * (1.0 - y[ticks - 1]), rel=1e-6)


def test_the_time_in_a_limit_is_that_of_the_ticks_that_ask_for_more():
    """At the limit U the speed rises by U T/J a tick; K (r - k U T/J) > U up to k = 200/3 where r = 0.5."""
    design = source_drive(0.1, 1.0, PERIOD, 0.3, controller={"velocity": VelocityLoop(gain=1.0)})
    asked = replace(design, requirements=(need("phase_margin", 1.0),))
    assert [one.limited for one in tune(asked, TuningSettings(curve=False)).checks] == ["", "voltage 67 ms"]


def test_a_speed_drive_trades_its_own_bandwidth_and_steps_to_half_its_top_speed():
    design = load_design("ilr33-amber")
    design = replace(design, controller=replace(design.controller, position=None), requirements=())
    tuned = tune(design, TuningSettings((need("phase_margin", 50.0, loop="velocity"),)))
    widths = [point.bandwidth_hz for point in tuned.trade_off]
    reached = closed_loop_bandwidth(assemble_loops(tuned.design).velocity.closed_loop).minus3db_hz
    assert min(widths) < reached < max(widths)
    top = design.limits.speed_rad_s / design.total_ratio
    assert [one.amplitude_rad for one in tuned.checks[::2]] == pytest.approx([0.025 * top, 0.5 * top])
    assert all(one.settling_time_s is not None for one in tuned.checks)


def test_an_unstable_drive_whose_outer_poles_are_not_known_is_far_from_every_limit():
    """A thousand times its current gain: the radius of the position loop is NaN, which is no reserve."""
    design = load_design("ballscrew")
    problem = problem_of(design, gain_requirements(design), {})
    gains = np.array([problem.present * [1e3 if "current.gain" in path else 1.0 for path in problem.paths]])
    wild = with_values(design, dict(zip(problem.paths, map(float, gains[0]), strict=True)))
    assert not stability_margins(assemble_loops(wild).current.open_loop).stable
    assert problem.distances(gains, problem.all_corners[:1]).max() <= -3.0


def test_what_cannot_be_met_is_refused_with_its_distance():
    """A phase margin of 60 deg and a bandwidth of 60 Hz exclude each other behind 3.5 ms of delay."""
    phase = need("phase_margin", 60.0, loop="position")
    wide = [need("bandwidth", hz, loop="position", unit="Hz") for hz in (10.0, 60.0)]
    reachable, asked = (tune(integrator(phase, each), QUICK) for each in wide)
    assert (reachable.feasible, asked.feasible) == (True, False)
    both = {r.id: r for r in asked.requirements}
    assert all(r.binds for r in both.values())
    margin, width = both["position-phase_margin"], both["position-bandwidth"]
    assert margin.relative == pytest.approx(width.relative, abs=0.01)
    assert width.value == pytest.approx(60.0 + width.distance)
    truth = stability_margins(assemble_loops(asked.design).position.open_loop).phase_margin_deg
    assert margin.value == pytest.approx(truth, abs=1e-3)
    assert "Cannot be met together" in asked.notes[0]


def pi_behind(gain, time, plant, s):
    return gain * (1 + 1 / (time * s)) * plant(s)


def test_rules_of_gains_are_their_closed_forms():
    s = 3.0j
    loop = pi_behind(*magnitude_optimum(2.0, 0.05, 0.01), lambda s: 2.0 / (1 + 0.05 * s) / (1 + 0.01 * s), s)
    assert loop == pytest.approx(1 / (2 * 0.01 * s * (1 + 0.01 * s)))
    for a, margin in ((2.0, 36.8699), (2 + math.sqrt(3), 60.0)):  # symmetric optimum: at its crossover
        gains, crossover = symmetric_optimum(4.0, 0.01, a), 1j / (a * 0.01)
        loop = pi_behind(*gains, lambda s: 4.0 / s / (1 + 0.01 * s), crossover)
        assert abs(loop) == pytest.approx(1.0)
        assert 180 + math.degrees(cmath.phase(loop)) == pytest.approx(margin, abs=1e-4)
    # R/(2 T_sigma) L/R = 20 mohm with T_sigma 150 us: the current gain that the baseline has
    rules = rule_gains(load_design("ilr33-amber")).values
    assert rules["control.current.gain"] == pytest.approx(0.02)
    assert rules["control.current.integral_time"] == pytest.approx(6e-6 / 0.055)
    # |K (1 + j w Td) kM/(j w (Cv + j w J))| = 1, at w = 2/Td, or without Td at the corner Cv/J
    base = load_design("ilr33-amber")
    kM, Cv, J = base.motor.torque_constant_Nm_A, base.friction.viscous_Nms_rad, base.inertia_kgm2
    for Td, w in ((0.02, 100.0), (None, Cv / J)):
        position = replace(base.controller.position, derivative_time_s=Td)
        control = replace(base.controller, velocity=None, position=position)
        gain = rule_gains(replace(base, controller=control)).values["control.position.gain"]
        loop = gain * (1 + 1j * w * (Td or 0.0)) * kM / (1j * w * (Cv + 1j * w * J))
        assert abs(loop) == pytest.approx(1.0)


def test_every_corner_meets_the_requirements_in_whole_steps_and_steps_settle():
    asked = need("bandwidth", 60.0, loop="position", unit="Hz"), need("phase_margin", 60.0, loop="every")
    told: list[tuple[int, int]] = []
    tuned = tune(load_design("ilr33-amber"), TuningSettings(asked), progress=lambda *of: told.append(of))
    assert (tuned.feasible, tuned.corners) == (True, 17)
    stages = len(tuned.trade_off) + 4  # one choice of elements, the point of each bandwidth, three more
    assert sorted(set(told)) == [(done, stages) for done in range(stages + 1)]
    assert told == sorted(told)
    figures = {"every-phase_margin": "phase_margin_deg", "gain-margin": "gain_margin_db"}
    asked = {r.id: r for r in tuned.requirements}
    for name, figure in figures.items():
        corner = asked[name].corner
        loops = assemble_loops(with_values(tuned.design, dict(corner)) if corner else tuned.design)
        margins = (stability_margins(loop.open_loop) for loop in loops.present.values())
        assert min(getattr(m, figure) for m in margins) == pytest.approx(asked[name].value, rel=1e-6)
    exported, gains = export_objects(tuned.design), {g.object: g for g in tuned.gains}
    written = {item.label: item.value for item in exported.objects.values}
    assert {label: written[label] for label in gains} == {label: g.steps for label, g in gains.items()}
    assert not {r.label for r in exported.rounded} & set(gains)
    assert 1 <= gains["0x2348.01"].steps <= 250
    assert gains["0x2342.02"].steps >= 150
    curve = [(p.bandwidth_hz, -p.phase_margin_deg) for p in tuned.trade_off if p.feasible]
    assert len(curve) >= 4
    for values in zip(*curve, strict=True):
        assert list(values) == sorted(values)
    assert len(tuned.checks) == 4
    assert all(c.settling_time_s is not None for c in tuned.checks)
    assert any(c.limited for c in tuned.checks)


@pytest.mark.parametrize(("least", "most", "limit"), [(10.0, 13.0, 13.0), (10.0, 400.0, 10.0)])
def test_a_requirement_with_two_limits_is_told_by_the_nearer_one(least, most, limit):
    """It was told by the lower one: 10.005 found of 10, where it was 12.995 of 13."""
    band = replace(need("bandwidth", least, loop="position", unit="Hz"), maximum=most)
    stiff = need("phase_margin", 80.0 if limit == least else 30.0, loop="position")
    tuned = tune(load_design("ilr33-amber"), replace(QUICK, requirements=(band, stiff)))
    (told,) = (one for one in tuned.requirements if one.id == band.id)
    design = with_values(tuned.design, dict(told.corner)) if told.corner else tuned.design
    found = closed_loop_bandwidth(assemble_loops(design).plain_response).minus3db_hz
    assert (told.value, told.limit) == (pytest.approx(found, rel=1e-6), limit)


def test_the_command_writes_a_design_that_is_what_it_says(cli, tmp_path):
    """What excludes each other, and what does not."""
    mine = tmp_path / "mine.toml"
    mine.write_text(write_design(integrator(need("phase_margin", 60.0, loop="position"))))
    words = ("tune", mine, "--no-curve", "--out", tmp_path, "--quiet", "--require")
    said = cli.text(*words, "position.bandwidth>=60 Hz", status=1)
    assert (said[:6], "misses" in said) == ("FAIL  ", True)
    made = json.loads((tmp_path / "tune.json").read_text())
    assert made["verdict"]["passed"] is False
    assert not (tmp_path / "tuned.toml").exists()
    cli.text(*words, "position.bandwidth>=10 Hz")
    made = json.loads((tmp_path / "tune.json").read_text())
    gains = {row["path"]: row["rounded"] for row in made["sections"][0]["blocks"][1]["rows"]}
    tuned = load_design(tmp_path / "tuned.toml")
    assert gains[GAIN] == pytest.approx(tuned.controller.position.gain, rel=1e-7)
    asked = {item.id: item.minimum for item in tuned.requirements if item.quantity == "bandwidth"}
    assert asked["position-bandwidth-wanted"] == 10.0


def test_of_many_tolerances_the_strongest_make_the_corners_and_wishes_make_sense():
    motor = dict.fromkeys(("resistance", "inductance", "rotor_inertia"), 10)
    friction = dict.fromkeys(("viscous", "dry_torque", "load_coefficient"), 30)
    design = read_design_text(toleranced(motor=motor, friction=friction, limits={"voltage": 5}))
    problem = problem_of(design, gain_requirements(design), dict(rule_gains(design).values))
    kept = {f.path for f in problem.factors}
    assert (len(problem.toleranced), len(kept), "motor.resistance" in kept) == (11, 10, True)
    assert problem.all_corners.shape == (1025, 10)
    refused(tune, integrator(), words="--require")
    for wish, words in (
        ("bandwidth>30", "allowed"), ("tail.bandwidth>=3 Hz", "current, velocity, position"),
        ("position.colour>=3 Hz", "bandwidth"), ("position.bandwidth>=3 kg", "kg"),
        ("position.bandwith>=3 Hz", 'known: "bandwidth"'), ("every.phase_margin>=40", "unit like deg"),
    ):  # fmt: skip
        refused(read_requirement, wish, design, words=words)
    for stage, element in (("velocity", "notch"), ("position", "feedforward")):
        refused(checked, as_law(design, stage), [element], words=f"not beside control.{stage}.law")


def servo(*requirements, stiffness=None, gain=0.02, integral_time=None, position=None):
    """A torque source and a velocity loop; with a stiffness the load hangs on a spring of 1 % damping."""
    inertia, coupling = 1e-4, None
    if stiffness is not None:
        damping = 0.02 * (stiffness * inertia / 2) ** 0.5
        coupling = Coupling(stiffness_Nm_rad=stiffness, damping_Nms_rad=damping)
    loop = model.VelocityLoop(gain=gain, integral_time_s=integral_time)
    control = {"computing_delay_s": 2.5e-4, "position": position, "velocity": loop}
    return source_drive(
        inertia, 1.0, 2.5e-4, 10.0, gears=(Gear(name="none", ratio=1.0),), coupling=coupling,
        load={"inertia_kgm2": inertia, "path": "back-drivable"}, friction={"viscous_Nms_rad": 1e-4},
        controller=control, requirements=requirements,
    )  # fmt: skip


RESONANT = 0.5e-4 * (2 * np.pi * 700.0) ** 2  # 700 Hz, where the delay turns by more than 90 deg
DIRECT = changed(servo(), controller={"velocity": None, "position": PositionLoop(gain=1.0)})
WIDE = (need("gain_margin", 6.0, unit="dB"), need("phase_margin", 30.0), need("bandwidth", 60.0, unit="Hz"))


def seen(design):
    """What certified margins and the bandwidth say of the velocity loop."""
    loop = assemble_loops(design).velocity
    found = stability_margins(loop.open_loop, certify=True)
    assert found.stable is True
    width = closed_loop_bandwidth(loop.closed_loop).minus3db_hz
    return found.gain_margin_db, found.phase_margin_deg, width


def test_a_requirement_that_only_a_notch_meets(cli, tmp_path):
    """No gain does; with the notch that the command places certified margins say that every limit is kept."""
    design, mine = servo(*WIDE, stiffness=RESONANT), tmp_path / "mine.toml"
    problem = problem_of(design, gain_requirements(design), {})
    grid = np.geomspace(1e-4, 1.0, 400)[:, None]
    assert problem.distances(grid, problem.all_corners).min(axis=(1, 2)).max() < 0.0
    refused = tune(design, QUICK)
    assert not refused.feasible
    assert "Cannot be met together" in refused.notes[0]
    mine.write_text(write_design(design))
    words = ("--place", "notch,lowpass", "--aim", "least-change", "--no-curve", "--quiet", "--out", tmp_path)
    assert "least change" in cli.text("tune", mine, *words)  # status 0: every requirement is met
    tuned = load_design(tmp_path / "tuned.toml")
    (notch,) = tuned.controller.velocity.filters
    assert notch.kind == "notch"
    assert notch.frequency_rad_s / (2 * np.pi) == pytest.approx(700.0, rel=0.3)
    gain, phase, width = seen(tuned)
    assert (gain >= 6.0, phase >= 30.0, width >= 60.0) == (True, True, True)
    assert nearest_drawn(design, 1.3 * distance_of(tuned)) >= 0.999 * distance_of(tuned)


def distance_of(tuned):
    """Squares of the ln ratios of gain and depth, and of the width of the notch over its frequency."""
    velocity, notch = tuned.controller.velocity, tuned.controller.velocity.filters[-1]
    ratios = np.log([velocity.gain / 0.02, notch.depth])
    return ratios @ ratios + (notch.width_rad_s / notch.frequency_rad_s) ** 2


def nearest_drawn(design, most):
    """Of many notches about the resonance, with any gain and depth: the nearest that does, below a change."""
    problem = problem_of(design, gain_requirements(design), {}, ("notch",))
    rng, size = np.random.default_rng(5), 60_000
    frequency = 2 * np.pi * 700.0 * np.exp(rng.uniform(-0.3, 0.3, size))
    gain, depth = 0.02 * np.exp(rng.uniform(0.0, 1.5, size)), np.exp(rng.uniform(-1.5, 0.0, size))
    rows = np.column_stack([gain, frequency, frequency * rng.uniform(0.0, 1.5, size), depth])
    rows = rows[problem.change(rows) < most]
    met = problem.distances(rows, problem.all_corners).min(axis=(1, 2)) >= 0.0
    assert met.any()
    return problem.change(rows)[met].min()


def test_no_smaller_change_of_two_gains_meets_the_requirements():
    """Every point of a dense grid over both gains that meets all limits is at least as far away."""
    asked = (need("bandwidth", 50.0, unit="Hz"), need("phase_margin", 62.0))
    design = servo(*asked, gain=0.03, integral_time=0.01)
    tuned = tune(design, QUICK)
    assert tuned.feasible
    gain, time = tuned.design.controller.velocity.gain, tuned.design.controller.velocity.integral_time_s
    change = np.log(gain / 0.03) ** 2 + np.log(time / 0.01) ** 2
    assert change > 0.01
    reach = 1.2 * np.sqrt(change)
    line = np.linspace(-reach, reach, 61)
    grid = np.exp(np.array(np.meshgrid(line, line)).reshape(2, -1).T) * [0.03, 0.01]
    problem = problem_of(design, gain_requirements(design), {})
    met = problem.distances(grid, problem.all_corners).min(axis=(1, 2)) >= 0.0
    assert met.any()
    away = (np.log(grid / [0.03, 0.01]) ** 2).sum(axis=1)
    assert change <= away[met].min() * (1 + 1e-9)
    _, phase, width = seen(tuned.design)
    assert (phase >= 62.0, width >= 50.0) == (True, True)


def test_what_meets_all_is_left_neutral_elements_are_neutral_and_ranges_are_of_the_drive():
    design = servo(need("phase_margin", 30.0))
    tuned = tune(design, replace(QUICK, place=("notch", "lowpass")))
    assert (tuned.feasible, tuned.placed, tuned.design.controller) == (True, (), design.controller)
    # a notch of depth 1 is a factor 1; feed-forward starts at what the design has
    design = servo(stiffness=RESONANT, position=PositionLoop(gain=20.0, feedforward=0.4))
    placed, variables = place(design, ("notch", "feedforward"))
    starts = {v.path: v.start for v in variables}
    assert starts["control.position.feedforward"] == 0.4
    for name in ("velocity", "position"):
        loops = (getattr(assemble_loops(one), name).open_loop for one in (design, placed))
        before, after = ((m.gain_margin_db, m.phase_margin_deg) for m in map(stability_margins, loops))
        assert after == pytest.approx(before, rel=1e-9)
    # 0x2348.01 holds 1 to 250 1/s in whole steps; another drive may have any gain
    baseline = load_design("ilr33-amber")
    assert baseline.objects.named
    assert allowed_range(baseline, "control.position.gain") == (1.0, 250.0)
    other = replace(baseline, objects=model.ControllerObjects())
    assert allowed_range(other, "control.position.gain") == (0.0, np.inf)
    assert step_of_gain(load_design("joint"), "control.position.gain") is None


def test_feed_forward_carries_the_bandwidth_where_the_gain_may_not_rise():
    """A P loop of 80 deg falls by 3 dB far below the velocity loop; feed-forward reaches that one."""
    band = need("bandwidth", 60.0, loop="position", unit="Hz")
    asked = (band, need("phase_margin", 80.0, loop="position"), need("gain_margin", 15.0, unit="dB"))
    design = servo(*asked, gain=0.1, position=PositionLoop(gain=20.0))
    assert not tune(design, QUICK).feasible
    tuned = tune(design, replace(QUICK, place=("feedforward",)))
    assert (tuned.feasible, tuned.placed) == (True, ("feedforward",))
    position = tuned.design.controller.position
    assert position.feedforward > 0.0 or position.acceleration_feedforward > 0.0


def test_a_rate_that_a_velocity_gain_bounds_is_tuned_for_and_every_other_requirement_is_judged():
    """K (w_lim - w) = C + L: w of w_lim/2 takes K = 2 (C + L)/w_lim; no gain moves the acceleration k U/J."""
    rate = model.Requirement(
        id="rate", quantity="output_rate", unit="deg/s", minimum=math.degrees(5.0), load_Nm=0.4
    )
    push = model.Requirement(id="push", quantity="acceleration", unit="deg/s^2", minimum=math.degrees(1e5))
    design = changed(
        servo(need("phase_margin", 30.0), rate, push, gain=0.05, position=PositionLoop(gain=1.0)),
        limits={"speed_rad_s": 10.0}, friction={"dry_torque_Nm": 0.1, "viscous_Nms_rad": 0.0},
    )  # fmt: skip
    tuned = tune(design, QUICK)
    assert tuned.design.controller.velocity.gain == pytest.approx(2.0 * 0.5 / 10.0, rel=1e-5)
    assert (tuned.feasible, tuned.passed) == (True, False)
    short = [one for one in evaluate_requirements(tuned.design) if not one.passes]
    for found in (tuned.others, short):
        assert {one.id: one.verdict for one in found} == {"push": "not met"}
    assert summary(tuned).endswith("Not met, and not searched for: Drive: acceleration.")
    slow = tuple(replace(one, minimum=one.minimum / 9.0) for one in design.requirements)
    met = tune(replace(design, requirements=slow), QUICK)
    assert met.passed
    assert summary(met).endswith("The tuned design meets every other requirement.")
    assert "Not met: Drive" not in summary(tune(replace(design, requirements=design.requirements[:2]), QUICK))


@pytest.mark.parametrize(("words", "design", "message"), [
    (("filter",), servo(), "notch, lowpass, feedforward"),
    (("feedforward",), servo(), "no control.position"),
    (("notch",), DIRECT, "no control.velocity"),
])  # fmt: skip
def test_what_has_no_place_is_refused(words, design, message):
    asked = replace(design, requirements=(need("gain_margin", 6.0, loop="every", unit="dB"),))
    with pytest.raises(InputError, match=message):
        tune(asked, replace(QUICK, place=words))
