"""What a host may ask of the unit, and when: order of calls, types, keys that go together, log, states."""

import re
import zipfile
from ctypes import c_char_p
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmu_host import Host, Refused, fmpy, hosted, needs_compiler, written

from actuator_lti import InputError
from actuator_lti.compiled.compiler import zig_command
from actuator_lti.design import load_design, parameter_value, with_values
from actuator_lti.design.asked import FrozenMap
from nonlinear import commands, simulate
from nonlinear.export.trace import trace_keys
from nonlinear.export.variables import structured

pytestmark = needs_compiler
PERIOD = 1e-4
NUMBER = re.compile(r"-?\d+(\.\d*)?(e[+-]?\d+)?")


def refused(host: Host, because: str, call: Any, *arguments: Any) -> None:
    """The call fails, says why, and leaves every byte of the state as it was."""
    before, said = saved(host), len(host.said)
    with pytest.raises(Refused):
        call(*arguments)
    assert len(host.said) == said + 1
    assert re.search(because, host.said[-1]), host.said[-1]
    assert saved(host) == before


def saved(host: Host) -> bytes:
    state = host.unit.getFMUState()
    data: bytes = host.unit.serializeFMUState(state)
    host.unit.freeFMUState(state)
    return data


def test_calls_out_of_order_are_refused_and_change_nothing(unit: Path) -> None:
    with hosted(unit) as (host,):
        u = host.unit
        refused(host, "before the init", host.step, 0.0, PERIOD)
        refused(host, "before the init", host.get, "output.angle")
        refused(host, "before the init", u.exitInitializationMode)
        refused(host, "before the init", u.terminate)
        host.start()
        refused(host, "after the init", u.enterInitializationMode)
        refused(host, "after the init", u.exitInitializationMode)
        host.set(command=0.05)
        for k in range(20):
            host.step(k * PERIOD, PERIOD)
        refused(host, "does not begin where", host.step, 10 * PERIOD, PERIOD)
        refused(host, "does not begin where", host.step, 21 * PERIOD, PERIOD)
        for step in (0.0, -PERIOD, float("nan"), float("inf")):
            refused(host, "not above 0, or not finite", host.step, 20 * PERIOD, step)
        refused(host, "no such input", host.put, {"supply_voltage": -1.0})
        refused(host, "no such input", host.put, {"control.period": 2 * PERIOD})
        refused(host, "no such input", host.put, {"output.angle": 1.0})
        host.step(20 * PERIOD, PERIOD)
        ours = simulate(load_design("ilr33-amber"), commands.step(0.05), 23 * PERIOD)
        assert host.get("output.angle") == [ours.output_angle_rad[21]]
        u.terminate()
        assert host.get("output.angle") == [ours.output_angle_rad[21]]
        refused(host, "after termination", host.step, 21 * PERIOD, PERIOD)
        refused(host, "after termination", host.put, {"command": 0.0})
        u.reset()
        refused(host, "the stop time before it", host.start, 0.9, 1.0)
        host.start(22 * PERIOD, command=0.05).step(0.0, 21 * PERIOD)
        assert host.get("output.angle") == [ours.output_angle_rad[21]]
        refused(host, "past the stop time", host.step, 21 * PERIOD, 1.1 * PERIOD)
        host.step(21 * PERIOD, PERIOD)


def test_the_log_can_be_turned_off_by_its_category(unit: Path) -> None:
    with hosted(unit) as (host,):
        fmi3 = unit.name == "drive3.fmu"

        def log(on: bool, *names: str) -> Any:
            given = (c_char_p * len(names))(*(name.encode() for name in names))
            known = host.unit.fmi3SetDebugLogging if fmi3 else host.unit.fmi2SetDebugLogging
            return known(host.unit.component, on, len(names), given)

        for on, names, count in ((False, ("logStatusError",), 0), (True, (), 1), (False, (), 1)):
            log(on, *names)
            with pytest.raises(Refused):
                host.step(0.0, PERIOD)
            assert len(host.said) == count
        log(True)
        refused(host, "allowed: logStatusError", log, True, "logAll")
        assert host.said[-1].startswith("logStatusError")


def test_counts_and_rates_are_integers(unit: Path) -> None:
    change = {"control.velocity.every": 2, "control.position.every": 6}
    description = fmpy.read_model_description(str(unit))
    types = {item.name: item.type for item in description.modelVariables}
    assert {types[name] for name in (*change, "encoder.counts_per_rev")} <= {"Integer", "Int32"}
    with hosted(unit) as (host,):
        refused(host, "of this type", host.put, {"control.velocity.every": 2.0})
        refused(host, "of this type", host.put, {"control.velocity.every": 0}, "Integer")
        host.put(change, "Integer")
        host.start(command=0.05).step(0.0, 200 * PERIOD)
        ours = simulate(with_values(load_design("ilr33-amber"), change), commands.step(0.05), 202 * PERIOD)
        assert host.get("output.angle")[0] == pytest.approx(ours.output_angle_rad[200], abs=1e-15)
        assert host.get("control.position.every", kind="Integer") == [6]


