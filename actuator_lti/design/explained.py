"""How each number of a design file was understood: as written, as read, as the model has it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from actuator_lti.design.data_sheet import FROM
from actuator_lti.design.fields import field_of
from actuator_lti.design.model import Design


@dataclass(frozen=True)
class Explained:
    """One number of a file.

    ``path``: its dotted key.
    ``written``, ``read``: as the file has it, and in SI.
    ``model``: as the equations have it: symbol and value, of the equivalent DC motor at its temperature.
    """

    path: Annotated[str, "Key"]
    written: Annotated[str, "Written"]
    read: Annotated[str, "Read as"]
    model: Annotated[str, "In the model as"]


def explained(design: Design) -> tuple[Explained, ...]:
    """Every number that stands in the file of a design, in its order.

    Examples
    --------
    >>> from actuator_lti.design import load_design
    >>> items = {item.path: item for item in explained(load_design("ballscrew"))}
    >>> one = items["motor.torque_constant"]
    >>> one.written, one.read, one.model
    ('0.50 N*m/A', '314.159265 N/A', 'kM = 256.509966 N/A')
    """
    result = []
    for path, item in design.parameters.items():
        field, value = field_of(path), item.value
        if path.startswith("motor.") and field is not None:
            value = getattr(design.effective_motor, field.attribute)
        unit = "" if item.unit == "1" else f" {item.unit}"
        symbol = f"{item.symbol} = " if item.symbol else ""
        written = item.source if item.source.startswith(FROM) else item.text
        result.append(Explained(path, written, f"{item.value:.9g}{unit}", f"{symbol}{value:.9g}{unit}"))
    return tuple(result)
