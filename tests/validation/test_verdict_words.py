"""What a validation says: an unstable loop, a drive that hunts, rows that are not met, and their words."""

from dataclasses import fields, replace
from math import degrees

import numpy as np
import pytest

from actuator_lti import load_design
from actuator_lti.design import with_values
from actuator_lti.design.model import Requirement, Waiver
from analyses.large_signal.from_rest import RestSweep
from analyses.limit_cycles import LimitCycles
from analyses.motion.settling import SMALL, Settling, noticed, settlings_of
from analyses.motion.settling import verdict_of as verdict_of_swing
from analyses.motion.settling import words as end_words
from analyses.specification import asked_figures
from analyses.specification.requirements import evaluate_requirements
from analyses.validation import CHECKS, Validation, validate
from analyses.validation.row import judged
from nonlinear.settling.rest import Rest
from reports import document as doc
from reports.sections.beyond import described
from reports.sections.cycles import summary as cycles_summary
from reports.sections.validation import summary
from reports.verdict_summary import verdict_of
from tests.changed import changed

EMPS = load_design("emps")
WAIVED = Waiver(requirement="swing", reason="known", date="2026-11-23")


def test_an_unstable_loop_is_not_met_and_its_response_still_is() -> None:
    result = validate(changed(EMPS, controller={"velocity": {"gain": 6.0e3}}), CHECKS)
    assert result.verdict == "not met"
    assert "the velocity loop is unstable" in str(result)
    assert not result.not_met  # the simulator's poles and response are those predicted, unstable as they are
    made = summary(result)
    items = next(block for block in made["blocks"] if block["kind"] == "verdicts")["items"]
    assert any(item["verdict"] == "not met" and "unstable" in item["reason"] for item in items)


def hunting(step_rad: float, swing_rad: float, hertz: float) -> Settling:
    rest = Rest(
        verdict="limit cycle", error=0.0, amplitude=swing_rad, motor_amplitude=swing_rad, frequency_hz=hertz,
        periods=8, limited=(), after_s=1.0, work=1,
    )  # fmt: skip
    return Settling(step_rad, 0.0, rest)


@pytest.mark.parametrize("name", ["emps", "fin"])
@pytest.mark.parametrize(
    ("ends", "allowed", "waivers", "verdict"),
    [
        ("limit cycle", (), (), "not met"),
        ("limit cycle", (2.0,), (), "met"),
        ("limit cycle", (0.9,), (), "not met"),
        ("limit cycle", (2.0, 0.9), (), "not met"),
        ("still moving", (2.0,), (), "not proven"),
        ("still moving", (2.0,), (WAIVED,), "met"),
        ("limit cycle", (0.9,), (WAIVED,), "not met"),
        ("diverging", (2.0,), (), "not met"),
    ],
)
def test_who_states_a_swing_that_is_accepted_has_rest_judged_by_it(
    name: str, ends, allowed: tuple[float, ...], waivers: tuple[Waiver, ...], verdict: str, monkeypatch
) -> None:
    """Requirement, cycles, validation and friction give one verdict, whatever a step ends in."""
    bare, swing_rad = load_design(name), 2e-3
    unit, scale = ("m", 1.0) if bare.axis == "linear" else ("deg", degrees(1.0))
    asked = tuple(
        Requirement(id="swing" + "x" * k, quantity="limit_cycle", unit=unit, maximum=part * scale * swing_rad)
        for k, part in enumerate(allowed)
    )
    design = replace(bare, requirements=asked, waivers=waivers)
    step = hunting(0.1, swing_rad, 3.0)
    step = replace(step, rest=replace(step.rest, verdict=ends))
    small = hunting(0.01, 1e-2 * swing_rad, 3.0)  # of less swing than any that is accepted
    found = LimitCycles(design, (), (small, step), ())
    monkeypatch.setattr(asked_figures, "limit_cycles", lambda _: found)
    rows = (judged("bandwidth", "position", 1.0, 1.0, 0.1, unit="Hz"),)
    validation = Validation(design=design, rows=rows, figures={}, settlings=found.rests)
    assert (found.verdict, validation.verdict) == (verdict, verdict)
    requirements = evaluate_requirements(design)
    assert not asked or all(one.passes for one in requirements) == (verdict == "met")
    said = [summary(validation)["result"], str(validation), cycles_summary(found)]
    said += [one.reason for one in requirements]
    assert all(("by requirement swing" in one) == (verdict == "met" and not waivers) for one in said)
    assert ("does not come to rest" in " ".join(said)) == (verdict == "not met")
    made = summary(validation)
    told = next(one for one in made["findings"] if "step of" in one["text"])  # said on the first screen
    grave = {"met": "info", "not met": "fail", "not proven": "warn"}[verdict]
    assert told["severity"] == grave
    doc.waived([made], design)
    assert verdict_of([made], "validation")["passed"] == (verdict == "met")


