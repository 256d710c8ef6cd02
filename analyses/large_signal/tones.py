"""Sines of many amplitudes and frequencies, begun in the linear steady state, run until they settle."""

import math
import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.design.plant import no_load_speed, reachable_speed
from actuator_lti.drive.facts import speed_torque_Nm, stall_torque_Nm
from actuator_lti.drive.profile import command_mean
from actuator_lti.drive.steady import steady_input
from actuator_lti.errors import InputError, NumericalError
from actuator_lti.loops import Loops
from actuator_lti.loops.tick import mean_response
from actuator_lti.systems.resolvent import states_at
from actuator_lti.systems.settling import settling_ticks
from analyses.large_signal.classify import FULL_TRIANGLE, STEADY
from analyses.linear.responses import response_at
from nonlinear import Rows
from nonlinear.runs.reduced import BatchResult


def without_value(states: Iterable[str], known: Collection[str], patterns: Iterable[str]) -> list[str]:
    """Give the states that an analysis has no value for, by name or by pattern."""
    whole = re.compile("|".join(f"(?:{each})" for each in patterns))
    return [name for name in states if name not in known and not whole.fullmatch(name)]


PLACES = {
    "i": "current_start",
    "w": "speed_start",
    "th": "angle_start",
    "current.I": "current_integrator_start",
    "velocity.I": "velocity_integrator_start",
    "hold_i_ref": "current_command_start",
    "u1": "voltage_start",
}
ELASTIC = {"W": "load_speed_start", "twist": "twist_start"}  # in contact; with play nobody knows them
LEFT_AT_REST = (
    r"W|twist|acc|u\d+",
    r"(?:speed\d*|estimate|torque\d+|command|position|derivative)\..+",
    r"hold_\w+|\w+_prev|(?:current|velocity)\.x\d+",
)
"""States that a run begins at rest: rows have no word for them; the settling time counts their decay."""
LEFT = 1e-9  # what begins at rest is gone by then, so that small sines are the linear ones
LONGEST_PERIODS = 20_000


@dataclass(frozen=True)
class LinearSteadyState:
    """The whole sampled loop under ``sin(w t)`` at the command, friction sliding without its dry part."""

    output: np.ndarray  # shape (K,): command to output angle, fundamental over all ticks, mean included
    states: dict[str, np.ndarray]  # shape (K,): by column of the rows: value at t = 0 is the imaginary part
    stable: bool
    settling_ticks: int  # as `settling_ticks_in_periods`


def settling_ticks_in_periods(loops: Loops, left: float = LEFT) -> int:
    """Ticks, whole periods of all loops, until so much is ``left``, the command's mean included; cut."""
    system, mean = loops.tick_system, command_mean(loops.design)
    assert system is not None
    settling = settling_ticks(system.slowest, left)
    periods = min(math.ceil(settling / system.ticks), LONGEST_PERIODS) if settling < math.inf else 500
    if mean is not None:
        periods += math.ceil(mean.samples * loops.design.controller.position_loop.every / system.ticks)
    return periods * system.ticks


def linear_steady_state(loops: Loops, omega_rad_s: np.ndarray, left: float = LEFT) -> LinearSteadyState:
    """Solve the sampled loop for its periodic state at each frequency; settled, so much is ``left``."""
    system = loops.tick_system
    assert system is not None
    if unknown := without_value(system.states, PLACES.keys(), LEFT_AT_REST):
        raise NumericalError(f"state {unknown[0]} of the linear drive: no start of a run knows it")
    Ts, M = loops.design.controller.period_s, system.ticks
    angle = [system.outputs.index("output_angle")]
    steps = [(A, B[:, :1], C[angle], D[angle, :1]) for A, B, C, D in map(system.matrices, range(M))]
    A, B = np.eye(len(system.states)), np.zeros(len(system.states))
    for A_j, B_j, _, _ in steps:
        A, B = A_j @ A, A_j @ B + B_j[:, 0]
    z = np.exp(1j * omega_rad_s * M * Ts)
    x = states_at(A, B[:, None], z)[..., 0]
    output = mean_response(steps, np.exp(1j * omega_rad_s * Ts)[:, None, None])[:, 0, 0]
    coupling = loops.design.coupling
    places = {**PLACES, **ELASTIC} if coupling is not None and coupling.play_rad == 0.0 else PLACES
    states = {places[name]: x[:, k] for k, name in enumerate(system.states) if name in places}
    if "w_ref" in system.outputs:
        row, (_, _, C, D) = system.outputs.index("w_ref"), system.matrices(0)
        states["speed_command_start"] = (x @ C[row] + D[row, 0]) / z
    mean = command_mean(loops.design)
    if mean is not None:  # in front of the loop: all that follows it is that much smaller and later
        before_loop = mean.response(omega_rad_s)
        output, states = output * before_loop, {name: x * before_loop for name, x in states.items()}
    stable = settling_ticks(system.slowest, left) < math.inf
    return LinearSteadyState(output, states, stable, settling_ticks_in_periods(loops, left))


