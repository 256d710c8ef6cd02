"""R, kE, L and the motion of records whose truth is an integration of its own, not the simulator's."""

from dataclasses import replace
from math import copysign, exp, floor, inf, pi
from typing import NamedTuple

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import StateSpace, dlsim, lfilter

from actuator_lti.design import read_design_text, with_values
from actuator_lti.design.model import Design
from analyses.identification.asked import Settings
from analyses.identification.bench import BenchResult, identify_bench
from analyses.identification.electrical import fit_electrical
from analyses.identification.own_bias import in_counts
from analyses.records.consistency import check_record
from analyses.records.record import Record
from nonlinear import commands, simulate
from tests.identification.bench_records import bare, errors_off, item_of, record_of
from tests.refusals import refused

OHM, HENRY, BACK, RATIO = 0.6, 3e-4, 0.05, 50.0
INERTIA, DRY, VISCOUS = 6e-5, 0.012, 4e-5
TICK_S, STEPS = 1e-4, 4
MOTOR = {"resistance": OHM, "back_emf": BACK, "inductance": HENRY}
TEXT = """
[design]
name = "mid"
[motor]
resistance = "0.6 ohm"
inductance = "0.0003 H"
torque_constant = "0.05 N*m/A"
back_emf_constant = "0.05 V*s/rad"
rotor_inertia = "4e-05 kg*m^2"
[[gear]]
name = "g"
ratio = 50
[load]
inertia = "0.05 kg*m^2"
path = "back-drivable"
moment_max = "5 N*m"
[friction]
law = "coulomb"
dry_torque = "0.012 N*m"
viscous = "4e-05 N*m*s/rad"
load_coefficient = 0
breakaway_ratio = 1
offset_torque = "0 N*m"
[encoder]
speed = "ideal"
[limits]
voltage = "48 V"
speed = "600 rad/s"
peak_current = "20 A"
[control]
period = "100 us"
computing_delay = "50 us"
[control.current]
gain = "0.75 V/A"
integral_time = "0.0005 s"
[control.velocity]
gain = "0.45 A*s/rad"
every = 1
integral_time = "0.02 s"
[control.position]
gain = "50 1/s"
every = 1
[validation]
full_deflection = "28.6 deg"
amplitude_fractions = [0.1]
loads = ["0 N*m"]
"""


def _held(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)


class Small(NamedTuple):
    """A motor, gains and integral times of its loops from within, limits of voltage, current and speed."""

    ohm: float
    henry: float
    back: float
    inertia: float
    dry: float
    viscous: float
    loops: tuple[float, ...]
    limits: tuple[float, float, float] = (inf, inf, inf)


def driven(drive: Small, command: np.ndarray, noise: np.ndarray | float = 0.0, every: int = 1) -> np.ndarray:
    """Speed, current, voltage and angle at each quarter of a tick under a position command, shape (4 n, 4).

    At a tick as the controller sees them, with the noise of speed and current. Exact, but for the quarter in
    which the speed changes its sign; the voltage acts half a tick after its sample, the integrators stand
    still at their limits, and the position loop runs ``every`` so many ticks.
    """
    back, dry, (of_current_V, current_s, of_speed_A, speed_s, of_place) = drive.back, drive.dry, drive.loops
    most_V, most_A, most_rad_s = drive.limits
    table = np.zeros((5, 5))  # current, speed, angle; voltage, friction torque
    table[0, [0, 1, 3]] = np.array([-drive.ohm, -back, 1.0]) / drive.henry
    table[1, [0, 1, 4]] = np.array([back, -drive.viscous, -1.0]) / drive.inertia
    table[2, 1] = 1.0
    (ii, iw, _, iu, it), (wi, ww, _, wu, wt), (ai, aw, _, au, at) = expm(table * TICK_S / STEPS)[:3].tolist()
    i = w = angle = acting = of_speed = of_current = wished = 0.0
    rows, on = np.empty((len(command) * STEPS, 4)), np.broadcast_to(noise, (len(command), 2))
    for k, (wanted, (on_speed, on_current)) in enumerate(zip(command.tolist(), on.tolist(), strict=True)):
        speed, current = w + on_speed, i + on_current
        wished = wished if k % every else _held(of_place * (wanted - angle), most_rad_s)
        off = wished - speed
        more = of_speed + of_speed_A * TICK_S / speed_s * off
        asked = _held(of_speed_A * off + more, most_A)
        of_speed = more if abs(asked) < most_A else of_speed
        more = of_current + of_current_V * TICK_S / current_s * (asked - current)
        voltage = _held(of_current_V * (asked - current) + more, most_V)
        of_current = more if abs(voltage) < most_V else of_current
        for step in range(STEPS):
            rows[k * STEPS + step] = w + on_speed, i + on_current, voltage, angle
            u, before = acting if 2 * step < STEPS else voltage, w
            friction = copysign(dry, w or back * i) if w or abs(back * i) > dry else back * i
            i, w, angle = (
                ii * i + iw * w + iu * u + it * friction,
                wi * i + ww * w + wu * u + wt * friction,
                angle + ai * i + aw * w + au * u + at * friction,
            )
            w = 0.0 if w * before < 0.0 and abs(back * i) <= dry else w
        acting = voltage
    return rows


