"""Columns of a measured frequency response: what each is, in which unit, and what it tells of the noise."""

import re
from collections.abc import Mapping, Sequence
from typing import cast

import numpy as np

from actuator_lti.design.units import compatible, parse_unit
from actuator_lti.errors import InputError
from actuator_lti.files.reading import shown
from actuator_lti.measured.response import CONFIDENCE, GAUSSIAN, student
from actuator_lti.types import Complexes, Floats, Mask
from analyses.records.naming import is_unit, spelled

WHAT = (
    "frequency response: CSV, JSON, Parquet or .mat (up to -v7) with frequency, dB and deg or real and "
    "imaginary part"
)
HEADS = "f_hz,gain_db,phase_deg or f_hz,real,imag"
TABLE = f"{WHAT}: a heading such as {HEADS}, then a row of numbers for each frequency"

PERIOD = "sampling period in s"
_ERROR = re.compile(r"std|dev|sigma|spread|uncert|err", re.I)
_DEVIATION = (
    re.compile(r"^(?!re|im|f)(.*[_ ])?(std|dev|sigma|spread|uncert)", re.I),
    {"%|percent": "%", "db": "dB", "deg|°": "deg", "rad": "rad", "abs": "abs"},
)
# what each column is named, by which it is known, and how a name says its unit
_UNITS: dict[str, tuple[re.Pattern[str], dict[str, str]]] = {
    "coherence": (re.compile(r"coh|gamma|^cxy", re.I), {}),
    "averages": (re.compile(r"^n?_?av(g|erages?)\b", re.I), {}),
    PERIOD: (re.compile(r"^(ts|dt|(sampl(e|ing)[_ ]?)?period|sampl(e|ing)[_ ]?time)([_ ]s)?$", re.I), {}),
    "deviation": _DEVIATION,
    "deviation beside it": _DEVIATION,
    "frequency": (
        re.compile(r"^f(req|_|\b)|^(omega|w|wout)(_|\b)|hz\b", re.I),
        {"khz": "kHz", "hz": "Hz", r"rad|^omega|^w(_|\b)|^wout": "rad/s"},
    ),
    "real": (re.compile(r"^re(al)?(_|\b)|[._]re(al)?\b", re.I), {}),
    "imaginary": (re.compile(r"^im(ag)?[a-z]*(_|\b)|[._]im(ag)?\b", re.I), {}),
    "phase": (re.compile(r"phase|^arg|deg\b|°|^ph(_|\b)", re.I), {"deg|°": "deg", "rad": "rad"}),
    "size": (re.compile(r"mag|gain|abs|amp|db\b", re.I), {"db": "dB", r"abs|ratio|lin|\b1\b|[/]": "ratio"}),
}
_LIKE = {"frequency": "Hz", "phase": "rad"}  # what is read of a unit is over this one
_ALLOWED = {"frequency": "Hz, kHz, rad/s or 1/min", "phase": "deg or rad"}
_BRACKETS = re.compile(r"[\[({]([^\])}]*)[\])}]")
_UNREAD = re.compile(
    r"(?<![a-z])[mgµunp]hz|grad(?!ient)|\bgon\b", re.I
)  # a prefix in other letters; deg or not
_TURNED = re.compile(r"lag\b|lag_|atten|loss|^1/|inverse", re.I)
_NO_UNIT = ("", "-", "1", "db", "abs", "ratio", "lin")  # in a row of units
# Of a name: its unit, and what is no letter.
_FREQUENCY_UNIT = re.compile(r"k?hz|rad([_/ ]*(per)?[_/ ]*s(ec)?)?|[\W_\d]")
_WORDS = {"size": "magnitude", "real": "real part", "imaginary": "imaginary part"}
_ORDER = ("frequency", "size", "phase", "real", "imaginary")
_DEVIATIONS = ("deviation", "deviation beside it")
_DB = np.log(10.0) / 20.0
_APART = 0.02  # nine tenths of what is said twice agrees so closely, rounded as it may be


