"""A measured response over the model: what is explained, margins as ranges, both drawn with the spread."""

from typing import Any

import numpy as np

from actuator_lti.margins.results import StabilityMargins
from analyses.margins.run import Measured
from reports import document as doc
from reports.charts import style
from reports.sections.names import LOOPS, hertz


def words(one: Measured) -> str:
    db, deg = np.abs(one.difference_db), np.abs(one.difference_deg)
    ends = f"{db.max():.2f} dB (at {one.frequency_hz[db.argmax()]:.4g} Hz) and {deg.max():.1f} deg"
    said = f"The model explains the measurement within {ends} (at {one.frequency_hz[deg.argmax()]:.4g} Hz)"
    said += f"; rms {np.sqrt((db**2).mean()):.2f} dB, {np.sqrt((deg**2).mean()):.1f} deg"
    if one.radius.any():
        said += f"; at {one.within} of {db.size} points it lies within the spread ({one.source})"
    like = ""
    if one.nearer:
        of, off = one.nearer
        asked = f"was it measured of {one.loop}:{of}" if of in WHAT else ASKED[of.removeprefix(one.of)[:1]]
        like = f" It is nearer to {of} of the model, {off:.2f} dB rms: {asked}?"
    beyond = f" {one.beyond} points above half the sampling frequency are left out." if one.beyond else ""
    left = f" {one.left_out} rows without numbers or at 0 Hz are left out." if one.left_out else ""
    read = f" {one.read_as[:1].upper()}{one.read_as[1:]}." if one.read_as else ""
    return f"{one.name} over the {_place(one)}. {said}.{like}{beyond}{left}{read} {one.note}".strip()


ASKED = {
    "-": "was it measured with the other sign",
    "*": "is its phase turned round, a lag above 0",
    " ": "are its frequencies in rad/s",
}
WHAT = {"L": "open {}", "T": "closed {}", "S": "sensitivity of the {}"}


def _place(one: Measured) -> str:
    return WHAT[one.of].format(LOOPS.get(one.loop, f"loop at {one.loop}").lower())


def section(one: Measured) -> doc.Section:
    return doc.section("measured-response", "Measured response", blocks(one)[1:], result=words(one))


def blocks(one: Measured) -> list[doc.Block]:
    made = [doc.text(words(one))]
    if one.margins is not None:
        made += [_margins(one.margins), *map(doc.remark, one.notes)]
    rows = doc.details("Difference to the model at each frequency", [differences(one)])
    return [*made, rows, _bode(one), _nyquist(one)]


def differences(one: Measured) -> doc.Block:
    columns = [
        doc.column("hz", "Frequency", "Hz", format="sig:4"),
        doc.column("db", "Measured", "dB", format="fix:2"),
        doc.column("deg", "Phase", "deg", format="fix:1"),
        doc.column("off_db", "Over model", "dB", format="fix:2"),
        doc.column("off_deg", "Phase over model", "deg", format="fix:1"),
        doc.column("spread", "Spread", "dB", format="fix:2"),
    ]
    size, phase = np.abs(one.measured), np.degrees(np.unwrap(np.angle(one.measured)))
    decibel, spread = 20.0 * np.log10(size), 20.0 * np.log10(1.0 + one.radius / size)
    found = (one.frequency_hz, decibel, phase, one.difference_db, one.difference_deg, spread)
    return doc.table("Measured over model", columns, zip(*found, strict=True))


