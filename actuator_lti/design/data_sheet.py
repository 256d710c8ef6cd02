"""What data sheets state in place of friction (model.md section 11), read into the keys that follow."""

import re
from collections.abc import Collection, Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from itertools import chain
from math import prod
from typing import Any

from actuator_lti.design import model
from actuator_lti.design.field import Field, Structure, positive, quantity
from actuator_lti.design.fields import FIELDS
from actuator_lti.design.mistakes import UNREAD, Refusal, readable
from actuator_lti.design.stated import Frame
from actuator_lti.design.units import si_text
from actuator_lti.errors import InputError
from actuator_lti.files.reading import Tree

_CURRENT, _SPEED, _SHARE = "motor.no_load_current", "motor.no_load_speed", "motor.no_load_dry_share"
SHEET: tuple[Field, ...] = (
    positive("current of the motor without a load: kM i0 = C0 + Cv w0, in place of friction.dry_torque and "
             "friction.viscous", "i0", key=_CURRENT, unit="A", example="137 mA"),
    positive("speed of the motor at its no-load current", "w0", key=_SPEED, unit="{angle}/s",
             example="7580 rpm"),
    quantity("share of the no-load torque that is dry; where it is not given a half, with a tolerance from 0 "
             "to 1", key=_SHARE, unit="1", low=0.0, high=1.0, example="0.8"),
    positive("efficiency of the stage under load, driving, in place of friction.load_coefficient; stages "
             "without one count as 1", "eta", key="gear.*.efficiency", unit="1", high=1.0, example="72 %"),
)  # fmt: skip
"""Keys of a file that no part of a design has an attribute for."""

FROM = "from data sheet: "  # what the source of a value begins with that follows from such keys
_WORD = re.compile(r"(?P<table>motor|gear\.[^.=;,]+)\.(?P<key>no_load_\w+|efficiency) = (?P<text>.+)")
_OPEN = "100.0 %"  # tolerance of a friction whose share is not said
_TAKEN = {
    _CURRENT: ("dry_torque", "viscous", "dry_torque_reverse", "viscous_reverse", "point"),
    "gear.efficiency": ("load_coefficient",),
}


def sheet_fields(template: str) -> tuple[Field, ...]:
    return tuple(field for field in SHEET if field.section == template)


def stated_in(design: model.Design) -> Iterator[tuple[str, str, str]]:
    """What a design's friction was read from, each once: dotted key, as written, as read in SI."""
    travel_m_rad = None if design.screw is None else design.screw.travel_m_rad
    frame = Frame(Structure.of(design), design.motor.constants, travel_m_rad)
    sources = (item.source for item in design.parameters.values() if item.source.startswith(FROM))
    said = (source.removeprefix(FROM).partition("; ")[0].split(", ") for source in sources)
    for word in filter(None, map(_WORD.fullmatch, dict.fromkeys(chain.from_iterable(said)))):
        field = next(one for one in SHEET if one.key == word["key"])
        with suppress(InputError):  # of a source that a user wrote
            value = frame.quantity(word["text"], field)
            read = si_text(float(f"{value:.9g}"), field.unit(frame.structure))
            yield f"{word['table']}.{word['key']}", word["text"], read


def as_stated(tree: Tree, changed: Collection[str]) -> None:
    """Put a sheet's own keys back for the friction read from them, unless changed: it is read again."""
    friction, pairs = tree.get("friction", {}), tree.get("correlation", [])
    tables = {"motor": tree.get("motor"), **{f"gear.{gear['name']}": gear for gear in tree.get("gear", ())}}
    for keys in _TAKEN.values():
        paths = {f"friction.{key}" for key in keys}
        if any(path.startswith((*paths, "correlation")) or path == "friction" for path in changed):
            continue
        read = {key: _words(friction[key], tables) for key in keys if key in friction}
        if None in read.values():
            continue
        for key, words in read.items():
            grade = friction.pop(key).get("grade", "")
            for word, source in words or ():
                tables[word["table"]][word["key"]] = {"value": word["text"], "source": source, "grade": grade}
        pairs[:] = [pair for pair in pairs if not {pair["first"], pair["second"]} <= paths]


def _words(entry: Any, tables: Collection[str]) -> list[tuple[re.Match[str], str]] | None:
    """The sheet's keys and sources that a value of friction was read from; None of a user's words."""
    if not isinstance(entry, dict) or not entry.get("source", "").startswith(FROM):
        return None
    said, _, source = entry["source"].removeprefix(FROM).partition("; ")
    words = [_WORD.fullmatch(word) for word in said.split(", ")]
    known = [(word, source) for word in words if word is not None and word["table"] in tables]
    return known if len(known) == len(words) and entry.get("tolerance", _OPEN) == _OPEN else None


