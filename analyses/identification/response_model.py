"""The response of a loop, of many designs at once, and what a measured one is off from it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np

from actuator_lti.design.access import stacked
from actuator_lti.design.model import Design
from actuator_lti.drive.operating import Operating
from actuator_lti.drive.wiring import Drive, wire
from actuator_lti.errors import InputError
from actuator_lti.loops.periodic import phase_blocks, point_blocks
from actuator_lti.loops.sampled import stage_blocks, whole_path
from actuator_lti.loops.tick import Block, TickProgram, mean_response
from actuator_lti.systems.sampling import split_delay
from actuator_lti.types import Complexes, Floats, Mask
from analyses.identification.asked import Of
from analyses.records.response import RecordedResponse

Values = Mapping[str, Floats]  # values in SI by key, each of shape (K,): K designs
ROUNDED = float(np.finfo(float).eps) ** 0.25  # how far rounding scatters four eigenvalues at 1


@dataclass(frozen=True, kw_only=True)
class Seen:
    """A measured response, shape (F,), the deviation of each of its parts (1: not known), and the model.

    ``relative``: the deviation is one share of each true value. Over the measured one it would have too much
    weight where noise made it small, and the values a bias; the logarithm has a mean of 0 of such noise.
    ``grows``: of which designs more modes grow than of the first: nobody measures them.
    """

    measured: Complexes
    size: Floats
    known: bool
    relative: bool
    model: Callable[[Values], Complexes]
    grows: Callable[[Values], Mask]

    def parts(self, values: Complexes) -> Floats:
        """Real and imaginary parts over their deviations, shape (..., 2 F)."""
        return np.concatenate([(values / self.size).real, (values / self.size).imag], axis=-1)

    def off(self, values: Values) -> Floats:
        """What the responses of designs are off by, shape (K, 2 F)."""
        return self.ratio(values) if self.relative else self.parts(self.model(values) - self.measured)

    def ratio(self, values: Values) -> Floats:
        """The same of the logarithms: far from the truth they are straighter."""
        return self.parts(np.log(self.model(values) / self.measured) * np.abs(self.measured))


def loop_model(
    design: Design, loop: str | None, of: Of, measured: RecordedResponse
) -> tuple[Callable[[Values], Complexes], Callable[[Values], Mask]]:
    """The responses, shape (K, F), of designs that differ in some values from one; which of them grow."""
    wired = wire(design, Operating())
    name = loop or wired.outermost
    there = (*wired.stages, *wired.points)
    if name not in there:
        raise InputError(f'--loop "{name}": allowed: {", ".join(there)}', where=design.name)

    def blocks(wired: Drive) -> tuple[list[Block], Any]:
        if of == "closed":
            _, signal, every, _ = whole_path(wired)
            program = TickProgram(wired, wired.outermost)
            return phase_blocks(program, every, "ref", signal), every * wired.tick_s
        if name in wired.stages:
            return stage_blocks(wired, name), wired.period_s(name)
        return point_blocks(wired, name), wired.period_s(wired.producer(name))

    def growing(wired: Drive) -> Any:
        """Modes that grow: of T and S with the loop closed, of L with those inside it."""
        made, _ = blocks(wired)
        closed = [block.feedback() for block in made] if of in ("T", "S") else made
        over = reduce(lambda before, block: block.A @ before, closed[1:], closed[0].A)
        return np.count_nonzero(np.abs(np.linalg.eigvals(over)) > 1.0 + ROUNDED, axis=-1)

    period_s, most = blocks(wired)[1], growing(wired)
    measured.refuse_other_period(name, period_s)
    top = 0.5 / period_s
    if not (last := measured.frequency_hz[-1]) < top:
        raise InputError(f"{last:g} Hz: the loop is sampled; allowed: below {top:g} Hz", measured.name)
    z = np.exp(1j * np.pi * measured.frequency_hz / top)[:, None, None]

    def relative(values: Values) -> Complexes:
        made, _ = blocks(wire(stacked(design, values), Operating()))
        periodic = len(made) > 1 and of != "closed"  # of its fundamentals T is that of the blocks
        made = [block.feedback() for block in made] if periodic else made
        steps = [tuple(part[..., None, :, :] for part in (b.A, b.B, b.C, b.D)) for b in made]
        value = mean_response(steps, z)[..., 0, 0]
        value = value / (1.0 - value) if periodic else value
        over = {"T": value, "S": np.ones_like(value)}.get(of)
        return np.asarray(value if over is None else over / (1.0 + value), dtype=np.complex128)

    def response(values: Values) -> Complexes:
        delay = {"control.computing_delay": np.asarray(design.controller.computing_delay_s)}
        names, each = zip(*{**delay, **values}.items(), strict=True)
        table = np.array(np.broadcast_arrays(np.zeros(1), *each)[1:])
        whole, part = split_delay(table[names.index(*delay)], design.controller.period_s)
        kinds = 2 * whole + (part > 0.0)  # designs of one kind have the same states
        result = np.empty((len(kinds), len(z)), dtype=complex)
        for kind in np.unique(kinds):
            result[kinds == kind] = relative(dict(zip(names, table[:, kinds == kind], strict=True)))
        return result

    def grows(values: Values) -> Mask:
        return np.asarray(growing(wire(stacked(design, values), Operating())) > most)

    return response, grows
