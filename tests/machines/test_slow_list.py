"""The list of slow tests names tests that are there."""

from pathlib import Path

HERE = Path(__file__).parents[1]


def test_every_slow_test_is_there() -> None:
    lines = [line for line in (HERE / "slow.txt").read_text(encoding="utf-8").splitlines() if line[:1] != "#"]
    assert lines == sorted(set(lines))
    for line in lines:
        file, _, name = line.partition("::")
        assert f"def {name}(" in (HERE.parent / file).read_text(encoding="utf-8") or not name, line
