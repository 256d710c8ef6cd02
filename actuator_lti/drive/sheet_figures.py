"""What data sheets state beside a design's own keys, from those keys: to hold against the sheet."""

from dataclasses import dataclass
from math import pi
from typing import Annotated

from actuator_lti.design.model import Design


@dataclass(frozen=True)
class SheetFigure:
    """One figure: what it is, its formula of the model's DC motor, its value in SI or the unit named."""

    name: Annotated[str, "Follows from the design"]
    value: Annotated[float, "Value"]
    unit: Annotated[str, "Unit"]


def sheet_figures(design: Design) -> tuple[SheetFigure, ...]:
    """Time constants, stall, no-load speed and inertia at the motor, at the design's temperature and supply.

    Of a linear axis behind gears of ratio N, speed and force are those of the output.

    >>> from actuator_lti.design import load_design
    >>> for one in sheet_figures(load_design("ilr33-amber"))[:2]:
    ...     print(f"{one.name}: {one.value:.4g} {one.unit}")
    electrical time constant L/R: 0.1091 ms
    mechanical time constant of the rotor alone R J/kM^2: 1.454 ms
    """
    linear, ratio = design.axis == "linear", design.total_ratio
    unit = "kg" if linear else "kg*m^2"
    behind = design.load.inertia_kgm2 / ratio**2
    inertia = (
        SheetFigure("load inertia at the motor, over the ratio squared", behind, unit),
        SheetFigure("all inertia at the motor", design.inertia_kgm2, unit),
    )
    motor, U = design.effective_motor, design.limits.voltage_V
    R, L, J = motor.resistance_ohm, motor.inductance_H, motor.rotor_inertia_kgm2
    kM, kE = motor.torque_constant_Nm_A, motor.back_emf_constant_Vs_rad
    if R is None or L is None or kM is None or kE is None:  # an ideal source
        return inertia
    geared, force, speed = linear and ratio != 1.0, kM * U / R, U / kE
    if linear:
        force, speed = force * ratio, speed / ratio
    of, by, over = (" of the output", " N", "/N") if geared else ("", "", "")
    shown = (speed, "m/s") if linear else (speed * 30.0 / pi, "rpm")
    return (
        SheetFigure("electrical time constant L/R", 1e3 * L / R, "ms"),
        SheetFigure("mechanical time constant of the rotor alone R J/kM^2", 1e3 * R * J / kM**2, "ms"),
        SheetFigure(f"no-load speed{of} without friction U/kE{over}", *shown),
        SheetFigure("stall current U/R", U / R, "A" if design.motor.constants == "dc" else "A dc"),
        SheetFigure(
            f"stall {'force' if linear else 'torque'}{of} kM U/R{by}", force, "N" if linear else "N*m"
        ),
        *inertia,
    )
