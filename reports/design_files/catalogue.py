"""The designs that come with the package."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

if TYPE_CHECKING:
    from actuator_lti.design.model import Design


@dataclass(frozen=True, kw_only=True)
class Listed:
    """What the list says of one design; of a loop its controller and how often it runs, inner one first."""

    name: Annotated[str, "Design"]
    title: Annotated[str, "Title"]
    revision: str
    axis: str
    motor: Annotated[str, "Motor"]
    loops: Annotated[tuple[str, ...], "Loops"]
    gears: tuple[str, ...]
    total_ratio: Annotated[float, "Total ratio"]
    period_s: float
    requirements: int
    warnings: tuple[str, ...]
    hash: str


@dataclass(frozen=True)
class Catalogue:
    """The shipped designs."""

    designs: tuple[Listed, ...]

    def __str__(self) -> str:
        return f"{len(self.designs)} designs come with the package"


def catalogue() -> Catalogue:
    from actuator_lti.design import load_design, shipped_designs

    return Catalogue(tuple(_listed(load_design(name)) for name in shipped_designs()))


def _listed(design: Design) -> Listed:
    from actuator_lti.design import design_hash, warnings_of

    electrical = design.motor.has_electrical_dynamics
    source = "force source" if design.axis == "linear" else "torque source"
    same = ("name", "title", "revision", "axis", "total_ratio")
    return Listed(
        **{name: getattr(design, name) for name in same},
        motor="resistance and inductance" if electrical else source,
        loops=_loops(design),
        gears=tuple(gear.name for gear in design.gears),
        period_s=design.controller.period_s,
        requirements=len(design.requirements),
        warnings=tuple(warnings_of(design)),
        hash=design_hash(design),
    )


def _loops(design: Design) -> tuple[str, ...]:
    words = []
    for name in reversed(design.controller.stages):
        loop = getattr(design.controller, name)
        kind = "PI" if loop.integral_time_s is not None else "P"
        kind = kind if loop.law is None else "law of one's own"
        every = getattr(loop, "every", 1)
        words.append(f"{name} {kind}" + (f" every {every} ticks" if every > 1 else ""))
    return tuple(words)
