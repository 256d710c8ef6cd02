"""Every public function and request, each argument in turn of another kind: refused in one line."""

import re
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from inspect import Parameter, isfunction, signature
from pathlib import Path
from pkgutil import walk_packages
from typing import Any

import control
import numpy as np
import pytest
from matplotlib import pyplot
from scipy import signal

import analyses
import nonlinear
from actuator_lti import (
    assemble_loops,
    load_design,
    onset,
    read_design_text,
    stability_margins,
    write_design,
)
from actuator_lti.batch import Population, linear_figures
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError
from analyses.corners import corners
from analyses.duty import duty
from analyses.margins import margins
from analyses.monte_carlo import MonteCarloSettings, SampleTask
from analyses.motion import Asked, motion
from analyses.studies.sampling import sampler_of
from analyses.validation import CHECKS
from nonlinear import Reducers, Run, commands, simulate
from tests.refusals import refused

AMBER, FIN, SMALL = load_design("ilr33-amber"), load_design("fin"), load_design("ctms-motor-position")
LAG, STEP = control.tf([1.0], [1.0, 1.0]), commands.step(0.01)
STUDY = """[study]
name = "gain"
base = "ctms-motor-position"

[[variant]]
name = "faster"
override = { "control.position.gain" = "1 V/rad" }
"""
WRONG = {
    "nothing": None, "a function": lambda one: one, "scipy": signal.lti([1.0], [1.0, 1.0]),
    "text": "3 parsec", "a table": {}, "nan": float("nan"), "inf": float("inf"), "-1": -1,
    "an empty list": [], "a ragged list": [[1, 2], [3]],
    "a cube": np.ones((2, 3, 4)), "a design": load_design("emps"), "an object": object(),
}  # fmt: skip


@cache
def run() -> Any:
    return simulate(AMBER, STEP, 0.1)


def record() -> str:
    run().to_csv("run.csv")
    return "run.csv"


def study() -> str:
    Path("study.toml").write_text(STUDY)
    return "study.toml"


