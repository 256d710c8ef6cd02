"""A measured response over the model: what is explained, margins as ranges, both drawn with the spread."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reports import document as doc
from reports.charts import style
from reports.charts.style import Chart
from reports.document_schema import Block, Row, Section
from reports.sections.names import LOOPS

if TYPE_CHECKING:
    from analyses.margins.measured import Measured

MARGINS = [
    doc.column("kind", "Measured margin"),
    doc.column("value", "Value", format="sig:4"),
    doc.column("low", "from", format="sig:4"),
    doc.column("high", "to", format="sig:4"),
    doc.column("unit", "Unit"),
    doc.column("hz", "at", "Hz", format="sig:4"),
]
DIFFERENCES = [
    doc.column("hz", "Frequency", "Hz", format="sig:4"),
    doc.column("db", "Measured", "dB", format="fix:2"),
    doc.column("deg", "Phase", "deg", format="fix:1"),
    doc.column("off_db", "Over model", "dB", format="fix:2"),
    doc.column("off_deg", "Phase over model", "deg", format="fix:1"),
    doc.column("spread", "Spread", "dB", format="fix:2"),
]


def words(one: Measured) -> str:
    """Say within what the model explains the measurement."""
    db, deg = np.abs(one.difference_db), np.abs(one.difference_deg)
    ends = f"{db.max():.2f} dB (at {one.frequency_hz[db.argmax()]:.4g} Hz) and {deg.max():.1f} deg"
    told = f"The model explains the measurement within {ends} (at {one.frequency_hz[deg.argmax()]:.4g} Hz)"
    told += f"; rms {np.sqrt((db**2).mean()):.2f} dB, {np.sqrt((deg**2).mean()):.1f} deg"
    if one.radius.any():
        told += f"; at {one.within} of {db.size} points it lies within the spread ({one.source})"
    beyond = f" {one.beyond} points above half the sampling frequency are left out." if one.beyond else ""
    left = f" {one.left_out} rows without numbers are left out." if one.left_out else ""
    return f"{one.name} over the {_place(one)}. {told}.{beyond}{left} {one.note}".strip()


def _place(one: Measured) -> str:
    return LOOPS.get(one.loop, f"loop at {one.loop}").lower()


def section(one: Measured) -> Section:
    """Make the section from `analyses.margins.measured.measured_over`."""
    return doc.section("measured-response", "Measured response", blocks(one)[1:], result=words(one))


def blocks(one: Measured) -> list[Block]:
    """Give verdict, margins, differences and charts."""
    made = [doc.text(words(one))]
    if one.margins is not None:
        made.append(doc.table("Margins of the measured loop", MARGINS, _margins(one)))
    rows = doc.details("Difference to the model at each frequency", [differences(one)])
    return [*made, rows, _bode(one), _nyquist(one)]


def differences(one: Measured) -> Block:
    """Make the table of differences."""
    phase, spread = np.degrees(np.unwrap(np.angle(one.measured))), _spread_db(one)
    columns = zip(one.frequency_hz, 20.0 * np.log10(np.abs(one.measured)), phase, one.difference_db,
                  one.difference_deg, spread, strict=True)  # fmt: skip
    keys = [column["key"] for column in DIFFERENCES]
    rows: list[Row] = [dict(zip(keys, map(float, row), strict=True)) for row in columns]
    return doc.table("Measured over model", DIFFERENCES, rows)


def _spread_db(one: Measured) -> np.ndarray:
    return 20.0 * np.log10(1.0 + one.radius / np.abs(one.measured))


def _margins(one: Measured) -> list[Row]:
    assert one.margins is not None
    rows: list[Row] = []
    for gain in one.margins.gain_margins:
        low, high = (
            (None, None) if gain.ratio_range is None else (20.0 * np.log10(x) for x in gain.ratio_range)
        )
        hz = gain.frequency_rad_s / (2.0 * np.pi)
        rows.append(
            {"kind": "Gain margin", "value": gain.db, "low": low, "high": high, "unit": "dB", "hz": hz}
        )
    for phase in one.margins.phase_margins:
        low, high = phase.deg_range or (None, None)
        hz = phase.frequency_rad_s / (2.0 * np.pi)
        rows.append(
            {"kind": "Phase margin", "value": phase.deg, "low": low, "high": high, "unit": "deg", "hz": hz}
        )
    low, high = one.margins.modulus_range or (None, None)
    hz = (one.margins.modulus_frequency_rad_s or np.nan) / (2.0 * np.pi)
    modulus = one.margins.modulus_margin
    rows.append({"kind": "Modulus margin", "value": modulus, "low": low, "high": high, "unit": "", "hz": hz})
    return [{key: doc.plain(value) for key, value in row.items()} for row in rows]


def _bode(one: Measured) -> Block:
    chart = Chart(width=style.WIDE, height=410.0)
    top, bottom = chart.column(1.15, 1.0)
    f, first, shown = one.frequency_hz, 0.0, []
    top.x.log = bottom.x.log = True
    for k, (label, L) in enumerate((("measured", one.measured), ("model", one.model))):
        db, phase = 20.0 * np.log10(np.abs(L)), np.degrees(np.unwrap(np.angle(L)))
        if k:  # of the same turn as the measurement
            phase += 360.0 * np.round((first - phase[0]) / 360.0)
        shown += phase.tolist()
        if k:
            top.curve(f, db, label, **style.series(k))
            bottom.curve(f, phase, label, **style.series(k))
            continue
        first, reach = phase[0], np.minimum(one.radius / np.abs(L), 0.999)
        top.points(f, db, label, colour=style.BLUE)
        bottom.points(f, phase, label, colour=style.BLUE)
        ends = 20.0 * np.log10(1.0 - reach), 20.0 * np.log10(1.0 + reach)
        around = np.degrees(np.arcsin(reach))
        for panel, y, (low, high) in ((top, db, ends), (bottom, phase, (-around, around))):
            ring = np.concatenate([f, f[::-1]]), np.concatenate([y + low, (y + high)[::-1]])
            panel.shape(
                [ring], "99 % of the measurement" if panel is top else "", colour=style.BLUE, opacity=0.15
            )
    top.y.label, bottom.y.label, bottom.x.label = "magnitude, dB", "phase, deg", "frequency, Hz"
    style.phase_axis(bottom, shown)
    caption = f"{one.name}: measured {_place(one)} with its spread, and the model"
    return doc.figure(
        "measured", chart, caption=caption, alt="Measured and modelled open loop over frequency"
    )


def _nyquist(one: Measured) -> Block:
    chart = Chart(width=style.HALF, height=430.0)
    panel = chart.panel("real part of L", "imaginary part of L", by_point=True)
    panel.equal = True
    turn = np.exp(2j * np.pi * np.arange(25) / 24)
    rings = [
        z + r * turn for z, r in zip(one.measured, one.radius, strict=True) if abs(z + 1.0) < 4.0 and r > 0.0
    ]
    if rings:
        panel.shape([(ring.real, ring.imag) for ring in rings], "spread", colour=style.BLUE, opacity=0.15)
    L = one.measured
    panel.points(L.real, L.imag, "measured", colour=style.BLUE, parameter=one.frequency_hz)
    panel.curve(one.model.real, one.model.imag, "model", parameter=one.frequency_hz, **style.series(1))
    panel.points([-1.0], [0.0], marker="+", colour=style.INK, size=14.0, read=False)
    panel.x.limits(-3.0, 1.65)
    panel.y.limits(-2.0, 2.0)
    caption = f"{one.name}: Nyquist, each value with the circle that holds the true one in 99 % of all cases"
    return doc.figure("measured-nyquist", chart, caption=caption, alt="Measured and modelled Nyquist curve")
