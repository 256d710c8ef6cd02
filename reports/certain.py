"""The digits of a document that are certain: the same on every machine, whatever adds up its sums.

Linear algebra libraries add in an order that depends on the processor and the number of threads; results then
differ by some 1e-14, and where a curve is flat the place of its maximum by the root of that. What a document
holds is rounded well above. Two results on either side of a rounding border still differ: for one number in
about a million, which no rounding can help.
"""

from typing import Any

DIGITS = 8
FLAT_DIGITS = 5  # of the frequency of a maximum
DECIMALS = 9  # of an angle or a level, which are differences of large ones
ZERO = 1e-12  # smaller is rounding of zero, in any unit that a report is written in
OF_LARGEST = 1e-12  # of a curve
_DIFFERENCES = ("deg", "db", "%")
_MAXIMA = ("resonance", "peak")
_PLACES = ("hz", "frequency", "rad/s")


def certain(value: Any, name: str = "") -> Any:
    """Round every number of plain data to what is certain.

    ``name``: keys (and unit of the column) that it stands under, which tell differences and places of maxima.

    >>> certain({"a": 0.1 + 0.2, "resonance_hz": 21.297262360815797, "curve": [1.0, 2.2e-16]})
    {'a': 0.3, 'resonance_hz': 21.297, 'curve': [1.0, 0.0]}
    >>> certain([3, True, None, "x", 1.7e-13]), certain({"phase_deg": 4.9201075519e-07})
    ([3, True, None, 'x', 0.0], {'phase_deg': 4.92e-07})
    """
    if isinstance(value, float):
        return _number(value, name.lower())
    if isinstance(value, dict):
        if value.get("kind") == "table":
            units = {column["key"]: column["unit"] for column in value["columns"]}
            names = {key: f"{key} {units.get(key, '')}".strip() for row in value["rows"] for key in row}
            rows = [{key: certain(cell, names[key]) for key, cell in row.items()} for row in value["rows"]]
            return {**value, "rows": rows}
        return {key: certain(item, f"{name} {key}") for key, item in value.items()}
    if isinstance(value, list):
        floor = OF_LARGEST * max((abs(x) for x in value if isinstance(x, float)), default=0.0)
        return [0.0 if isinstance(x, float) and abs(x) <= floor else certain(x, name) for x in value]
    return value


def _number(value: float, name: str) -> float:
    if name.endswith(_DIFFERENCES):
        value = round(value, DECIMALS)
    flat = name.endswith(_PLACES) and any(word in name for word in _MAXIMA)
    return 0.0 if abs(value) < ZERO else float(f"{value:.{FLAT_DIGITS if flat else DIGITS}g}")