def roles(columns: Mapping[str, Floats]) -> dict[str, str]:
    """Names of the columns that are read, by what they are: the first that may be."""
    found: dict[str, str] = {}
    for role, (like, _) in _UNITS.items():
        named = next((one for one in columns if one not in found.values() and like.search(one)), None)
        if named is not None:
            found[role] = named
    if "coherence" not in found:
        found.pop("averages", None)
    if PERIOD in found and np.ptp(columns[found[PERIOD]]) != 0.0:  # something else, or not a number
        found.pop(PERIOD)
    parts = {"real", "imaginary"} <= set(found)
    wanted = ("frequency", "real", "imaginary") if "real" in found else ("frequency", "size", "phase")
    if missing := [role for role in wanted if role not in found]:
        held = ", ".join(shown(one)[1:-1] for one in list(columns)[:12])
        raise InputError(f"no {' and no '.join(missing)} in the columns {held}; allowed: a {TABLE}")
    return {role: own for role, own in found.items() if not (parts and role in ("size", "phase"))}


def is_heading(words: Sequence[str]) -> bool:
    """Whether two kinds of columns are named."""
    return sum(any(like.search(word) for word in words) for like, _ in _UNITS.values()) > 1


def are_units(words: Sequence[str]) -> bool:
    """Whether this is a row of units, as stands below a heading."""
    plain = [word.strip("[]() ") for word in words]
    return any(plain) and all(word.lower() in _NO_UNIT or is_unit(word) for word in plain)


def si_of(role: str, unit: str) -> float:
    """Factor of a frequency to Hz, of a phase to rad, of a deviation to a ratio."""
    if not unit:
        return 1.0
    return parse_unit(spelled(unit)).factor / parse_unit(_LIKE.get(role, "1")).factor


def unit_of(role: str, name: str, values: Floats) -> str:
    """As its name says, else as its numbers do; frequencies are in Hz then.

    An InputError for a unit that is none of the column's, and for what is turned round.
    """
    if role in ("size", "phase") and _TURNED.search(name):
        raise InputError(f"{shown(name)} is turned round; allowed: a gain, a phase (below 0 where it lags)")
    if said := _said(role, name):
        return said
    if role == "size" and not (values < 0.0).any():
        raise InputError(f"{shown(name)} says no unit; allowed: gain_db or gain_ratio")
    if role == "phase" and not (np.abs(values) > 2.0 * np.pi).any():
        raise InputError(f"{shown(name)} says no unit; allowed: phase_deg or phase_rad")
    return {"size": "dB", "phase": "deg", "frequency": "Hz"}.get(role, "")


def _said(role: str, name: str) -> str:
    """The unit in a name: of a frequency or phase in brackets or behind it with any prefix."""
    if role in _LIKE:
        held = _BRACKETS.findall(name)
        written = [
            one for one in (*held, *re.split(r"[_\s/]", name)[-1:]) if is_unit(one) and one.strip("1 ")
        ]
        fits = [one for one in written if compatible(parse_unit(spelled(one)), parse_unit(_LIKE[role]))]
        if fits:
            return fits[0].strip()
        square = [one for one in held if f"[{one}]" in name and not re.search(r"hz|rad|deg", one, re.I)]
        if square or _UNREAD.search(name) or any(is_unit(one) and one.strip("1 ") for one in held):
            raise InputError(f"{shown(name)}: its unit is not known; allowed: {_ALLOWED[role]}")
    return next((unit for like, unit in _UNITS[role][1].items() if re.search(like, name, re.I)), "")


def _size(values: Floats, unit: str) -> Floats:
    with np.errstate(over="ignore", under="ignore"):
        return 10.0 ** (values / 20.0) if unit == "dB" else values


def complex_values(table: Mapping[str, Floats], units: Mapping[str, str]) -> Complexes:
    if "real" in table:
        return table["real"] + 1j * table["imaginary"]
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        made = _size(table["size"], units["size"]) * np.exp(
            1j * si_of("phase", units["phase"]) * table["phase"]
        )
    return cast("Complexes", made)


def refuse_contradiction(beside: Mapping[str, Floats], f: Floats, z: Complexes, good: Mask) -> None:
    """Refuse a response z at frequencies f, in Hz, that columns beside it tell otherwise."""
    for name, values in beside.items():
        role = next((role for role, (like, _) in _UNITS.items() if like.search(name)), "")
        other = _ERROR.search(name) or values.size != good.size
        if other or (off := _off(role, name, values[good], f, z)) is None:
            continue
        off = np.abs(off[np.isfinite(off)])
        if off.size and np.quantile(off, 0.9) > _APART:
            which = _WORDS.get(role, role)
            raise InputError(f"{shown(name)} contradicts the {which} that is read; allowed: one of them")


