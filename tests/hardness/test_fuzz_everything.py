"""A minute of the attack, the same inputs every time; ``make fuzz`` goes on for as long as one likes."""

from __future__ import annotations

import random

import pytest
from fuzz import attack
from mutate import damaged, damaged_tree, extreme
from targets import Target, targets

SEED = 18
INPUTS = {"command": 12, "history": 100, "study": 100}  # by the first word of a target's name
LINES = 100  # of the target "command line"
USUAL = 400


@pytest.mark.parametrize("target", targets(), ids=lambda target: target.name.replace(" ", "-"))
def test_the_inputs_that_are_damaged_are_good(target: Target, tmp_path) -> None:
    for k, seed in enumerate(target.seeds):
        path = tmp_path / f"{k}{target.suffix}"
        path.write_bytes(seed)
        target.attack(path)


@pytest.mark.parametrize("target", targets(), ids=lambda target: target.name.replace(" ", "-"))
def test_whatever_a_file_holds_it_is_taken_or_refused_in_one_line(target: Target) -> None:
    count = LINES if target.name == "command line" else INPUTS.get(target.name.partition(" ")[0], USUAL)
    finds = [find for number in range(count) if (find := attack(target, SEED, number)) is not None]
    assert finds == []


def test_the_attack_sees_what_it_looks_for() -> None:
    def careless(path) -> None:
        if b"5" not in path.read_bytes():
            raise KeyError("five")

    find = attack(Target("careless", (b"5",), careless), SEED, 3)
    assert find is None or find.what.startswith("KeyError")
    assert any(attack(Target("careless", (b"5",), careless), SEED, k) for k in range(30))


def test_damage_is_damage_and_comes_again() -> None:
    data = b'[motor]\nresistance = "55 mohm"\nratio = 66\n' * 5
    for fault in (damaged, extreme):
        made = [fault(data, random.Random(k)) for k in range(60)]
        assert made == [fault(data, random.Random(k)) for k in range(60)]
        assert len(set(made)) > 20
    tree = {"a": [1, {"b": "c"}], "d": None}
    trees = [damaged_tree(tree, random.Random(k)) for k in range(60)]
    assert tree == {"a": [1, {"b": "c"}], "d": None}
    assert sum(one != tree for one in trees) > 50