def triangle_start(design: Design, rows: Rows, amplitude_rad: np.ndarray, limited: np.ndarray) -> None:
    """Begin sines that are ``limited`` and far beyond the speed limit on the flank of their triangle.

    A triangle finds its mean only slowly, by a factor of about (x - 1)/(x + 1) each half period, x = w A/R.
    None where a quarter period from rest is too short for the limit: parabolas (model.md, section 5).
    """
    limit = design.limits.speed_rad_s
    if design.controller.velocity is None or not limit < no_load_speed(design):
        return
    rate, omega = limit / design.total_ratio, 2.0 * np.pi * rows.frequency_hz()
    x = omega * amplitude_rad / rate
    push = min(float(stall_torque_Nm(design)) / design.inertia_kgm2, design.limits.acceleration_rad_s2)
    which = np.flatnonzero((x >= FULL_TRIANGLE) & limited & (omega * limit <= 0.5 * np.pi * push))
    lag = np.arccos(np.pi / (2.0 * x[which]))
    rows["angle_start"][which] = -limit * lag / omega[which]
    rows["speed_start"][which] = rows["speed_command_start"][which] = limit
    current, voltage = steady_input(design, speed_torque_Nm(design, limit), limit)
    rows["current_start"][which], rows["voltage_start"][which] = current, voltage
    inner, asked = design.controller.current, voltage
    if inner is not None:
        rows["current_command_start"][which] = asked = current
        if inner.integral_time_s is not None:  # without an integral it would keep what it begins with
            rows["current_integrator_start"][which] = voltage
    if design.controller.velocity.integral_time_s is not None:
        rows["velocity_integrator_start"][which] = asked


LEAST_UPDATES = 96  # updates of the position loop in a window: peaks are seen to 1 - cos(pi/96) = 0.05 %
DECADES_BELOW, FACTOR_ABOVE = 1.6, 8.0
HIGHEST = 0.8  # of the Nyquist frequency of the position loop
MOST_TICKS = 4_000_000  # of a map, its repetitions apart; where more work is needed the grid is coarser
FRICTION_RANGE, PLAIN_RANGE, LARGEST_RANGE = 2.0, 200.0, 2e4


@dataclass(frozen=True)
class Tone:
    """A frequency of which whole periods fill a window of ticks, at as many phases as it has updates."""

    frequency_hz: float
    ticks: int
    cycles: int

    @property
    def omega_rad_s(self) -> float:
        return 2.0 * math.pi * self.frequency_hz


def tone(
    frequency_hz: float, design: Design, least_updates: int = LEAST_UPDATES, least_cycles: int = 1
) -> Tone:
    """The tone next to a frequency: updates without a common factor with periods see as many phases."""
    every = design.controller.position_loop.every
    T = every * design.controller.period_s
    cycles = max(least_cycles, math.ceil(least_updates * frequency_hz * T))
    updates = round(cycles / (frequency_hz * T))
    while math.gcd(cycles, updates) > 1:
        updates += 1
    return Tone(cycles / (updates * T), updates * every, cycles)


def frequency_range_hz(design: Design, loops: Loops) -> tuple[float, float]:
    """Give the range around the bandwidth of the position loop in which large signals are looked at."""
    nyquist = 0.5 / (design.controller.position_loop.every * design.controller.period_s)
    grid = np.geomspace(nyquist * 1e-5, nyquist * 0.999, 400)
    below = np.flatnonzero(np.abs(response_at(loops.plain_response, 2.0 * np.pi * grid)) < math.sqrt(0.5))
    bandwidth = float(grid[below[0]]) if below.size else nyquist
    return bandwidth / 10.0**DECADES_BELOW, min(bandwidth * FACTOR_ABOVE, HIGHEST * nyquist)


def tones(design: Design, loops: Loops, count: int) -> tuple[Tone, ...]:
    """Give tones, spread evenly on a logarithmic scale around the bandwidth."""
    low, high = frequency_range_hz(design, loops)
    return tuple(tone(float(f), design) for f in np.geomspace(low, high, count))


def work_ticks(design: Design, loops: Loops, count: int) -> int:
    """Ticks that a sine at each of so many tones takes, two windows long; with smoothed friction thrice."""
    settling = settling_ticks_in_periods(loops)
    each = 3 if design.friction.law == "tanh" else 1
    return each * sum(settling + 2 * tone.ticks for tone in tones(design, loops, count))


def amplitudes(design: Design, count: int, smallest_rad: float | None) -> np.ndarray:
    """Command amplitudes up to full deflection, with the design's own, from twice ``smallest_rad`` on."""
    full = design.validation.full_deflection_rad
    wanted = sorted({fraction * full for fraction in design.validation.amplitude_fractions})
    top = max(full, wanted[-1])
    low = full / PLAIN_RANGE
    if smallest_rad is not None and math.isfinite(smallest_rad):
        low = float(np.clip(FRICTION_RANGE * smallest_rad, full / LARGEST_RANGE, low))
    values = np.geomspace(min(low, 0.5 * wanted[0]), top, max(count, 2))
    free = np.ones(len(values), dtype=bool)
    for amplitude in wanted:
        distance = np.where(free, np.abs(np.log(values / amplitude)), np.inf)
        nearest = int(np.argmin(distance))
        values[nearest], free[nearest] = amplitude, False
    return np.sort(values)