def test_keys_that_contradict_each_other_are_refused_as_in_a_design_file(unit: Path) -> None:
    """Position updates at every so many of the velocity's; kE within 10 % of kM; at first and later."""
    design, odd = load_design("ilr33-amber"), {"control.velocity.every": 2, "control.position.every": 3}
    with hosted(unit) as (host,):
        host.put(odd, "Integer")
        with pytest.raises(Refused):
            host.start()
        with pytest.raises(InputError) as python:
            with_values(design, odd)
        assert host.said[-1] == f"logStatusError: {python.value.message}"
        host.put({"control.velocity.every": 1, "control.position.every": 1}, "Integer")
        host.unit.exitInitializationMode()
        host.step(0.0, 2.5 * PERIOD)
        kM = parameter_value(design, "motor.torque_constant")
        many = {"control.position.gain": 60.0, "motor.back_emf_constant": 1.2 * kM}
        refused(host, "motor.back_emf_constant = .*within 10 %", host.put, many)
        assert host.get("control.position.gain")[0] == parameter_value(design, "control.position.gain")
        host.put({"motor.torque_constant": 1.15 * kM, "motor.back_emf_constant": 1.2 * kM})
        host.step(2.5 * PERIOD, PERIOD)


def test_what_no_longer_applies_is_not_refused(tmp_path) -> None:
    """Only a gear error bounds its order: without one, any order is a design and is taken."""
    design = with_values(load_design("ballscrew"), {"load.gear_error": 0.01})
    path = written(tmp_path, design)
    none = {"load.gear_error": 0.0, "load.gear_error_periods": 1e6}
    with_values(design, none)
    with hosted(path) as (host,):
        host.start(**{structured(key): value for key, value in none.items()})
        refused(host, "load.gear_error_periods = .*at most", host.put, {"load.gear_error": 0.01})


@pytest.mark.parametrize("name", ["ilr33-amber", "joint", "ballscrew", "fin"])
def test_random_keys_are_refused_with_the_words_of_the_design_file(name: str, tmp_path) -> None:
    rng = np.random.default_rng(11)
    design = replace(load_design(name), parameters=FrozenMap({}))  # a refusal shows SI, not the file's text
    path = written(tmp_path, design)
    keys = [key for key in trace_keys(design).keys if not key.whole]
    seen = {"refused": 0, "taken": 0}
    with hosted(path) as (host,):
        for _ in range(150):
            chosen = [keys[j] for j in rng.choice(len(keys), 3, replace=False)]
            drawn = [key.value * 10.0 ** rng.uniform(-1.5, 1.5) for key in chosen]
            pairs = zip(chosen, drawn, strict=True)
            values = {key.path: min(max(value, key.low), key.high) for key, value in pairs}
            try:
                with_values(design, values)
                words = ""
            except InputError as refusal:
                words = refusal.message
            host.said.clear()
            host.unit.reset()
            try:
                host.start(**{structured(key): value for key, value in values.items()})
                assert not words, words
                seen["taken"] += 1
            except Refused:
                said = host.said[-1].removeprefix("logStatusError: ")
                if "another structure" in said or "no such" in said:
                    continue
                # a hint at data-sheet conventions, behind it, is of the file alone
                assert NUMBER.sub("#", words).startswith(NUMBER.sub("#", said))
                seen["refused"] += 1
    assert min(seen.values()) > 5, seen


def test_what_the_units_of_the_file_were_turned_by_is_decided(tmp_path) -> None:
    """A screw's lead moves every number that the file gives on the motor's side: it is a constant."""
    path = written(tmp_path, load_design("ballscrew"))
    known = {item.name: item for item in fmpy.read_model_description(str(path)).modelVariables}
    assert known["screw.lead"].variability == "constant"
    assert known["motor.speed"].declaredType is None
    assert known["output.angle"].displayUnit == "mm"


def test_two_units_interleave_and_each_goes_back(unit: Path) -> None:
    """Two instances of one library, at steps of their own; one is saved, runs ahead, and goes back twice."""
    design = load_design("ilr33-amber")
    ours = [simulate(design, commands.step(x), 302 * PERIOD).output_angle_rad for x in (0.02, 0.05)]
    with hosted(unit, 2) as (a, b):
        a.start(command=0.02)
        b.start(command=0.05)
        kept, angles = None, []
        for k in range(100):
            a.step(3 * k * PERIOD, 3 * PERIOD)
            b.step(1.5 * k * PERIOD, 1.5 * PERIOD)
            assert a.get("output.angle") == [ours[0][3 * (k + 1)]]
            if k % 2 == 1:
                assert b.get("output.angle") == [ours[1][3 * (k + 1) // 2]]
            if k == 40:  # between two ticks
                kept = b.unit.getFMUState()
            angles.append(b.get("output.angle")[0])
        for _ in range(2):
            b.unit.setFMUState(kept)
            assert b.get("output.angle") == [angles[40]]
            for k in range(41, 100):
                b.step(1.5 * k * PERIOD, 1.5 * PERIOD)
                assert b.get("output.angle") == [angles[k]]
        a.unit.setFMUState(kept)  # the state of one in the other
        for k in range(41, 100):
            a.step(1.5 * k * PERIOD, 1.5 * PERIOD)
        assert a.get("output.angle") == [angles[99]]
        b.unit.freeFMUState(kept)


@pytest.mark.skipif(zig_command() is None, reason="ziglang is not installed")
def test_the_linux_binary_needs_no_newer_glibc_than_2_17(unit: Path) -> None:
    with zipfile.ZipFile(unit) as archive:
        (name,) = [name for name in archive.namelist() if name.endswith(".so")]
        needed = {tuple(map(int, v.split(b"."))) for v in re.findall(rb"GLIBC_([\d.]+)", archive.read(name))}
    assert needed
    assert max(needed) <= (2, 17)
