"""How data sheets write numbers and units: each spelling becomes a number and a product of names."""

import re
from functools import lru_cache
from math import isfinite, nan

from actuator_lti.files.reading import shown

_NUMBER = re.compile(r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)\s*(.*)\Z", re.DOTALL)
_NOT_FINITE = re.compile(r"\s*[+-]?(?:nan|inf(?:inity)?)\b", re.IGNORECASE)
_THOUSANDS = re.compile(r"\s*[+-]?[1-9][0-9]{0,2},[0-9]{3}(?![0-9])")
_MILLIONS = re.compile(r"\s*[+-]?[1-9][0-9]{0,2}(?:(?:,[0-9]{3}){2,}(?![0-9,])|,[0-9]{3}\.)")
_COMMA = re.compile(r"\s*[+-]?[0-9]*,[0-9]")
_SIGNS = str.maketrans(
    {"·": "*", "⋅": "*", "×": "*", "μ": "µ", "\N{OHM SIGN}": "Ω", "′": "'", "″": '"', "−": "-", "–": "-",
     "\N{MASCULINE ORDINAL INDICATOR}": "°", "\N{RING ABOVE}": "°"}
)  # fmt: skip
_POWER = re.compile(r"[-⁻]?[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+")  # min⁻¹
_GROUPS = re.compile(r"\s*[+-]?[1-9][0-9]{0,2}(?:[ \u00a0\u2009\u202f][0-9]{3})+(?![0-9/])")  # 10 600
# How data sheets write what is not a product of names: each becomes one, in this order.
_SPELLINGS = (
    (re.compile(r"\*\*"), "^"),
    (re.compile(r"\bKg"), "kg"),
    (re.compile(r"\bAmp(s?)\b"), r"amp\1"),
    (re.compile(r"^/"), "1/"),  # 25/s
    (re.compile(r"(?i)\(?\b(l|line|ph(?:ase)?)(?:[- ]+|[- ]*to[- ]*)\1\b\)?"), "line_line"),
    (re.compile(r"°C|℃|\bdeg(?:rees?)? ?C\b"), " degC"),
    (re.compile(r"\barc[- ](?=min|sec)"), "arc"),
    (re.compile(r"\bK(?:RPM|rpm)\b"), "krpm"),
    (re.compile(r"°K\b"), " K"),
    (re.compile(r"°"), " deg"),
    (re.compile(r"%|\bpct\b"), " percent"),
    (re.compile(r"\bper\b"), "/"),
    (re.compile(r"\br\.p\.m\.?"), "rpm"),
    (re.compile(r"''|\""), " arcsec"),
    (re.compile(r"'"), " arcmin"),
    (re.compile(r"(?<=[AV]) ?_?(?:DC|dc)\b"), ""),  # of the motor that the model has: direct
    (re.compile(r"(?<=[A-Za-z])\^?-([123])\b"), r"^-\1"),  # min-1
    (re.compile(r"\bkmin\^-1\b"), "(1000*min^-1)"),
    (re.compile(r"(?<=V)min\b"), "*min"),  # mVmin
    (re.compile(r"(?<=[A-Za-z])([23])(?![0-9])"), r"^\1"),  # cm2
    (re.compile(r"(?<=[A-Za-z23])[-.](?=[A-Za-z])"), "*"),  # oz-in, g.cm2
    (re.compile(r"\b(?:r|U|tr|rev)/min\b"), "rpm"),
    (re.compile(r"/ *rps\b(?!\^)"), "/(rev/s)"),
    (re.compile(r"\brps\b"), "rev/s"),
    (re.compile(r"/ *\(? *1000 *(rpm|1/min|min\^-1)\b *\)?"), r"/(1000*(\1))"),
    (re.compile(r"\b(k?g)([cm]?m\^2)"), r"\1*\2"),  # gcm2
)
_POWER_OF_TEN = re.compile(r"(?<=[0-9.])\s*(?:[x×·*]|(?<=\s)\.)\s*10\s*(?:\^|(?=[+-]))\s*([+-]?[0-9]{1,3})\b")
# A column's power of ten, before or behind its unit: "1.18 (10^-4 kg m2)", "0.1 kg-m2 x 10^-3", "7 kgm2*1e-7"
_COLUMN = (
    (re.compile(r"\A(\s*[+-]?[0-9.]+)\s*([^0-9\s].*?)\s*[x×·*]\s*1[eE]([+-]?[0-9]{1,2})\s*\Z"), r"\1e\3 \2"),
    (re.compile(r"\A(\s*[+-]?[0-9.]+)\s+\(?\s*[x×]?\s*10\^([+-]?[0-9]{1,2})\s+(.*?)\)?\s*\Z"), r"\1e\2 \3"),
    (
        re.compile(r"\A(\s*[+-]?[0-9.]+)\s*([^0-9\s].*?)[\sx×·*]+10(?:\^|(?=[+-]))([+-]?[0-9]{1,2})\s*\Z"),
        r"\1e\3 \2",
    ),
)
_TEN = re.compile(r"(?<![0-9])10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)")
_BOUND = re.compile(r"\s*(±|\+/-|[≤≥<>~≈]=?|max\.?|typ\.?|ca\.?|approx\.?)\s*(?=[0-9.])", re.IGNORECASE)
_SPREAD = re.compile(r"\s*((?:±|\+/-).*|\(?(?:max|typ|nom)\b\.?\)?)\s*\Z", re.IGNORECASE)
_EXPONENT = re.compile(r"(?<=[0-9.])\s+([eE][+-]?[0-9]+)\b")  # 5.0 E-6
_TWO = re.compile(r"\s*([0-9.]+)\s*(?:±|\+/-)\s*([0-9]+\.?[0-9]*)\s*([^\s0-9%].*?)\s*\Z")
_BRACKETED = re.compile(r"\A\s*\(([^()]*(?:±|\+/-)[^()]*)\)")  # (20 ± 1) mm
_AT = re.compile(r"\s*(@\s*[-+]?[0-9.]+ ?(?:°|deg)?\s*[CK]?)\s*\Z")
_RANGE = re.compile(r"\s*[+-]?[0-9.]*[0-9] *(?:[-–…]|\.{2,3}|to\b) *[0-9]")
_SECOND = re.compile(r"(?<![\w^.-])(?!1(?:000)?(?![0-9.]))[0-9]")
_RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_OVER = re.compile(r"\s*([0-9]+\.?[0-9]*)\s*([/:]|to\b)\s*([0-9]+\.?[0-9]*)\s*\Z")
_BITS = re.compile(r"\s*(?:([0-9]{1,2})[ -]?[Bb]its?|2\^([0-9]{1,2}))\s*\Z")  # of an encoder
_SYMBOL = re.compile(r"\A\s*(?:[A-Za-z]\w{0,3}\s*=|K[Vv]\b)\s*(?=[+-]?[0-9.])")  # i = 8, KV 100 rpm/V
LONGEST = 120  # characters of a quantity


