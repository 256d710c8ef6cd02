"""What a file or a system gives a law of one's own: all of it is taken, or refused by its name."""

import json
from pathlib import Path
from typing import Any
from unittest import mock

import control
import numpy as np
import pytest
import scipy.signal
from scipy.io import savemat
from scipy.sparse import csc_matrix

from actuator_lti import load_design
from actuator_lti.design import Design, read_design_text, write_design
from actuator_lti.design.law import Law
from actuator_lti.errors import InputError
from actuator_lti.files import matlab
from actuator_lti.files.matlab import read_mat
from tests.mat_reader import forked
from tests.refusals import refused

BASE = load_design("ilr33-amber-multirate")
T = BASE.controller.period_of("velocity")
A, B, C, D = (
    np.array(one) for one in ([[0.5, 0.1], [0, 0.9]], [[1e-3, 0], [0, 1e-4]], [[1, 0.5]], [[0.1, 0]])
)
L = np.array([0.25, -0.5])
INPUTS = ["error", "speed"]
WANTED = BASE.with_law("velocity", (A, B, C, D, T), INPUTS, L=L).controller
PARTS = {"A": A, "B": B, "C": C, "D": D, "Ts": T}
LISTS = {key: np.asarray(value).tolist() for key, value in PARTS.items()}


def read(folder: Path, held: Any, beside: str = "") -> Design:
    """The design with a law of a file: JSON of a text, else .mat."""
    if isinstance(held, str):
        (folder / "k.json").write_text(held)
    else:
        savemat(folder / "k.mat", held)
    tables = write_design(BASE.with_law("velocity", ([], [], [], [[1.0]], T), ["error"])).split("\n\n")
    name = f'file = "k.{"json" if isinstance(held, str) else "mat"}"'
    made = [f"[control.velocity.law]\n{name}\n{beside}" if "velocity.law" in one else one for one in tables]
    (folder / "mine.toml").write_text("\n\n".join(made))
    with mock.patch.object(matlab, "run", forked):
        return load_design(folder / "mine.toml")


NAMES = f"inputs = {INPUTS}"


@pytest.mark.parametrize(("held", "beside"), [
    (PARTS | {"L": L}, NAMES),
    (PARTS | {"L": L[:, None], "inputs": INPUTS}, ""),
    (PARTS, f"{NAMES}\nL = [0.25, -0.5]"),
    (PARTS | {"L": L, "A": csc_matrix(A), "B": csc_matrix(B), "D": csc_matrix(D)}, NAMES),
    (PARTS | {"L": L + 0j, "A": csc_matrix(A + 0j)}, NAMES),
    ({"K": PARTS | {"L": L, "inputs": np.array(INPUTS, dtype=object)}}, NAMES),
    (json.dumps(LISTS | {"L": L.tolist(), "dt": T}), NAMES),
])  # fmt: skip
def test_all_that_a_file_holds_is_taken(held: Any, beside: str, tmp_path: Path) -> None:
    found = read(tmp_path, held, beside)
    assert found.controller == WANTED
    assert read_design_text(write_design(found)).controller == WANTED


def test_an_unknown_key_is_named_where_a_law_is_all_that_is_held(tmp_path: Path) -> None:
    for held in (json.dumps({**LISTS, "gains": 2}), json.dumps({"K": {**LISTS, "gains": 2}})):
        said = refused(read, tmp_path, held, NAMES)
        assert 'k.json": "gains": unknown key (nearest known: "gain"); allowed: a file of one law' in said
    assert '"l", "state"' in refused(read, tmp_path, {"K": PARTS | {"l": L, "state": 1.0}}, NAMES)
    assert read(tmp_path, PARTS | {"L": L, "plant": 2.0}, NAMES).controller == WANTED  # of a workspace


def test_its_gain_is_taken(tmp_path: Path) -> None:
    assert read(tmp_path, PARTS | {"gain": 2.0}, NAMES).controller.velocity.law.gain == 2.0


@pytest.mark.parametrize("name", ["A", "B", "C", "D", "L", "Ts", "gain"])
@pytest.mark.parametrize(
    "made", [lambda one: one + 1e-3j, lambda _: "text", lambda one: csc_matrix(one * 1j)]
)
def test_what_is_not_real_is_refused_by_its_name(name: str, made: Any, tmp_path: Path) -> None:
    whole = PARTS | {"L": L, "gain": 1.0}
    for held in (whole | {name: made(whole[name])}, {"K": whole | {name: made(whole[name])}}):
        said = refused(read, tmp_path, held, NAMES)
        assert said.endswith(f'law.file = "k.mat": {name}: must be real; allowed: finite real numbers'), said


EVERY = {"value": 8, "source": "data sheet", "grade": "C"}