class DataSheet:
    """What a file states so: values with their pedigree, by dotted key, `UNREAD` where they could not be."""

    def __init__(self, stated: dict[str, model.Parameter], tree: Tree) -> None:
        self.stated, friction = stated, tree.get("friction")
        self.friction = friction if isinstance(friction, dict) else {}
        self.gears = {path: item for path, item in stated.items() if path.startswith(("gear.", "gear["))}

    def refusals(self, design: model.Design) -> Iterator[Refusal]:
        for path, item in self.stated.items():
            yield from readable(self._beside(path, item, design))
        yield from readable(self._halved())

    def _beside(self, path: str, item: model.Parameter, design: model.Design) -> Iterator[Refusal]:
        for key in _TAKEN["gear.efficiency" if path in self.gears else _CURRENT]:
            if key in self.friction:
                yield path, item.text, f"not allowed beside friction.{key}, which says the same; give one"
        if item.tolerance is not None:
            yield f"{path}.tolerance", "", "allowed: none here; of the keys of friction"
        if path in (_SPEED, _SHARE) and _CURRENT not in self.stated:
            yield path, item.text, f"needs {_CURRENT}"
        if path == _CURRENT and design.motor.torque_constant_Nm_A is None:
            yield path, item.text, "needs motor.torque_constant"

    def _halved(self) -> Iterator[Refusal]:
        share = self.stated.get(_SHARE)
        if _CURRENT in self.stated and _SPEED not in self.stated and (share is None or share.value < 1.0):
            yield _SPEED, "", f"missing; {_CURRENT} needs it"

    def read_into(self, design: model.Design) -> model.Design:
        if design.friction is UNREAD:
            return design
        if _CURRENT in self.stated:
            design = self._no_load(design)
        return self._loaded(design) if self.gears else design

    def _no_load(self, design: model.Design) -> model.Design:
        """kM i0 = C0 + Cv w0, both in the sheet's own amperes."""
        assert design.motor.torque_constant_Nm_A is not None
        torque = design.motor.torque_constant_Nm_A * self.stated[_CURRENT].value
        share = self.stated[_SHARE].value if _SHARE in self.stated else 0.5
        values = {"friction.dry_torque": share * torque}
        if share < 1.0:
            values["friction.viscous"] = (1.0 - share) * torque / self.stated[_SPEED].value
        values = {path: value for path, value in values.items() if value}
        design = self._with(design, values, (_CURRENT, _SPEED, _SHARE))
        if _SHARE in self.stated:
            return design
        open_ = {path: replace(design.parameters[path], tolerance=model.Tolerance(
            kind="uniform", half_width=value, text=_OPEN)) for path, value in values.items()}  # fmt: skip
        pair = model.Correlation(first="friction.dry_torque", second="friction.viscous", coefficient=-1.0)
        parameters = model.FrozenMap({**design.parameters, **open_})
        return replace(design, parameters=parameters, correlations=(*design.correlations, pair))

    def _loaded(self, design: model.Design) -> model.Design:
        """A load M wants M/(N eta) of the motor; where it is not locked M/N of that acts by itself."""
        eta = prod(item.value for item in self.gears.values())
        lost = 1.0 / eta if design.load.path == "self-locking" else 1.0 / eta - 1.0
        values = {"friction.load_coefficient": lost / design.total_ratio} if lost else {}
        return self._with(design, values, self.gears)

    def _with(self, design: model.Design, values: dict[str, float], said: Iterable[str]) -> model.Design:
        stated = [self.stated[path] for path in said if path in self.stated]
        words = ", ".join(f"{item.path} = {item.text}" for item in stated)
        source = "; ".join((FROM + words, *dict.fromkeys(item.source for item in stated if item.source)))
        made, attributes = dict(design.parameters), dict[str, Any]()
        for path, value in values.items():
            field, unit = FIELDS[path], FIELDS[path].unit(Structure.of(design))
            made[path] = model.Parameter(
                path=path, text=si_text(value, unit), value=value, unit=unit, symbol=field.symbol,
                source=source, grade=stated[0].grade, stated=source)  # fmt: skip
            attributes[field.attribute] = value
        friction = replace(design.friction, **attributes)
        return replace(design, friction=friction, parameters=model.FrozenMap(made))
