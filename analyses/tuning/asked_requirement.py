"""A requirement from the command line: ``position.bandwidth>=30 Hz``."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from actuator_lti.asked.quantities import QUANTITIES
from actuator_lti.design.model import Requirement
from actuator_lti.design.units import parse_limit
from actuator_lti.errors import InputError
from analyses.monte_carlo.judging import loops_of

if TYPE_CHECKING:
    from actuator_lti.design.model import Design

_FORM = re.compile(r"\s*([a-z]+)\.([a-z_0-9]+)\s*(>=|<=)\s*(.+?)\s*")


def read_requirement(words: str, design: Design) -> Requirement:
    """Read a requirement on a loop; what makes no sense is refused with what is allowed.

    Examples
    --------
    >>> from actuator_lti import load_design
    >>> result = read_requirement("position.bandwidth >= 30 Hz", load_design("ilr33-amber"))
    >>> result.id, result.minimum, result.unit
    ('position-bandwidth-wanted', 30.0, 'Hz')
    """
    match = _FORM.fullmatch(words)
    if match is None:
        raise InputError(
            f'--require {words!r}: allowed: LOOP.QUANTITY>=LIMIT, as "position.bandwidth>=30 Hz"'
        )
    loop, quantity, sign, limit = match.groups()
    loops = (*loops_of(design), "every")
    if loop not in loops:
        raise InputError(f"--require {words!r}: loop {loop!r}; allowed: {', '.join(loops)}")
    known = {name: q for name, q in QUANTITIES.items() if q.scope == "loop"}
    if quantity not in known:
        raise InputError(f"--require {words!r}: quantity {quantity!r}; allowed: {', '.join(known)}")
    unit = known[quantity].unit_for(design.axis)
    try:
        value = parse_limit(limit, unit)
    except InputError as error:
        raise InputError(f"--require {words!r}: {error.message}") from error
    return Requirement(
        id=f"{loop}-{quantity.replace('_', '-')}-wanted", quantity=quantity, unit=unit, loop=loop,
        minimum=value if sign == ">=" else None, maximum=value if sign == "<=" else None,
        source="command line",
    )  # fmt: skip
