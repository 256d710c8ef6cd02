"""A motor switched off: what its decay shows, friction over inertia, in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_lti.design import read_design_text, with_values
from actuator_lti.design.model import Design
from analyses.identification.asked import Settings
from analyses.identification.bench import BenchResult, identify_bench
from analyses.identification.run_down import decay_of, switched_off
from analyses.records.record import Record
from reports.sections.identify_records import section
from tests.identification.bench_records import errors_off, item_of, record_of
from tests.identification.test_voltage_equation import TEXT
from tests.refusals import refused

PERIOD_S, COUNT = 1e-3, 2.0 * np.pi / 4096
INERTIA, VISCOUS, DRY = 6e-5, 1.1e-4, 8e-3


def _design(**changes: float) -> Design:
    return with_values(read_design_text(TEXT), {f"friction.{key}": one for key, one in changes.items()})


def _decay(p: float, q: float, begin: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, speed and angle of w' = -p w - q, from a speed until it stands, and a while after."""
    stop = np.log1p(begin * p / q) / p
    time = np.arange(0.0, 1.3 * stop, PERIOD_S)
    since = np.minimum(time, stop)
    speed = np.where(time < stop, (begin + q / p) * np.exp(-p * since) - q / p, 0.0)
    return time, speed, (begin + q / p) / p * -np.expm1(-p * since) - q / p * since


def _recorded(
    rng: np.random.Generator,
    p: float,
    q: float,
    *,
    side: int = 1,
    noise: float = 1.0,
    current_A: float = 0.0,
    level_A: float = 0.0,
) -> Record:
    time, speed, _ = _decay(p, q, rng.uniform(250.0, 500.0))
    seen = side * speed + noise * rng.standard_normal(len(time))
    current = level_A + current_A * rng.standard_normal(len(time))
    return record_of(time, "off", speed=seen, current=current)


def _identified(*records: Record, fix: list[str] | None = None, **changes: float) -> BenchResult:
    return identify_bench(_design(**changes), records, settings=Settings(fix=fix))


@pytest.mark.parametrize("by", ["speed", "angle"])
def test_intervals_of_the_ratios_hold_95_in_100(by: str) -> None:
    """They were 0 ± 0; white noise of the speed, or counts of an encoder, which are none."""
    off = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        truth = np.array([10.0 ** rng.uniform(-0.5, 0.5), rng.uniform(60.0, 300.0)])
        time, speed, angle = _decay(*truth, rng.uniform(200.0, 550.0))
        noisy = speed + 10.0 ** rng.uniform(-1.0, 1.0) * rng.standard_normal(len(time))
        seen = {"speed": noisy} if by == "speed" else {"angle": COUNT * np.floor(angle / COUNT)}
        found = decay_of(_design(), record_of(time, current=np.zeros_like(time), **seen))
        off.append((found.ratios - truth) / np.sqrt(np.diag(found.covariance)))
    held = np.mean(np.abs(off) < 1.96, axis=0)
    assert np.all(held >= 0.92)
    assert np.all(held <= (0.98 if by == "speed" else 1.0))
    assert np.max(np.abs(off)) < 4.0


@pytest.mark.parametrize(
    ("current_A", "level_A"), [(0.0, 0.0), (0.01, 0.0), (0.01, 0.02), (0.003, -0.05), (0.0, 0.02)]
)
def test_friction_is_found_at_the_design_s_inertia_and_the_ratios_are_said(
    current_A: float, level_A: float
) -> None:
    """Of a sensor with an offset it was "no motion beyond noise", or passed with half of the friction."""
    p, q = VISCOUS / INERTIA, DRY / INERTIA
    seen = _recorded(np.random.default_rng(1), p, q, current_A=current_A, level_A=level_A)
    result = _identified(seen)
    assert any("offset of its sensor" in note for one in result.records for note in one.notes) == bool(
        level_A
    )
    model, kept = result.model, result.model.fixed["inertia"]
    assert model.names == ("viscous", "dry")
    for name, truth in (("viscous", VISCOUS), ("dry", DRY)):
        assert abs(model[name] - truth) < 3.0 * model.std(name) < 0.05 * truth
        assert kept.moves[name] == pytest.approx(model[name] / INERTIA)
    assert "friction over inertia alone" in kept.reason
    assert f"b/J = {p:.2g}" in kept.reason
    assert {item.id for item in result.items if not item.passed} == {"kept-inertia", "kept-offset"}
    assert result.design.friction.dry_torque_Nm == pytest.approx(DRY, rel=0.01)


def test_at_known_friction_the_inertia_is_found() -> None:
    """Twice the design's: the dry friction is what the user knows."""
    record = _recorded(np.random.default_rng(2), 0.5 * VISCOUS / INERTIA, 0.5 * DRY / INERTIA)
    model = _identified(record, fix=[f"friction.dry_torque={DRY}"]).model
    assert model.names == ("inertia", "viscous")
    assert abs(model["inertia"] - 2.0 * INERTIA) < 3.0 * model.std("inertia") < 0.1 * INERTIA
    assert abs(model["viscous"] - VISCOUS) < 3.0 * model.std("viscous")


def test_both_directions_tell_the_offset() -> None:
    rng, offset, p = np.random.default_rng(3), 1e-3, VISCOUS / INERTIA
    pair = [_recorded(rng, p, (DRY + side * offset) / INERTIA, side=side) for side in (1, -1)]
    result = _identified(*pair)
    model = result.model
    assert model.names == ("viscous", "dry", "offset")
    assert section(result)["blocks"]  # no table of records fitted alone: of a run-down there is none
    assert errors_off(model, {"viscous": VISCOUS, "dry": DRY, "offset": offset}) < 3.0


