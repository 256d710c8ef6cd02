"""The unit is the simulator: the same bits, any communication step, every key a parameter, both versions."""

import io
import os
import shutil
import subprocess
import sys
import zipfile
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmu_host import fmpy, hosted, needs_compiler, written
from programs import executed

from actuator_lti.compiled.compiler import compile_files, zig_command
from actuator_lti.design import Design, load_design, parameter_value, paths_of, with_values
from nonlinear import commands, loads, simulate
from nonlinear._kernels import layout as at
from nonlinear._kernels.start import derive, prepare_sizes, retune
from nonlinear.export import fmu_bytes
from nonlinear.export.c_files import exported_row, spare_parameters
from nonlinear.export.trace import trace_keys
from nonlinear.export.variables import structured
from nonlinear.native import parameters, tick
from nonlinear.row.parameters import design_row

validation = pytest.importorskip("fmpy.validation")
OUTPUTS = ["output.angle", "motor.speed", "motor.current", "motor.voltage"]


def run(path: Path, step_s: float, stop_s: float, start: dict[str, Any] | None = None, **more: Any) -> Any:
    return fmpy.simulate_fmu(
        str(path), stop_time=stop_s, output_interval=step_s, start_values=start or {}, output=OUTPUTS, **more
    )


def assert_same(result: Any, design: Design, command: float, load: float, every: int = 1) -> None:
    ticks = (len(result) - 1) * every + 1
    ours = simulate(design, commands.step(command), ticks * design.controller.period_s, loads.constant(load))
    seen = (ours.output_angle_rad, ours.motor_speed_rad_s, ours.current_A)
    for name, values in zip(OUTPUTS, seen, strict=False):
        assert np.array_equal(result[name], values[::every]), name
    # the voltage at a communication point is that of the tick before
    assert np.array_equal(result["motor.voltage"][1:], ours.voltage_V[every - 1 :: every][: len(result) - 1])


@needs_compiler
@pytest.mark.parametrize("name", ["ilr33-amber", "joint", "ballscrew", "fin", "ilr33-amber-compliant"])
def test_units_are_valid_and_give_the_simulators_bits(name: str, tmp_path) -> None:
    design = load_design(name)
    step = design.controller.period_s
    for version in (2, 3):
        path = written(tmp_path, design, version)
        assert validation.validate_fmu(str(path)) == []
        for size, load, every in ((0.05, 0.0, 1), (0.01, 0.1, 1), (0.02, 3.0, 5)):
            start = {"command": size, "hinge_moment": load}
            assert_same(run(path, every * step, 500 * step, start), design, size, load, every)


@needs_compiler
def test_the_manipulation_toolbox_finds_nothing(unit: Path) -> None:
    tool = Path(sys.prefix) / "bin/fmutool"
    if not tool.is_file():
        pytest.skip("fmu-manipulation-toolbox is not installed")
    call = [str(tool), "-input", str(unit), "-check"]
    done = subprocess.run(call, capture_output=True, text=True, check=True)
    said = done.stdout + done.stderr
    assert "seems to be compliant" in said
    assert "No semantic error" in said


@needs_compiler
def test_parameters_are_the_keys_of_the_design(unit: Path) -> None:
    description = fmpy.read_model_description(str(unit))
    design = load_design("ilr33-amber")
    known = {item.name: item for item in description.modelVariables}
    for path in {*paths_of(design)} - {"limits.voltage"}:  # an input
        assert float(known[structured(path)].start) == parameter_value(design, path), path
    at_start = {each.variable.name: each.dependencies for each in description.initialUnknowns}
    assert (
        at_start["motor.angle"] is None
    )  # not said, so of all that is known: initial.angle times the ratios
    assert [each.name for each in at_start["output.angle"]] == ["initial.angle"]
    changes = {"motor.resistance": 0.07, "control.position.gain": 60.0, "friction.dry_torque": 0.003}
    changed = with_values(design, changes)
    result = run(unit, 1e-4, 0.05, {"command": 0.05, **changes})
    ours = simulate(changed, commands.step(0.05), 501e-4)
    assert np.abs(result["output.angle"] - ours.output_angle_rad).max() < 1e-13


