"""The kept WebAssembly: made of today's sources, without imports, small, equal to the simulator in node."""

import hashlib
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
import pytest
from programs import in_json, in_node, needs_node

from actuator_lti import load_design
from actuator_lti.compiled.compiler import zig_command
from actuator_lti.design.model import Instruments
from nonlinear._kernels import layout as at
from nonlinear.export.c_files import exported_row
from nonlinear.export.wasm_module import MOST_BYTES, build_wasm, kept_wasm, record, sources_hash
from nonlinear.native import parameters, tick
from tests.validation.rich_drives import random_inputs, rich_drive

AT = {
    "command": at.IN_COMMAND, "moment": at.IN_LOAD, "output": at.IO_OUTPUT, "speed": at.IO_SPEED,
    "current": at.IO_CURRENT,
}  # fmt: skip


def test_kept_module_is_made_of_these_sources() -> None:
    known, data = record(), kept_wasm()
    assert known["sources_sha256"] == sources_hash(), "the kernels have changed: make wasm"
    assert known["module_sha256"] == hashlib.sha256(data).hexdigest()
    assert len(data) == known["bytes"] <= MOST_BYTES
    assert data[:4] == b"\0asm"


def _same_compiler() -> bool:
    try:
        return zig_command() is not None and record()["compiler"] == f"ziglang {version('ziglang')}"
    except PackageNotFoundError:
        return False


@pytest.mark.skipif(not _same_compiler(), reason="the ziglang that made the module is not installed")
def test_building_again_gives_the_same_bytes() -> None:
    assert build_wasm() == kept_wasm()


def drive(seed: int, ticks: int = 400) -> tuple[dict[str, Any], np.ndarray]:
    """A drive with what comes into it, and what the simulator makes of it; no instruments, which round."""
    design = load_design("ilr33-amber") if seed < 0 else rich_drive(seed)
    design = replace(design, instruments=Instruments())
    command, moment = random_inputs(design, np.random.default_rng(200 + seed), ticks)
    row = exported_row(design)
    p, s = parameters(row)
    io, ours = np.zeros(at.IO_SIZE), np.empty((ticks, 3))
    for k in range(ticks):
        io[at.IN_COMMAND], io[at.IN_LOAD] = command[k], moment[k]
        assert tick(p, s, io) == at.OK
        ours[k] = io[at.IO_OUTPUT], io[at.IO_SPEED], io[at.IO_CURRENT]
    return {"row": in_json(row), "command": command.tolist(), "moment": moment.tolist()}, ours


@needs_node
def test_instances_interleave_have_the_simulators_motion_and_go_back(tmp_path) -> None:
    """One module, five designs in turns; the last is saved, runs ahead, and goes back twice to the same bits.

    Another C library's exp, sin, log: 1e-9 of the largest value.
    """
    units, motions = zip(*map(drive, (-1, 0, 2, 3, 1)), strict=True)
    done = in_node("wasm_host.mjs", tmp_path, units=units, at=AT, keep=150)
    for theirs, ours in zip(done["rows"], motions, strict=True):
        assert (np.abs(np.array(theirs) - ours).max(axis=0) <= 1e-9 * np.abs(ours).max(axis=0)).all()
    assert done["backs"] == [done["rows"][-1][150:]] * 2
