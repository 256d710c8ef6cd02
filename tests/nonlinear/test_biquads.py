"""A biquad is (b0 + b1 z^-1 + b2 z^-2)/(1 + a1 z^-1 + a2 z^-2), a = [a1, a2], wherever a drive is written."""

from importlib.resources import files
from typing import Any

import numpy as np
import pytest

from actuator_lti import assemble_loops, load_design
from actuator_lti.batch import Population, linear_figures
from actuator_lti.design.model import Design, Filter, Limits
from actuator_lti.drive.steady import torque_gain_Nm_rad
from nonlinear import Drive, commands, simulate
from nonlinear.row.filters import section
from tests.changed import changed
from tests.refusals import refused

IDENTITIES = [
    ((1.0, 0.5, 0.2), (0.5, 0.2)),
    ((1.0, 0.0, 0.1), (0.0, 0.1)),
    ((1.0, -0.25), (-0.25,)),
    ((1.0, 0.0, 0.0), (0.0, 0.0)),
    ((1.0,), (0.0,)),
]
FILTERS = [
    ((0.3, 0.1, 0.05), (-0.4, 0.15)),
    ((0.9, 0.3), (0.0, 0.1)),  # no a1
    ((0.2, 0.3, 0.5), (0.0, 0.0)),  # of finite length
    ((0.0, 0.0, 1.0), (0.0,)),  # two periods of delay
    ((0.5,), (-0.5,)),
]
TS = load_design("ilr33-amber").controller.period_s


def amber(*filters: Filter) -> Design:
    control = {"velocity": {"filters": filters, "every": 2}, "position": {"every": 4}}
    return changed(load_design("ilr33-amber"), controller=control)


def response(b: tuple[float, ...], a: tuple[float, ...], z: complex) -> complex:
    return sum(c * z**-k for k, c in enumerate(b)) / (1 + sum(c * z**-k for k, c in enumerate(a, 1)))


@pytest.mark.parametrize("place", ["torque", "speed"])
@pytest.mark.parametrize(("b", "a"), IDENTITIES)
def test_an_identity_is_no_filter(b: Any, a: Any, place: str) -> None:
    plain, same = amber(), amber(Filter(kind="biquad", on=place, b=b, a=a))
    z = np.exp(1j * np.array([0.01, 0.3, 2.0]))
    for form in ("sampled", "continuous", "ideal"):
        for name in ("velocity", "position"):
            ours, theirs = (getattr(assemble_loops(each, form=form), name) for each in (same, plain))
            at = z if form == "sampled" else np.log(z) / 1e-3
            np.testing.assert_array_equal(ours.open_loop(at), theirs.open_loop(at))
    runs = [simulate(each, commands.step(0.05), duration_s=0.05, load_Nm=1.0) for each in (same, plain)]
    np.testing.assert_array_equal(runs[0].output_angle_rad, runs[1].output_angle_rad)
    np.testing.assert_array_equal(runs[0].current_A, runs[1].current_A)
    assert section(same.controller.velocity.filters[0], 1e-4) == (1.0, 0.0, 0.0, 0.0, 0.0)
    values = {"motor.rotor_inertia": plain.motor.rotor_inertia_kgm2 * np.array([0.5, 1.0, 2.0])}
    ours, theirs = (linear_figures(Population(each, values, 3)) for each in (same, plain))
    np.testing.assert_array_equal(ours.raw, theirs.raw)


@pytest.mark.parametrize("place", ["torque", "speed"])
@pytest.mark.parametrize(("b", "a"), FILTERS)
def test_the_velocity_loop_has_the_filter_as_factor(b: Any, a: Any, place: str) -> None:
    """The loop is that without the filter times H(z), in the ideal form at s = (2/T) j tan(angle/2)."""
    drives = amber(), amber(Filter(kind="biquad", on=place, b=b, a=a))
    for form in ("sampled", "ideal"):
        plain, filtered = (assemble_loops(each, form=form).velocity for each in drives)
        for angle in (0.02, 0.4, 1.5):
            z, s = np.exp(1j * angle), 2j / (2.0 * TS) * np.tan(angle / 2)
            at = z if form == "sampled" else s
            ratio = filtered.open_loop(at) / plain.open_loop(at)
            assert complex(ratio) == pytest.approx(response(b, a, z), rel=1e-9)


@pytest.mark.parametrize(("b", "a"), FILTERS)
def test_the_running_drive_and_the_facts_have_its_difference_equation(b: Any, a: Any) -> None:
    """y_n = sum b_k x_(n-k) - sum a_k y_(n-k): the torque command of a P controller after a step of speed."""
    design = amber(Filter(kind="biquad", b=b, a=a))
    velocity = {"integral_time_s": None, "every": 1, "gain": 0.01}
    alone = {"velocity": velocity, "position": None, "current": None}
    drive = Drive(changed(design, controller=alone, limits=Limits(voltage_V=1e9)))
    expected: list[float] = []
    got = []
    for n in range(30):
        past = sum(c for k, c in enumerate(b) if k <= n)
        expected.append(past - sum(c * expected[n - k] for k, c in enumerate(a, 1) if k <= n))
        got.append(drive.control(100.0, 0.0, 0.0, 0.0, 0.0))
    scale = got[-1] / expected[-1]
    np.testing.assert_allclose(got, scale * np.array(expected), rtol=1e-9, atol=1e-12)
    assert scale == pytest.approx(0.01 * 100.0 * design.total_ratio, rel=1e-12)
    ratio = torque_gain_Nm_rad(design) / torque_gain_Nm_rad(amber())
    assert ratio == pytest.approx(sum(b) / (1 + sum(a)), rel=1e-12)


@pytest.mark.parametrize(("key", "value", "allowed"), [
    ("a", (1.0, 0.5, 0.2), "1 or 2, a1 a2, after a leading 1"),
    ("a", (-2.1, 1.0), "poles inside the unit circle"),
    ("b", (1.0, 2.0, 3.0, 4.0), "1 to 3, b0 b1 b2"),
])  # fmt: skip
def test_a_refusal_names_file_key_and_what_is_allowed(tmp_path, key: str, value: Any, allowed: str) -> None:
    """In a file; one made in Python is refused alike."""
    given = {"b": (1.0,), "a": (0.0,), key: value}
    shipped = files("actuator_lti.design").joinpath("shipped/ilr33-amber.toml").read_text()
    table = "".join(f"{name} = {list(numbers)}\n" for name, numbers in given.items())
    path = tmp_path / "mine.toml"
    path.write_text(f'{shipped}\n[[control.velocity.filter]]\nkind = "biquad"\n{table}')
    refused(load_design, path, words=(str(path), f"control.velocity.filter.1.{key}", allowed))
    for item in (Filter(kind="biquad", **given), Filter(kind="biquad", b=(), a=(0.5,))):
        refused(section, item, 1e-4, words="allowed: ")
        refused(assemble_loops, amber(item), words="allowed: ")
