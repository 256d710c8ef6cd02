"""Gravity, load friction on the moment, supply from a voltage drive, friction maps: closed forms as truth."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from actuator_lti.design import load_design, read_design_text, with_values, write_design
from actuator_lti.design.model import Design, Gravity
from actuator_lti.errors import InputError
from analyses.correlation.closed_loop import correlate_record
from analyses.estimation.fit import Fit
from analyses.identification.asked import Settings
from analyses.identification.bench import identify_bench
from analyses.identification.electrical import electrical_slopes, fit_electrical
from analyses.identification.friction_law import fit_map
from analyses.identification.inverse import fit_records
from analyses.identification.rows import recipe_for
from analyses.identification.to_design import design_with_fit, joint_values, with_structure
from analyses.records.record import Record
from analyses.studies.sampling import sampler_of
from tests.identification.bench_records import bare, record_of

PERIOD = 1e-3
TIME = np.arange(0.0, 20.0, PERIOD)


def _waves(order: int, scale: float = 1.0) -> np.ndarray:
    """A sum of sines, differentiated ``order`` times."""
    parts = ((1.0, 0.15, 0.0), (0.4, 0.6, 1.0), (0.08, 2.1, 2.0))
    total = np.zeros(len(TIME))
    for amplitude, hertz, phase in parts:
        w = 2.0 * np.pi * hertz
        total += scale * amplitude * w**order * np.sin(w * TIME + phase + 0.5 * np.pi * order)
    return total


def _record(**signals: np.ndarray) -> Record:
    return record_of(TIME, **signals)


def _joint() -> Design:
    """A back-drivable joint, 100:1, 1 kg at 0.3 m to be found."""
    design = load_design("ilr33-amber")
    values = {"gear.planetary.ratio": 10.0, "gear.worm.ratio": 10.0, "motor.torque_constant": 0.02}
    values |= {"motor.back_emf_constant": 0.02, "motor.resistance": 2.0, "motor.rotor_inertia": 2e-5}
    values |= {"limits.speed": 500.0}
    changed = with_values(design, values, check=False)
    return replace(changed, load=replace(changed.load, path="back-drivable"))


def _pendulum_record(noise: float, *, drive: str, size: float = 1.0) -> Record:
    """Closed form: torque at the motor = J a + Cv w + (C0 + CM |M|) sgn w - M/N, M = m g l sin(phi + off)."""
    n, phi = 100.0, 1.2 * size + _waves(0, size)
    w, a = n * _waves(1, size), n * _waves(2, size)
    moment = 1.0 * 9.80665 * 0.3 * np.sin(phi + 0.2)
    torque = 3e-5 * a + 2e-5 * w + (4e-3 + 1.5e-3 * np.abs(moment)) * np.sign(w) - moment / n
    rng = np.random.default_rng(3)
    current = torque / 0.02 + noise * rng.standard_normal(len(TIME))
    if drive == "current":
        return _record(output_angle=phi, current=current)
    return _record(output_angle=phi, voltage=2.0 * current + 0.02 * w, supply=12.0 + np.sin(TIME))


@pytest.mark.parametrize("drive", ["current", "voltage"])
def test_a_pendulum_and_its_load_friction_are_found(drive: str) -> None:
    """From a current, or from a voltage with kE w taken off: no inductance is needed for either."""
    design = _joint()
    model = fit_records(design, [_pendulum_record(0.02, drive=drive)], gravity=True)
    assert model["inertia"] == pytest.approx(3e-5, rel=0.01)
    assert model["viscous"] == pytest.approx(2e-5, rel=0.02)
    assert model["dry"] == pytest.approx(4e-3, rel=0.02)
    assert model["load_coefficient"] == pytest.approx(1.5e-3, rel=0.02)
    made = design_with_fit(with_structure(design, model), joint_values(design, model), "record")
    gravity = read_design_text(write_design(made)).load.gravity
    assert gravity is not None
    assert gravity.peak_Nm == pytest.approx(9.80665 * 0.3, rel=2e-3)
    assert gravity.offset_rad == pytest.approx(0.2, abs=2e-3)


def test_a_small_motion_tells_the_mass_at_the_design_s_offset_and_no_load_beside_it() -> None:
    """The design's pendulum is a tenth too heavy, its offset is right: there is no constant torque."""
    gravity = Gravity(mass_kg=1.1, arm_m=0.3, offset_rad=0.2)
    design = replace(_joint(), load=replace(_joint().load, gravity=gravity))
    model = fit_records(design, [_pendulum_record(0.02, drive="current", size=0.1)], gravity=True)
    assert tuple(model.fixed) == ("gravity_cos",)
    assert model["gravity_sin"] == pytest.approx(9.80665 * 0.3, rel=0.01)
    assert abs(model["offset"]) < 3.0 * model.std("offset") < 1e-4


