"""A comparison that is stopped goes on: each finished design is kept, damaged ones are computed again."""

from pathlib import Path

import pytest

from analyses.comparison import variants
from analyses.comparison.variants import compare
from analyses.studies.study import load_study

STUDY = """
[study]
base = "ctms-motor-position"
[[sweep]]
parameter = "control.position.gain"
values = ["9 V/rad", "12 V/rad", "15 V/rad", "18 V/rad"]
[[requirement]]
id = "margin"
quantity = "gain_margin"
loop = "every"
minimum = "6 dB"
"""


@pytest.fixture
def counted(monkeypatch) -> list[str]:
    """Names of the designs that were computed; the fourth of them stops the run where asked."""
    done: list[str] = []
    whole = variants._evaluated

    def evaluated(variant, *rest):
        done.append(variant.name)
        if len(done) == 4 and "stop" in done[:1]:
            raise KeyboardInterrupt
        return whole(variant, *rest)

    monkeypatch.setattr(variants, "_evaluated", evaluated)
    return done


def test_what_was_finished_is_kept_and_what_is_damaged_or_foreign_computed_again(counted, tmp_path) -> None:
    folder, path = tmp_path / "designs", tmp_path / "study.toml"
    path.write_text(STUDY)
    study = load_study(path)
    counted.append("stop")
    with pytest.raises(KeyboardInterrupt):
        compare(study, folder=folder)
    kept = len(list(folder.rglob("*.json")))
    assert kept >= 2
    fresh, wanted = compare(study), [5 - kept, 0, 4]
    for k, count in enumerate(wanted):
        if k == 2:
            damage(sorted(folder.rglob("*.json")))
        counted.clear()
        again = compare(study, folder=folder)
        assert len(counted) == count
        assert (again.all, again.names) == (fresh.all, fresh.names)
    assert len(list(folder.rglob("*.json"))) == 5


def damage(paths: list[Path]) -> None:
    """Four of five entries."""
    assert len(paths) == 5
    paths[0].write_bytes(paths[0].read_bytes()[:-3])
    paths[1].write_text("")
    paths[2].write_bytes(paths[3].read_bytes().replace(b'"figures"', b'"figure"', 1))
    paths[4].write_bytes(b"\xff" * 10)
