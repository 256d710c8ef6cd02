"""Which arguments an annotation allows."""

from __future__ import annotations

import ast
import builtins
import sys
from collections.abc import Callable, Collection, Hashable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache, partial
from importlib import import_module
from inspect import getsource, signature
from numbers import Integral
from os import PathLike
from types import NoneType, SimpleNamespace, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints, is_typeddict

from actuator_lti.errors import CHECKED, InputError, shown

Kind = tuple[str, Callable[[Any], bool]]  # words for what is allowed, and whether it is that


def refuse_others(made: Callable[..., Any], given: Iterable[tuple[str, Any]]) -> None:
    """Refuse the first argument, of names and values, that is none of what its annotation says."""
    kinds = _kinds(made)
    for name, value in given:
        words, holds = kinds.get(name, ANYTHING)
        if not holds(value):
            raise InputError(f"{name} = {shown(value)}: must be {words}")


class _Names(dict[str, Any]):
    """Names of a module, and those that it imports for type checkers only."""

    def __missing__(self, name: str) -> Any:
        if hasattr(builtins, name):
            return getattr(builtins, name)
        with suppress(OSError):  # without a source
            for line in ast.walk(ast.parse(getsource(sys.modules[self["__name__"]]))):
                if isinstance(line, ast.ImportFrom) and name in [each.name for each in line.names]:
                    return getattr(import_module(str(line.module)), name)
        return Any


@cache
def _kinds(made: Callable[..., Any]) -> dict[str, Kind]:
    asked = {name: hint for name, hint in made.__annotations__.items() if name != "return"}
    held = SimpleNamespace(__annotations__=asked)
    hints = get_type_hints(held, localns=_Names(made.__globals__), include_extras=True)
    return {name: _kind(hint) for name, hint in hints.items()}


def _kind(hint: Any) -> Kind:
    """What a hint allows; anything where others tell more of it.

    Who opens it does of what has a name or path as well, its own check of what is `CHECKED`.
    """
    origin, inside = get_origin(hint) or hint, get_args(hint)
    if origin is Annotated:
        return ANYTHING if inside[1] is CHECKED else _kind(inside[0])
    if origin is Literal:
        words = f"one of {', '.join(map(str, inside))}"
        return words, lambda given: isinstance(given, Hashable) and given in inside
    if origin is Callable and inside and isinstance(inside[0], list):
        return f"a function of {len(inside[0])} arguments", lambda given: _takes(given, len(inside[0]))
    if origin in (Union, UnionType):
        others = {get_origin(one) or one for one in inside} - {str, NoneType}
        each = list(map(_kind, inside))
        words = " or ".join(words for words, _ in each)
        known = PathLike in others and len(others) > 1
        return ANYTHING if known else (words, lambda given: any(holds(given) for _, holds in each))
    if origin in (tuple, list, Sequence, Collection, Iterable) and inside:
        return _several(origin, [_kind(one) for one in inside if one is not Ellipsis])
    return _PLAIN.get(origin) or _instance(origin)


def _several(series: Any, kinds: Sequence[Kind]) -> Kind:
    """A series of one kind or, where each has a kind of its own, of so many."""
    each = " or ".join(dict.fromkeys(words for words, _ in kinds))
    if len(kinds) > 1:
        return f"{len(kinds)}, each {each}", partial(_so_many, kinds)
    words = "several" if kinds[0] is ANYTHING else f"several, each {each}"
    return words, partial(_all, kinds[0][1], once=series is Iterable)


def _so_many(kinds: Sequence[Kind], given: Any) -> bool:
    if not _listed(given) or len(given) != len(kinds):
        return False
    return all(holds(one) for (_, holds), one in zip(kinds, given, strict=True))


def _all(holds: Callable[[Any], bool], given: Any, *, once: bool) -> bool:
    """Of what may be asked ``once`` only nothing is taken away; a range, of 1e9 too, is of one kind."""
    given = given[:1] if isinstance(given, range) else given
    return all(map(holds, given)) if _listed(given) else once and isinstance(given, Iterator)


def _listed(given: Any) -> bool:
    return isinstance(given, Collection) and not isinstance(given, str | bytes | Mapping)


def _instance(kind: Any) -> Kind:
    if not isinstance(kind, type) or getattr(kind, "_is_protocol", False):
        return ANYTHING
    if kind.__name__ == "ndarray":
        return "numbers", _is_numbers
    if is_typeddict(kind) or issubclass(kind, Mapping):
        return "a dict", lambda given: isinstance(given, Mapping)
    of = PathLike if issubclass(kind, PathLike) else kind
    return f"a {kind.__name__}, from {kind.__module__}", lambda given: isinstance(given, of)


def _takes(given: Any, count: int) -> bool:
    try:
        signature(given).bind(*range(count))
    except TypeError:  # not callable, or otherwise
        return False
    except ValueError:  # of a function that does not say
        return True
    return True


def _is_number(given: Any) -> bool:
    try:
        return not isinstance(given, str | bytes | bool) and float(given) == float(given)
    except (TypeError, ValueError, OverflowError):
        return False


def _is_numbers(given: Any) -> bool:
    import numpy as np

    with suppress(ValueError):  # rows of several lengths
        return np.asarray(given).dtype.kind in "biufc"
    return False


ANYTHING: Kind = "anything", lambda given: True
_PLAIN: dict[Any, Kind] = {
    float: ("a number, in SI", _is_number),
    int: ("a whole number", lambda given: isinstance(given, Integral)),
    bool: ("True or False", lambda given: isinstance(given, Hashable) and given in (True, False)),
    str: ("text", lambda given: isinstance(given, str)),
    NoneType: ("None", lambda given: given is None),
    Callable: ("a function", callable),
    Any: ANYTHING,
}
