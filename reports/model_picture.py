"""The picture of an exported unit: controller above, drive train below, drawn from the design."""

import math
from collections.abc import Sequence
from importlib.util import find_spec

from actuator_lti.design.model import Design
from reports.charts.chart import COLOURS
from reports.charts.pen import Pen
from reports.numbers import seconds

WIDTH, HEIGHT = 640, 300
LEFT, TOP, GAP = 16.0, 62.0, 14.0
BOX_HEIGHT, ROW = 62.0, 128.0
PEN = Pen(prefix="", page=False, keys={})
FONT = "DejaVu Sans Mono"  # comes with the typesetter, so that the picture is the same on every machine
PPI = 144.0  # two pixels a point
MOST_CHARACTERS = 14
_PAGE = """#set page(width: {width}pt, height: {height}pt, margin: 0pt)
#image(bytes(sys.inputs.svg), width: {width}pt)
"""

Box = tuple[str, str]


def model_png(design: Design) -> bytes | None:
    """The picture as PNG, ``model.png`` of a unit; ``None`` where the typesetter is not installed."""
    if find_spec("typst") is None:  # comes with the extras export and pdf; a unit is valid without a picture
        return None
    import typst

    page = _PAGE.format(width=WIDTH, height=HEIGHT)
    made = typst.compile(page.encode(), format="png", ppi=PPI, sys_inputs={"svg": model_svg(design)})
    assert isinstance(made, bytes)
    return made


def model_svg(design: Design) -> str:
    parts = [
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="{COLOURS["paper"]}"/>',
        _words(WIDTH / 2, 28, design.name, 17, bold=True),
        _words(WIDTH / 2, 46, design.title, 10, colour="muted", most=80),
        *_row(controller_boxes(design), TOP, "c1"),
        *_row(train_boxes(design), TOP + ROW, "c3"),
        *_returns(design),
    ]
    size = f'width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="{FONT}">{"".join(parts)}</svg>'


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


def _row(boxes: Sequence[Box], top: float, colour: str) -> list[str]:
    width = (WIDTH - 2 * LEFT - GAP * (len(boxes) - 1)) / len(boxes)
    parts = []
    for n, (title, value) in enumerate(boxes):
        x, middle = LEFT + n * (width + GAP), top + BOX_HEIGHT / 2
        most = min(MOST_CHARACTERS, int(width / 6.4))
        parts.append(
            f'<rect x="{x:.1f}" y="{top:g}" width="{width:.1f}" height="{BOX_HEIGHT:g}" rx="7" '
            f'fill="{COLOURS[colour]}" fill-opacity="0.09" stroke="{COLOURS[colour]}" stroke-width="1.5"/>'
        )
        parts.append(_words(x + width / 2, middle - 4, title, 11, bold=True, most=most))
        parts.append(_words(x + width / 2, middle + 14, value, 9.5, most=int(width / 5.8)))
        if n:
            parts.append(_arrow([(x - GAP, middle), (x - 1.5, middle)]))
    return parts


def _returns(design: Design) -> list[str]:
    """Voltage down to the motor, measured values back up to the controller."""
    right, low, high = WIDTH - LEFT - 28.0, TOP + ROW, TOP + BOX_HEIGHT
    middle, bottom = 0.5 * (low + high), low + BOX_HEIGHT
    down = [(right, high), (right, middle - 10), (LEFT + 28.0, middle - 10), (LEFT + 28.0, low - 1.5)]
    has_output = design.output_encoder.counts_per_rev is not None
    words = "measured: current, encoder" + ", output encoder" * has_output
    return [
        _arrow(down),
        _words(WIDTH / 2, middle - 15, "voltage", 9.5, colour="muted"),
        _words(WIDTH / 2, bottom + 24, words, 9.5, colour="muted", most=80),
    ]


def _arrow(points: Sequence[tuple[float, float]]) -> str:
    (x0, y0), (x, y) = points[-2], points[-1]
    dx, dy = (5.0, 0.0) if y == y0 and x > x0 else (0.0, 5.0)
    sides = [(x - dx + way * dy / 1.6, y - dy + way * dx / 1.6) for way in (-1, 1)]
    lines = (points, (sides[0], (x, y), sides[1]))
    path = "".join("M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in line) for line in lines)
    return f'<path d="{path}" fill="none" stroke="{COLOURS["ink"]}" stroke-width="1.2"/>'


def _words(
    x: float, y: float, text: str, size: float, *, colour: str = "ink", bold: bool = False, most: int = 60
) -> str:
    short = text if len(text) <= most else text[: most - 1] + "."
    return PEN.words(short, x, y, size=size, anchor="middle", colour=colour, bold=bold)
