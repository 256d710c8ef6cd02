"""The field's words in names and in what users read; the words that they replaced stay away."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LEFT = {  # our word: the field's
    "foreseen": "predicted", "unforeseen": "unexpected", "told": "determined, reason",
    "border": "stability limit", "borders": "linear limit", "confirmation": "result",
    "rig": "test set-up", "ledger": "predictions",
    "sound": "is_stable", "alike": "equal", "course": "response", "woven": "inlined", "face": "realisation",
}  # fmt: skip
SENTENCES = re.compile(
    r"\b(foreseen|ulp of the entries|on the border|load moment|held loop|bias motion|for ever"
    r"|steps of the drive as it is|value to measure the fall from)\b"
)
ROOMS = ("actuator_lti", "nonlinear", "analyses", "reports")


def parts(name: str) -> set[str]:
    """Words of a name: `LimitCycle` and `limit_cycle`."""
    return {part.lower() for part in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)}


def names(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        for field in ("id", "attr", "arg", "name"):
            if isinstance(name := getattr(node, field, None), str):
                yield name


def sentences(tree: ast.Module) -> Iterator[str]:
    """All texts but docstrings."""
    said = {
        id(node.value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in said:
            yield node.value


def test_names_and_sentences_have_the_field_s_words() -> None:
    found = {}
    for path in (path for room in ROOMS for path in (ROOT / room).rglob("*.py")):
        tree = ast.parse(path.read_text())
        ours = {name: LEFT[part] for name in names(tree) for part in parts(name) & LEFT.keys()}
        found[path] = [*ours.items(), *(text for text in sentences(tree) if SENTENCES.search(text))]
    assert len(found) > 400
    assert not {path: ours for path, ours in found.items() if ours}
