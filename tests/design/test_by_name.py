"""Designs by name, path or key where Python asks for one: sweeps, changes, hashes, what a notebook shows."""

import pickle
from contextlib import nullcontext
from importlib import import_module
from xml.etree import ElementTree

import control
import numpy as np
import pytest
from scipy import signal

import analyses
from actuator_lti import (
    InputError,
    assemble_loops,
    closed_loop_bandwidth,
    load_design,
    onset,
    stability_margins,
    step_figures,
    sweep,
    unwrapped_phase_deg,
    write_design,
)
from actuator_lti.design import (
    design_hash,
    parameter_value,
    paths_of,
    read_design_text,
    tolerances,
    with_overrides,
    with_values,
)
from actuator_lti.design.loader import design_text
from actuator_lti.loops.delay_budget import delay_budget
from actuator_lti.margins import MeasuredResponse
from analyses.monte_carlo import StepCheck, monte_carlo
from nonlinear import Drive, commands, simulate
from nonlinear.export import c_export, controller_export, fmu_bytes
from tests.refusals import refused

DESIGN, STEP = load_design("ilr33-amber"), commands.step(0.01)


def test_loops_and_runs_of_a_name_a_path_and_a_design_are_the_same(tmp_path) -> None:
    file = tmp_path / "copy.toml"
    file.write_text(write_design(DESIGN), encoding="utf-8")
    wanted = assemble_loops(DESIGN).position.open_loop
    run = simulate(DESIGN, STEP, 0.02)
    budget = delay_budget(DESIGN, "velocity", 100.0)
    assert load_design(DESIGN) is DESIGN
    for given in ("ilr33-amber", str(file), file):
        result = assemble_loops(given).position.open_loop
        assert all(np.array_equal(getattr(result, part), getattr(wanted, part)) for part in "ABCD")
        again = simulate(given, STEP, 0.02)
        assert np.array_equal(again.output_angle_rad, run.output_angle_rad)
        assert delay_budget(given, "velocity", 100.0) == budget


ROOMS = "corners duty failures friction_effects limit_cycles margins specification stiffness"
SHORT = "evaluate_requirements large_signals sawtooth survey_loops tune validate"
ASKED = {name: getattr(import_module(f"analyses.{name}"), name) for name in ROOMS.split()}
ASKED |= {name: getattr(analyses, name) for name in SHORT.split()} | {"loops": assemble_loops}
ASKED |= {one.__name__: one for one in (c_export, controller_export, fmu_bytes)}
ASKED |= {"samples": lambda name: monte_carlo(name, "x"), "run": lambda name: simulate(name, STEP, 0.02)}
ASKED |= {"map": lambda name: analyses.amplitude_map(name, assemble_loops(DESIGN))}


@pytest.mark.parametrize("ask", ASKED.values(), ids=ASKED)
def test_every_analysis_of_a_design_takes_its_name(ask) -> None:
    refused(ask, "ilr33-ambre", words='nearest known: "ilr33-amber"')
    refused(ask, b"ilr33-amber", words="a Design, a shipped name, or the path of a design file")


