"""Margins at the corners: hot, cold, low supply, and the worst ends of the tolerances."""

from collections import Counter

from actuator_lti.asked.quantities import CORNERED, QUANTITIES, Quantity
from actuator_lti.asked.verdict import Verdict
from analyses.corners.run import Corner, Corners
from reports import document as doc
from reports.charts import style
from reports.sections.margins import shown
from reports.sections.names import figure_column, loop_words

PER_LOOP = [QUANTITIES[name] for name in (*CORNERED, "bandwidth")]


def section(result: Corners) -> doc.Section:
    intro = (
        "Each corner is a design of its own, put through the same sampled loops and the same requirements. "
        "The worst ends are those that one by one lower the margin of the loop where it is smallest, all "
        "taken together; the worst-case search of montecarlo looks inside the box as well."
    )
    named = [
        doc.text(". ".join([f"{one.name.capitalize()}: {one.words}", *one.refused.values()]) + ".")
        for one in result.corners[1:]
    ]
    caption = "From nominal (line) to each corner (dot): which corner moves which margin, loop by loop."
    alt = f"{caption} The figures stand in the table of every loop at every corner."
    details = doc.details("Every loop at every corner", [_loop_table(result), *named])
    blocks = [_summary_table(result)]
    if result.corners[0].figures:
        blocks += [doc.figure("corners", chart(result), caption, alt=alt), details]
    grave = doc.severity(result.verdict)
    words = summary(result)
    return doc.section("corners", "Corners", blocks, result=words, intro=intro, severity=grave)


def summary(result: Corners) -> str:
    failed = [corner.name for corner in result.corners if not corner.passed]
    open_ones = [one for one in result.left_out if not one.passes]
    unmet = [one for one in (*result.over_all, *open_ones) if one.verdict is Verdict.NOT_MET]
    untold = ", ".join(one.id for one in open_ones if one not in unmet)
    more = "".join(f" Not met: {one.id}{f', {one.reason}' * bool(one.reason)}." for one in unmet)
    more += f" Not judged at corners: {untold}." * bool(untold)
    count = len(result.corners)
    if not failed:
        every = "every other requirement" if more else "every requirement"
        judged = result.corners[0].verdicts
        met, none = (f" and {every} met", "") if judged else ("", " No requirement is judged there.")
        stable = "Every loop is stable" if result.corners[0].figures else "The drive has no loop"
        return f"{stable}{met} at all {count} corners.{none}{more}"
    where = f"{len(failed)} of {count} corners ({'; '.join(failed)})"
    where = f"all {count} corners" if len(failed) == count else where
    what = Counter(name for corner in result.corners for name in _failings(corner))
    return f"The drive fails at {where}: {', '.join(f'{name} at {n}' for name, n in what.items())}.{more}"


def _failings(corner: Corner) -> list[str]:
    doubts = {name: one.is_stable for name, one in corner.figures.items() if not one.is_stable}
    known = {None: "not known to be stable", False: "not stable"}
    loops = [f"{name} loop {known[stable]}" for name, stable in doubts.items()]
    refused = [f"{key} not allowed there" for key in corner.refused]
    return [*refused, *loops, *(one.id for one in corner.verdicts if not one.passes)]


def worst(corner: Corner, quantity: Quantity) -> tuple[float, str] | None:
    """The worst of a figure over the loops, and its loop; None where there is none."""
    read = [(quantity.read(one.judged), name) for name, one in corner.figures.items() if one.is_stable]
    found = [(value, name) for value, name in read if value is not None]
    return min(found, key=lambda each: quantity.better * each[0], default=None)


def chart(result: Corners) -> style.Chart:
    made = style.Chart(width=style.WIDE, height=96.0 + 38.0 * len(result.corners), legend=True)
    nominal = result.corners[0]
    for quantity in (QUANTITIES[name] for name in CORNERED):
        panel = made.panel(title=quantity.words)
        for k, (name, own) in enumerate(nominal.figures.items()):
            start = shown(quantity, own.judged)
            if start is not None:
                panel.rule_x(start, colour=style.SERIES[k], dash=2)
            for row, corner in enumerate(result.corners):
                one = corner.figures[name]
                value = shown(quantity, one.judged) if one.is_stable else None
                at = row + 0.22 * (k - (len(nominal.figures) - 1) / 2.0)
                look: style.Style = {"colour": style.SERIES[k], "read": False}
                panel.curve([start, value], [at, at], width=2.4, **look)
                if not one.is_stable and start is not None:
                    panel.note("not stable", (start, at), colour=style.RED, pinned=True)
                panel.points([value], [at], loop_words(name, one.rotor), **look | {"read": True})
        asked = [one.requirement for one in nominal.verdicts if one.requirement.quantity == quantity.name]
        limits = (one.minimum if quantity.better > 0 else one.maximum for one in asked)
        for limit in {value for value in limits if value is not None}:
            panel.x.see([limit])
            panel.rule_x(limit, label="limit", colour=style.INK, dash=1, width=1.4)
        style.rows(panel, [corner.name for corner in result.corners])
        panel.x.label = f"{quantity.words}, {quantity.shown[0]}"
    return made


def _summary_table(result: Corners) -> doc.Block:
    columns = [doc.column("corner", "Corner")]
    for name in CORNERED:
        worst_is = "least" if QUANTITIES[name].better > 0 else "largest"
        label = f"{worst_is} {QUANTITIES[name].words}".capitalize()
        columns += [figure_column(name, name, label=label, format="fix:1"), doc.column(f"{name}_loop", "in")]
    columns.append(doc.column("unmet", "Not met"))
    rows = []
    for corner in result.corners:
        row: doc.Row = {"corner": corner.name}
        for name in CORNERED:
            found = worst(corner, QUANTITIES[name])
            of = found and loop_words(found[1], corner.figures[found[1]].rotor)
            row |= {name: found and found[0], f"{name}_loop": of or ""}
        unmet = ", ".join(_failings(corner))
        rows.append({**row, "unmet": unmet, "_status": None if corner.passed else "fail"})
    note = "The least margin is that of the stable loops; others are named under what is not met."
    return doc.table("Corners", columns, rows, note)


def _loop_table(result: Corners) -> doc.Block:
    def figure(of: Quantity) -> doc.Shown:
        column = figure_column(of.name, of.name, label=of.label, format=of.at_a_glance)
        return column, lambda pair: shown(of, pair[1].judged)

    columns = [
        doc.of(lambda pair: pair[0].name, "corner", "Corner"),
        doc.of(lambda pair: loop_words(pair[1].loop.name, pair[1].rotor), "loop", "Loop"),
        doc.of(lambda pair: pair[1].is_stable is True, "stable", "Stable", format="yesno"),
        *map(figure, PER_LOOP),
    ]
    loops = [(corner, one) for corner in result.corners for one in corner.figures.values()]
    return doc.listing("Loops at the corners", loops, columns)
