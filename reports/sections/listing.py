"""A result that is one list or more: its sentence, and tables headed as the fields of a row state."""

from functools import partial
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from reports import document as doc


def section(result: Any) -> doc.Section:
    listed = [value for value in vars(result).values() if isinstance(value, tuple) and value]
    blocks = []
    for rows in listed:
        hints = get_type_hints(type(rows[0]), include_extras=True).items()
        headed = {name: get_args(hint)[1] for name, hint in hints if get_origin(hint) is Annotated}
        columns = [doc.of(partial(_text, name), name, heading) for name, heading in headed.items()]
        blocks += [doc.listing("", rows, columns)] if columns else []
    return doc.section("list", "List", blocks, result=str(result))


def _text(name: str, row: Any) -> Any:
    value = getattr(row, name)
    return ", ".join(value) if isinstance(value, tuple) else value
