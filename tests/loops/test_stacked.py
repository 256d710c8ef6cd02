"""Many designs at once are each of them alone: random drives over decades, every stage left out, all keys."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from loop_designs import controlled, drive_d, drive_e, sprung

from actuator_lti import assemble_loops, closed_loop_bandwidth, stability_margins, step_figures
from actuator_lti.asked.drive_figure import drive_figure
from actuator_lti.asked.quantities import DRIVE_QUANTITIES
from actuator_lti.batch import Population, drive_figures, linear_figures, variable_paths
from actuator_lti.batch._figures import DC_GAIN
from actuator_lti.design import load_design, parameter_value
from actuator_lti.design.access import stacked
from actuator_lti.design.model import Command, Design, Encoder, Filter, PositionLoop
from actuator_lti.drive.operating import Operating
from actuator_lti.drive.wiring import wire
from actuator_lti.loops.periodic import fundamental
from actuator_lti.loops.sampled import fundamental_path, stage_blocks
from actuator_lti.loops.tick import TickProgram
from tests.validation.random_drives import drives
from tests.validation.rich_drives import rich_drive

FILTERS = (
    Filter(kind="lowpass", frequency_rad_s=2000.0, order=2),
    Filter(kind="notch", frequency_rad_s=900.0, width_rad_s=300.0, depth=0.1),
    Filter(kind="leadlag", zero_rad_s=500.0, pole_rad_s=1500.0),
    Filter(kind="lowpass", frequency_rad_s=3000.0, on="speed"),
)


def everything() -> Design:
    """A position loop in front of a spring, every slot of the controller filled."""
    base = drive_e()
    position = PositionLoop(
        gain=20.0, every=4, feedforward=0.8, integral_time_s=0.2, derivative_time_s=2e-3,
        derivative_filter_s=1e-3, acceleration_feedforward=0.7, sensor="output",
    )  # fmt: skip
    encoder = Encoder(speed="tracking", bandwidth_rad_s=800.0, filter_time_s=2e-4)
    command = Command(filter_time_s=3e-3, filter_order=2)
    load = replace(base.load, moment_slope_Nm_rad=-30.0)
    fed = {"back_emf_feedforward": 0.9, "resistance_feedforward": 0.5}
    filled = controlled(base, computing_delay_s=3e-4, position=position,
                        velocity={"every": 2, "filters": FILTERS}, current=fed)  # fmt: skip
    return replace(filled, encoder=encoder, command=command, load=load)


RICH = (7, 9, 13, 18, 20, 23, 29, 51, 54)  # each with at least five of what is rare
KINDS = (everything(), *(rich_drive(seed, own_law=False) for seed in RICH), *drives(90_310, 10))
DRIVES = {one.name: one for one in KINDS}


def scattered(design: Design, count: int) -> dict[str, Any]:
    """Every number that is not 0, over four decades in all (those of the clock over one).

    Each draws by its own name: a number that is new leaves the others as they are.
    """
    values = {}
    for path in variable_paths(design):
        nominal = parameter_value(design, path)
        if nominal == 0.0 or not np.isfinite(nominal) or path.endswith(("filter_time", "computing_delay")):
            continue
        decades = 0.5 if path == "control.period" else 2.0
        rng = np.random.default_rng([3, *path.encode()])
        values[path] = nominal * 10 ** rng.uniform(-decades, decades, count)
    if design.command.filter_time_s:
        values["control.period"] = np.minimum(values["control.period"], 3e-4)
    ticks = design.controller.computing_delay_s / design.controller.period_s
    values["control.computing_delay"] = ticks * values["control.period"]
    for path in values:  # what a filter may be is bounded by its period
        if path.startswith("control.velocity.filter") and not path.endswith(("depth", "damping")):
            velocity = design.controller.velocity
            most = 2.0 if path.endswith("pole") else 2.5  # a pole on its zero would be no state at all
            values[path] = np.minimum(values[path], most / (velocity.every * values["control.period"]))
    return values


@pytest.mark.parametrize("name", DRIVES)
def test_stacked_blocks_are_the_single_ones(name: str) -> None:
    design, count, at = DRIVES[name], 6, Operating(load_Nm=2.0)
    values = scattered(design, count)
    many = wire(stacked(design, values), at)
    for k in range(count):
        alone = wire(stacked(design, {path: float(array[k]) for path, array in values.items()}), at)
        for stage in many.stages:
            blocks = [fundamental(stage_blocks(each, stage)) for each in (many, alone)]
            same(blocks, k)
        paths = [
            fundamental_path(TickProgram(each, each.outermost), each.interval[each.outermost], "ref", "w")
            for each in (many, alone)
        ]
        same(paths, k)


def same(blocks: list[Any], k: int) -> None:
    """Equal to 1e-9, each state in its own unit: rows and columns over their own size."""
    many, alone = blocks
    assert many.states == alone.states
    for part in ("A", "B", "C", "D"):
        one = getattr(alone, part)
        mine = np.broadcast_to(getattr(many, part), (6, *one.shape))[k]
        scale = np.abs(one)
        scale = np.maximum(scale, 1e-3 * np.sqrt(scale.max(0, keepdims=True) * scale.max(1, keepdims=True)))
        np.testing.assert_array_less(np.abs(mine - one), 1e-9 * scale + 1e-300)


@pytest.mark.parametrize(("design", "k", "loop", "told"), [
    (drive_d(), 3, "current", False),  # a crossover at 2.5e-4 rad/s, 2e8 samples a turn
    (load_design("fin"), 8, "velocity", True),  # nearest to -1 at zero frequency itself
    (sprung("ilr33-amber", 3000.0), 10, "velocity", True),  # L(0) from two slow poles
    (sprung("ilr33-amber", 3000.0), 20, "velocity", True),  # the same, and nearest to -1 there
])  # fmt: skip
def test_slow_loops_agree_with_exact_arithmetic_or_have_no_figures(design, k, loop, told):
    values = scattered(design, k + 1)
    figures = linear_figures(Population(design, values, k + 1), time_figures=False)
    alone = stacked(design, {path: float(array[k]) for path, array in values.items()})
    truth = stability_margins(assemble_loops(alone).present[loop].open_loop, certify=True)
    assert truth.evidence == "certified"
    assert bool(figures.withheld(loop)[k]) is not told
    if not told:
        return
    assert bool(figures.stable(loop)[k]) is truth.stable
    for name in ("gain_margin_db", "phase_margin_deg", "modulus_margin"):
        quantity, expected = name.removesuffix("_db").removesuffix("_deg"), getattr(truth, name)
        assert figures.quantity(quantity, loop)[k] == pytest.approx(expected, rel=1e-7), quantity


@pytest.mark.parametrize("gain", [0.01, 1.0])
@pytest.mark.parametrize("slope", [-1e3, -1.0, -1e-3])
def test_behind_a_soft_spring_the_gain_at_zero_frequency_keeps_its_digits(slope: float, gain: float) -> None:
    """A spring takes the speed's gain at rest away, the integral of the PI gives it back: L(0) is finite."""
    design = sprung("ilr33-amber", slope)
    design = controlled(design, velocity={"gain": gain * design.controller.velocity.gain})
    figures = linear_figures(Population(design, {}, 1), time_figures=False)
    response = assemble_loops(design).present["velocity"].open_loop
    A, b, c = (np.asarray(part, dtype=float) for part in (response.A, response.B, response.C))
    closed = float((c @ np.linalg.solve(np.eye(len(A)) - A + b @ c, b))[0, 0])
    assert figures.raw[0, figures._index("velocity"), DC_GAIN] == pytest.approx(closed, rel=1e-12)