def _command(kind: str) -> np.ndarray:
    time = np.arange(40_000) * TICK_S
    if kind == "square":
        return np.radians(17.0) * np.sign(np.sin(pi * time - 0.3)) * (time > 0.2)
    waves = 0.7 * np.sin(4.4 * time) + 0.3 * np.sin(14.5 * time + 1.0) - 0.3 * np.sin(1.0)
    return np.asarray(0.25 * waves * np.clip(time / 0.2, 0.0, 1.0))


LOOPS = (0.75, 0.0005, 0.45, 0.02)
DRIVE = Small(OHM, HENRY, BACK, INERTIA, DRY, VISCOUS, (*LOOPS, 50.0), (48.0, 20.0, 600.0))


def _recorded(command: np.ndarray, name: str, every: int = 1, gain: float = 50.0) -> Record:
    drive = DRIVE._replace(loops=(*LOOPS, gain))
    _, current, voltage, angle = driven(drive, RATIO * command, every=every)[::STEPS].T
    signals = {"reference": command, "angle": angle, "current": current, "voltage": voltage}
    return record_of(np.arange(len(command)) * TICK_S, name, **signals)


@pytest.fixture(scope="module", params=["square", "sines"])
def ticks(request: pytest.FixtureRequest) -> Record:
    """The drive at every tick."""
    return _recorded(_command(request.param), request.param)


def _every(record: Record, count: int) -> Record:
    signals = {name: values[::count] for name, values in record.signals.items()}
    return record_of(record.time_s[::count], record.name, **signals)


def _design(**changes: float) -> Design:
    design = read_design_text(TEXT)
    return with_values(design, {f"motor.{key}": value for key, value in changes.items()})


def _identified(record: Record, **changes: float) -> BenchResult:
    return identify_bench(_design(**changes), [record], settings=Settings(electrical=True))


@pytest.mark.parametrize("every", [1, 5, 10])
def test_rows_thinned_out_tell_the_motor_within_their_intervals(ticks: Record, every: int) -> None:
    """The voltage at a tenth of the ticks is not its mean between them: kE was off by ten standard errors."""
    off = {"back_emf_constant": 0.047, "torque_constant": 0.047, "resistance": 0.55}
    result = _identified(_every(ticks, every), **off)
    assert errors_off(result.electrical, MOTOR) < 3.5
    assert result.electrical["back_emf"] == pytest.approx(BACK, rel=1e-3)
    assert errors_off(result.model, {"inertia": INERTIA}) < 3.5
    assert result.passed


@pytest.mark.parametrize(
    ("gain", "every", "told", "near"),
    [(20.0, 10, True, 2e-3), (50.0, 20, True, 2e-3), (50.0, 10, False, 0.01)],
)
def test_rows_at_the_ticks_of_the_position_loop_tell_the_inertia(gain, every, told, near) -> None:
    """Each shows the end of what the loops made of a jump: 2 to 7 % low, the interval no narrower.

    A bias of more than a fifth of the viscous friction was left in all values, and of a motion with steps a
    command was learnt that made another (6.2 +- 1.5 % low, and met).
    """
    command = np.repeat(np.random.default_rng(1).uniform(-0.2, 0.2, 20), 2000)
    record = _every(_recorded(command, "steps", 10, gain), every)
    design = with_values(_design(), {"control.position.every": 10, "control.position.gain": gain})
    result = identify_bench(design, [record if told else record.without({"reference"})])
    model = result.model
    assert "% of Inertia, all at the motor" in item_of(result, "phase").reason  # as of another tick
    assert errors_off(model, {"inertia": INERTIA}) < 3.5
    assert model["inertia"] == pytest.approx(INERTIA, rel=near)
    assert model.std("inertia") < near * INERTIA