SQUARE = control.nlsys(None, lambda t, x, u, params: u**2, inputs=1, outputs=1)
THREE = control.frd([1j, 2j, 3j], [1.0, 2.0, 3.0])
BAD = [  # arguments of another kind: tests/python/test_public_arguments.py
    lambda: analyses.large_signals("ilr33-amber", counts=(0, 0)),
    lambda: analyses.large_signals("ilr33-amber", counts=(5.5, 6)),
    lambda: DESIGN.with_values({"motor.resistance": lambda: 1.0}),
    lambda: DESIGN.with_values({"motor.resistance": 1j}),
    lambda: DESIGN.with_values([("motor.resistance", 1.0)]),
    lambda: DESIGN.with_values({3: 1.0}),
    lambda: assemble_loops(DESIGN)["speed"],
    lambda: stability_margins(control.tf([1.0], [1.0, 1.0]), delay_s=True),
    lambda: onset(assemble_loops(DESIGN), "1"),
    lambda: unwrapped_phase_deg(control.tf([1.0], [1.0, 1.0]), "1"),
    lambda: MeasuredResponse.with_noise(THREE, "1"),
    lambda: stability_margins(SQUARE),
    lambda: closed_loop_bandwidth(SQUARE),
    lambda: step_figures(SQUARE),
    lambda: unwrapped_phase_deg(SQUARE, 1.0),
    lambda: stability_margins(signal.lti([[0.0]], [[1.0, 1.0]], [[1.0]], [[0.0, 0.0]])),
    lambda: Drive(DESIGN).control(None, 0.0, 0.0, 0.0),
    lambda: Drive(DESIGN).control(0.0, "a", 0.0, 0.0),
    lambda: Drive(DESIGN).control(0.0, 0.0, 0.0, [0.1]),
    lambda: Drive(DESIGN).control(0.0, 0.0, float("nan"), 0.0),
    lambda: Drive(DESIGN).control(0.0, 0.0, 0.0, 0.0, bus_V=float("nan")),
    lambda: Drive(DESIGN).set(np.nan * Drive(DESIGN).get()),
    lambda: simulate(DESIGN, STEP, 0.1, record_every=1.5),
    lambda: simulate(DESIGN, STEP, 0.001).limit_active("brake"),
    lambda: DESIGN.add_filter("velocity", kind="lowpass", frequency=[1.0]),
]


@pytest.mark.parametrize("ask", BAD)
def test_a_bad_argument_is_an_input_error_that_says_what_is_allowed(ask) -> None:
    refused(ask, match=r"allowed: |must be |one of |has one input")


@pytest.mark.parametrize(("ask", "words"), [
    (lambda: sweep(DESIGN, None, [1]), "path = None: must be text"),
    (lambda: MeasuredResponse.from_coherence(THREE, [0.5, 1.2, 0.9], 8), "(0, 1]"),
    (lambda: MeasuredResponse.from_coherence(THREE, [0.5, 0.0, 0.9], 8), "(0, 1]"),
    (lambda: MeasuredResponse.with_noise(THREE, np.inf), "finite and not negative"),
    (lambda: delay_budget("ilr33-amber", "velocity", "a"), "frequency_rad_s = 'a'"),
    (lambda: onset(assemble_loops(DESIGN), "a"), "omega_rad_s = 'a'"),
    (lambda: onset(assemble_loops(DESIGN), float("nan")), "omega_rad_s = nan"),
    (lambda: onset(assemble_loops(DESIGN), 1.0, {"curent": 1.0}), "curent"),
    (lambda: onset("ilr33-amber", 1.0), "must be a Loops, from actuator_lti"),
    (lambda: simulate(DESIGN, STEP, 0.01, tanh_tolerance=0), "tanh_tolerance = 0"),
    (lambda: DESIGN.with_law("velocity", control.tf([1.0, 0.0], [1.0], 1e-3), ["error"]), "system: improper"),
    (lambda: sweep(DESIGN, "limits.voltage", "10 V"), "must be several"),
    (lambda: stability_margins(5), "system = 5: allowed: a StateSpace"),
    (lambda: StepCheck(-1.0), "amplitude_rad = -1: must be above 0"),
    (lambda: DESIGN.with_law("velocity", ([],) * 4 + (1e-4,), []), "inputs = an empty list: allowed: a list"),
])  # fmt: skip
def test_a_refusal_names_what_is_wrong(ask, words: str) -> None:
    refused(ask, words=words)


