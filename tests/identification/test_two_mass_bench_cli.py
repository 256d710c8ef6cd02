"""The bench of a compliant drive by the command line alone: records written, read again, a design found."""

from __future__ import annotations

from pathlib import Path

import pytest

from actuator_lti.design import load_design
from examples.virtual_bench.__main__ import main as simulate
from tests.identification.bench_records import Command

WRONG = ("motor.rotor_inertia=1.1 kg*cm^2", "load.inertia=0.4 kg*m^2", "coupling.stiffness=1.7e4 N*m/rad")


def _set(*changes: str) -> list[str]:
    return [part for change in changes for part in ("--set", change)]


def test_a_robot_joint_from_its_simulated_bench(tmp_path: Path, command: Command) -> None:
    """Truth: the shipped joint with 2 mrad of play; start: inertias and stiffness 20 to 30 % off.

    Its friction grows with the load (CM) and it has dry friction on both sides: both are in the truth.
    """
    bench, out = tmp_path / "bench", tmp_path / "o"
    made = _set("instruments.current_noise=30 mA", "coupling.play=2 mrad")
    simulate([str(bench), "--sweep", "--design", "joint", "--seed", "3", *made])
    files = ["--frequency-response", bench / "sweep.csv", "--play", bench / "reversal.csv"]
    ran = command("identify", *files, "--design", "joint", *_set(*WRONG), "--out", out, "--json")
    result = ran.data
    assert not ran.status, result["items"]
    design = load_design("joint")
    assert design.coupling is not None
    truth = {
        "motor_inertia": design.motor_side_inertia_kgm2,
        "load_inertia": design.load_side_inertia_kgm2,
        "stiffness": design.coupling.stiffness_Nm_rad,
        "damping": design.coupling.damping_Nms_rad,
        "play": 2e-3,
    }
    for label, value in truth.items():
        found = result["found"]["parameters"][label]
        assert found["value"] == pytest.approx(value, abs=3.0 * found["standard_error"]), label
        assert found["standard_error"] < 0.03 * value, label
    written = load_design(next(out.glob("*.toml")))
    assert written.coupling is not None
    assert written.coupling.play_rad == pytest.approx(2e-3, rel=0.06)
    assert written.parameters["coupling.play"].tolerance is not None
    assert {check["id"]: check for check in result["items"]}["written-sweep.csv"]["value"] < 0.05
    assert "two-mass" in (out / "identification.html").read_text()