def test_a_map_is_refused_and_a_second_run_down_is_held_against_the_design() -> None:
    pair = [_recorded(np.random.default_rng(k), VISCOUS / INERTIA, DRY / INERTIA) for k in (6, 7)]
    refused(identify_bench, _design(), pair, settings=Settings(friction="map"), words="friction map")
    one, other = pair
    result = identify_bench(_design(), [one], validation=[replace(other, name="second")])
    written = [item for item in result.items if item.id.startswith("written-")]
    assert [item.passed for item in written] == [True, True]
    assert all(0.0 < item.value < 0.02 for item in written)


@pytest.mark.parametrize("more", [0.0, 0.5])
def test_a_decay_of_another_law_is_not_proven(more: float) -> None:
    """Friction that rises below 60 rad/s by half, integrated in steps of 10 us."""
    speed, rows = 400.0, []
    while speed > 0.0:
        rows.append(speed)
        for _ in range(100):
            rise = 1.0 + more * np.exp(-((speed / 60.0) ** 2))
            speed -= 1e-5 * (VISCOUS * speed + DRY * rise) / INERTIA
    seen = np.array(rows) + 0.3 * np.random.default_rng(4).standard_normal(len(rows))
    time = PERIOD_S * np.arange(len(rows))
    result = _identified(record_of(time, "bent", speed=seen, current=np.zeros(len(rows))))
    assert item_of(result, "law").passed is (None if more else True)


@pytest.mark.parametrize("by", ["speed", "angle"])
def test_a_motor_that_nothing_slows_tells_no_friction(by: str) -> None:
    """It ended in an error of linear algebra, or in ratios of any size."""
    for seed in range(5):
        rng, time = np.random.default_rng(seed), PERIOD_S * np.arange(2000)
        begin = rng.uniform(300.0, 400.0)
        seen = begin + 0.05 * rng.standard_normal(len(time))
        seen = COUNT * np.floor(begin * time / COUNT) if by == "angle" else seen
        record = record_of(time, current=0.0 * time, **{by: seen})
        refused(decay_of, _design(), record, words="no friction")


def test_no_dry_friction_is_written_as_none() -> None:
    """Below zero within its error the design's own was kept, 8 mN m, which does not meet the record."""
    none, time = 0, PERIOD_S * np.arange(4000)
    fall = 300.0 * np.exp(-VISCOUS / INERTIA * time)
    for seed in range(4):
        seen = fall + 0.05 * np.random.default_rng(seed).standard_normal(4000)
        result = _identified(record_of(time, speed=seen, current=0.0 * time))
        dry, law = result.model["dry"], result.design.friction
        assert abs(dry) < 4.0 * result.model.std("dry") < 1e-3 * DRY
        assert law.dry_torque_Nm == pytest.approx(dry, rel=1e-6)
        assert law.viscous_Nms_rad == pytest.approx(VISCOUS, rel=1e-3)
        assert all(item.passed for item in result.items if item.id.startswith("written-"))
        none += dry == 0.0
    assert none


@pytest.mark.parametrize(("side", "rest"), [(-1, 1), (1, 1), (-1, 0)])
def test_two_decays_in_one_record_are_refused(side: int, rest: int) -> None:
    """The first alone was fitted, and all rows told as used."""
    speed = _decay(VISCOUS / INERTIA, DRY / INERTIA, 300.0)[1]
    speed = speed if rest else speed[speed > 0.0]
    both = np.concatenate([speed, side * speed])
    record = record_of(PERIOD_S * np.arange(len(both)), speed=both, current=0.0 * both)
    refused(identify_bench, _design(), [record], settings=Settings(), words="one decay")


def test_a_run_down_beside_a_driven_record_or_with_gravity_is_refused() -> None:
    down = _recorded(np.random.default_rng(8), VISCOUS / INERTIA, DRY / INERTIA)
    refused(identify_bench, _design(), [down, _driven()], settings=Settings(), words="by itself")
    refused(identify_bench, _design(), [down], settings=Settings(gravity=True), words="--gravity")


def test_a_shorted_motor_brakes_itself_and_is_no_run_down() -> None:
    """No voltage at its clamps: a current kM w / R, which tells the inertia, ten times the design's."""
    design, inertia = _design(viscous=VISCOUS, dry_torque=DRY), 10.0 * INERTIA
    motor = design.motor
    assert motor.torque_constant_Nm_A is not None
    assert motor.resistance_ohm is not None
    braking = motor.torque_constant_Nm_A**2 / motor.resistance_ohm
    time, speed, _ = _decay((VISCOUS + braking) / inertia, DRY / inertia, 550.0)
    record = record_of(time, "short", speed=speed, voltage=0.0 * time)
    assert identify_bench(design, [record]).model["inertia"] == pytest.approx(inertia, rel=0.03)


def _driven() -> Record:
    """Noise of 0.1 A that turns the rotor by itself, from rest."""
    drive = 0.3 * np.random.default_rng(5).standard_normal(4000)
    speed = np.concatenate([[0.0], np.cumsum(PERIOD_S * 0.05 * drive[:-1] / INERTIA)])
    return record_of(PERIOD_S * np.arange(4000), "driven", speed=speed, current=drive)


def test_a_current_that_drives_is_not_taken_for_noise() -> None:
    assert np.any(switched_off(_design(), _driven())["current"])