def test_a_system_of_scipy_is_that_system() -> None:
    """1/(s (s + 1)) has 51.827 deg, 1/(s + 1) a bandwidth of 1 rad/s and a rise of ln 9; integrators in z."""
    pole, double = signal.lti([1.0], [1.0, 1.0]), [[0.0, 1.0], [0.0, -1.0]]
    phase_deg = np.degrees(np.arctan(1.0 / np.sqrt(0.5 * (np.sqrt(5.0) - 1.0))))
    matrices = signal.lti(double, [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]])
    for loop in (signal.lti([1.0], [1.0, 1.0, 0.0]), signal.lti([], [0.0, -1.0], 1.0), matrices):
        assert stability_margins(loop).phase_margin_deg == pytest.approx(phase_deg, rel=1e-12)
        assert unwrapped_phase_deg(loop, 1.0) == pytest.approx(-135.0, rel=1e-12)
    assert closed_loop_bandwidth(pole.to_ss()).minus3db_rad_s == pytest.approx(1.0, rel=1e-12)
    assert step_figures(pole).rise_time_s == pytest.approx(np.log(9.0), rel=1e-12)
    sampled = stability_margins(signal.dlti([0.1], [1.0, -1.0], dt=0.1))
    assert (sampled.period_s, sampled.gain_margin.ratio) == (0.1, pytest.approx(20.0, rel=1e-12))


NUMPY = (np.int64, np.int32, np.uint8, np.float16, np.float32, np.float64, np.longdouble)


@pytest.mark.parametrize("kind", NUMPY)
def test_every_real_number_of_numpy_is_a_number(kind) -> None:
    law = ([], [], [], [[60.0]], 2.0 * DESIGN.controller.period_s)
    design = DESIGN.with_law("position", law, ["error"], every=kind(2), gain=kind(3)).with_values(
        {"limits.voltage": kind(14), "control.velocity.every": kind(2)}
    )
    assert (design.controller.position.every, design.controller.position.law.gain) == (2, 3.0)
    assert (design.limits.voltage_V, design.controller.velocity.every) == (14.0, 2)
    (point,) = sweep(DESIGN, "limits.voltage", np.array([14], kind))
    assert point.design.limits.voltage_V == 14.0
    refused(DESIGN.with_values, {"control.velocity.every": True}, words="every = True: allowed: a whole")


def test_loops_are_indexed_and_iterated_by_name() -> None:
    loops = assemble_loops(DESIGN)
    assert list(loops) == ["current", "velocity", "position", "u", "i_ref", "w_ref", "output"]
    assert loops["velocity"] is loops.velocity
    assert loops["output"] is loops.break_points["output"]
    assert dict(loops) == dict(loops.items()) == {name: loops[name] for name in loops}
    assert (len(loops), loops.values()[1]) == (len(loops.keys()), loops.velocity)
    refused(stability_margins, loops.velocity, words="of a Loop its open_loop")


def test_a_sweep_changes_one_key_and_says_so() -> None:
    points = sweep("ilr33-amber", "control.position.gain", ["60 1/s", 120.0])
    assert [point.value for point in points] == ["60 1/s", 120.0]
    assert [point.design.controller.position.gain for point in points] == [60.0, 120.0]
    assert points[0].design.parameters["control.position.gain"].source.startswith("changed from")
    assert all(point.design.motor == DESIGN.motor for point in points)
    refused(sweep, "ilr33-amber", "limits.voltage", ["12 A"], words="limits.voltage")


def cells(html: str) -> list[str]:
    """Cells of a table, all of whose tags are closed."""
    parts = list(ElementTree.fromstring(f"<table>{html}</table>").iter())
    assert {part.tag for part in parts} <= {"table", "caption", "thead", "tbody", "tr", "th", "td"}
    return ["".join(part.itertext()) for part in parts if part.tag in ("td", "th", "caption")]


