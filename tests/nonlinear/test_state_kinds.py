"""The layout says of each number of the state what it is, and the running drive agrees."""

from dataclasses import replace

import numpy as np
from elastic_drive import two_mass
from test_controller import some_drive

from actuator_lti import load_design
from actuator_lti.design import shipped_designs
from actuator_lti.design.model import Design, Supply
from nonlinear import Drive
from nonlinear._kernels import elastic_layout, layout
from nonlinear._kernels.state_kinds import CONTINUOUS, KINDS, NOTE, WORK, state_kinds

TICKS = 60
NAMED = [
    (part, name)
    for part, begin in ((layout, "S_"), (elastic_layout, "ES_"))
    for name in vars(part)
    if name.startswith(begin) and name != "ES_END"
]


def kinds_of(drive: Drive) -> np.ndarray:
    return state_kinds(drive._p)


def drives() -> list[Design]:
    """Every shipped drive, random cascades, two masses with play, stick on both sides, and a supply."""
    play = two_mass(
        friction={"dry_torque_Nm": 0.02, "load_coefficient": 0.01}, load_friction={"dry_torque_Nm": 0.1}
    )
    play = replace(play, load=replace(play.load, moment_damping_Nms_rad=0.01))
    weak = load_design("ilr33-amber")
    weak = replace(weak, supply=Supply(resistance_ohm=0.05, regenerative=False, capacitance_F=1e-3))
    feeding = replace(
        weak.controller, position=replace(weak.controller.position, acceleration_feedforward=0.5)
    )
    random = [some_drive(np.random.default_rng(case)) for case in range(60)]
    return [*map(load_design, shipped_designs()), *random, play, replace(weak, controller=feeding)]


def command(tick: int) -> float:
    return 0.3 * np.sin(0.2 * tick) + 0.01 * tick


def test_every_number_has_a_kind() -> None:
    assert all(name in part.__annotations__ for part, name in NAMED)
    for design in drives():
        drive = Drive(design)
        kinds = kinds_of(drive)
        assert kinds.shape == drive.get().shape
        assert set(kinds) <= set(KINDS)
        lines = slice(layout.S_QUEUE, int(drive._p[layout.AT_WORK]))  # delay line, angles, average, rings
        assert set(kinds[lines]) == {CONTINUOUS}


def test_nothing_goes_on_from_notes_and_work_space() -> None:
    """NaN in all of them before every tick: not one bit of what goes on is different."""
    for design in drives():
        plain, spoilt = Drive(design), Drive(design)
        kinds = kinds_of(plain)
        held = np.isin(kinds, (NOTE, WORK))
        for k in range(TICKS):
            state = spoilt.get()
            state[held] = np.nan
            spoilt.set(state)
            for drive in (plain, spoilt):
                drive.step(command(k))
            assert np.array_equal(plain.get()[~held], spoilt.get()[~held])


def test_something_goes_on_from_every_continuous_number() -> None:
    """Each of them, moved in one drive or the other, moves another number."""
    idle = {getattr(part, name): name for part, name in NAMED}
    for design in drives():
        drives_of_it = [Drive(design) for _ in range(3)]
        kinds = kinds_of(drives_of_it[0])
        idle = {place: name for place, name in idle.items() if kinds[place] == CONTINUOUS}
        for k in range(0, TICKS, 4):
            idle = {place: name for place, name in idle.items() if not moves(*drives_of_it, place, k)}
            for j in range(4):
                drives_of_it[0].step(command(k + j))
    assert list(idle.values()) == ["S_QUEUE"]  # the oldest voltage, which the delay line drops


def moves(drive: Drive, twin: Drive, changed: Drive, place: int, tick: int) -> bool:
    """Whether a number of the state of ``drive`` changes another one within three ticks."""
    state = drive.get()
    twin.set(state)
    state[place] += 2.0 if place == layout.S_OVERLOAD else 1e-3 * (abs(state[place]) + 1e-3)  # felt at 1
    changed.set(state)
    for k in range(3):
        twin.step(command(tick + k))
        changed.step(command(tick + k))
    return not np.array_equal(np.delete(twin.get(), place), np.delete(changed.get(), place))
