"""Speed of the nonlinear simulator, each figure as a ratio measured in one run."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np
import numpy.typing as npt

from actuator_lti import load_design
from actuator_lti.design.model import Coupling, Design, LoadFriction
from benchmarks.control_cascade import seconds_per_second
from benchmarks.plain_servo import PlainServo
from benchmarks.row import Row
from nonlinear import Rows, commands, loads, simulate
from nonlinear._kernels import layout as at
from nonlinear.native import parameters, resume

Floats = npt.NDArray[np.float64]
DURATION_S = 10.0
FIRST_CALL = """
import time
start = time.perf_counter()
from actuator_lti import load_design
from nonlinear import commands, simulate
simulate(load_design("ilr33-amber"), commands.sine(0.02, 1.0), 0.01)
print(time.perf_counter() - start, time.process_time())
"""


def rows(quick: bool = False) -> Iterator[Row]:
    """The rows of the table."""
    row = sawtooth_row()
    best = seconds_of(row, 3 if quick else 20)
    yield from against_plain_c(3 if quick else 15)
    yield against_control(best)
    note = f"{1e9 * best / row[at.TICKS]:.1f} ns a tick"
    yield Row(
        "real time over one core's time, 10 s run with history",
        DURATION_S / best,
        "x",
        2000.0,
        comparison=">=",
        note=note,
    )
    yield from wider_drives(PlainServo(load_design("ilr33-amber")), 1 if quick else 5)
    yield two_mass_with_play(best, quick)
    yield two_threads(quick)
    yield from constant_cost(quick)
    yield first_call()


def sawtooth_row() -> np.ndarray:
    """5 deg at 1 Hz with 4 N m on the baseline: stick, slip and saturation."""
    return sawtooth().values[0]


def sawtooth(design: Design | None = None) -> Rows:
    """The same as one row of a batch, of the baseline or another drive."""
    rows = Rows.of(design or load_design("ilr33-amber"))
    rows["ticks"] = round(DURATION_S / rows.value("period"))
    rows["load"] = 4.0
    rows.sine("command", np.radians(5.0), 1.0)
    return rows


def seconds_of(row: np.ndarray, repeats: int) -> float:
    """Best time of the compiled run with its history."""
    history, flags = room(row)
    return best_of(lambda: run(row, history, flags), repeats)


def run(row: np.ndarray, history: np.ndarray, flags: np.ndarray) -> np.ndarray:
    """The compiled run of a row, from its parameters on; what it sums up."""
    out = np.zeros(at.OUT_SIZE)
    p, s = parameters(row)
    resume(p, s, np.zeros(1), history, flags, out, np.zeros(2))
    return out


def room(row: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Arrays for a history."""
    ticks, elastic = int(row[at.TICKS]), int(row[at.ELASTIC_DRIVE])
    columns = 8 + at.ELASTIC_COLUMNS * elastic + int(row[at.VARYING_LOAD].any())
    return np.zeros((columns, ticks)), np.zeros(ticks, np.uint16)


def best_of(work: Callable[[], object], repeats: int, clock: Callable[[], float] = time.thread_time) -> float:
    """Shortest time of some repetitions, after one for warming up; time of this thread unless said."""
    work()
    times = []
    for _ in range(repeats):
        start = clock()
        work()
        times.append(clock() - start)
    return min(times)


PLAIN_RUNS = ((5.0, 1.0, 4.0), (0.05, 10.0, 2.0), (10.0, 3.0, 0.0))  # deg, Hz, N m


def against_plain_c(repeats: int) -> Iterator[Row]:
    """`simulate` against a plain C program of the same cascade, in turns; each allocates its history.

    The program has its reference and its load worked out before; `simulate` works its own out, so that a
    second row is given where the program does too.
    """
    design = load_design("ilr33-amber")
    peer, ticks = PlainServo(design), round(DURATION_S / design.controller.period_s)
    for size_deg, frequency_hz, load_Nm in PLAIN_RUNS:
        command, load = commands.sine(np.radians(size_deg), frequency_hz), loads.constant(load_Nm)
        reference = design.total_ratio * command.values(design.controller.period_s, ticks)
        moment = np.full(ticks, load_Nm)
        ours = partial(simulate, design, command, DURATION_S, load)
        given = partial(peer.run, reference, moment)
        worked_out = partial(_with_command, peer, design, command, moment)
        turns = [[best_of(work, repeats) for work in (ours, given, worked_out)] for _ in range(3)]
        here, *there = np.array(turns).min(axis=0)
        run = f"{size_deg:g} deg {frequency_hz:g} Hz {load_Nm:g} N m"
        for peers, time_s in zip(("", " with its command"), there, strict=True):
            note = f"{1e9 * here / ticks:.1f} ns a tick, C {1e9 * time_s / ticks:.1f}"
            yield Row(
                f"time over that of a plain C program{peers}, {run}",
                float(here / time_s),
                "x",
                1.2,
                note=note,
            )


def _with_command(peer: PlainServo, design: Design, command: commands.Command, load_Nm: Floats) -> object:
    """The plain program, and the sine of its command at every tick before it."""
    values = command.values(design.controller.period_s, load_Nm.size)
    return peer.run(design.total_ratio * values, load_Nm)


def against_control(best: float) -> Row:
    """The same cascade as python-control nonlinear systems."""
    slow = seconds_per_second(load_design("ilr33-amber"), 4.0)
    note = f"control: {slow:.0f} s for a simulated second, from its first 20 ms"
    return Row(
        "speed over control.input_output_response (RK45, rtol 1e-6)",
        slow / (best / DURATION_S),
        "x",
        3000.0,
        comparison=">=",
        note=note,
    )