def test_a_notebook_shows_designs_loops_and_margins_and_texts_of_a_file_become_no_html() -> None:
    hostile = write_design(DESIGN).replace("ILR-33", "<script>alert(1)</script>ILR-33")
    assert cells(read_design_text(hostile)._repr_html_())
    shown = cells(DESIGN._repr_html_())
    assert all(path in shown and known.text in shown for path, known in DESIGN.parameters.items())
    loops = assemble_loops(DESIGN)
    assert {"current", "velocity", "position", "w_ref"} <= set(cells(loops._repr_html_()))
    margins = stability_margins(loops.position.open_loop)
    shown = cells(margins._repr_html_())
    assert shown[0] == "closed loop: stable"
    assert f"{margins.phase_margin_deg:.4g} deg" in shown


@pytest.mark.parametrize("path", paths_of(DESIGN))
def test_every_numeric_key_can_be_read_and_changed(path: str) -> None:
    value = parameter_value(DESIGN, path)
    factor = 1.0 if path in ("encoder.difference_samples", "friction.breakaway_ratio") else 2.0
    factor = 0.5 if path in ("limits.continuous_current", "limits.speed", "limits.release") else factor
    changed = with_values(DESIGN, {path: value * factor}, check=False)
    assert parameter_value(changed, path) == value * factor
    others = {p: parameter_value(changed, p) for p in paths_of(changed) if p != path}
    assert others == {p: parameter_value(DESIGN, p) for p in paths_of(DESIGN) if p != path}


def test_a_changed_value_says_what_it_was_with_its_relative_tolerance_or_the_absolute_one() -> None:
    parameter = with_values(DESIGN, {"motor.resistance": 0.06}).parameters["motor.resistance"]
    assert (parameter.value, parameter.text) == (0.06, "0.06 ohm")
    assert parameter.source == "changed from 55 mohm"
    relative = with_values(DESIGN, {"load.inertia": 4e-4}).parameters["load.inertia"].tolerance
    assert relative.half_width == pytest.approx(2e-4)
    emps = load_design("emps")
    absolute = with_values(emps, {"motor.rotor_inertia": 200.0}).parameters["motor.rotor_inertia"].tolerance
    assert absolute == emps.parameters["motor.rotor_inertia"].tolerance


@pytest.mark.parametrize(("values", "says"), [
    ({"motor.resistence": 1.0}, 'nearest known: "motor.resistance"'),
    ({"gear.bevel.ratio": 2.0}, "has no gear.bevel"),
    ({"gear.ratio": 2.0}, "unknown parameter"),
    ({"friction.law": 1.0}, "unknown parameter"),
    ({"motor.resistance": -1.0}, "above 0"),
    ({"motor.resistance": float("nan")}, "above 0"),
    ({"motor.resistance": True}, "a number"),
    ({"control.velocity.every": 1.5}, "whole number"),
    ({"motor.back_emf_constant": 0.01}, "within 10 %"),
])  # fmt: skip
def test_an_impossible_change_is_refused(values: dict[str, float], says: str) -> None:
    """Relations may be left unchecked for sampling, but not ranges."""
    refused(with_values, DESIGN, values, match=says)
    with nullcontext() if says == "within 10 %" else pytest.raises(InputError, match=says):
        with_values(DESIGN, values, check=False)


def test_text_overrides_change_any_key_as_a_file_would() -> None:
    changed = with_overrides(
        DESIGN,
        {
            "motor.resistance": "60 mohm",
            "gear.worm.ratio": 40,
            "friction.law": "tanh",
            "control.velocity.every": 2,
            "control.position.every": 10,
            "validation.loads": ["0 N*m", "4 N*m"],
            "requirement.position-bandwidth.minimum": "20 Hz",
            "design.name": "variant",
            "load.inertia": {"value": "1e-4 kg*m^2", "source": "weighed"},
        },
    )
    assert changed.motor.resistance_ohm == 0.06
    assert changed.total_ratio == 66 * 40
    assert changed.friction.law == "tanh"
    assert changed.controller.position.every == 10
    assert changed.validation.loads_Nm == (0.0, 4.0)
    assert {r.id: r.minimum for r in changed.requirements}["position-bandwidth"] == 20.0
    assert changed.name == "variant"
    assert changed.parameters["load.inertia"].source == "weighed"
    assert changed.parameters["load.inertia"].tolerance is None


