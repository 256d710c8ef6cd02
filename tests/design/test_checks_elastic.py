"""Drive trains that cannot be are refused in one line; a stage that cannot lock is warned of."""

from __future__ import annotations

from dataclasses import replace

import pytest

from actuator_lti import load_design
from actuator_lti.design.checks import check_design
from actuator_lti.design.checks_elastic import elastic_warnings
from actuator_lti.design.model import Coupling, Design, LoadFriction
from actuator_lti.errors import InputError

RIGID = load_design("ilr33-amber")
COUPLED = replace(RIGID, coupling=Coupling(stiffness_Nm_rad=100.0, play_rad=0.002))
LAST, FIRST = RIGID.gears[-1].name, RIGID.gears[0].name


def with_coefficient(design: Design, coefficient: float) -> Design:
    return replace(design, friction=replace(design.friction, load_coefficient=coefficient))


def weightless(design: Design) -> Design:
    return replace(design, load=replace(design.load, inertia_kgm2=0.0))


REFUSED = {
    "coupling.stiffness = 100": weightless(COUPLED),
    "friction.law": replace(COUPLED, friction=replace(COUPLED.friction, law="tanh")),
    "before the self-locking stage": replace(COUPLED, coupling=replace(COUPLED.coupling, after=FIRST)),
    "a self-locking stage with less": with_coefficient(COUPLED, 0.9 / RIGID.total_ratio),
    "allowed behind a coupling": replace(RIGID, load=replace(RIGID.load, friction=LoadFriction())),
}


@pytest.mark.parametrize("words", REFUSED)
def test_refused(words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        check_design(REFUSED[words], "a.toml")
    assert "\n" not in str(caught.value)
    assert "a.toml" in str(caught.value)


@pytest.mark.parametrize(
    "design",
    [
        RIGID,
        COUPLED,
        replace(COUPLED, coupling=replace(COUPLED.coupling, after=LAST)),
        with_coefficient(COUPLED, 1.0 / RIGID.total_ratio),
        replace(
            with_coefficient(COUPLED, 0.0),
            load=replace(COUPLED.load, path="back-drivable", friction=LoadFriction(dry_torque_Nm=1.0)),
            coupling=replace(COUPLED.coupling, after=FIRST),
        ),
    ],
)
def test_allowed(design: Design) -> None:
    check_design(design, "a.toml")


def test_rigid_stage_that_cannot_hold_its_load() -> None:
    assert list(elastic_warnings(RIGID)) == []
    (line,) = elastic_warnings(with_coefficient(RIGID, 0.9 / RIGID.total_ratio))
    assert line.startswith("friction.load_coefficient: ")
    damped = replace(COUPLED, coupling=replace(COUPLED.coupling, damping_Nms_rad=0.1))
    assert list(elastic_warnings(with_coefficient(damped, 0.0))) == []
