"""Statements from keys to a row, in C, run as Python."""

import math
import re
from collections.abc import Sequence
from typing import Any

_KNOWN: dict[str, Any] = {
    **vars(math), "INFINITY": math.inf, "NAN": math.nan, "fabs": abs, "pow": pow,
    "where": lambda condition, yes, no: yes if condition else no,
}  # fmt: skip


def executed(lines: Sequence[str], keys: Sequence[float]) -> dict[int, float] | None:
    """What the statements store, by its place; None where a condition ends them."""
    stored: dict[int, float] = {}
    scope = {**_KNOWN, "k": keys}
    for line in lines:
        text = line.replace("&&", "and").replace("||", "or")
        if made := re.fullmatch(r"const double (v\d+) = (.*);", text):
            scope[made[1]] = eval(made[2], scope)
        elif kept := re.fullmatch(r"p\[(\d+)\] = (.*);", text):
            stored[int(kept[1])] = float(eval(kept[2], scope))
        else:
            condition = re.fullmatch(r"if \((!?)\((.*)\)\) \{ return 0; \}", text)
            assert condition is not None, line
            if bool(eval(condition[2], scope)) is (condition[1] == ""):
                return None
    return stored
