"""Margins and bandwidths of every loop: the tables that a reader looks for first."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from actuator_lti.asked.quantities import CUSTOMARY, QUANTITIES, Quantity, unit_words
from actuator_lti.asked.verdict import Verdict
from actuator_lti.files.reading import Tree
from actuator_lti.margins.single import DelayMargin, GainMargin, PhaseMargin
from analyses.finite import finite
from analyses.linear.loop_figures import HELD, LoopFigures
from analyses.linear.loop_survey import AT_REST, OperatingPointFigures, at_rest
from analyses.margins.run import Margins, as_judged
from analyses.specification.weakest import Spread, figures_of, spread
from reports import document as doc
from reports.numbers import fixed, gain_margin, short, to_minus
from reports.sections import measured, requirements
from reports.sections.names import FORMS, LOOPS, figure_column, loop_words
from reports.terminal import Brief, side_by_side

EVIDENCE: dict[str, doc.Status] = {"certified": "pass", "checked": "info", "withheld": "warn"}
MEANING = {
    "certified": "exact arithmetic on the numbers of the loop as stored, each crossing and pole in a proven "
    "interval, and the same answer for numbers 8 units in the last place away",
    "checked": "double precision; poles and Nyquist count agree, no pole lies within its own error of the "
    "stability limit",
    "withheld": "the numbers of the loop do not determine the answer",
}

RETURNED = 0.1  # of command and peak: a response that ends below it has nothing to be relative to
DOWNWARDS = (
    " Down to: so far the gain may fall before the loop is unstable. Limits and compare take the size of it."
)


def _figure(quantity: str, key: str, format: str) -> doc.Shown:
    of = QUANTITIES[quantity]
    return figure_column(quantity, key, format=format), doc.of(of.reader, key, "", scale=of.shown[1])[1]


def _state(figures: LoopFigures) -> doc.State:
    if figures.held is not None:
        return {"text": "unstable by itself", "status": "warn"}
    return {"text": figures.margins.verdict, "status": Verdict.of(figures.margins.stable).role()}


def _evidence(figures: LoopFigures) -> doc.State:
    return {"text": figures.margins.evidence, "status": EVIDENCE[figures.margins.evidence]}


def _samples(figures: LoopFigures) -> float | None:
    return getattr(figures.margins.delay_margin, "samples", None) if figures.margins.stable else None


HERTZ: dict[str, Any] = {"unit": "Hz", "format": "sig:4"}
DOUBTS = {False: "not stable", None: "stability not known"}
MARGINS = [
    doc.of(_state, "stable", "Closed loop"),
    doc.of(_evidence, "evidence", "Margins are"),
    _figure("gain_margin", "gain_margin_db", "gain:2"),
    doc.of("margins.gain_margin.frequency_hz", "gain_margin_hz", "at", **HERTZ),
    _figure("phase_margin", "phase_margin_deg", "fix:2"),
    doc.of("margins.phase_margin.frequency_hz", "crossover_hz", "at", **HERTZ),
    _figure("delay_margin", "delay_margin_ms", "ms:3"),
    doc.of(_samples, "delay_margin_samples", "", "samples", format="sig:3", better=1),
    _figure("modulus_margin", "modulus_margin", "fix:3"),
    _figure("sensitivity_peak", "s_peak_db", "fix:2"),
    doc.of("margins.disk_margin.alpha", "disk_margin", "Disk margin", format="fix:3", better=1),
]
RESPONSES = [
    _figure("bandwidth", "minus3db_hz", "sig:4"),
    _figure("bandwidth_90deg", "minus90deg_hz", "sig:4"),
    _figure("resonance_peak", "resonance_db", "fix:2"),
    doc.of(lambda f: (f.bandwidth and f.bandwidth.resonance_hz) or None, "resonance_hz", "at", **HERTZ),
    doc.of("peaks.complementary_db", "t_peak_db", "Peak of T", "dB", format="fix:2", better=-1),
    _figure("rise_time", "rise_ms", "ms:3"),
    _figure("overshoot", "overshoot_percent", "fix:1"),
    _figure("settling_time", "settling_ms", "ms:3"),
    doc.of("step.final_value", "dc", "Gain at DC", format="sig:4"),
]
LOOP = doc.column("loop", "Loop")
MARGIN_COLUMNS = [LOOP, *(column for column, _ in MARGINS)]
RESPONSE_COLUMNS = [LOOP, *(column for column, _ in RESPONSES)]
CROSSING_COLUMNS = [
    doc.of("loop", "loop", "Loop"),
    doc.of("kind", "kind", "Crossing"),
    doc.of(lambda one: finite(one.value), "value", "Margin", format="sig:5"),
    doc.of("unit", "unit", "Unit"),
    doc.of(lambda one: finite(one.at.frequency_rad_s), "rad_s", "at", "rad/s", format="sig:5"),
    doc.of(lambda one: finite(one.at.frequency_hz), "hz", "at", "Hz", format="sig:4"),
    (figure_column("delay_margin", "delay_ms", format="ms:4"), doc.of("delay.seconds", "", "", scale=1e3)[1]),
    doc.of("delay.samples", "samples", "", "samples", format="sig:4"),
    doc.of("note", "note", "Remark"),
]


def section(result: Margins) -> list[doc.Section]:
    """Make the sections from `analyses.margins.margins`: the loops as asked for, the requirements."""
    judged, known = requirements.section(result.requirements), _named(result)
    how = f"{FORMS[result.asked.form].capitalize()}; {_where(result)}. "
    made = _loops(known, result.operating_points, how)
    made["blocks"] += map(doc.text, _notes(result, known))
    made["blocks"] += [] if result.measured is None else measured.blocks(result.measured)
    said = f"{_stability(known)}{_elsewhere(result)}{_by_angle(result)}. {judged['result']}"
    if result.requirements and not as_judged(result.design, result.asked):
        said += " Judged on the sampled loops with sliding friction, without a load."
    return [{**made, "result": said + _below_custom(result)}, judged]


def brief(result: Margins) -> Brief:
    (first, judged), known = section(result), _named(result)
    every, own = with_held(known), with_held(known, of_margins=True)
    head = f"{result.design.name}: {result.asked.form}, {_where(result)}"
    tables = [margin_table(own), spread_table(result.operating_points, known), response_table(every)]
    counts = [len(one.margins.gain_margins) + len(one.margins.phase_margins) for one in known.values()]
    more, said = [crossing_table(own)] if max(counts, default=0) > 2 else [], list[str]()
    if result.measured is not None:
        more += [block for block in measured.blocks(result.measured) if block["kind"] == "table"]
        said += [measured.words(result.measured), *(f"measured loop: {one}" for one in result.measured.notes)]
    notes = [*said, *by_itself_notes(known), *evidence_notes(known), *_notes(result, known)]
    shown = [side_by_side(head, tables), *more] if known else []
    return Brief(first["result"], [*shown, *judged["blocks"]], notes)


def _named(result: Margins) -> dict[str, LoopFigures]:
    """The loops and the places around them by the words of their rows."""
    return {**{LOOPS[name]: one for name, one in result.loops.items()}, **result.around}


def _below_custom(result: Margins) -> str:
    """Margins below what is customary that no requirement names: without any, and of a loop around it."""
    low, judged = [], bool(result.requirements)
    for name, one in (result.around if judged else _named(result)).items():
        for quantity, value in figures_of(one.judged.margins).items() if one.is_stable else ():
            if value < (usual := CUSTOMARY[quantity]):
                of = QUANTITIES[quantity]
                unit = f" {unit_words(of.unit)}".rstrip()
                own = name if name in result.around else name.lower()
                low.append(f"{own}, {of.words} {value:.3g}{unit} (of {usual:g}{unit})")
    return f" Below what is customary: {'; '.join(low)}." if low else ""


def _where(result: Margins) -> str:
    point, load = result.asked.operating_point, f"load {result.asked.load_Nm:g} {result.design.load_unit}"
    return f"{at_rest(result.design) if point == 'rest' else point}, {load}"


def _notes(result: Margins, named: Mapping[str, LoopFigures]) -> list[str]:
    own = [note for one in named.values() for note in (*one.margins.notes, *one.notes)]
    around = [f"{name}: broken at the command of the drive" for name in result.around]
    return list(dict.fromkeys([*own, *around, *_smoothed(result)]))


def _smoothed(result: Margins) -> list[str]:
    """Where the speed that dry friction is smoothed over decides the least phase margins: those without."""
    least = {name: own["phase_margin"].where for name, own in result.spread.items() if "phase_margin" in own}
    sliding = {name: one.judged.margins for name, one in result.operating_points[0].figures.items()}
    known = [
        f"{LOOPS[name].lower()} {fixed(value, 2)} deg"
        for name, where in least.items()
        if where.startswith(f"{AT_REST}, ") and (value := sliding[name].phase_margin_deg) is not None
    ]
    if not known or at_rest(result.design) == AT_REST:
        return []
    given = "" if "friction.smoothing_speed" in result.design.parameters else " (not given)"
    return [
        f"the phase margins at rest go with friction.smoothing_speed{given}, as dry friction has no slope of "
        f"its own there; without that slope (sliding): {', '.join(known)}"
    ]


def _stability(named: Mapping[str, LoopFigures]) -> str:
    if not named:
        return "the drive has no loop, so there are no margins"
    for stability, words in DOUBTS.items():
        if names := [name for name, one in named.items() if one.is_stable is stability]:
            return f"{words}: {', '.join(names)}"
    held = [
        f"; the {label[:1].lower()}{label[1:]}, unstable by itself, is judged with the {HELD[one.loop.name]}"
        for label, one in named.items()
        if one.held is not None
    ]
    return f"the drive is stable with all loops closed{''.join(held)}" if held else "every loop is stable"


def _elsewhere(result: Margins) -> str:
    """Name the operating points at which a loop that is stable as asked for is not."""
    places: dict[tuple[str, str], list[str]] = {}
    for point in result.operating_points:
        for name, one in point.figures.items():
            if not one.is_stable and name in result.loops and result.loops[name].is_stable:
                where = place_words(point.place), "not" if one.is_stable is False else "not known to be"
                places.setdefault(where, []).append(name)
    return "".join(
        f"; {where} these loops are {doubt} stable: {', '.join(names)}"
        for (where, doubt), names in places.items()
    )


def place_words(place: str) -> str:
    """An operating point within a sentence.

    >>> place_words("motor driven by the load"), place_words("in the gap of the play"), place_words("")
    ('with the motor driven by the load', 'in the gap of the play', 'sliding')
    """
    return f"with the {place}" if " driven by " in place else place or "sliding"


def _by_angle(result: Margins) -> str:
    """Loops unstable only by cogging, whose phase a sheet leaves open, or by a slope held over a tick."""
    away = "which drives the rotor away at angle 0: motor.cogging_phase says where it stands"
    held = "only as the slope of a torque over the angle, held over a tick, is slightly active"
    by_hold = [name for name, one in result.loops.items() if one.by_hold and not one.is_stable]
    causes = {f"by cogging alone, {away}": result.by_cogging, held: by_hold}
    named = {why: ", ".join(LOOPS[name].lower() for name in names) for why, names in causes.items()}
    return "".join(f" ({loops}: {why})" for why, loops in named.items() if loops)


def of_loops(figures: Mapping[str, LoopFigures], points: Sequence[OperatingPointFigures] = ()) -> doc.Section:
    how = "Sampled form: exact hold and computing delay, no approximation; sliding friction. "
    return {**_loops({LOOPS[n]: one for n, one in figures.items()}, points, how), "result": result(figures)}


def _loops(
    loops: Mapping[str, LoopFigures], points: Sequence[OperatingPointFigures], how: str
) -> doc.Section:
    named, own = with_held(loops), with_held(loops, of_margins=True)
    blocks = [
        *(doc.text(note) for note in by_itself_notes(loops)),
        margin_table(own),
        *([spread_table(points, loops)] if points else ()),
        response_table(named),
        doc.details("Every crossing of every loop", [crossing_table(own)]),
        *(doc.text(note) for note in evidence_notes(named)),
    ]
    if not loops:
        blocks, how = [], "The drive has no loop: its command is the voltage. "
    kinds = {one.margins.evidence for one in named.values()}
    meaning = " ".join(f"{kind.capitalize()}: {words}." for kind, words in MEANING.items() if kind in kinds)
    law = ", that of a law at what the law gives," * any(one.loop.at_law for one in loops.values())
    intro = (
        f"Each loop is cut at its own error{law or ','} with the loops inside it closed and those outside it "
        f"open. {how}{meaning}"
    )
    status = worst_status([one.is_stable for one in loops.values()])
    return doc.section(
        "margins", "Margins and bandwidths", blocks, intro=intro, status=status,
        verdict=Verdict.NOT_PROVEN if status == "warn" else None,
    )  # fmt: skip


def result(figures: Mapping[str, LoopFigures]) -> str:
    doubts = [
        f"{words}: {', '.join(names)}."
        for words, is_stable in (("Not stable", False), ("Not known to be stable", None))
        if (names := [LOOPS[name].lower() for name, one in figures.items() if one.is_stable is is_stable])
    ]
    if doubts or not figures:
        return " ".join(doubts)
    rows = {loop_words(name, one.rotor).lower(): margin_row(one.judged) for name, one in figures.items()}
    words = []
    for what, unit, write in (("gain margin", "dB", gain_margin), ("phase margin", "deg", fixed)):
        key = f"{what.replace(' ', '_')}_{unit.lower()}"
        known = {name: row[key] for name, row in rows.items() if row[key] is not None}
        if known:
            name = min(known, key=lambda n: abs(known[n]))
            words.append(f"the smallest {what} is {write(known[name], 1)} {unit} ({name})")
    count = {1: "The loop is", 2: "Both loops are"}.get(len(rows), f"All {len(rows)} loops are")
    count = f"{count} stable, {evidence_words(figures)}"
    held = [f"{LOOPS[name].lower()} with the {HELD[name]}" for name, one in figures.items() if one.held]
    count += f" ({', '.join(held)})" if held else ""
    return to_minus(f"{count}; with sliding friction {' and '.join(words)}." if words else f"{count}.")


def evidence_words(figures: Mapping[str, LoopFigures]) -> str:
    """Say how the margins of some loops are known: "certified", or which of them are not."""
    kinds: dict[str, list[str]] = {}
    for name, one in figures.items():
        kinds.setdefault(one.margins.evidence, []).append(LOOPS[name].lower())
    said = (f"{' and '.join(names)} {kind}" if len(kinds) > 1 else kind for kind, names in kinds.items())
    return ", ".join(said)


def evidence_notes(named: Mapping[str, LoopFigures]) -> list[str]:
    known = [(name, one.margins) for name, one in named.items()]
    return [f"{name}, {m.evidence}: {m.evidence_reason}." for name, m in known if m.evidence != "certified"]


def margin_table(named: Mapping[str, LoopFigures]) -> doc.Block:
    note = (
        "Of several crossings the table quotes the gain margin nearest to 0 dB and the phase margin nearest "
        "to 0°; all of them are listed below. A dash means that there is no such crossing, or that the loop "
        "is not stable and has no margins. Disk margin: α, balanced (S + T)."
    )
    rows = [{"loop": name, **margin_row(one)} for name, one in named.items()]
    note += DOWNWARDS if any((row["gain_margin_db"] or 0.0) < 0.0 for row in rows) else ""
    return doc.table("Stability margins", MARGIN_COLUMNS, rows, note)


def response_table(named: Mapping[str, LoopFigures]) -> doc.Block:
    note = (
        "−3 dB: where the closed loop has fallen to 1/√2 of its gain at DC. −90°: where its phase reaches "
        "−90°. Current and velocity: the feedback loop. Position: the response from the user's command to "
        "the output shaft, with what the drive has of feed-forward, jerk limit and filter of the command; to "
        "the reference: behind profile and filter."
    )
    rows = [{"loop": name, **response_row(one)} for name, one in named.items()]
    if any(None in row.values() for row in rows):
        note += " A dash: the response never falls or peaks so far, or the loop is not stable."
    return doc.table("Closed-loop bandwidth, resonance and step", RESPONSE_COLUMNS, rows, note)


SPREAD_COLUMNS = [
    LOOP,
    doc.column("gain", "Gain margin, operating points", "dB"),
    doc.column("phase", "Phase margin, operating points", "deg"),
]


def spread_table(points: Sequence[OperatingPointFigures], named: Mapping[str, LoopFigures]) -> doc.Block:
    seen = [point for point in points if point.kind != "describing-function"]
    places = "; ".join(dict.fromkeys(point.place or "sliding" for point in seen))
    ranges, rows = spread(seen), list[doc.Row]()
    for label, figures in named.items():
        name, own = figures.loop.name, ranges.get(figures.loop.name, {})
        row: doc.Row = {"loop": list(with_held({label: figures}))[figures.held is not None]}  # as judged
        row |= {name.split("_")[0]: range_words(range_, name) for name, range_ in own.items()}
        doubts = {words: list[str]() for words in DOUBTS.values()}
        for point in seen:
            if name in point.figures and not (is_stable := point.figures[name].is_stable):
                doubts[DOUBTS[is_stable]].append(point.place or "sliding")
        said = [f"{words} {'; '.join(where)}" for words, where in doubts.items() if where]
        row |= {"gain": "; ".join(said)} if said else {}
        rows += [row] if len(row) > 1 else []
    gains = [own["gain_margin"] for own in ranges.values() if "gain_margin" in own]
    note = f"Operating points: {places}."
    note += DOWNWARDS if any(min(one.least, one.most) < 0.0 for one in gains) else ""
    return doc.table("Margins over the operating points", SPREAD_COLUMNS, rows, note)


def range_words(range_: Spread, quantity: str) -> str:
    """Say between which values a margin lies over the operating points.

    >>> range_words(Spread(15.0, -16.3, "in the gap of the play"), "gain_margin")
    '15 (in the gap of the play); elsewhere down to −16.3'
    """

    def end(value: float) -> str:
        words = "∞" if math.isinf(value) else short(value, 3)
        return f"down to {words}" if quantity == "gain_margin" and words[0] == "−" else words

    least, most = end(range_.least), end(range_.most)
    if least == most:
        return least
    return f"{least} ({range_.where})" + (f"; elsewhere {most}" if most.startswith("down") else f" to {most}")


class _Crossing(NamedTuple):
    loop: str
    kind: str
    value: float
    unit: str
    at: GainMargin | PhaseMargin
    note: str
    delay: DelayMargin | None = None


def crossing_table(named: Mapping[str, LoopFigures]) -> doc.Block:
    found, touches = list[_Crossing](), "touches, does not cross"
    for name, m in ((name, one.margins) for name, one in named.items()):
        for gain in m.gain_margins:
            note = f"{'upper' if gain.ratio >= 1.0 else 'lower'} limit of the gain"
            note += f", {touches}" * gain.tangent
            found.append(_Crossing(name, "phase crossover", gain.db, "dB", gain, note))
        delays = {margin.frequency_rad_s: margin for margin in m.delay_margins}
        for phase in m.phase_margins:
            more = touches * phase.tangent, delays.get(phase.frequency_rad_s)
            found.append(_Crossing(name, "gain crossover", phase.deg, "deg", phase, *more))
    loops = {words: key for key, title in LOOPS.items() for words in (title, loop_words(key))}
    return doc.listing(
        "Every gain and phase crossover", found, CROSSING_COLUMNS,
        more=lambda one: {"_loop": loops.get(one.loop, ""), "_hz": finite(one.at.frequency_hz) or None},
    )  # fmt: skip


def margin_row(figures: LoopFigures) -> Tree:
    """Give the margins of one loop by column; an unstable loop has none, only the crossings listed below."""
    row: Tree = {one["key"]: doc.plain(read(figures)) for one, read in MARGINS}
    row["crossover_rad_s"] = getattr(figures.margins.phase_margin, "frequency_rad_s", None)
    if figures.margins.stable is not False:
        return row
    return {key: row[key] if key in ("stable", "evidence") else None for key in row}


def with_held(named: Mapping[str, LoopFigures], *, of_margins: bool = False) -> dict[str, LoopFigures]:
    """Put the other row of a loop behind it, under names that say which is which.

    Of a current loop that with the rotor locked; of an inner loop that is unstable only by itself, the held
    one; of a position loop behind a mean or filter of the command, its response to the reference, which has
    no margins of its own (``of_margins``: without it).
    """
    every: dict[str, LoopFigures] = {}
    for label, figures in named.items():
        free = figures.loop.name == "current" and (figures.locked or figures.held)
        every[f"{label}, rotor free" if free else label] = figures
        if other := free or figures.held:
            every[f"{label}, {'rotor locked' if free else HELD[figures.loop.name]}"] = other
        if figures.reference is not None and not of_margins:
            every[f"{label}, to the reference"] = figures.reference
    return every


def by_itself_notes(named: Mapping[str, LoopFigures]) -> list[str]:
    """Say of each loop that is unstable only by itself how it is judged; of one that returns what is not."""
    returned = [(label, one.step) for label, one in named.items() if one.step and returns(one)]
    return [
        f"{label}: after a peak of {step.peak_value:.3g} the response returns to {step.final_value:.3g} of "
        "its command. Bandwidth, resonance, rise, overshoot and settling, which are relative to that, are "
        "left out."
        for label, step in returned
    ] + [
        f"{label}: unstable by itself, {figures.by_itself}. With all loops "
        f"closed the drive is stable. The loop is judged with the {HELD[figures.loop.name]}: stable."
        for label, figures in named.items()
        if figures.held is not None
    ]


def response_row(figures: LoopFigures) -> Tree:
    """Give the response of one loop by column; of one that returns what is not relative to its end."""
    row = {one["key"]: doc.plain(read(figures)) for one, read in RESPONSES}
    kept = ("t_peak_db", "dc") if returns(figures) else row
    return {key: row[key] if key in kept else None for key in row}


def returns(figures: LoopFigures) -> bool:
    """Whether a step response comes back to next to nothing, of its command and of its peak.

    As a P current loop's does with a free rotor, which turns until back-EMF has taken its voltage.
    """
    step = figures.step
    return step is not None and abs(step.final_value) < RETURNED * min(1.0, abs(step.peak_value))


def shown(quantity: Quantity, figures: LoopFigures) -> float | None:
    """Give a figure of the registry as reports write it: with its sign; an unstable loop has none."""
    lost = figures.margins.stable is False or (quantity.of_response and returns(figures))
    value = None if lost else finite(quantity.raw(figures))
    return None if value is None else value * quantity.shown[1]


def worst_status(stable: Iterable[bool | None]) -> doc.Status:
    """Give the status of a section from the stability of its loops: unstable fails, unknown warns."""
    known = list(stable)
    return "fail" if False in known else "warn" if None in known else "info"