HARMONICS = 3
BEYOND = 1.1  # of the amplitude of the linear start: only what is limited can end in a triangle
DOUBLINGS = 4  # of a run that is not steady: at most so many times twice as long
ROUNDING = 1e-10  # of an output that stands: less is the rounding of its fundamental
TANH_TOLERANCE = 1e-5  # of the smoothing speed, a tick: far below what a fundamental is looked at for


def tone_rows(
    design: Design, tones: tuple[Tone, ...], which: np.ndarray, amplitude_rad: np.ndarray,
    start: LinearSteadyState, start_amplitude_rad: np.ndarray, *, load_Nm: float = 0.0,
    friction_on: bool = True, harmonics: int = HARMONICS,
) -> Rows:  # fmt: skip
    """One sine a run, tone ``which[r]``, from the linear steady state at ``start_amplitude_rad``.

    That is at most the onset of limiting; both amplitudes are the command's, at the output shaft.
    """
    rows = Rows.of(design, len(which), friction_on=friction_on)
    hertz, windows, cycles = np.array([(t.frequency_hz, t.ticks, t.cycles) for t in tones])[which].T
    rows.sine("command", amplitude_rad, hertz)
    rows.window(windows, cycles, harmonics)
    for place, values in start.states.items() if start.stable else ():
        rows[place] = start_amplitude_rad * values.imag[which]
    triangle_start(design, rows, amplitude_rad, amplitude_rad > BEYOND * start_amplitude_rad)
    rows["load"], rows["tanh_tolerance"] = load_Nm, TANH_TOLERANCE
    rows["ticks"] = start.settling_ticks + 2 * windows
    return rows


def run_until_steady(rows: Rows) -> tuple[BatchResult, np.ndarray]:
    """Run each until the fundamental of its output is that of half as long; and its last relative change.

    What changes by more than `STEADY` after `DOUBLINGS` is not steady; what stands is.
    """
    drives = [rows.running(k) for k in range(len(rows))]
    result = rows.run(drives=drives)
    change = np.zeros(len(rows))
    late = np.flatnonzero(result.ok & (result.window_stick_fraction < 1.0))
    for _ in range(DOUBLINGS):
        if not len(late):
            break
        longer, before = rows.take(late), result.phasor("output_angle_rad")[late]
        longer["ticks"] = 2 * result.column("ticks")[late]
        result = result.with_part(late, longer.run(drives=[drives[int(k)] for k in late]))
        after = result.phasor("output_angle_rad")[late]
        still = ROUNDING * result.rms("output_angle_rad")[late]
        change[late] = np.abs(after - before) / np.maximum(np.abs(after), np.maximum(still, 1e-300))
        late = late[change[late] > STEADY]
    return result, change


FAINT = 1e-6  # of what begins at rest is left, unless said otherwise
LONGEST_TICKS = 400_000


def settled_ticks(loops: Loops, left: float = FAINT) -> int:
    """Whole ticks after which so much is ``left`` of the slowest mode of sampled loops, cut at the longest.

    Raises `InputError`: where they are not stable.
    """
    assert loops.tick_system is not None
    ticks = settling_ticks(loops.tick_system.slowest, left)
    if ticks == math.inf:
        raise InputError("the loop is not stable: nothing settles in it", where=loops.design.name)
    return math.ceil(min(ticks, LONGEST_TICKS))


def full_range(design: Design) -> dict[str, float]:
    """Full deflection (output), motor speed and motor current that a drive can reach."""
    limits, motor = design.limits, design.effective_motor
    speed, current = reachable_speed(design), limits.peak_current_A
    if motor.resistance_ohm is not None:
        current = min(current, limits.voltage_V / motor.resistance_ohm)
    elif motor.source_gain_Nm_V is not None and design.friction.viscous() > 0.0:
        speed = min(speed, limits.voltage_V * motor.source_gain_Nm_V / design.friction.viscous())
    if not math.isfinite(speed):
        place = design.controller.position  # a gain of 0: a law of one's own
        gain = 1.0 if place is None or place.gain == 0.0 else place.gain
        speed = design.validation.full_deflection_rad * design.total_ratio * gain
    return {"position": design.validation.full_deflection_rad, "velocity": speed, "current": current}


def full_command(design: Design) -> float:
    """The largest command of the outermost loop: at the output a full deflection or a speed, a current."""
    stage, full = design.controller.outermost, {**full_range(design), "voltage": design.limits.voltage_V}
    return full[stage] / (design.total_ratio if stage == "velocity" else 1.0)