WIDER = {  # drive, the filters of its velocity loop, with energies: most ticks of the plain program
    ("ilr33-amber-tanh", "", False): 2.45,
    ("ilr33-amber-compliant", "", False): 2.4,
    ("joint", "", False): 3.1,
    ("ballscrew", "", False): 2.5,
    ("fin", "", False): 4.4,
    ("ilr33-amber", ", two notches and a low-pass", False): 3.6,
    ("ilr33-amber", "", True): 4.8,
    ("ilr33-amber-tanh", "", True): 9.6,
}
"""Half of what springs and the tanh law took when the plain program took 22 ns a tick (106 to 193 ns);
three halves of the 53 ns of then with filters, twice with energies."""


def wider_drives(peer: PlainServo, repeats: int) -> Iterator[Row]:
    """A tick of what the plain program cannot do, over its tick of the rigid drive, in turns."""
    ticks = sawtooth().value("ticks")
    command = commands.sine(np.radians(5.0), 1.0).values(DURATION_S / ticks, int(ticks))
    given = load_design("ilr33-amber").total_ratio * command, np.full(command.size, 4.0)
    for (name, filters, energy), target in WIDER.items():
        rows = sawtooth(_filtered(load_design(name)) if filters else load_design(name))
        rows["with_energy"] = float(energy)
        row, count = rows.values[0], rows.value("ticks")
        turns = [[seconds_of(row, repeats), best_of(partial(peer.run, *given), repeats)] for _ in range(3)]
        tick_s, plain_s = np.array(turns).min(axis=0) / (count, ticks)
        what = f"{name}{filters}{', with energies' if energy else ''}"
        note = f"{1e9 * tick_s:.1f} ns, C {1e9 * plain_s:.1f}"
        yield Row(
            f"time a tick of {what} over the plain C program's", tick_s / plain_s, "x", target, note=note
        )


def _filtered(design: Design) -> Design:
    """Two notches and a low-pass in its velocity loop."""
    for frequency, width in ((4000.0, 2000.0), (9000.0, 4000.0)):
        notch = {"kind": "notch", "frequency": frequency, "width": width, "depth": 0.1}
        design = design.add_filter("velocity", **notch)
    return design.add_filter("velocity", kind="lowpass", frequency=12_000.0)


def two_mass_with_play(best: float, quick: bool) -> Row:
    """The baseline behind a coupling with play, against its own time a tick, in the same run."""
    rigid = load_design("ilr33-amber")
    stiffness, play = 100.0, np.radians(0.1)
    coupling = Coupling(stiffness_Nm_rad=stiffness, damping_Nms_rad=0.01, play_rad=float(play))
    friction = LoadFriction(dry_torque_Nm=0.2, viscous_Nms_rad=0.05)
    load = replace(rigid.load, inertia_kgm2=5e-3, friction=friction)
    row = sawtooth(replace(rigid, coupling=coupling, load=load)).values[0]
    taken, out = seconds_of(row, 2 if quick else 8), run(row, *room(row))
    note = f"{1e9 * taken / row[at.TICKS]:.1f} ns a tick, {out[at.OUT_STATE + at.S_EVENTS]:.0f} events"
    return Row(
        "two masses with play and both sides' friction over the baseline, time a tick",
        taken / best,
        "x",
        4.0,
        note=note,
    )


def two_threads(quick: bool) -> Row:
    """A batch of 1000 runs on two threads over one; and what two processes of plain arithmetic get here."""
    batch = sawtooth().repeat(1000)
    batch["ticks"] = 2000 if quick else 20_000
    batch.sine("command", np.linspace(0.001, 0.1, 1000), 3.0)
    pairs = [[best_of(partial(batch.run, threads=n), 1, time.perf_counter) for n in (1, 2)] for _ in range(3)]
    one, two = np.array(pairs).min(axis=0)
    note = f"two plain processes gain {machine_gain():.2f} on this machine now"
    return Row("two threads over one, batch of 1000", float(one / two), "x", 1.8, comparison=">=", note=note)


def machine_gain() -> float:
    """What two processes that share nothing gain over one: below 2 where the cores are shared."""
    with ProcessPoolExecutor(2) as pool:
        list(pool.map(spin, [1000, 1000]))
        start = time.perf_counter()
        list(pool.map(spin, [3_000_000]))
        one = time.perf_counter() - start
        start = time.perf_counter()
        list(pool.map(spin, [3_000_000, 3_000_000]))
        two = time.perf_counter() - start
    return 2.0 * one / two


def spin(n: int) -> int:
    """Plain arithmetic."""
    total = 0
    for k in range(n):
        total += k & 7
    return total


def constant_cost(quick: bool) -> Iterator[Row]:
    """Cost per tick of short and of very long runs (without history)."""
    row = sawtooth_row()
    costs = []
    for ticks in (10**4, 10**6, 10**7 if quick else 10**8):
        row[at.TICKS] = ticks
        work = partial(run, row, np.empty((0, 0)), np.empty(0, np.uint16))
        costs.append(best_of(work, 50 if ticks <= 10**6 else 1) / ticks)
    note = ", ".join(f"{1e9 * c:.1f}" for c in costs) + " ns"
    yield Row(
        "dearest over cheapest cost per tick, 1e4 to 1e8 ticks", max(costs) / min(costs), "x", 1.25, note=note
    )


def first_call() -> Row:
    """The first run of a new process, imports and all."""
    done = subprocess.run([sys.executable, "-c", FIRST_CALL], capture_output=True, text=True, check=True)
    wall, cpu = (float(word) for word in done.stdout.split())
    note = f"{cpu:.2f} s of processor time"
    return Row("first call of a process", wall, "s", 1.0, note=note)