PUBLIC = {
    "actuator_lti": "assemble_loops closed_loop_bandwidth delay_budget load_design onset plant sweep "
    "read_design_text stability_margins step_figures unwrapped_phase_deg write_design",
    "actuator_lti.bandwidth": "peaks",
    "actuator_lti.batch": "Population drive_figures linear_figures variable_paths",
    "actuator_lti.design": "check_design design_hash design_tree no_load_speed parameter_value paths_of "
    "tolerances warnings_of with_overrides with_values",
    "actuator_lti.drawing.plotting": "plot_bode plot_map plot_nyquist plot_onset plot_run plot_step",
    "actuator_lti.loops": "exact_margins periodic_loop",
    "nonlinear": "Drive Probe Reducers Run State simulate simulate_many tangent",
    "nonlinear.commands": "chirp hold multisine ramp recorded sampled sine step stepped_sine triangle",
    "nonlinear.export": "c_export controller_export refuse_unknown",
    "nonlinear.loads": "LoadTorque constant proportional series",
    "analyses": "amplitude_map compare correlate_record evaluate_requirements identify_campaign sawtooth "
    "import_campaign large_signals load_campaign load_study open_record survey_loops tune validate",
    "analyses.corners": "Asked corners worst_of",
    "analyses.duty": "Asked duty",
    "analyses.failures": "Asked failures",
    "analyses.friction_effects": "friction_effects",
    "analyses.limit_cycles": "limit_cycles",
    "analyses.margins": "Asked margins",
    "analyses.monte_carlo": "MonteCarloSettings SampleTask StepCheck monte_carlo replay",
    "analyses.motion": "Asked motion",
    "analyses.specification": "specification",
    "analyses.stiffness": "check_stiffness lost_motion_simulated stiffness stiffness_at_rest "
    "stiffness_curves",
    "analyses.tuning": "TuningSettings",
    "analyses.validation": "Asked Settings",
    "reports": "report",
}
NAMES = [f"{room}.{name}" for room, names in PUBLIC.items() for name in names.split()]
USUAL: dict[str, Any] = {  # arguments without a default, by their names
    "system": lambda: LAG, "loops": cache(lambda: assemble_loops(AMBER)), "run": run, "where": lambda: "x",
    "population": lambda: Population(AMBER, {}, 1), "sampler": lambda: sampler_of(AMBER, seed=0),
    "path": lambda: "limits.voltage", "point": lambda: "u", "command": lambda: STEP, "study": study,
    "values": lambda: {"limits.voltage": 9.0}, "overrides": lambda: {"limits.voltage": "9 V"},
    "frequencies_hz": lambda: [10.0], "time_s": lambda: [0.0, 1.0], "period_s": lambda: 1e-3,
    "omega_rad_s": lambda: 1.0, "frequency_rad_s": lambda: 100.0, "duration_s": lambda: 0.01,
    "amplitude_rad": lambda: 0.1, "frequency_hz": lambda: 1.0, "rate_rad_s": lambda: 1.0,
    "moment_Nm": lambda: 0.0, "slope_Nm_rad": lambda: 0.0, "count": lambda: 1, "cycles": lambda: 2,
    "imported": lambda: None, "campaign": lambda: None,
}  # fmt: skip
SMALLER = {  # a design for which they answer, or sooner than for ilr33-amber
    name: design
    for design, names in (
        (SMALL, "assemble_loops plant write_design evaluate_requirements survey_loops tune validate corners "
        "limit_cycles margins report"),
        (FIN, "duty failures check_stiffness lost_motion_simulated stiffness stiffness_at_rest "
        "stiffness_curves"),
    )
    for name in names.split()
}  # fmt: skip
OWN: dict[str, Any] = {  # arguments of some functions, and those that take less time than their defaults
    "actuator_lti.closed_loop_bandwidth": lambda: {"level": "-3 dB"},
    "actuator_lti.delay_budget": lambda: {"loop_name": "velocity"},
    "actuator_lti.load_design": lambda: {"name_or_path": "fin"},
    "actuator_lti.read_design_text": lambda: {"text": write_design(SMALL), "folder": Path()},
    "actuator_lti.sweep": lambda: {"values": ["10 V"]},
    "actuator_lti.batch.Population": lambda: {"values": {"limits.voltage": [9.0]}},
    "actuator_lti.batch.drive_figures": lambda: {"quantity": "output_rate"},
    "actuator_lti.drawing.plotting.plot_map": lambda: {
        "frequency_hz": np.array([1.0, 10.0]), "amplitude_rad": np.array([0.01, 0.1]),
        "kind": np.eye(2, dtype=int), "names": ("none", "speed")},
    "actuator_lti.drawing.plotting.plot_onset": lambda: {"onset": onset(USUAL["loops"](), [1.0, 10.0])},
    "actuator_lti.drawing.plotting.plot_step": lambda: {"duration_s": 1.0},
    "actuator_lti.loops.exact_margins": lambda: {"longest_delay_ticks": 2.0},
    "nonlinear.Reducers": lambda: {"window_ticks": 10, "step_target_rad": 1.0},
    "nonlinear.Run": lambda: {"reducers": Reducers()},
    "nonlinear.State": lambda: {"motor_angle_rad": 0.0, "output_angle_rad": None, "law": ()},
    "nonlinear.simulate": lambda: {"tanh_tolerance": 1e-3, "max_events": 10},
    "nonlinear.simulate_many": lambda: {"runs": [Run(design=AMBER, command=STEP, duration_s=0.01)]},
    "nonlinear.tangent": lambda: {"place": "velocity"},
    "nonlinear.commands.chirp": lambda: {"from_hz": 1.0, "to_hz": 2.0, "span_s": 1.0},
    "nonlinear.commands.multisine": lambda: {"duration_s": 1.0},
    "nonlinear.commands.recorded": lambda: {"path": record()},
    "nonlinear.commands.sampled": lambda: {"angle_rad": [0.0, 1.0]},
    "nonlinear.export.controller_export": lambda: {"single_precision": False},
    "nonlinear.export.refuse_unknown": lambda: {"version": 2, "platforms": ("linux64",)},
    "nonlinear.loads.series": lambda: {"moment_Nm": [0.0, 1.0]},
    "analyses.amplitude_map": lambda: {"counts": (2, 2)},
    "analyses.compare": lambda: {"validation": False},
    "analyses.correlate_record": lambda: {"record": analyses.open_record(record())},
    "analyses.large_signals": lambda: {"counts": (2, 2)},
    "analyses.load_campaign": lambda: {"path": "nowhere.toml"},
    "analyses.load_study": lambda: {"path": study()},
    "analyses.open_record": lambda: {"path": record()},
    "analyses.validate": lambda: {"settings": CHECKS},
    "analyses.corners.Asked": lambda: {"hot_degC": 99.0, "cold_degC": -40.0, "supply_V": 20.0},
    "analyses.corners.worst_of": lambda: {
        "corners": corners(SMALL).corners[:1], "name": "corner_gain_margin"},
    "analyses.duty.Asked": lambda: {"amplitude_rad": 0.1, "ramp_s": None},
    "analyses.failures.Asked": lambda: {"stop_rad": 0.3, "deflection_rad": 0.1, "watched_s": 0.2},
    "analyses.monte_carlo.MonteCarloSettings": lambda: {"samples": 4, "worst_cases": False, "chunk": 4},
    "analyses.monte_carlo.StepCheck": lambda: {"amplitude_rad": 0.01, "duration_s": 0.1},
    "analyses.monte_carlo.monte_carlo": lambda: {
        "folder": "a study", "settings": MonteCarloSettings(2, worst_cases=False)},
    "analyses.monte_carlo.replay": lambda: {"number": 1},
    "analyses.motion.Asked": lambda: {"duration": 0.01},
    "analyses.motion.motion": lambda: {"asked": Asked(duration=0.01)},
    "analyses.stiffness.stiffness": lambda: {"simulated": False},
    "analyses.stiffness.stiffness_at_rest": lambda: {"asked": [(20.0, 1.0)]},
    "analyses.tuning.TuningSettings": lambda: {"aim": "reserve"},
    "analyses.validation.Settings": lambda: {"findings": (), "map_counts": (2, 2)},
    "reports.report": lambda: {
        "design": SMALL, "out": None, "validation": False, "also": (), "added": (), "response": None,
        "response_of": "", "averages": None, "source": None},
}  # fmt: skip