@pytest.mark.parametrize("load_Nm", [0.0, 3.0, -20.0])
def test_drive_figures(load_Nm: float) -> None:
    """Speed, current, acceleration, torque margin, stiffness, lost motion."""
    for design in drives(90_100, 12):
        many = Population(design, {}, 2)
        for name in DRIVE_QUANTITIES:
            one = drive_figure(design, name, load_Nm)
            truth = np.nan if one is None else float(one)
            if name == "motor_current" and not design.motor.has_electrical_dynamics:
                continue
            found = drive_figures(many, name, load_Nm)
            assert found == pytest.approx([truth] * 2, rel=1e-9, nan_ok=True), (design.name, name)


def test_figures_of_the_response_to_the_command() -> None:
    """Of a drive with every slot of the controller filled."""
    figures = linear_figures(Population(everything(), {}, 1))
    response = assemble_loops(everything()).reference_to_output
    width, step = closed_loop_bandwidth(response), step_figures(response)
    pairs = {"bandwidth": width.minus3db_hz, "resonance_peak": width.resonance_peak_db,
             "overshoot": step.overshoot_percent, "rise_time": step.rise_time_s}  # fmt: skip
    for quantity, expected in pairs.items():
        found = figures.quantity(quantity, "position")[0]
        assert found == pytest.approx(expected, rel=1e-6, abs=1e-6), quantity