@pytest.mark.parametrize("every", [8, 8.0, "8", EVERY])
def test_a_system_is_sampled_at_the_period_of_its_stage_however_that_is_written(every: Any) -> None:
    """Of a design and of the setting alike: a lag's pole p is exp(p 8 Ts) by zero-order hold."""
    joint, K = load_design("joint"), control.tf([0.3, 40.0], [0.02, 1.0])
    T_8 = 8 * joint.controller.period_s
    design = joint.with_values({"control.position.every": every})
    for made in (design.with_law("position", K, ["error"], method="zoh"),
                 joint.with_law("position", K, ["error"], method="zoh", every=every)):  # fmt: skip
        assert made.controller.position.every == 8
        assert made.controller.position.law.A[0][0] == pytest.approx(np.exp(-50.0 * T_8), rel=1e-12)
    assert f"a sampled one of dt = {T_8:g} s" in refused(design.with_law, "position", K, ["error"])


@pytest.mark.parametrize("made", [scipy.signal.TransferFunction, control.tf])
@pytest.mark.parametrize("dt", [None, T])
def test_an_improper_transfer_function_is_refused(made: Any, dt: float | None) -> None:
    sampled = {} if dt is None else {"dt": dt}
    K, how = made([1, 0, 0], [1, 5], **sampled), {"method": "tustin"} if dt is None else {}
    said = refused(lambda: BASE.with_law("velocity", K, ["error"], **how))
    assert said == "system: improper; allowed: no more zeros than poles"


def test_a_pole_that_tustin_takes_to_infinity_is_refused() -> None:
    """At s = 2/T, alone or beside another, where rounding leaves a number of 1e16."""
    s = control.tf("s")
    for K in (1 / (s * T / 2 - 1), (3 * s + 1) / ((s * T / 2 - 1) * (s / 300 + 1) * (s / 7e4 + 1))):
        said = refused(lambda K=K: BASE.with_law("velocity", K, ["error"], method="tustin"))
        assert f"a pole at 2/T = {2 / T:g} 1/s" in said
        assert "allowed: none there, or method = zoh" in said


def test_a_matrix_the_wrong_way_round_is_refused() -> None:
    """Not read row by row into a law of other numbers; a vector may lie or stand."""
    A, B, C = [[0.5, 0.0], [0.1, 0.2]], np.arange(6.0).reshape(2, 3), [[1.0, 1.0]]
    three, D = ["error", "speed", "current"], [[0.0] * 3]
    assert BASE.with_law("velocity", (A, B, C, D, T), three).controller.velocity.law.B[1] == (3.0, 4.0, 5.0)
    for wrong in (B.T, B.ravel()):
        said = refused(BASE.with_law, "velocity", (A, wrong, C, D, T), three)
        assert said.startswith("B: ")
        assert "allowed: 2 rows, as A has" in said
    for vector in ([1.0, 2.0], [[1.0, 2.0]], [[1.0], [2.0]]):
        law = BASE.with_law("velocity", (A, vector, C, [[0.0]], T), ["error"]).controller.velocity.law
        assert law.B == ((1.0,), (2.0,))


@pytest.mark.parametrize("value", ['"0.5"', "true", "null", "[[0.5, true]]"])
def test_json_text_and_truth_are_no_numbers(value: str, tmp_path: Path) -> None:
    said = refused(read, tmp_path, f'{{"A": {value}, "B": [[1]], "C": [[1]], "D": [[0]], "Ts": {T}}}', NAMES)
    assert "A: must be real" in said


def test_what_a_file_leaves_open_is_refused(tmp_path: Path) -> None:
    several = refused(read, tmp_path, {"K1": PARTS, "K2": PARTS}, NAMES)
    assert "holds several laws: K1, K2; allowed: a file of one law" in several
    assert "several laws: its own A, B, C, D, K" in refused(
        read, tmp_path, json.dumps({**LISTS, "K": LISTS}), NAMES
    )
    assert "has Ts and dt that differ" in refused(read, tmp_path, json.dumps({**LISTS, "dt": 1.0}), NAMES)
    assert "Ts: 1 x 2; allowed: one number" in refused(read, tmp_path, PARTS | {"Ts": [T, T]}, NAMES)
    for more, beside in (
        ({"inputs": INPUTS[::-1]}, ""),
        ({"L": L}, "L = [1.0, 2.0]"),
        ({"gain": 2.0}, "gain = 3"),
    ):
        said, key = refused(read, tmp_path, PARTS | more, f"{NAMES}\n{beside}"), next(iter(more))
        assert said.endswith(f"allowed: a file's name, without {key}, which the file gives")
    with pytest.raises(InputError, match="without A, period, which"):  # and a line for the other mistake
        read(tmp_path, PARTS, f'{NAMES}\nA = [[1]]\nperiod = "1 ms"')