@pytest.mark.parametrize(
    "path", ["motor.resistence", "gear.bevel.ratio", "x", "design", "motor.resistance.a.b", "gear.worm", ""]
)
def test_an_override_of_an_unknown_key_is_refused(path: str) -> None:
    refused(with_overrides, DESIGN, {path: "1 ohm"})


@pytest.mark.parametrize(
    ("stated", "known_as"),
    [({"duty.amplitude": "5 deg"}, "b1689d6892e2"), ({"failure.stop": "28 deg"}, "acc0a8fc8393")],
)
def test_a_key_that_came_later_leaves_the_hash_of_a_design_without_it(stated, known_as: str) -> None:
    """Hashes that nights, signed reports and folders of studies have."""
    assert design_hash(with_overrides(DESIGN, stated)).startswith(known_as)


def test_the_hash_sees_values_and_requirements_and_nothing_else() -> None:
    respelled = with_overrides(DESIGN, {"motor.inductance": "0.006 mH", "motor.resistance": "0.055 ohm"})
    assert design_hash(respelled) == design_hash(DESIGN)
    text = "# mine\n" + design_text("ilr33-amber").replace('source = "tuned here"', 'source = "elsewhere"')
    assert design_hash(read_design_text(text, "elsewhere")) == design_hash(DESIGN)
    for change in (
        {"motor.inductance": "6.1 uH"},
        {"requirement.gain-margin.minimum": "7 dB"},
        {"load.inertia": {"value": "2e-4 kg*m^2", "tolerance": "40 %"}},
        {"friction.law": "tanh"},
    ):
        assert design_hash(with_overrides(DESIGN, change)) != design_hash(DESIGN)


def test_results_can_be_compared_and_sent() -> None:
    """Results with arrays are equal where their numbers are, nan as nan; loops are assembled again."""
    grid = np.geomspace(0.1, 100.0, 20)
    for made in (
        lambda scale: step_figures(control.tf([scale], [1.0, 1.0])),
        lambda scale: simulate(DESIGN, commands.step(0.01 * scale), 0.01),
        lambda scale: onset(assemble_loops(DESIGN), scale * grid),
        lambda scale: MeasuredResponse.from_scatter(control.frd(scale / (1j * grid), grid)),
    ):
        result = made(1.0)
        assert result == made(1.0) == pickle.loads(pickle.dumps(result))
        assert result != made(2.0)
        assert result != "another"
    loops = assemble_loops(DESIGN, "continuous", "rest", load_Nm=2.0, inner_loops="open")
    survey = pickle.loads(pickle.dumps(analyses.survey_loops(DESIGN)))
    for sent in (pickle.loads(pickle.dumps(loops)), survey.loops):
        here = loops if sent.form == loops.form else assemble_loops(DESIGN)
        assert sent.operating == here.operating
        assert sent["position"].open_loop(1j) == here["position"].open_loop(1j)
        path, own = sent.limiters["current"], here.limiters["current"]
        assert path.response(1.0) == own.response(1.0)
    assert hash(pickle.loads(pickle.dumps(DESIGN))) == hash(DESIGN)  # kept in caches
    assert repr(DESIGN) == "<Design ilr33-amber: rotary, position > velocity > current>"
    assert repr(Drive(DESIGN)) == "<Drive ilr33-amber: tick 0>"


def test_tolerances_are_listed_in_the_order_of_the_file() -> None:
    listed = [(path, nominal, width.half_width / nominal) for path, nominal, width in tolerances(DESIGN)]
    assert listed == [
        ("gear.planetary.input_inertia", 1e-7, pytest.approx(0.5)),
        ("gear.planetary.output_inertia", 5e-7, pytest.approx(0.5)),
        ("gear.worm.input_inertia", 5e-7, pytest.approx(0.5)),
        ("load.inertia", 2e-4, pytest.approx(0.5)),
    ]