def tidy(unit: str) -> str:
    text = _POWER.sub(lambda found: f"^{found[0].translate(_RAISED)}", unit.strip().translate(_SIGNS))
    for spelling, product in _SPELLINGS:
        text = spelling.sub(product, text)
    return text.rstrip()


def _alone(text: str) -> str:
    """A number in one power of ten and its unit; what a sheet says of its bounds is refused."""
    text = _BRACKETED.sub(r"\1 ", text)
    for aside, find in ((_BOUND, _BOUND.match), (_AT, _AT.search), (_SPREAD, _SPREAD.search)):
        if found := find(text):
            plain = f"{text[: found.start()]}{text[found.end() :]}".strip()
            keys = "temperature.reference" if aside is _AT else "tolerance"
            if two := _TWO.fullmatch(text):  # a number, its tolerance, and the unit of both
                plain, value = f"{two[1]} {two[3]}", float(two[1])
                keys += f' = "{100.0 * float(two[2]) / value:.4g} %"' if value else ""
            raise ValueError(f"write {shown(plain)}; {shown(found[1])} is one for {keys} or source")
    text = _TEN.sub(lambda found: f"10^{found[1].translate(_RAISED)}", text)
    for column, product in _COLUMN:
        text = column.sub(product, text)
    return text


@lru_cache(maxsize=1024)
def split_quantity(text: str) -> tuple[float, str]:
    """Number and unit of a written quantity; ``43:1``, ``i = 8`` and ``17 bit`` are numbers without one."""
    if len(text) > LONGEST:
        raise ValueError("a number and a unit are wanted")
    text = _SYMBOL.sub("", text)
    if bits := _BITS.match(text):
        return 2.0 ** int(bits[1] or bits[2]), ""
    if over := _OVER.match(text):
        above, below = float(over[1]), float(over[3])
        if over[2] != "/" and above < below:
            raise ValueError(f'a reduction is written "{over[3]}:{over[1]}"')
        return above / below if below else nan, ""
    text = _EXPONENT.sub(r"\1", _alone(text.replace("−", "-")))
    if grouped := _GROUPS.match(text):
        text = "".join(grouped[0].split()) + text[grouped.end() :]
    text = _POWER_OF_TEN.sub(r"e\1", text.translate(_RAISED) if "10" in text else text)
    match = _NUMBER.match(text)
    if match is None:
        raise ValueError("must be finite" if _NOT_FINITE.match(text) else "a number and a unit are wanted")
    if millions := _MILLIONS.match(text):
        plain = millions[0].replace(",", "") + text[millions.end() :]
        raise ValueError(f"commas; write {shown(plain)}")
    if _THOUSANDS.match(text):
        whole, part = (shown(text.replace(",", sign, 1)) for sign in ("", "."))
        raise ValueError(f"a comma; write {whole} or {part}")
    if _COMMA.match(text):
        raise ValueError(f"a decimal comma; use a decimal point: {shown(text.replace(',', '.', 1))}")
    if _RANGE.match(text):
        raise ValueError("a range; write one number")
    if _SECOND.search(match[2]):
        raise ValueError(f"{shown(match[2])} is not a unit, it has a number in it; write one number")
    number = float(match[1])
    if not isfinite(number):
        raise ValueError("must be finite")
    return number, match[2].strip()
