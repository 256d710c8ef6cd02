"""The picture of an exported unit: controller above, drive train below, typeset from the design."""

import json
import math
from importlib.util import find_spec
from pathlib import Path

from actuator_lti.design.model import Design
from reports.numbers import seconds

TEMPLATE = Path(__file__).resolve().parent / "templates" / "pdf" / "model.typ"
PPI = 144.0  # two pixels a point
Box = tuple[str, str]


def model_png(design: Design) -> bytes | None:
    """The picture as PNG, ``model.png`` of a unit; ``None`` where the typesetter is not installed."""
    if find_spec("typst") is None:  # comes with the extras export and pdf; a unit is valid without a picture
        return None
    import typst

    more = ", output encoder" * (design.output_encoder.counts_per_rev is not None)
    model = {
        "name": design.name, "title": design.title, "measured": f"measured: current, encoder{more}",
        "controller": controller_boxes(design), "train": train_boxes(design),
    }  # fmt: skip
    data = {"model": json.dumps(model)}
    made = typst.compile(str(TEMPLATE), root=str(TEMPLATE.parent), format="png", ppi=PPI, sys_inputs=data)
    assert isinstance(made, bytes)
    return made


def controller_boxes(design: Design) -> list[Box]:
    """What the command passes, outermost stage first: title and its leading value."""
    c = design.controller
    what = {"position": "position" if design.axis == "linear" else "angle", "velocity": "rate"}
    boxes: list[Box] = [("command", what.get(c.outermost, c.outermost))]
    if c.position is not None:
        boxes.append(("position", f"{c.position.gain:.4g} 1/s"))
    if c.velocity is not None:
        integral = c.velocity.integral_time_s
        boxes.append(("velocity", "P" if integral is None else f"PI {seconds(integral)}"))
    boxes += [("current", _limit(design.limits.peak_current_A, "A"))] if c.current else []
    return [*boxes, ("voltage", _limit(design.limits.voltage_V, "V")), ("tick", f"{1e6 * c.period_s:.4g} us")]


def _limit(value: float, unit: str) -> str:
    return f"{value:.4g} {unit}" if math.isfinite(value) else "no limit"


def train_boxes(design: Design) -> list[Box]:
    """What the torque passes, from the motor to the load."""
    motor = design.motor
    electrical = motor.resistance_ohm is not None
    boxes: list[Box] = [("motor", f"{motor.resistance_ohm:.4g} ohm" if electrical else "torque source")]
    boxes += [(gear.name, f"{gear.ratio:.5g} : 1") for gear in design.gears]
    if design.screw is not None:
        boxes.insert(1, ("screw", f"{1e3 * design.screw.lead_m:.4g} mm/turn"))
    if design.coupling is not None:
        after = design.coupling.after or (design.gears[-1].name if design.gears else None)
        place = next((n for n, box in enumerate(boxes) if box[0] == after), len(boxes) - 1) + 1
        play, unit = design.coupling.play_rad, "mm" if design.axis == "linear" else "mrad"
        boxes.insert(place, ("coupling", f"play {1e3 * play:.3g} {unit}" if play else "elastic"))
    boxes.append(("load", f"{design.load.inertia_kgm2:.3g} kg{' m2' if design.axis == 'rotary' else ''}"))
    return boxes
