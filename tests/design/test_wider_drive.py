"""Keys of the wider drive: what is read, what is refused and with which words."""

from collections.abc import Callable
from dataclasses import replace
from math import log, nan, pi, sqrt
from typing import Any

import numpy as np
import pytest

from actuator_lti.design import check_design, design_tree, load_design, model, read_design_text, write_design
from actuator_lti.design.access import stacked
from actuator_lti.design.checks import misplaced
from actuator_lti.design.checks_control import TRACKING_LIMIT
from actuator_lti.design.fields import FIELDS, TABLES, at_place, part_at, template_of, with_part
from actuator_lti.design.loader import design_from_tree
from actuator_lti.design.writing import with_overrides
from actuator_lti.errors import InputError
from tests.refusals import refused
from tests.validation.random_drives import full_drive

AMBER = load_design("ilr33-amber")
FILTER = "control.velocity.filter"
STIFF = {"stiffness": "100 N*m/rad"}
NOTCH = {"kind": "notch", "frequency": "640 rad/s", "width": "320 rad/s", "depth": 0.1}


def test_the_two_meanings_of_a_peak_time_of_one_design_and_of_many() -> None:
    """r = 3 for one second: tau = t/ln(r^2/(r^2 - 1)), 8.490187 s (model.md section 6); in excess r^2 - 1."""
    base = with_overrides(AMBER, {"limits.peak_time": "1 s"})
    assert base.limits.overload_time_s == pytest.approx(1 / log(9 / 8), rel=1e-14)
    assert base.limits.overload_time_s == pytest.approx(8.490187, abs=5e-7)
    assert with_overrides(base, {"limits.overload": "excess"}).limits.overload_time_s == pytest.approx(8.0)
    peaks, times = np.array([8.0, 12.0, 20.0]), np.array([0.5, 1.0, 3.0])
    many = stacked(base, {"limits.peak_current": peaks, "limits.peak_time": times}).limits.overload_time_s
    squares = (peaks / 4) ** 2
    assert many == pytest.approx(times / np.log(squares / (squares - 1)))
    many = stacked(base, {"limits.peak_time": times}).limits.overload_time_s
    assert many == pytest.approx(times * 8.490187, rel=1e-6)


def test_a_warm_motor() -> None:
    warm = {"temperature.winding": "125 degC", "temperature.magnet": "75 °C"}
    motor = with_overrides(AMBER, warm).effective_motor
    assert motor.resistance_ohm == pytest.approx(0.055 * 1.393, rel=1e-14)
    assert motor.torque_constant_Nm_A == pytest.approx(5.9e-3 * (1 - 0.0011 * 50), rel=1e-14)


def test_a_speed_drive_has_no_position_loop() -> None:
    tree = design_tree(AMBER)
    del tree["control"]["position"]
    tree["requirement"] = []
    design = design_from_tree(tree, "speed drive")
    assert design.controller.outermost == "velocity"
    with pytest.raises(InputError, match=r"control\.position: missing"):
        _ = design.controller.position_loop


