"""An outer loop around a drive: its margins are borders of the running drive; bad files are one line."""

import json
import sys

import numpy as np
import pytest
from scipy.linalg import expm

from actuator_lti import assemble_loops, load_design, stability_margins
from actuator_lti.compiled.compiler import system_compiler
from actuator_lti.design import with_values
from analyses.linear.outer_loop import loop_around, outer_loop
from examples.exported_drive import ExportedDrive
from reports.cli.main import main

needs_compiler = pytest.mark.skipif(
    system_compiler() is None or not sys.platform.startswith("linux"), reason="no C compiler on this machine"
)
PERIOD, TICK_S = 1e-3, 1e-4
# roll rate under a fin angle, p' = -2 p + 60 delta, and half of it given back: one pole
AIRFRAME = {"num": [30.0], "den": [1.0, 2.0], "dt": 0, "sampling_period": PERIOD, "name": "roll rate"}
# a weathercock mode with a lag, in matrices
WEATHERCOCK = {
    "A": [[0.0, 1.0, 0.0], [-400.0, -4.0, 300.0], [0.0, 0.0, -50.0]], "B": [[0.0], [0.0], [50.0]],
    "C": [[1.0, 0.02, 0.0]], "D": [[0.0]], "dt": 0, "sampling_period": 3 * PERIOD,
}  # fmt: skip


SMOOTH = {"friction.dry_torque": 0.0, "friction.load_coefficient": 0.0}
JERK = {"command.rate": 0.3, "command.acceleration": 70.0, "command.jerk": 140.0 / (37.0 * TICK_S)}
DRIVE = with_values(load_design("ilr33-amber"), SMOOTH)
MEAN = with_values(DRIVE, JERK)  # takes the mean of 37 samples of its command


def growth(table: dict, factor: float, drive: ExportedDrive, seconds: float) -> float:
    """Largest output of the last third over that of the second, the exported drive in the loop from rest."""
    drive.reset()
    matrices = table if "A" in table else {"A": [[-2.0]], "B": [[60.0]], "C": [[0.5]]}
    A, B, C = (np.array(matrices[key]) for key in "ABC")
    n, ticks = A.shape[0], round(table["sampling_period"] / TICK_S)
    step = expm(np.block([[A, B], [np.zeros((1, n + 1))]]) * table["sampling_period"])
    x, angle, result = np.full(n, 1e-9), 0.0, []
    for _ in range(round(seconds / table["sampling_period"])):
        result.append(float(abs(C @ x)[0]))
        command, before = -factor * float((C @ x)[0]), angle
        for _ in range(ticks):
            angle = drive.step(command)
        x = step[:n, :n] @ x + step[:n, n] * before
    third = len(result) // 3
    return max(result[2 * third :]) / max(result[third : 2 * third])


@needs_compiler
@pytest.mark.parametrize(("design", "table", "seconds"), [
    (DRIVE, AIRFRAME, 0.6), (DRIVE, WEATHERCOCK, 1.5), (MEAN, AIRFRAME, 0.9), (MEAN, WEATHERCOCK, 1.5),
])  # fmt: skip
def test_the_running_drive_decays_below_the_gain_margin_and_grows_above(design, table, seconds, tmp_path):
    drive = ExportedDrive(design, tmp_path)
    loop = loop_around(assemble_loops(design), outer_loop(table, "test"))
    result = stability_margins(loop.open_loop)
    assert result.stable
    limit = min(margin.ratio for margin in result.gain_margins if margin.ratio > 1.0)
    assert loop.period_s == table["sampling_period"]
    below, above = (growth(table, share * limit, drive, seconds) for share in (0.97, 1.03))
    assert below < 1.0 < above


def test_closed_forms_of_an_integrator_around_the_ideal_drive() -> None:
    """L = -s K T/p: at low frequency T = 1, so the crossover is at K and the phase margin 90 deg less T's."""
    K, loops = 0.5, assemble_loops("ilr33-amber", form="ideal")
    table = {"num": [K], "den": [1.0, 0.0], "dt": 0}
    loop = loop_around(loops, outer_loop(table, "test"))
    drive = complex(loops.reference_to_output(1j * K))
    margin = stability_margins(loop.open_loop).phase_margins[0]
    assert margin.frequency_rad_s == pytest.approx(K, rel=1e-4)
    assert margin.deg == pytest.approx(90.0 + np.degrees(np.angle(drive)), abs=1e-2)
    opposite = loop_around(loops, outer_loop({**table, "sign": 1}, "test"))
    assert complex(opposite.open_loop(2j)) == pytest.approx(-complex(loop.open_loop(2j)), rel=1e-12)
    assert complex(loop.closed_loop(2j) + loop.sensitivity(2j)) == pytest.approx(1.0, abs=1e-12)