def right(name: str) -> dict[str, Any]:
    """Arguments with which a function answers: its own, else the usual ones, else its defaults."""
    own = OWN.get(name, dict)()
    if name in ("nonlinear.State", "reports.report"):  # the others are any array, and a function
        return own
    asked = signature(public(name)).parameters
    given = {one: SMALLER.get(name.rpartition(".")[2], AMBER) for one in asked if one == "design"}
    usual = {one: USUAL[one]() for one in asked if one in USUAL and asked[one].default is Parameter.empty}
    return {one: each.default for one, each in asked.items()} | given | usual | own


USED = {  # what is asked with a request
    "nonlinear.Probe": lambda made: simulate(AMBER, STEP, 0.01, probes=[made]),
    "nonlinear.Reducers": lambda made: nonlinear.simulate_many(
        [Run(design=AMBER, command=STEP, duration_s=0.01, reducers=made)]
    ),
    "nonlinear.Run": lambda made: nonlinear.simulate_many([made]),
    "nonlinear.State": lambda made: simulate(AMBER, STEP, 0.01, initial=made),
    "nonlinear.loads.LoadTorque": lambda made: simulate(AMBER, STEP, 0.01, made),
    "actuator_lti.batch.Population": linear_figures,
    "analyses.monte_carlo.SampleTask": lambda made: made((0, 2)),
    "analyses.monte_carlo.StepCheck": lambda made: SampleTask(AMBER, sampler_of(AMBER, seed=0), step=made),
    "analyses.corners.Asked": lambda made: corners(SMALL, made),
    "analyses.duty.Asked": lambda made: duty(FIN, made),
    "analyses.margins.Asked": lambda made: margins(SMALL, made),
    "analyses.motion.Asked": lambda made: motion(AMBER, made),
}
NO_ROW = {  # without arguments; the same as `load_design`; calls a compiler
    "actuator_lti.design.shipped_designs", "actuator_lti.drawing.plotting.style",
    "actuator_lti.design.as_design", "nonlinear.export.fmu_bytes",
}  # fmt: skip
SAME_KIND = {(Design, "a design"), (tuple, "an empty list")}
TOLD = "allowed|must|one of|needed|two frequencies"
KINDS = {"nothing", "a function", "scipy", "a table", "a design", "an object"}  # no numbers or texts
SHAPED = {"omega_rad_s", "injection", "disturbance_Nm"}  # numbers of any shape