@pytest.mark.parametrize(("changes", "words"), [
    ({FILTER: [{"kind": "notch", "frequency": "1 kHz"}]}, r"filter\.1\.width.*missing"),
    ({FILTER: [{**NOTCH, "order": 2}]}, r"filter\.1\.order = 2.*not allowed with kind"),
    ({FILTER: [{**NOTCH, "frequency": "6 kHz"}]}, r"below the velocity loop's Nyquist"),
    ({FILTER: [NOTCH] * 9}, "allowed: at most 8"),
    ({FILTER: [{"kind": "biquad", "b": [1.0], "a": [-2.1, 1.0]}]}, "inside the unit circle"),
    ({"encoder.speed": "tracking"}, r"needs encoder\.bandwidth"),
    ({"control.velocity.tracking_time": "1 ms"}, "back-calculation"),
    ({"friction.point": [{"speed": "1 rad/s", "torque": "1 mN*m"}]}, "friction.dry_torque"),
    ({"temperature.winding": "20 K"}, "degC"),
    ({"motor.constants": "ac"}, "rms-line"),
    ({"coupling": STIFF, "load.inertia": "0 kg*m^2"}, r"coupling\.stiffness = 100"),
    ({"coupling": STIFF, "friction.law": "tanh"}, r"friction\.law"),
    ({"coupling": {**STIFF, "after": "planetary"}}, "before the self-locking stage"),
    ({"coupling": {**STIFF, "after": "bevel"}}, "is no gear; allowed: planetary, worm"),
    ({"coupling": STIFF, "friction.load_coefficient": 0.9 / 2376}, "gives energy"),
    ({"load.friction": {"dry_torque": "1 N*m"}}, "allowed behind a coupling"),
    ({"coupling": {"stiffness": "1 N*m/rad"}, "load.friction": {"breakaway_ratio": 0.9}}, "at least 1"),
    ({"motor.rotor_inertia": "3 kg"}, r"motor.rotor_inertia.*m \(p/2 pi\)\^2"),
    ({"motor.back_emf_constant": f"{5.9e-3 / sqrt(3)!r} V*s/rad"}, r'motor\.constants = "rms-line"'),
    ({"motor.back_emf_constant": f"{5.9e-3 * 60 / (2 * pi)!r} V*s/rad"}, r"60/\(2 pi\)"),
])  # fmt: skip
def test_refused_in_one_line(changes: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        with_overrides(AMBER, changes)
    assert "\n" not in str(caught.value) or len(changes) == 1  # another key contradicts it too


SPRING = {"coupling": {**STIFF, "play": "2 mrad"}}


@pytest.mark.parametrize("changes", [
    {},
    SPRING,
    {"coupling": {**SPRING["coupling"], "after": "worm"}},
    {**SPRING, "friction.load_coefficient": 1.0 / 2376},
    {"coupling": {**SPRING["coupling"], "after": "planetary"}, "load.path": "back-drivable",
     "friction.load_coefficient": 0.0, "load.friction": {"dry_torque": "1 N*m"}},
])  # fmt: skip
def test_a_drive_train_that_can_be(changes: dict[str, object]) -> None:
    assert with_overrides(AMBER, changes).coupling is not None or not changes


def test_the_tracking_limit_is_where_its_poles_leave_the_unit_circle() -> None:
    """The tracking loop of section 7: th+ = p + 2 w0 T r, w+ = w + w0^2 T r, p = th + T w, r = y - p."""

    def radius(x: float) -> float:
        A = np.array([[1 - 2 * x, (1 - 2 * x)], [-(x**2), 1 - x**2]])
        return float(np.max(np.abs(np.linalg.eigvals(A))))

    assert radius(TRACKING_LIMIT * 0.999) < 1.0 < radius(2 * (sqrt(2) - 1) * 1.001)


def _taken(call: Callable[[], object]) -> bool:
    try:
        call()
    except InputError:
        return False
    return True


def test_what_the_check_of_a_design_accepts_its_file_may_hold() -> None:
    """Random drives, some with the speed from the output's sensor: one drive in Python and in a file."""
    drives = [full_drive(seed) for seed in range(2_100_000, 2_100_060)]
    accepted = [drive for drive in drives if _taken(lambda drive=drive: check_design(drive, drive.name))]
    read = [read_design_text(write_design(drive)) for drive in accepted]
    assert [one.controller for one in read] == [one.controller for one in accepted]
    assert [one.load for one in read] == [one.load for one in accepted]
    behind = [one.controller.velocity for one in read if one.controller.velocity is not None]
    assert {one.sensor for one in behind} == {"motor", "output"}
    refused = [drive for drive in drives if drive not in accepted]
    assert not any(_taken(lambda drive=drive: read_design_text(write_design(drive))) for drive in refused)
    assert refused


@pytest.mark.parametrize(("key", "value", "written"), [
    ("motor.resistance", -1.0, "-1 ohm"),
    ("motor.inductance", nan, "nan H"),
    ("limits.voltage", (), "-1 V"),
    ("control.period", 0.0, "0 s"),
    ("control.position.every", 0, 0),
    ("control.position.gain", 1e13, "1e13 1/s"),
    ("control.velocity.sensor", "load", "load"),
    ("friction.law", "none", "none"),
    ("gear.worm.ratio", 0.0, 0.0),
    ("validation.full_deflection", -0.1, "-0.1 rad"),
])  # fmt: skip
def test_a_design_made_in_python_is_refused_with_the_words_of_the_file(key, value, written) -> None:
    section, field = key.rpartition(".")[0], FIELDS[template_of(key)]
    part = replace(part_at(AMBER, section), **{field.attribute: value})
    with pytest.raises(InputError) as made:
        check_design(with_part(AMBER, section, part), "drive")
    with pytest.raises(InputError) as read:
        with_overrides(AMBER, {key: written})
    assert str(made.value).startswith(f"drive: {key} = ")
    if value == value:  # of nan the file says more
        assert str(made.value).rpartition("allowed: ")[2] == str(read.value).rpartition("allowed: ")[2]


def _with(design: Any, place: str, part: object) -> Any:
    """A design with something else at a dotted place."""
    name, _, rest = place.partition(".")
    return replace(design, **{name: _with(getattr(design, name), rest, part) if rest else part})


@pytest.mark.parametrize("part", [None, 1e30, "x", (3.0,)])
def test_a_part_of_another_kind_is_refused_by_name(part: object) -> None:
    """At every place of a design, an own law's too; None only where a drive may be without it."""
    law = model.Law(
        inputs=("error",), continuous=model.StateSpace(A=((-1.0,),), B=((1.0,),), C=((1.0,),), D=((0.0,),))
    )
    design = _with(AMBER, "controller.velocity.law", law)
    for section in TABLES:
        if "." in section.place and at_place(design, section.place.rpartition(".")[0]) is None:
            continue
        wrong = _with(design, section.place, part)
        if part is None and section.optional:
            assert not [*misplaced(wrong)]
        else:
            assert [path for path, *_ in misplaced(wrong)] == [section.path]
            kind = section.kind.__name__
            refused(check_design, wrong, "drive", match=rf"^drive: {section.path} = .*allowed: .*{kind}")


def test_an_axis_that_is_none_is_refused_before_its_units_are_asked_and_a_linear_one_has_masses() -> None:
    words = 'axis = "round": allowed: "rotary" or "linear"'
    refused(check_design, replace(AMBER, axis="round"), "drive", words=words)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"motor.rotor_inertia.*J \(2 pi/p\)\^2"):
        load_design("emps").with_values({"motor.rotor_inertia": "3 kg*cm^2"})