def test_coefficients_and_matrices_of_one_sampled_system_are_one_loop() -> None:
    loops, z, pole, gain = assemble_loops("ilr33-amber"), np.exp(0.03j), 0.995, 0.02
    matrices = {"A": [[pole]], "B": [[1.0]], "C": [[gain]], "D": [[0.0]]}
    want = gain / (z - pole) * complex(loops.reference_to_output(z))
    for one in ({"num": [gain], "den": [1.0, -pole]}, matrices):
        loop = loop_around(loops, outer_loop({**one, "dt": 1e-4}, "test"))
        assert complex(loop.open_loop(z)) == pytest.approx(want, rel=1e-12)


def test_the_command_line_judges_it(tmp_path, cli) -> None:
    path = tmp_path / "airframe.json"
    path.write_text(json.dumps(AIRFRAME))
    around = cli.data("margins", "ilr33-amber", "--around", path)["around"]["roll rate"]
    assert around["stable"] is True
    words = " ".join(cli.text("margins", "ilr33-amber", "--around", path).split())
    assert "roll rate: broken at the command of the drive" in words
    assert "customary" not in words
    near, beyond = (
        json.dumps({**AIRFRAME, "num": [30.0 * 10.0 ** (share * around["gain_margin_db"] / 20.0)]})
        for share in (0.9, 1.1)
    )
    path.write_text(near)
    words = " ".join(cli.text("margins", "ilr33-amber", "--around", path).split())
    assert f"Below what is customary: roll rate, gain margin {0.1 * around['gain_margin_db']:.3g} dB" in words
    path.write_text(beyond)
    around = cli.data("margins", "ilr33-amber", "--around", path, status=1)["around"]["roll rate"]
    assert around["stable"] is False


@pytest.mark.parametrize(("change", "said"), [
    ({"dt": None}, "dt: missing"),
    ({"dt": -1.0}, "dt: allowed: a time in s"),
    ({"dt": True}, "dt: allowed"),
    ({"dt": 1.5e-4, "sampling_period": None}, "whole multiples of 0.0001 s"),
    ({"sampling_period": None}, "sampling_period: missing"),
    ({"sampling_period": 0.0}, "sampling_period: allowed: a time > 0"),
    ({"dt": 1e-3}, "sampling_period: allowed: a time > 0 in s, for a continuous"),
    ({"num": [1.0, 2.0, 3.0]}, "num: of a higher degree"),
    ({"num": ["a"]}, "num: allowed: a list of numbers"),
    ({"den": [0.0]}, "num, den: all zero"),
    ({"den": None}, "allowed: num and den, or A"),
    ({"A": [[1.0]]}, "allowed: num and den, or A"),
    ({"gain": 2.0}, "gain: no such key"),
    ({"sign": 0}, "sign: allowed"),
    ({"name": ""}, "name: allowed: a text"),
    ({"num": None, "den": None, "A": [[1.0, 2.0]], "B": [[1.0]], "C": [[1.0]], "D": [[0.0]]}, "n by n"),
    ({"num": None, "den": None, "A": [[1.0], [1.0, 2.0]], "B": [[1.0]], "C": [[1.0]], "D": [[0.0]]},
     "A: allowed: a list of rows"),
    *((text, "airframe.json") for text in ("", "[1, 2]", "{", '{"num": [NaN]}', '{"dt": 0, "dt": 1}')),
])  # fmt: skip
def test_a_bad_file_is_one_line(change: dict | str, said: str, tmp_path, cli) -> None:
    path = tmp_path / "airframe.json"
    if isinstance(change, str):
        path.write_text(change)
    else:
        table = {key: value for key, value in {**AIRFRAME, **change}.items() if value is not None}
        path.write_text(json.dumps(table))
    assert said in cli.refused("margins", "ilr33-amber", "--around", path)
    assert main(["margins", "ilr33-amber", "--around", str(tmp_path / "none.json")]) == 2