def rooms() -> Iterator[Any]:
    """The packages, and what they hold that says what is public of it."""
    for top in map(import_module, ("actuator_lti", "nonlinear", "analyses", "reports")):
        yield top
        names = [each.name for each in walk_packages(top.__path__, f"{top.__name__}.") if each.ispkg]
        yield from (import_module(name) for name in names if "._" not in name)
    yield from map(import_module, ("nonlinear.commands", "nonlinear.loads", "actuator_lti.drawing.plotting"))


def test_every_public_function_has_a_row() -> None:
    known = {id(public(name)) for name in (*NAMES, *NO_ROW)}
    for room in rooms():
        for name in getattr(room, "__all__", ()):
            value = getattr(room, name)
            assert not isfunction(value) or id(value) in known, f"{room.__name__}.{name}"
            asked = isinstance(value, type) and hasattr(value.__init__, "__wrapped__")
            assert not asked or id(value) in known, f"{room.__name__}.{name}"


def public(name: str) -> Any:
    room, _, own = name.rpartition(".")
    return getattr(import_module(room), own)


@pytest.mark.parametrize("name", NAMES)
def test_an_argument_of_another_kind_is_refused_in_one_line(name: str, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    asked, arguments = signature(public(name)).parameters, right(name)
    assert all(given is not Parameter.empty for given in arguments.values())
    for argument, given in arguments.items():
        for words, wrong in WRONG.items():
            if wrong is asked[argument].default or (type(given), words) in SAME_KIND:
                continue
            if said := refusal(name, {**arguments, argument: wrong}):
                assert "\n" not in said
                assert words not in KINDS or re.search(TOLD, said), said
            else:
                assert words not in ("a function", "an object", "nan"), (argument, words)
                assert words != "a cube" or argument in SHAPED, (argument, words)


def refusal(name: str, arguments: dict[str, Any]) -> str:
    """What is said of what is not answered; anything else that is raised is a mistake."""
    try:
        made = public(name)(**arguments)
        USED.get(name, id)(made)
    except InputError as error:
        return str(error)
    except NumericalError:
        return "not finished"
    finally:
        pyplot.close("all")
    return ""


def test_names_texts_and_series_are_taken_where_they_answer() -> None:
    assert stability_margins(LAG, 0.0, iter((0.1, 10.0))) == stability_margins(LAG, 0.0, (0.1, 10.0))
    assert read_design_text(write_design(SMALL), "x", "/") == read_design_text(write_design(SMALL), "x")
    runs = [Run(design=design, command=STEP, duration_s=0.01) for design in (AMBER, "ilr33-amber")]
    by_design, by_name = nonlinear.simulate_many(runs).rows
    assert np.array_equal(by_design, by_name, equal_nan=True)


@pytest.mark.parametrize("wrong", [wrong for wrong in WRONG if wrong != "text"])
def test_methods_refuse_an_argument_of_another_kind(wrong: str) -> None:
    """`Trajectory.to_csv(None)` was a TypeError of the file system, `loops[[]]` one of a dict."""
    loops, drive = assemble_loops(SMALL), run()
    for method in (loops.__getitem__, drive.limit_active, drive.to_csv, drive.to_parquet, AMBER.add_filter):
        refused(method, WRONG[wrong])
    refused(AMBER.with_law, WRONG[wrong], LAG)