def test_a_way_to_take_the_command_that_no_drive_has_is_left_out() -> None:
    """The one held between the rows came with a negative friction, of which nothing can be simulated."""
    design = with_values(bare("ilr33-amber"), {"control.position.every": 10, "control.velocity.every": 2})
    run = simulate(design, commands.multisine(0.004, [5, 17, 43], 4.0, 1e-4, seed=1), 4.0)
    seen = {"reference": run.reference_rad, "angle": run.motor_angle_rad, "current": run.current_A}
    seen["speed"] = run.motor_speed_rad_s
    record = record_of(run.time_s[::20], **{name: values[::20] for name, values in seen.items()})
    model = identify_bench(design, [record]).model
    assert model["inertia"] == pytest.approx(design.inertia_kgm2, rel=5e-3)


def test_the_drive_may_take_its_command_between_the_rows_in_straight_lines() -> None:
    """Taken for a smooth curve, it met the record with a wrong motor: R was off, and nothing said so."""
    at = np.arange(0, 40_000, 10)
    command = np.interp(np.arange(40_000), at, _command("sines")[at])
    result = _identified(_every(_recorded(command, "sines"), 10), back_emf_constant=0.047, resistance=0.55)
    assert result.electrical["resistance"] == pytest.approx(OHM, rel=1e-3)
    assert result.electrical["back_emf"] == pytest.approx(BACK, rel=1e-4)
    assert result.electrical["inductance"] == pytest.approx(HENRY, rel=0.02)
    told = "command of the simulated drive, in straight lines between samples"
    assert result.model.records[0].used["reference"] == told


def test_a_voltage_that_is_commanded_says_nothing_of_how_it_was_commanded() -> None:
    """It is recorded to the last digit however the drive took it: one rounding outweighed all of the motion.

    Held between the rows was taken (with friction and noise, inertia 0.5 % off by 13 standard errors).
    """
    ticks = np.arange(40_000) * TICK_S
    volts = 8.0 * (np.sin(3.8 * ticks) + np.sin(10.7 * ticks + 1.0) + np.sin(24.5 * ticks + 2.0))
    volts *= np.clip(ticks / 0.3, 0.0, 1.0)
    table = np.array([[-OHM, -BACK, 0.0], [0.0, -VISCOUS, 0.0], [0.0, 1.0, 0.0]])
    table[1, 0] = BACK
    table /= np.array([[HENRY], [INERTIA], [1.0]])
    run = StateSpace(table, [[1.0 / HENRY], [0.0], [0.0]], np.eye(3), np.zeros((3, 1)))
    _, states, _ = dlsim(run.to_discrete(TICK_S), volts)
    current, _, angle = states[::10].T
    signals = {"voltage_reference": volts[::10], "voltage": volts[::10], "current": current, "angle": angle}
    free = {"friction.dry_torque": 0.0, "control.computing_delay": 0.0}
    design = with_values(_design(resistance=0.7, back_emf_constant=0.045, torque_constant=0.045), free)
    design = replace(
        design, controller=replace(design.controller, position=None, velocity=None, current=None)
    )
    record = record_of(ticks[::10], "open", **signals)
    result = identify_bench(design, [record], settings=Settings(electrical=True))
    assert result.model["inertia"] == pytest.approx(INERTIA, rel=2e-4)
    assert result.model.records[0].used["voltage_reference"] == "command of the simulated drive"