@pytest.mark.parametrize(("gain", "demanded"), [(4000.0, False), (4000.0, True), (120.0, False)])
def test_a_step_after_which_the_drive_hunts_is_the_last_that_is_asked(gain: float, demanded: bool) -> None:
    """The largest first; where a swing is accepted, or all end at rest, every size is asked."""
    asked = (Requirement(id="swing", quantity="limit_cycle", unit="deg", maximum=1e-9),) if demanded else ()
    amber = with_values(load_design("ilr33-amber"), {"control.position.gain": gain})
    design = replace(amber, requirements=asked)
    found = settlings_of(design, loads_Nm=(0.0,))
    full, shares = design.validation.full_deflection_rad, {SMALL, *design.validation.amplitude_fractions}
    whole = gain == 120.0 or demanded
    assert [one.amplitude_rad for one in found] == [full * x for x in (sorted(shares) if whole else [1.0])]
    swing = noticed(design, found)
    assert (swing is None) == (gain == 120.0)
    assert verdict_of_swing(design, swing).value == ("met" if gain == 120.0 else "not met")


@pytest.mark.parametrize(("part", "hunts"), [(2e-10, False), (1e-3, True)])
def test_a_swing_that_nothing_shows_fails_nothing(part: float, hunts: bool) -> None:
    """Seed 100035 hunts by 8e-14 rad of 4e-4 (plain integration says the same): a verdict of no use."""
    size = part * EMPS.validation.full_deflection_rad
    validation = Validation(design=EMPS, rows=(), figures={}, settlings=(hunting(size, size, 3.0),))
    assert (validation.hunting is not None) is hunts


@pytest.mark.parametrize(
    ("swing_rad", "said"),
    [
        (0.0, "stands still 40 s later; whether it stays is not known"),
        (1e-5, "still moving 40 s later, by ±0.000573 deg"),
    ],
)
def test_what_does_not_move_is_not_said_to_be_moving(swing_rad: float, said: str) -> None:
    """1e-5 rad are 5.73e-4 deg; nothing is no motion."""
    rest = replace(hunting(0.1, swing_rad, 3.0).rest, verdict="still moving", frequency_hz=None, after_s=40.0)
    assert end_words(rest, degrees(1.0), "deg") == said


def test_nothing_judged_is_not_proven() -> None:
    rough = judged("bandwidth", "position", 1.0, 1.0, 0.1, unit="Hz", resolved=False)
    for rows in ((), (rough,)):
        assert Validation(design=EMPS, rows=rows, figures={}).verdict == "not proven"


def test_points_without_motion_are_left_out_without_a_warning() -> None:
    """Half the size and a quarter turn late where both move: 6 dB and 90 deg; NaN and 0 elsewhere."""
    expected = np.array([1.0, np.nan, 1.0, complex(np.nan, np.nan)])
    measured, nothing = np.array([-0.5j, 1.0, 0.0, 0.0]), np.zeros(4)
    sweep = RestSweep(*([nothing] * len(fields(RestSweep))))
    words = described(replace(sweep, measured=measured, described=expected))
    assert "up to 6 dB and 90 deg" in words
    assert "not compared" in described(replace(sweep, measured=nothing, described=expected))