@pytest.mark.parametrize("name", ["ilr33-amber", "emps", "ctms-motor-position", "joint"])
def test_traced_keys_give_the_row_of_the_changed_design(name: str) -> None:
    """The statements, run as Python, against `design_row` of the design with these values."""
    design = load_design(name)
    trace, rng = trace_keys(design), np.random.default_rng(5)
    free = [key for key in trace.keys if not key.fixed and key.path != "friction.breakaway_ratio"]
    tried = 0
    for _ in range(40):
        values = {key.path: min(max(key.value * rng.uniform(0.8, 1.25), key.low), key.high) for key in free}
        k = [values.get(key.path, key.value) for key in trace.keys]
        p = executed(trace.lines, k)
        row = design_row(with_values(design, values, check=False))
        for place, value in p.items():
            assert value == pytest.approx(row[place], rel=1e-14)
            tried += 1
    assert tried > 200


@needs_compiler
def test_one_hour_in_one_step(unit: Path) -> None:
    """36 million ticks, counted: the time of the last one is exact."""
    if "drive3" in unit.name:
        pytest.skip("the counting is the same code; once is enough")
    result = fmpy.simulate_fmu(str(unit), stop_time=3600.0, output_interval=3600.0, output=["output.angle"])
    assert len(result) == 2
    assert result["output.angle"][-1] == 0.0


def own_host(folder: Path, design: Design, platform: str, *flags: str) -> str:
    """Unpacks the unit of a design beside a host in C; the unit's GUID."""
    path = written(folder, design, platform=platform)
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder)
    source = {"host.c": Path(__file__).with_name("c_host.c").read_text(encoding="utf-8")}
    (folder / "host.exe").write_bytes(compile_files(source, "host.exe", platform, flags))
    (folder / "host.exe").chmod(0o755)
    return str(fmpy.read_model_description(str(path)).guid)


@needs_compiler
@pytest.mark.parametrize(("step", "save_at"), [(1e-4, 50), (1.0 / 60.0, 7), (2.5e-5, 42), (1e-3, 0)])
def test_own_host_saves_serialises_and_goes_on(step: float, save_at: int, tmp_path) -> None:
    design = load_design("ilr33-amber-multirate")
    guid = own_host(tmp_path, design, "linux64", "-ldl")
    library = tmp_path / "binaries/linux64/drive.so"
    call = [str(tmp_path / "host.exe"), str(library), guid, "100", repr(step), "0.05"]
    done = subprocess.run([*call, str(save_at)], capture_output=True, text=True, check=True)
    through = subprocess.run([*call, "-1"], capture_output=True, text=True, check=True)
    assert done.stdout == through.stdout
    angles = np.array([float.fromhex(line) for line in done.stdout.split()])
    ours = simulate(design, commands.step(0.05), 100 * step + 2e-3)
    ticks = np.arange(1, 101) * step / 1e-4
    whole = np.abs(ticks - np.round(ticks)) < 1e-4
    assert np.array_equal(angles[whole], ours.output_angle_rad[np.round(ticks[whole]).astype(int)])
    assert "wrong type, name or GUID" in done.stderr