def _margins(of: StabilityMargins) -> doc.Block:
    """Each margin of the measured loop with its range, where the points tell one."""
    gains = [(m.db, m.ratio_range and 20.0 * np.log10(m.ratio_range), m) for m in of.gain_margins]
    found: list[tuple[str, float | None, Any, str, float | None]]
    found = [("Gain margin", db, range_, "dB", m.frequency_rad_s) for db, range_, m in gains]
    found += [("Phase margin", m.deg, m.deg_range, "deg", m.frequency_rad_s) for m in of.phase_margins]
    delays = [(m, m.seconds_range and 1e3 * np.array(m.seconds_range)) for m in of.delay_margins]
    found += [("Delay margin", 1e3 * m.seconds, ends, "ms", m.frequency_rad_s) for m, ends in delays]
    found.append(("Modulus margin", of.modulus_margin, of.modulus_range, "", of.modulus_frequency_rad_s))
    columns = [
        doc.of(lambda one: one[0], "kind", "Measured margin"),
        doc.of(lambda one: one[1], "value", "Value", format="sig:4"),
        doc.of(lambda one: None if one[2] is None else one[2][0], "low", "from", format="sig:4"),
        doc.of(lambda one: None if one[2] is None else one[2][1], "high", "to", format="sig:4"),
        doc.of(lambda one: one[3], "unit", "Unit"),
        doc.of(lambda one: hertz(one[4]), "hz", "at", "Hz", format="sig:4"),
    ]
    return doc.listing("Margins of the measured open loop", found, columns)


def _bode(one: Measured) -> doc.Block:
    chart, (top, bottom) = style.stack(410.0, 1.15, 1.0)
    f, reach = one.frequency_hz, np.minimum(one.radius / np.abs(one.measured), 0.999)
    found, model = decibels_and_degrees(one.measured, one.model)
    around = np.degrees(np.arcsin(reach))
    spread = ((20.0 * np.log10(1.0 - reach), 20.0 * np.log10(1.0 + reach)), (-around, around))
    style.bode_axes(top, bottom, [*found[1], *model[1]])
    for panel, y, fitted, (low, high) in zip((top, bottom), found, model, spread, strict=True):
        panel.points(f, y, "measured", colour=style.BLUE)
        ring = np.concatenate([f, f[::-1]]), np.concatenate([y + low, (y + high)[::-1]])
        panel.shape([ring], "99 % of the measurement", colour=style.BLUE, opacity=0.15)
        panel.curve(f, fitted, "model", **style.series(1))
    caption = f"{one.name}: {_place(one)}, measured with its spread, and the model"
    return doc.figure("measured", chart, caption, alt=f"Measured and modelled {_place(one)} over frequency")


def decibels_and_degrees(
    measured: np.ndarray, model: np.ndarray
) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
    """Magnitude in dB and unwrapped phase in degrees of a measurement and of its model, on the same turn."""
    phases = [style.phases(L) for L in (measured, model)]
    phases[1] += 360.0 * np.round((phases[0][0] - phases[1][0]) / 360.0)
    return tuple((style.decibels(L), y) for L, y in zip((measured, model), phases, strict=True))


def _nyquist(one: Measured) -> doc.Block:
    chart, L, model = style.Chart(width=style.HALF, height=430.0), one.open_loop.frdata, one.curve
    panel = chart.panel("real part of L", "imaginary part of L", by_point=True)
    panel.equal = True
    near = [(z, r) for z, r in zip(L, one.open_loop.radius, strict=True) if abs(z + 1.0) < 4.0 and r > 0.0]
    if rings := [z + r * style.TURN[::3] for z, r in near]:
        panel.shape([(ring.real, ring.imag) for ring in rings], "spread", colour=style.BLUE, opacity=0.15)
    panel.points(L.real, L.imag, "measured", colour=style.BLUE, parameter=one.frequency_hz)
    panel.curve(model.real, model.imag, "model", parameter=one.curve_hz, **style.series(1))
    panel.points([-1.0], [0.0], marker="+", colour=style.INK, size=14.0, read=False)
    panel.x.limits(-3.0, 1.65)
    panel.y.limits(-2.0, 2.0)
    caption = f"{one.name}: Nyquist, each value with the circle that holds the true one in 99 % of all cases"
    return doc.figure("measured-nyquist", chart, caption=caption, alt="Measured and modelled Nyquist curve")
