"""The scripts of a page: modules by room in ``templates/page``, put together into the one that it carries.

A page runs from disk and asks for nothing, so it cannot load modules. Each becomes a function here that gives
what it exports, in the order of the imports, which go one way. A module says these in two forms only:
``import { a, b } from "./name.js";`` and ``export const`` or ``export class``.
"""

import re
from functools import cache
from pathlib import Path

IMPORT = re.compile(r'^import \{ ([\w, ]+) \} from "\./(\w+)\.js";\n', re.MULTILINE)
ASIDE = re.compile(r"^[ \t]+|^//[^\n]*\n", re.MULTILINE)  # what a page does not need: indents, remarks
GIVEN = re.compile(r"export\{([^}]*)\};\n?$")  # what a library put together by others says at its end
EXPORT = re.compile(r"^export (const|class) (\w+)", re.MULTILINE)


@cache
def asset(name: str) -> str:
    """Give the text of a style sheet or script that stands beside the templates."""
    return (Path(__file__).parent / "templates" / name).read_text(encoding="utf-8")


@cache
def bundled(*entries: str) -> str:
    """Give one script of some modules and all that they import, each once."""
    made: dict[str, str] = {}
    for entry in entries:
        _take(entry, made, ())
    return f'"use strict";\n(() => {{\n{"".join(made.values())}}})();\n'


def _take(name: str, made: dict[str, str], above: tuple[str, ...]) -> None:
    if name in above:
        raise ValueError(f"scripts import each other: {' -> '.join([*above, name])}")
    if name in made:
        return
    text = asset(f"page/{name}.js")
    wanted = IMPORT.findall(text)
    for _, other in wanted:
        _take(other, made, (*above, name))
    taken = "".join(f"const {{ {names} }} = {other}$;\n" for names, other in wanted)
    given = ", ".join(own for _, own in EXPORT.findall(text))
    if library := GIVEN.search(text):
        given = re.sub(r"([\w$]+) as (\w+)", r"\2: \1", library[1])
    body = ASIDE.sub("", GIVEN.sub("", EXPORT.sub(r"\1 \2", IMPORT.sub("", text))))
    made[name] = f"const {name}$ = (() => {{\n{taken}{body}return {{ {given} }};\n}})();\n"