@pytest.mark.parametrize(("term", "found_kg", "given", "mass_kg", "offset_rad"), [
    ("gravity_sin", 2.0, None, 2.0, 0.0),
    ("gravity_cos", 2.0, None, 2.0, 0.5 * np.pi),
    ("gravity_sin", -2.0, None, 2.0, np.pi),  # it hangs
    ("gravity_cos", -2.0, None, 2.0, -0.5 * np.pi),
    ("gravity_sin", 2.0, 1.1, 2.0, 1.1),
    ("gravity_cos", 2.0, 1.1, np.hypot(0.5, 2.0), 1.1 + np.arctan2(2.0, 0.5)),  # the other term is kept
    ("gravity_sin", -2.0, 3.0, 2.0, 3.0 - np.pi),
])  # fmt: skip
def test_one_term_of_a_pendulum_is_written_at_the_design_s_offset(term, found_kg, given, mass_kg, offset_rad):
    design = _joint()
    if given is not None:
        gravity = Gravity(mass_kg=0.5, arm_m=1.0, offset_rad=given)
        design = replace(design, load=replace(design.load, gravity=gravity))
    found = np.array([found_kg * 9.80665, 2e-5])
    fit = Fit(names=(term, "viscous"), values=found, covariance=np.diag([1e-4, 1e-14]))
    made = design_with_fit(with_structure(design, fit), joint_values(design, fit), "record").load.gravity
    assert made is not None
    assert (made.mass_kg, made.arm_m, made.offset_rad) == pytest.approx((mass_kg, 1.0, offset_rad), rel=1e-6)


def test_a_cogging_that_the_design_knows_is_none_of_the_friction() -> None:
    """Inertia, viscous and dry friction of a torque in closed form, half as much cogging as friction."""
    motor = {"motor.cogging": 0.015, "motor.cogging_periods": 12.0, "motor.cogging_phase": 0.7}
    inertia, viscous, dry = 7.5e-4, 8.6e-5, 0.03
    angle, speed = _waves(0), _waves(1)
    torque = inertia * _waves(2) + viscous * speed + dry * np.sign(speed) - 0.015 * np.sin(12.0 * angle + 0.7)
    design = with_values(bare("ilr33-amber"), {**motor, "limits.speed": 200.0})
    model = fit_records(design, [_record(angle=angle, torque_reference=torque)])
    assert model["inertia"] == pytest.approx(inertia, rel=1e-3)
    assert model["viscous"] == pytest.approx(viscous, rel=2e-2)
    assert model["dry"] == pytest.approx(dry, rel=2e-3)


def test_a_value_below_zero_within_its_error_is_the_design_s_own() -> None:
    names, covariance = ("friction.load_coefficient", "friction.viscous"), np.diag([1e-10, 1e-14])
    fit = Fit(names=names, values=np.array([-8e-6, 2e-6]), covariance=covariance)
    made, own = design_with_fit(_joint(), fit, "record").friction, _joint().friction
    assert (made.load_coefficient, made.viscous_Nms_rad) == (own.load_coefficient, 2e-6)
    # of two normal values the mean of one at the other: m + c/v (x - m)
    beside = replace(fit, covariance=np.array([[1e-10, 2e-13], [2e-13, 1e-14]]))
    moved = design_with_fit(_joint(), beside, "record").friction.viscous_Nms_rad
    assert moved == pytest.approx(2e-6 + 2e-3 * (own.load_coefficient + 8e-6))
    alone = fit.mapped({names[0]: {names[0]: 1.0}})
    assert design_with_fit(_joint(), alone, "record").friction == own


def test_gravity_left_out_shows_in_the_residual_and_what_cannot_be_is_refused() -> None:
    """The same record without a pendulum in the model: ten times as far off."""
    record = _pendulum_record(0.02, drive="current")
    without = fit_records(_joint(), [record])
    assert without.relative_residual > 0.15
    assert fit_records(_joint(), [record], gravity=True).relative_residual < 0.02
    with pytest.raises(InputError, match="self-locking"):
        fit_records(load_design("ilr33-amber"), [_pendulum_record(0.0, drive="current")], gravity=True)
    record = _record(position=_waves(0, 0.05), supply=np.full(len(TIME), 12.0))
    with pytest.raises(InputError, match="no drive signal"):
        fit_records(load_design("emps"), [record])


def _stribeck(speed: np.ndarray) -> np.ndarray:
    return np.interp(speed, [0.0, 0.01, 0.05, 0.2], [30.0, 18.0, 15.0, 30.0])


def _axis_record(law: str, seed: int = 0) -> Record:
    v, a = _waves(1, 0.05), _waves(2, 0.05)
    size = np.abs(v)
    friction = _stribeck(size) if law == "map" else 20.0 + 100.0 * size
    noise = np.random.default_rng(seed).standard_normal(len(TIME))
    force = 95.0 * a + friction * np.sign(v) + 1.0 + noise
    return _record(position=_waves(0, 0.05), force=force)


