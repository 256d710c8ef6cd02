"""A measured response of a loop over that of the model: margins as ranges, differences, what is explained."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.files.response import FloatArray, read_response
from actuator_lti.files.response import Loop as Kind
from actuator_lti.loops import Loops
from actuator_lti.margins import StabilityMargins, stability_margins
from actuator_lti.systems.measured_response import MeasuredResponse, measured_response


@dataclass(frozen=True, kw_only=True)
class Measured:
    """A measured open loop and the model's at the same frequencies."""

    # The file; which loop; L, T or S that was measured
    name: str
    loop: str
    of: str
    frequency_hz: FloatArray
    # Open loops
    measured: np.ndarray
    model: np.ndarray
    radius: FloatArray  # of the circle about each measured value that holds the true one in 99 % of all cases
    source: str  # where the radius comes from
    # Of the measured loop, each with its range; None where the points are too coarse, see ``note``
    margins: StabilityMargins | None
    note: str
    beyond: int  # points above half the sampling frequency, left out
    left_out: int  # rows of the file without numbers

    @property
    def difference_db(self) -> FloatArray:
        """Measured over model, dB."""
        return cast("FloatArray", 20.0 * np.log10(np.abs(self.measured / self.model)))

    @property
    def difference_deg(self) -> FloatArray:
        """Measured over model, deg."""
        return cast("FloatArray", np.degrees(np.angle(self.measured / self.model)))

    @property
    def within(self) -> int:
        """Points at which the model lies within the measurement's own spread."""
        return int(np.count_nonzero(np.abs(self.measured - self.model) <= self.radius))


def measured_if_asked(loops: Loops, source: Any, place: str, averages: int | None) -> Measured | None:
    """`measured_over`, where there is a response; what is said of one that is not there is refused."""
    if source is not None:
        return measured_over(loops, source, place, averages)
    if place or averages is not None:
        raise InputError(f"--{'response-of' if place else 'averages'}: allowed with --response")
    return None


def measured_over(loops: Loops, source: Any, place: str = "", averages: int | None = None) -> Measured:
    """Lay a measured response (a path, or python-control's data) over the loop that it was measured of.

    ``place``: a loop or a break point, and what of it was measured behind a colon: ``"velocity"`` (its open
    loop), ``"position:T"`` (closed), ``"i_ref:S"`` (sensitivity); empty: the open outermost loop.
    ``averages``: those behind the coherence.

    Raises `InputError`: for a file that is no response, or a loop that is not there.
    """
    import control

    every = {**loops.break_points, **loops.present}
    name, _, of = place.partition(":")
    name, of = name or list(loops.present)[-1], of or "L"
    if name not in every or of not in ("L", "T", "S"):
        allowed = f"{', '.join(every)}, each with :T (closed loop) or :S (sensitivity) behind it, or without"
        raise InputError(f"--response-of {place}: allowed: {allowed}")
    loop, read = every[name], read_response(source, averages).as_loop(cast("Kind", of))
    below = np.full(read.frequency_hz.size, True)
    if loop.period_s is not None:
        below = read.frequency_hz < 0.5 / loop.period_s
    if np.count_nonzero(below) < 2:
        raise InputError(
            f"{read.name}: no two frequencies below half that of the sampling of the {name} loop"
        )
    omega, L = 2.0 * np.pi * read.frequency_hz[below], read.response[below]
    points = 1j * omega if loop.period_s is None else np.exp(1j * omega * loop.period_s)
    data = MeasuredResponse(omega, L, np.zeros(omega.size), loop.period_s, "")
    sigma, known = np.abs(L) * read.deviation[below], np.isfinite(read.deviation[below]).all()
    if known:
        data = MeasuredResponse.with_noise(data, sigma)
    else:  # with the noise that the scatter of the points about their neighbours tells
        data = measured_response(control.FrequencyResponseData(data.frdata, data.omega, dt=data.dt))
    margins, note = None, ""
    try:
        margins = stability_margins(data)
    except InputError as error:
        note = error.message
    return Measured(
        name=read.name, loop=name, of=of, frequency_hz=omega / (2.0 * np.pi), measured=L,
        model=np.asarray(loop.plain_open(points)).reshape(-1),
        radius=np.asarray(data.radius, dtype=np.float64), source=data.source,
        margins=margins, note=note, beyond=int((~below).sum()), left_out=read.left_out,
    )  # fmt: skip