@pytest.mark.parametrize(("form", "dry"), [("symmetric", 0.0), ("symmetric", 1.0), ("per-direction", 1.0)])
def test_a_held_command_is_told_by_the_simulated_drive(form, dry, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each row shows the same end of the answer to a jump: R was off by 38 %, inertia by 20 %, and it failed.

    In sixteenths of a tick: by quarters, where the speed changes its sign, viscous friction is 2.3 % off.
    """
    monkeypatch.setitem(globals(), "STEPS", 16)
    record = _every(_recorded(np.repeat(_command("sines")[:12_000:10], 10), "held"), 10)
    changes = {"back_emf_constant": 0.047, "torque_constant": 0.047, "resistance": 0.55, "inductance": 2.5e-4}
    design = with_values(_design(**changes), {"friction.offset_torque": 0.2 * dry * DRY})
    design = design if dry else with_values(design, {"friction.dry_torque": 0.0})
    result = identify_bench(design, [record], settings=Settings(electrical=True, friction=form))
    motor = {"resistance": (OHM, 2e-3), "back_emf": (BACK, 1e-3), "inductance": (HENRY, 0.01)}
    laws = {"dry": (DRY, 1e-3), "viscous": (VISCOUS, 0.02)}
    sides = [""] if form == "symmetric" else ["_forward", "_reverse"]
    motion = {"inertia": (INERTIA, 1e-3), **{name + side: laws[name] for name in laws for side in sides}}
    for fit, truth in ((result.electrical, motor), (result.model, motion)):
        assert all(fit[n] == pytest.approx(one, rel=rel) for n, (one, rel) in truth.items()), fit
    assert result.model.records[0].used["reference"] == "command of the simulated drive, held between samples"
    assert result.passed


def test_noise_of_the_current_does_not_make_the_inductance_small(ticks: Record) -> None:
    """It is noise of two columns, R i and L di/dt: the simulated record, which has none, weighs the rows."""
    record, rng = _every(ticks, 1), np.random.default_rng(5)
    noisy = record["current"] + 0.1 * rng.standard_normal(len(record))
    fit = _identified(record_of(record.time_s, "noisy", **{**record.signals, "current": noisy})).electrical
    assert errors_off(fit, MOTOR) < 3.5


def test_a_voltage_that_one_row_misses_is_in_the_intervals(ticks: Record) -> None:
    """10 V over 5 ms at twelve places, which no simulated record has; the noise elsewhere is 1 mV."""
    record = _every(ticks, 10)
    rng, off = np.random.default_rng(3), np.zeros(len(record))
    off[rng.integers(200, len(record) - 200, 12)[:, None] + np.arange(5)] = 10.0
    noise = 1e-3 * rng.standard_normal(len(record))
    hit = {**record.signals, "voltage": record["voltage"] + off * np.sign(rng.normal(size=len(off))) + noise}
    fit = _identified(record_of(record.time_s, "hit", **hit)).electrical
    assert errors_off(fit, {"back_emf": BACK}) < 3.5


@pytest.mark.parametrize("counts", [256, 1024])
def test_a_coarse_encoder_does_not_make_the_inertia_small(ticks: Record, counts: int) -> None:
    """Noise of the acceleration takes from the inertia; what it takes is known of a simulated encoder."""
    record, count = _every(ticks, 10), 2.0 * pi / counts
    seen = np.array([count * floor(angle / count) for angle in record["angle"]])
    signals = {**record.signals, "angle": seen}
    del signals["voltage"]
    rng = np.random.default_rng(counts)
    signals["current"] = record["current"] + 4e-3 * rng.standard_normal(len(seen))
    model = identify_bench(_design(), [record_of(record.time_s, "coarse", **signals)]).model
    assert abs(model["inertia"] - INERTIA) < 3.0 * model.std("inertia")
    assert model["inertia"] == pytest.approx(INERTIA, rel=5e-3)


def test_counts_are_those_of_the_record_and_no_others() -> None:
    rng = np.random.default_rng(1)
    angle, count = rng.uniform(-20.0, 20.0, 4000), 2.0 * pi / 256
    recorded = np.array([float(f"{np.degrees(count) * k:.8g}") for k in np.floor(angle / count)])
    assert in_counts(np.degrees(angle), recorded) == pytest.approx(recorded, abs=1e-4)
    assert np.array_equal(in_counts(angle, angle), angle)


def test_a_record_is_held_against_one_design(ticks: Record) -> None:
    """R i and kE w, both as the design has them, and the voltage is used."""
    result = _identified(_every(ticks, 1), back_emf_constant=0.047, torque_constant=0.047)
    (finding,) = (one for one in result.findings[ticks.name] if one.subject.startswith("voltage against R"))
    assert finding.passed
    assert "kE w is 1.06 to 1.06 times as the design has it" in finding.text
    ratio = next(one.ratio for one in result.design_values if one.name == "back_emf")
    assert ratio == pytest.approx(0.05 / 0.047, rel=1e-3)
    assert result.passed


@pytest.mark.parametrize("filter_s", [2e-3, 4e-3])
def test_a_late_speed_is_no_other_resistance(filter_s: float, ticks: Record) -> None:
    """What kE w lacks goes with the current: R counted 1.28 times for 4 ms, "a winding 72 K warmer"."""
    keep = exp(-TICK_S / filter_s)
    late = lfilter([1.0 - keep], [1.0, -keep], np.gradient(ticks["angle"], TICK_S))
    record = record_of(ticks.time_s, "r", **{**ticks.without({"angle"}).signals, "speed": late})
    (one,) = (one for one in check_record(_design(), record) if one.subject.endswith("kE w"))
    assert one.passed, one.text


def test_a_reversed_column_is_not_answered_with_a_longer_motion(ticks: Record) -> None:
    record = _every(ticks, 10)
    turned = record_of(record.time_s, "r", **{**record.signals, "current": -record["current"]})
    refused(_identified, turned, match=r"current is reversed.*a column has the other sign")


@pytest.mark.parametrize("motion", ["angle", "angle between two counts", "speed"])
def test_a_motor_held_fast_tells_resistance_and_inductance(motion: str) -> None:
    """u = R i + L di/dt, by the derivative of the current itself; the voltage acts 0.1 ms later.

    An angle that flickers and the noise of a speed are no motion: as regressor it gave kE = 0 +- 0.1 kE.
    """
    time, turn, rng = np.arange(20_000) * TICK_S, 2.0 * pi * 40.0, np.random.default_rng(7)
    current = np.sin(turn * time)
    voltage = OHM * np.sin(turn * (time + TICK_S)) + HENRY * turn * np.cos(turn * (time + TICK_S))
    noise = {"angle": np.full(len(time), 0.1), "speed": 0.2 * rng.standard_normal(len(time))}
    noise["angle between two counts"] = 1.0 + 0.001 * rng.integers(0, 2, len(time))
    signals = {motion.split()[0]: noise[motion], "current": current, "voltage": voltage}
    record = record_of(time, "fast", **signals)
    refused(_identified, record, match=r"resistance = 0\.6 ohm .*inductance = 0\.000(3|299\d) H .*moves")
    refused(identify_bench, _design(), [record], match="fast: no motion beyond noise.*--electrical tells R")


@pytest.mark.parametrize("henry", [HENRY, 10.0 * HENRY])
@pytest.mark.parametrize(("every", "row"), [(5, 5), (20, 20), (20, 10), (20, 1)])
def test_a_voltage_of_a_slow_speed_loop_is_no_inductance(every: int, row: int, henry: float) -> None:
    """It is held for 20 ticks, and was taken for one: inductance +252 %, by 11 standard errors.

    The winding is exact at a fortieth of a tick, but for the speed's change within it.
    """
    fine, late, most = TICK_S / 40, TICK_S / 2, every * TICK_S
    time = fine * np.arange(int(4.0 / fine))
    speed = sum(w * np.sin(2.0 * pi * f * time + f) for w, f in ((200, 0.7), (100, 2.3), (40, 6.1)))

    def volts(time: np.ndarray) -> np.ndarray:
        held = most * np.floor(np.maximum(time, 0.0) / most + 1e-6)
        waves = ((6, 0.9), (4, 3.1), (1, 11.0), (2, 23.0))
        return np.asarray(sum(u * np.sin(2.0 * pi * f * held + f) for u, f in waves))

    fall = exp(-OHM / henry * fine)
    driving = (volts(time - late) - BACK * speed) / OHM
    current = lfilter([0.0, 1.0 - fall], [1.0, -fall], driving)
    at = np.arange(800 * row, len(time), 40 * row)
    noise = 1e-3 * np.random.default_rng(1).standard_normal(len(at))
    seen = {"speed": speed[at], "current": current[at] + noise, "voltage": volts(time[at])}
    slow = {"control.velocity.every": every, "control.position.every": every}
    design = with_values(read_design_text(TEXT), slow)
    design = replace(design, controller=replace(design.controller, current=None))
    fit = fit_electrical(design, [record_of(time[at] - time[at[0]], **seen)])
    assert errors_off(fit, {**MOTOR, "inductance": henry}) < 3.0
    assert fit["resistance"] == pytest.approx(OHM, rel=3e-3)