@needs_compiler
@pytest.mark.parametrize(("name", "change"), [
    ("ilr33-amber", {"control.position.gain": 50.0}),
    # a row of parameters that becomes longer, and a motor that no longer slips where it did
    ("joint", {"coupling.stiffness": 30.0, "coupling.play": 2e-3, "friction.dry_torque": 3.0}),
    ("ilr33-amber", {"friction.dry_torque": 0.0, "friction.load_coefficient": 0.0}),
])  # fmt: skip
def test_tuning_between_steps_changes_what_follows(name: str, change: dict[str, float], tmp_path) -> None:
    """Keys changed during the run: as if the simulator had been stopped and gone on with the other row."""
    design = load_design(name)
    values = {path: parameter_value(design, path) * factor for path, factor in change.items()}
    path = written(tmp_path, design)
    assert set(change) <= {key.path for key in trace_keys(design).keys if not key.fixed}
    p, s = parameters(exported_row(design))
    p, row = np.concatenate([p, np.zeros(spare_parameters(p))]), np.zeros(at.IO_SIZE)
    row[at.IN_COMMAND] = 0.05
    period = design.controller.period_s
    with hosted(path) as (host,):
        host.start(command=0.05)
        for k in range(400):
            if k == 200:
                host.put({structured(key): value for key, value in values.items()})
                p[: at.SIZE] = exported_row(with_values(design, values))
                prepare_sizes(p)
                derive(p, s)
                retune(p, s)
            host.step(k * period, period)
            tick(p, s, row)
            assert host.get("motor.angle") == [s[at.S_ANGLE]], k
        with pytest.raises(Exception, match="fmi2SetReal failed"):
            host.put({"control.period": 2.0 * period})


@pytest.mark.skipif(zig_command() is None, reason="ziglang is not installed")
def test_both_platforms_in_one_file_with_the_same_bytes_each_time(monkeypatch) -> None:
    monkeypatch.setattr("nonlinear.export.fmu.compile_files", compile_files)  # each time anew
    design = load_design("emps")
    data = fmu_bytes(design)
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        names = set(archive.namelist())
        assert {"binaries/linux64/drive.so", "binaries/win64/drive.dll", "sources/drive.c"} <= names
        assert archive.read("binaries/win64/drive.dll")[:2] == b"MZ"
        assert archive.read("binaries/linux64/drive.so")[:4] == b"\x7fELF"
    assert fmu_bytes(design) == data


@pytest.fixture(scope="module")
def wine_prefix(tmp_path_factory) -> Path:
    """One Windows for all units: the first start of wine furnishes it, and takes the longest."""
    return tmp_path_factory.mktemp("wine")


@pytest.mark.skipif(
    zig_command() is None or shutil.which("wine") is None, reason="ziglang or wine is not installed"
)
@pytest.mark.parametrize("name", ["ilr33-amber", "fin", "joint"])
def test_win64_binary_runs_under_wine(name: str, wine_prefix: Path, tmp_path) -> None:
    """Another C library's sine and exponential: equal to 1e-11 of full scale, events at the same ticks."""
    design = load_design(name)
    period_s, guid = design.controller.period_s, own_host(tmp_path, design, "win64")
    call = ["wine", "host.exe", "binaries/win64/drive.dll", guid, "300", repr(period_s), "0.05", "100"]
    quiet, said = {**os.environ, "WINEDEBUG": "-all", "WINEPREFIX": str(wine_prefix)}, ""
    with suppress(subprocess.TimeoutExpired):
        options = {"cwd": tmp_path, "capture_output": True, "text": True, "env": quiet, "timeout": 120}
        said = subprocess.run(call, **options).stdout
    if not said:
        pytest.skip("wine does not start here")
    angles = np.array([float.fromhex(line) for line in said.split()])
    ours = simulate(design, commands.step(0.05), 301 * period_s)
    assert np.abs(angles - ours.output_angle_rad[1:]).max() < 1e-11 * 0.05


@needs_compiler
def test_command_writes_the_report_and_the_licence_into_it(tmp_path, cli) -> None:
    cli.text("export", "fmu", "emps", "--out", tmp_path / "d.fmu", "--platform", "linux64")
    with zipfile.ZipFile(tmp_path / "d.fmu") as archive:
        assert b"<html" in archive.read("documentation/index.html")
        assert b"MIT License" in archive.read("documentation/licenses/license.txt")
