"""Every public function and request, each argument in turn of another kind: refused in one line."""

from collections.abc import Iterator
from functools import cache
from importlib import import_module
from inspect import isfunction, signature
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
def loops() -> Any:
    return assemble_loops(AMBER)


@cache
def run() -> Any:
    return simulate(AMBER, STEP, 0.1)


def record() -> str:
    run().to_csv("run.csv")
    return "run.csv"


def study() -> str:
    Path("study.toml").write_text(STUDY)
    return "study.toml"


def of(**arguments: Any) -> dict[str, Any]:
    return arguments


def none_of(names: str) -> dict[str, Any]:
    return dict.fromkeys(names.split())


AT = {"operating_point": "sliding", "load_Nm": 0.0}
RIGHT: dict[str, Any] = {
    "actuator_lti.assemble_loops": lambda: of(
        design=SMALL, form="sampled", **AT, speed_amplitude_rad_s=None, direction=1, rotor="free",
        inner_loops="closed", speed_rad_s=0.0, angle_rad=0.0, twist_rad=0.0),
    "actuator_lti.closed_loop_bandwidth": lambda: of(system=LAG, delay_s=0.0, level="-3 dB"),
    "actuator_lti.delay_budget": lambda: of(
        design=AMBER, loop_name="velocity", frequency_rad_s=100.0, **AT, rotor="free", torques_held=False),
    "actuator_lti.load_design": lambda: of(name_or_path="fin"),
    "actuator_lti.onset": lambda: of(loops=loops(), omega_rad_s=1.0, bias=None),
    "actuator_lti.plant": lambda: of(design=SMALL, form="sampled", rotor="free", command="u", **AT),
    "actuator_lti.read_design_text": lambda: of(text=write_design(SMALL), origin="x", folder=Path()),
    "actuator_lti.stability_margins": lambda: of(system=LAG, delay_s=0.0, band_rad_s=None, certify=False),
    "actuator_lti.step_figures": lambda: of(system=LAG),
    "actuator_lti.sweep": lambda: of(design=AMBER, path="limits.voltage", values=["10 V"]),
    "actuator_lti.unwrapped_phase_deg": lambda: of(system=LAG, omega_rad_s=1.0, delay_s=0.0),
    "actuator_lti.write_design": lambda: of(design=SMALL),
    "actuator_lti.bandwidth.peaks": lambda: of(system=LAG, delay_s=0.0),
    "actuator_lti.batch.Population": lambda: of(design=AMBER, values={"limits.voltage": [9.0]}, count=1),
    "actuator_lti.batch.drive_figures": lambda: of(
        population=Population(AMBER, {}, 1), quantity="output_rate", load_Nm=0.0),
    "actuator_lti.batch.linear_figures": lambda: of(
        population=Population(AMBER, {}, 1), **AT, speed_amplitude_rad_s=None, direction=1, time_figures=True,
        held=False, threads=1),
    "actuator_lti.batch.variable_paths": lambda: of(design=AMBER),
    "actuator_lti.design.check_design": lambda: of(design=AMBER, where="x"),
    "actuator_lti.design.design_hash": lambda: of(design=AMBER),
    "actuator_lti.design.design_tree": lambda: of(design=AMBER),
    "actuator_lti.design.no_load_speed": lambda: of(design=AMBER),
    "actuator_lti.design.parameter_value": lambda: of(design=AMBER, path="limits.voltage"),
    "actuator_lti.design.paths_of": lambda: of(design=AMBER),
    "actuator_lti.design.tolerances": lambda: of(design=AMBER),
    "actuator_lti.design.warnings_of": lambda: of(design=AMBER),
    "actuator_lti.design.with_overrides": lambda: of(design=AMBER, overrides={"limits.voltage": "9 V"}),
    "actuator_lti.design.with_values": lambda: of(design=AMBER, values={"limits.voltage": 9.0}, check=True),
    "actuator_lti.drawing.plotting.plot_bode": lambda: of(system=LAG, label="", margins=None, axes=None),
    "actuator_lti.drawing.plotting.plot_map": lambda: of(
        frequency_hz=np.array([1.0, 10.0]), amplitude_rad=np.array([0.01, 0.1]), kind=np.eye(2, dtype=int),
        names=("none", "speed"), onset_rad=None, linear_axis=False, axes=None),
    "actuator_lti.drawing.plotting.plot_nyquist": lambda: of(system=LAG, label="", axes=None),
    "actuator_lti.drawing.plotting.plot_onset": lambda: of(
        onset=onset(loops(), [1.0, 10.0]), linear_axis=False, axes=None),
    "actuator_lti.drawing.plotting.plot_run": lambda: of(run=run(), axes=None),
    "actuator_lti.drawing.plotting.plot_step": lambda: of(system=LAG, duration_s=1.0, label="", axes=None),
    "actuator_lti.loops.exact_margins": lambda: of(loops=loops(), point="u", longest_delay_ticks=2.0),
    "actuator_lti.loops.periodic_loop": lambda: of(loops=loops(), point="u"),
    "nonlinear.Drive": lambda: of(design=AMBER, initial=None, load_Nm=0.0, friction_on=True, limits_on=True),
    "nonlinear.Probe": lambda: of(point="u", injection=None, gain=1.0, delay_samples=0.0),
    "nonlinear.Reducers": lambda: of(
        window_ticks=10, cycles=1, harmonics=1, extremes=False, step_target_rad=1.0, step_band=0.02),
    "nonlinear.Run": lambda: of(
        design=AMBER, command=STEP, duration_s=0.01, load_Nm=0.0, bias=None, probes=(), initial=None,
        friction_on=True, limits_on=True, reducers=Reducers()),
    "nonlinear.State": lambda: of(motor_angle_rad=0.0, output_angle_rad=None, law=()),
    "nonlinear.simulate": lambda: of(
        design=AMBER, command=STEP, duration_s=0.01, load_Nm=0.0, bias=None, probes=(), initial=None,
        disturbance_Nm=None, supply=None, supply_scales=False, friction_on=True, limits_on=True, energy=False,
        record_every=1, tanh_tolerance=1e-3, max_events=10, raise_on_failure=True, progress=None),
    "nonlinear.simulate_many": lambda: of(
        runs=[Run(design=AMBER, command=STEP, duration_s=0.01)], threads=1, progress=None),
    "nonlinear.tangent": lambda: of(design=AMBER, place="velocity", setup=None, hold=True),
    "nonlinear.commands.chirp": lambda: of(
        amplitude_rad=0.1, from_hz=1.0, to_hz=2.0, span_s=1.0, logarithmic=True, start_s=0.0),
    "nonlinear.commands.hold": lambda: of(angle_rad=0.1),
    "nonlinear.commands.multisine": lambda: of(
        amplitude_rad=0.1, frequencies_hz=[10.0], duration_s=1.0, period_s=1e-3, seed=0),
    "nonlinear.commands.ramp": lambda: of(rate_rad_s=1.0, start_s=0.0, stop_s=1.0),
    "nonlinear.commands.recorded": lambda: of(
        path=record(), time_column=0, angle_column=1, unit="deg", delimiter=",", held=False),
    "nonlinear.commands.sampled": lambda: of(time_s=[0.0, 1.0], angle_rad=[0.0, 1.0], where="record"),
    "nonlinear.commands.sine": lambda: of(amplitude_rad=0.1, frequency_hz=1.0, phase_rad=0.0, start_s=0.0),
    "nonlinear.commands.step": lambda: of(amplitude_rad=0.1, start_s=0.0),
    "nonlinear.commands.stepped_sine": lambda: of(
        amplitude_rad=0.1, frequencies_hz=[10.0], cycles=2, period_s=1e-3, settle_cycles=2),
    "nonlinear.commands.triangle": lambda: of(amplitude_rad=0.1, frequency_hz=1.0, start_s=0.0),
    "nonlinear.export.c_export": lambda: of(design=AMBER, single_precision=False, prefix="drive_"),
    "nonlinear.export.controller_export": lambda: of(
        design=AMBER, single_precision=False, prefix="drive_", vectors=True),
    "nonlinear.export.refuse_unknown": lambda: of(version=2, platforms=("linux64",)),
    "nonlinear.loads.LoadMoment": lambda: of(constant_Nm=0.0, slope_Nm_rad=0.0, series=None),
    "nonlinear.loads.constant": lambda: of(moment_Nm=0.0),
    "nonlinear.loads.proportional": lambda: of(slope_Nm_rad=0.0, offset_Nm=0.0),
    "nonlinear.loads.series": lambda: of(time_s=[0.0, 1.0], moment_Nm=[0.0, 1.0], where="x"),
    "analyses.amplitude_map": lambda: of(
        design=AMBER, loops=loops(), load_Nm=0.0, friction_on=True, counts=(2, 2)),
    "analyses.compare": lambda: of(study=study(), validation=False, **none_of("progress engine folder")),
    "analyses.correlate_record": lambda: of(
        design=AMBER, record=analyses.open_record(record()), command=None, progress=None),
    "analyses.evaluate_requirements": lambda: of(design=SMALL, figures=None, progress=None),
    "analyses.identify_campaign": lambda: of(imported=None, design=AMBER, richer=True, fixed=None),
    "analyses.import_campaign": lambda: of(campaign=None, progress=None),
    "analyses.large_signals": lambda: of(design=AMBER, loops=None, counts=(2, 2)),
    "analyses.load_campaign": lambda: of(path="nowhere.toml"),
    "analyses.load_study": lambda: of(path=study(), keep_going=False),
    "analyses.open_record": lambda: of(path=record()),
    "analyses.sawtooth": lambda: of(design=AMBER, amplitude_rad=None, frequency_hz=None),
    "analyses.survey_loops": lambda: of(design=SMALL, progress=None),
    "analyses.tune": lambda: of(design=SMALL, settings=None, progress=None),
    "analyses.validate": lambda: of(design=SMALL, settings=CHECKS, progress=None, model=None),
    "analyses.corners.Asked": lambda: of(hot_degC=99.0, cold_degC=-40.0, supply_V=20.0, cold_viscous=1.0),
    "analyses.corners.corners": lambda: of(design=SMALL, asked=None, progress=None),
    "analyses.corners.worst_of": lambda: of(
        corners=corners(SMALL).corners[:1], name="corner_gain_margin"),
    "analyses.duty.Asked": lambda: of(
        amplitude_rad=0.1, frequency_hz=1.0, load_Nm=0.0, share=1.0, cycle_s=10.0,
        **none_of("speed_rad_s current_A ramp_s")),
    "analyses.duty.duty": lambda: of(design=FIN, asked=None),
    "analyses.failures.Asked": lambda: of(
        stop_rad=0.3, deflection_rad=0.1, detection_s=0.1, watched_s=0.2, load_Nm=0.0,
        speed_rad_s=0.0),
    "analyses.failures.failures": lambda: of(design=FIN, asked=None),
    "analyses.friction_effects.friction_effects": lambda: of(design=AMBER, loops=None, settlings=None),
    "analyses.limit_cycles.limit_cycles": lambda: of(design=SMALL),
    "analyses.margins.Asked": lambda: of(
        form="sampled", **AT, around=None, response=None, response_of="", averages=None),
    "analyses.margins.margins": lambda: of(design=SMALL, asked=None),
    "analyses.monte_carlo.MonteCarloSettings": lambda: of(
        samples=4, seed=0, **AT, step=None, table=None, worst_cases=False, chunk=4),
    "analyses.monte_carlo.SampleTask": lambda: of(
        design=AMBER, sampler=sampler_of(AMBER, seed=0), **AT, loops=True, time_figures=True, step=None),
    "analyses.monte_carlo.StepCheck": lambda: of(amplitude_rad=0.01, duration_s=0.1, load_Nm=0.0),
    "analyses.monte_carlo.monte_carlo": lambda: of(
        design=AMBER, folder="a study", settings=MonteCarloSettings(2, worst_cases=False), engine=None,
        progress=None),
    "analyses.monte_carlo.replay": lambda: of(
        design=AMBER, sampler=sampler_of(AMBER, seed=0), number=1),
    "analyses.motion.Asked": lambda: of(
        amplitude=1.0, frequency=1.0, count=10, seed=0, start=0.0, duration=0.01, bias_rate=0.0, load=0.0,
        load_slope=0.0, held=False, every=1, no_friction=False, no_limits=False, energy=False,
        **none_of("command to cycles load_file record csv parquet plot")),
    "analyses.motion.motion": lambda: of(design=AMBER, asked=Asked(duration=0.01), progress=None),
    "analyses.specification.specification": lambda: of(design=AMBER, loops=None),
    "analyses.stiffness.check_stiffness": lambda: of(design=FIN, frequencies_hz=[10.0]),
    "analyses.stiffness.lost_motion_seen": lambda: of(design=FIN),
    "analyses.stiffness.stiffness": lambda: of(design=FIN, simulated=False),
    "analyses.stiffness.stiffness_at_rest": lambda: of(design=FIN, asked=[(20.0, 1.0)]),
    "analyses.stiffness.stiffness_curves": lambda: of(design=FIN),
    "analyses.tuning.TuningSettings": lambda: of(
        requirements=(), rounded=True, curve=True, check=True, aim="reserve", place=()),
    "analyses.validation.Asked": lambda: of(quick=False, large=False),
    "analyses.validation.Settings": lambda: of(
        own=True, findings=(), rest_frequencies=16, map_counts=(2, 2)),
    "reports.report": lambda: of(
        design=SMALL, out=None, validation=False, also=(), added=(), response=None, response_of="",
        averages=None, source=None),
}  # fmt: skip
USED = {  # what is asked with a request
    "nonlinear.Probe": lambda made: simulate(AMBER, STEP, 0.01, probes=[made]),
    "nonlinear.Reducers": lambda made: nonlinear.simulate_many(
        [Run(design=AMBER, command=STEP, duration_s=0.01, reducers=made)]
    ),
    "nonlinear.Run": lambda made: nonlinear.simulate_many([made]),
    "nonlinear.State": lambda made: simulate(AMBER, STEP, 0.01, initial=made),
    "nonlinear.loads.LoadMoment": lambda made: simulate(AMBER, STEP, 0.01, made),
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
SHAPED = {"omega_rad_s", "injection", "disturbance_Nm"}  # numbers of any shape


def rooms() -> Iterator[Any]:
    """The packages, and what they hold that says what is public of it."""
    for top in map(import_module, ("actuator_lti", "nonlinear", "analyses", "reports")):
        yield top
        names = [each.name for each in walk_packages(top.__path__, f"{top.__name__}.") if each.ispkg]
        yield from (import_module(name) for name in names if "._" not in name)
    yield from map(import_module, ("nonlinear.commands", "nonlinear.loads", "actuator_lti.drawing.plotting"))


def test_every_public_function_has_a_row() -> None:
    known = {id(public(name)) for name in (*RIGHT, *NO_ROW)}
    for room in rooms():
        for name in getattr(room, "__all__", ()):
            value = getattr(room, name)
            assert not isfunction(value) or id(value) in known, f"{room.__name__}.{name}"
            asked = isinstance(value, type) and hasattr(value.__init__, "__wrapped__")
            assert not asked or id(value) in known, f"{room.__name__}.{name}"


def public(name: str) -> Any:
    room, _, own = name.rpartition(".")
    return getattr(import_module(room), own)


@pytest.mark.parametrize("name", RIGHT)
def test_an_argument_of_another_kind_is_refused_in_one_line(name: str, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    made, right = public(name), RIGHT[name]()
    asked = signature(made).parameters
    assert name.endswith(("State", "report")) or right.keys() == asked.keys()
    for argument, given in right.items():
        for words, wrong in WRONG.items():
            if wrong is asked[argument].default or (type(given), words) in SAME_KIND:
                continue
            if answered(name, {**right, argument: wrong}):
                assert words not in ("a function", "an object", "nan"), (argument, words)
                assert words != "a cube" or argument in SHAPED, (argument, words)


def answered(name: str, arguments: dict[str, Any]) -> bool:
    """Whether this is not refused; anything else that is raised is a mistake."""
    try:
        made = public(name)(**arguments)
        USED.get(name, id)(made)
    except (InputError, NumericalError):
        return False
    finally:
        pyplot.close("all")
    return True


def test_names_texts_and_series_are_taken_where_they_answer() -> None:
    assert stability_margins(LAG, 0.0, iter((0.1, 10.0))) == stability_margins(LAG, 0.0, (0.1, 10.0))
    assert read_design_text(write_design(SMALL), "x", "/") == read_design_text(write_design(SMALL), "x")
    runs = [Run(design=design, command=STEP, duration_s=0.01) for design in (AMBER, "ilr33-amber")]
    by_design, by_name = nonlinear.simulate_many(runs).rows
    assert np.array_equal(by_design, by_name, equal_nan=True)