def _off(role: str, name: str, values: Floats, f: Floats, z: Complexes) -> Floats | None:
    """How far off a column is, over the size; ``None`` where it does not say that it is the same."""
    if role == "frequency":  # in Hz or rad/s where its name does not say so
        if _FREQUENCY_UNIT.sub("", name.lower()) not in ("f", "freq", "frequency", "omega", "w"):
            return None
        said = _said("frequency", name)
        off = [values * si_of(role, one) / f - 1.0 for one in ([said] if said else ["Hz", "rad/s"])]
        return min(off, key=lambda one: float(np.median(np.abs(one))))
    if role in ("real", "imaginary"):
        return (values - (z.real if role == "real" else z.imag)) / np.abs(z)
    if role not in ("size", "phase") or not (unit := _said(role, name)):
        return None
    if role == "size":
        return _size(values, unit) / np.abs(z) - 1.0
    return cast("Floats", np.angle(np.exp(1j * si_of(role, unit) * values) / z))


def noise_of(
    table: Mapping[str, Floats], units: Mapping[str, str], averages: int | None
) -> tuple[Floats, Floats, str]:
    """Deviation and radius over the size of each value, and where they are from."""
    if averages is not None and "coherence" not in table:
        raise InputError("averages: allowed with a column of coherence")
    if "deviation" in table:
        deviation = _deviation(table, units)
        return deviation, GAUSSIAN * deviation, "given as a standard deviation"
    coherence = table.get("coherence", np.full(table["frequency"].size, np.nan))
    n = np.broadcast_to(table.get("averages", np.nan) if averages is None else averages, coherence.shape)
    if (n < 2.0).any():
        raise InputError("averages: at least 2")
    deviation = np.sqrt((1.0 - coherence) / (coherence * (n - 1.0)))
    source = f"coherence of {n.min():g} averages{' or more' if n.min() < n.max() else ''}"
    return deviation, deviation * student(n - 1.0, CONFIDENCE), source if np.isfinite(n).all() else ""


def _deviation(table: Mapping[str, Floats], units: Mapping[str, str]) -> Floats:
    """Root mean square of the complex error over the size, from that or from one or both of its parts."""
    given = [(units[role], table[role]) for role in _DEVIATIONS if role in table]
    if not all((values >= 0.0).all() for _, values in given):
        raise InputError("a deviation below 0")
    kinds = tuple(sorted(unit for unit, _ in given))
    if kinds in (("",), ("%",)):
        return given[0][1] * si_of("", kinds[0])
    if kinds not in (("dB",), ("deg",), ("rad",), ("dB", "deg"), ("dB", "rad")):
        words = " and ".join(unit or "no unit" for unit in kinds)
        allowed = "one over the size of the value (a ratio or %), or of the gain in dB, of the phase in deg"
        raise InputError(f"deviations in {words}; allowed: {allowed}, or both")
    parts = [
        np.expm1(values * _DB) if unit == "dB" else si_of("phase", unit) * values for unit, values in given
    ]
    return np.sqrt(2.0 / len(parts) * np.sum(np.square(parts), axis=0))


def taken_as(
    columns: Mapping[str, Floats], found: Mapping[str, str], units: Mapping[str, str], *, known: bool
) -> str:
    sentences = []
    for role in sorted(found, key=lambda role: (*_ORDER, role).index(role)):
        unsaid = units[role] and not _said(role, found[role])
        unit = f" in {units[role]}{' (it says no unit)' if unsaid else ''}" if units[role] else ""
        sentences.append(f"{_WORDS.get(role, role)} {shown(found[role])}{unit}")
    left = [shown(name) for name in columns if name and name not in found.values()]
    more = f"; not read: {', '.join(left[:12])}" if left else ""
    if "coherence" in found and not known:
        more += "; the coherence tells no noise without averages (--averages N)"
    elif "coherence" in found and "deviation" in found:
        more += "; the noise is that of the deviation, not of the coherence"
    return f"read as {', '.join(sentences)}{more}"