def test_a_plain_law_needs_no_map_and_a_design_with_one_is_moved_like_any_other() -> None:
    """Over five draws of noise the criterion never takes a map for a drive that has none."""
    for seed in range(5):
        model = fit_map(partial(fit_records, load_design("emps"), [_axis_record("plain", seed)]))
        assert model.knots_rad_s is None
        assert next(law for law in model.laws if law.taken).name.startswith("plain")
    record = _axis_record("map")
    record = replace(record, signals={**record.signals, "position_reference": record["position"]})
    result = identify_bench(load_design("emps"), [record], settings=Settings(friction="map"))
    assert result.design.friction.points
    outcome = correlate_record(result.design, record)
    assert all(np.isfinite(signal.relative_error) for signal in outcome.signals.values())
    assert "torque needed for its motion" not in result.resimulated[0].how


def test_a_friction_map_is_found_with_its_break_points_and_goes_into_the_design() -> None:
    """Truth: 30, 18, 15 N at 0, 0.01, 0.05 m/s, then rising 100 N per m/s; each point with its error."""
    result = identify_bench(load_design("emps"), [_axis_record("map")], settings=Settings(friction="map"))
    taken = next(law for law in result.laws if law.taken)
    assert taken.breaks_rad_s == pytest.approx((0.01, 0.05), rel=0.25)
    assert taken.criterion < -100.0
    assert result.model["inertia"] == pytest.approx(95.0, rel=5e-3)
    back = read_design_text(result.text)
    points = back.friction.map(1)
    assert points[0].speed_rad_s == 0.0
    assert len(points) == 4
    for k, point in enumerate(points, 1):
        assert point.torque_Nm == pytest.approx(result.model[f"map_{k - 1}"], rel=1e-6)
        assert back.parameters[f"friction.point.{k}.torque"].tolerance is not None
    assert result.passed
    assert result.resimulated[0].relative_error < 0.02
    speeds = np.array([0.003, 0.02, 0.04, 0.1, 0.15])
    torque = np.interp(speeds, [one.speed_rad_s for one in points], [one.torque_Nm for one in points])
    assert torque == pytest.approx(_stribeck(speeds), rel=0.05)


def test_only_what_was_recorded_while_enabled_is_used() -> None:
    """With the torque off for a second the fit is that of the rest, exactly."""
    record = _axis_record("plain")
    on = np.ones(len(TIME))
    on[-3000:] = 0.0
    force = np.where(on > 0.0, record["force"], 500.0)
    told = replace(record, signals={**record.signals, "force": force, "enable": on})
    cut = record.slice(0, len(TIME) - 3000)
    design = load_design("emps")
    whole, part = fit_records(design, [told]), fit_records(design, [cut])
    assert whole.values == pytest.approx(part.values, rel=1e-12)
    assert any("enabled from 0 s" in note for note in whole.records[0].notes)


def _voltage_record(noise: float, *, fast: bool) -> Record:
    """u = R i + kE w + L di/dt with R 0.5 ohm, kE 0.02, L 3 mH; fast: the current has a part at 60 Hz."""
    w, turn, part = 200.0 * _waves(1), 2.0 * np.pi * 60.0, 0.5 * fast
    current = 2.0 * _waves(0) + part * np.sin(turn * TIME)
    rate = 2.0 * _waves(1) + part * turn * np.cos(turn * TIME)
    rng = np.random.default_rng(2)
    voltage = 0.5 * current + 0.02 * w + 3e-3 * rate + noise * rng.standard_normal(len(TIME))
    return _record(angle=200.0 * _waves(0), current=current, voltage=voltage, speed=w)


def test_no_inductance_is_invented_and_a_cutoff_keeps_out_what_is_above_it() -> None:
    """The same motor twice: a calm record tells R and kE only, a fast one the inductance as well."""
    calm = fit_electrical(_joint(), [_voltage_record(0.5, fast=False)])
    assert "inductance" not in calm.names
    assert calm.fixed["inductance"].reason
    fast = fit_electrical(_joint(), [_voltage_record(0.05, fast=True)])
    assert fast["inductance"] == pytest.approx(3e-3, rel=0.02)
    for fit in (calm, fast):
        assert fit["resistance"] == pytest.approx(0.5, abs=4.0 * fit.std("resistance") + 0.02)
        assert fit["back_emf"] == pytest.approx(0.02, rel=0.02)
    record = _voltage_record(0.0, fast=False)
    tone = np.sin(2.0 * np.pi * 90.0 * TIME)
    record = replace(record, signals={**record.signals, "voltage": record["voltage"] + tone})
    far, near = (fit_electrical(_joint(), [record], recipe_for(record, hertz)) for hertz in (20.0, None))
    assert far.relative_residual < 0.05 * near.relative_residual


def test_the_motors_one_constant_goes_into_the_design_as_one() -> None:
    design = _joint()
    fit = fit_electrical(design, [_voltage_record(0.5, fast=False)])
    made = design_with_fit(design, fit.mapped(electrical_slopes(design, fit)), "record")
    back = read_design_text(write_design(made))
    assert back.motor.torque_constant_Nm_A == back.motor.back_emf_constant_Vs_rad
    assert back.motor.inductance_H == design.motor.inductance_H
    sampler = sampler_of(back)
    draws = dict(zip(sampler.paths, sampler.draw(0, 64).T, strict=True))
    assert draws["motor.torque_constant"] == pytest.approx(draws["motor.back_emf_constant"], rel=1e-5)