@pytest.mark.parametrize("system", [
    scipy.signal.StateSpace([[0.5j]], [[1]], [[1]], [[0]], dt=T),
    scipy.signal.ZerosPolesGain([0.2j], [0.5], 1.0, dt=T),
    scipy.signal.TransferFunction([1 + 1j], [1, 0.5], dt=T),
])  # fmt: skip
def test_a_complex_system_is_refused(system: Any) -> None:
    assert "must be real" in refused(BASE.with_law, "velocity", system, ["error"])


def test_a_sparse_matrix_that_crashes_its_reader_is_refused(tmp_path: Path) -> None:
    savemat(tmp_path / "k.mat", {"A": csc_matrix(A)})
    good = (tmp_path / "k.mat").read_bytes()
    assert np.array_equal(read_mat(good).arrays["A"], A)
    rows = np.array([0, 0, 1], dtype="<i4").tobytes()
    far = np.array([0, 0, 1 << 30], dtype="<i4").tobytes()
    assert "damaged" in refused(read_mat, good.replace(rows, far))


def response(law: Law, z: np.ndarray) -> np.ndarray:
    made = law.sampled
    n = len(made.A)
    return np.array(
        [(made.C @ np.linalg.solve(one * np.eye(n) - made.A, made.B) + made.D).item() for one in z]
    )


@pytest.mark.parametrize("form", [lambda K: K, control.ss])
def test_a_product_of_transfer_functions_is_a_law(form: Any) -> None:
    """Its companion form has numbers of 1e15; the response is that of the factors one by one."""
    s = control.tf("s")

    def factors(p: Any) -> list[Any]:
        lag = [1 / ((p / w) ** 2 + 1.2 * p / w + 1) for w in (900.0, 3000.0)]
        return [22 * (p + 3) / p, (p / 20 + 1) / (p / 200 + 1), *lag]

    K = form(np.prod(factors(s)))
    mine = BASE.with_law("velocity", K, ["error"], method="tustin")
    z = np.exp(1j * np.geomspace(1e-3, 3.0, 40))
    want = np.prod(factors(2 / T * (z - 1) / (z + 1)), axis=0)
    np.testing.assert_allclose(response(mine.controller.velocity.law, z), want, rtol=1e-11)
    assert mine.controller.velocity.law.integrates


def test_sampling_keeps_what_a_long_filter_leaves() -> None:
    """Six lags of 30 rad/s: 1e-12 of the gain at rest is left far above them, and it is right."""
    s, T_p = control.tf("s"), BASE.controller.period_of("position")
    K = np.prod([1 / (s / (30.0 + 10 * k) + 1) for k in range(6)])
    law = BASE.with_law("position", K, ["error"], method="tustin").controller.position.law
    p = 1j * np.geomspace(1.0, 3000.0, 30)
    z = (2 / T_p + p) / (2 / T_p - p)
    want = np.prod([1 / (p / (30.0 + 10 * k) + 1) for k in range(6)], axis=0)
    np.testing.assert_allclose(response(law, z), want, rtol=1e-10)
    assert law.steady("command") == pytest.approx(1.0, rel=1e-9)


def test_the_size_of_the_states_changes_nothing() -> None:
    """Scaled by powers of two a law is the same to the last bit, anti-windup and all."""
    law = BASE.with_law("velocity", (A, B, C, D, T), INPUTS, L=L).controller.velocity.law
    t = 2.0 ** np.array([60.0, -60.0])
    scaled = A * t / t[:, None], B / t[:, None], C * t, D, T
    found = BASE.with_law("velocity", scaled, INPUTS, L=L / t).controller.velocity.law
    for k in range(4):
        power = np.linalg.matrix_power
        assert np.array_equal(found.sampled.C @ power(found.sampled.A, k) @ found.sampled.B,
                              law.sampled.C @ power(law.sampled.A, k) @ law.sampled.B)  # fmt: skip
        assert found.sampled.C @ power(found.sampled.A, k) @ found.sampled.L == (
            law.sampled.C @ power(law.sampled.A, k) @ law.sampled.L
        )
    apart = ([[0.5, 1e12], [0.0, 0.5]], [[0.0], [1.0]], [[1e-12, 0.0]], [[0.0]], T)
    law = BASE.with_law("velocity", apart, ["error"]).controller.velocity.law
    assert law.steady("command") == pytest.approx(4.0, rel=1e-12)


def test_a_continuous_system_that_does_not_fit_is_refused() -> None:
    bad = ([[1.0, 0.0], [0.0, 1.0]], [[1.0], [1.0]], [[1.0]], [[0.0]])
    assert "C: other sizes; allowed: 1 x 2" in refused(
        lambda: BASE.with_law("velocity", bad, ["error"], method="zoh")
    )
    gain = BASE.with_law("velocity", ([], [], [], [[0.2]]), ["error"], method="zoh")
    assert gain.controller.velocity.law.D == (0.2,)
