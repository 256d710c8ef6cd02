"""The same bytes again, whatever kernel and threads; a comparison that is stopped goes on."""

import ast
import os
import platform
import subprocess
import sys
from pathlib import Path

import pytest

from analyses.comparison import variants
from analyses.comparison.variants import compare
from analyses.studies.study import load_study
from reports.arithmetic import same_order
from reports.certain import certain
from tests.machines.machine_kinds import kernels
from tests.reports.test_cli import PLOTTING

DOCUMENT = """
import sys
from actuator_lti.design import load_design
from reports.build import design_report
from reports.document import dumps
sys.stdout.write(dumps(design_report(load_design("ilr33-amber"))))
"""


REPORT = """
import sys
from reports.cli.main import main
status = main()
print(*sys.modules)
sys.exit(status)
"""


def ran(*words: str, kept: tuple[str, ...] = tuple(os.environ), **environment: str) -> bytes:
    """What Python says with these words, in an environment that keeps some of ours."""
    given = {**{name: os.environ[name] for name in kept}, **environment}
    done = subprocess.run([sys.executable, *words], capture_output=True, env=given, check=False, timeout=3000)
    assert done.returncode in (0, "report" in words), done.stderr
    return done.stdout


@pytest.mark.skipif(platform.machine() != "x86_64", reason="names of kernels of one family of processors")
def test_the_document_does_not_depend_on_kernel_and_threads() -> None:
    made = [
        ran("-c", DOCUMENT, SOURCE_DATE_EPOCH="0", OPENBLAS_CORETYPE=core, OPENBLAS_NUM_THREADS=threads)
        for core, threads in zip(kernels(), "121", strict=True)
    ]
    assert len(made[0]) > 100_000
    assert made[0] == made[1] == made[2]


@pytest.mark.parametrize("name", ["fin", "emps"])
def test_a_report_with_its_validation_has_the_same_bytes_twice(name: str, tmp_path) -> None:
    """Page and JSON, by two processes whose sets and dictionaries are ordered by other hashes.

    Neither waits for a library that it does not use.
    """
    made = []
    for seed in ("1", "2"):
        words = ("-c", REPORT, "report", name, "--quiet", "--out", str(tmp_path / seed))
        said = ran(*words, SOURCE_DATE_EPOCH="1700000000", PYTHONHASHSEED=seed).decode()
        unused = PLOTTING - {"jinja2", "scipy.optimize"}  # a page takes templates and a search
        assert not unused & set(said.splitlines()[-1].split())
        made.append([(tmp_path / seed / file).read_bytes() for file in ("report.html", "report.json")])
    assert made[0] == made[1]
    assert b"Predictions against simulation" in made[0][0]


NOT_SIMULATED = """
from actuator_lti.design import load_design
from analyses.identification.bench import Settings, identify_bench
from tests.identification.bench_records import motion, record_of, signals_of
seen = signals_of(motion(1), 1)
record = record_of(seen["time"], **{name: seen[name] for name in ("reference", "angle", "current")})
print(identify_bench(load_design("joint"), [record], settings=Settings(gravity=True)).records[0].between)
"""


def test_how_a_command_was_taken_does_not_depend_on_hashes() -> None:
    """Of a drive that cannot be simulated no way meets its record better: the first of a set was told."""
    told = {ran("-c", NOT_SIMULATED, PYTHONHASHSEED=seed).decode().strip() for seed in "03"}
    assert told == {"smooth but for its steps between samples"}


def test_rounding_keeps_what_is_certain_and_nothing_else() -> None:
    assert {certain((1.0 + ulp) / 3.0) for ulp in (0.0, 4e-15, -4e-15)} == {0.33333333}
    assert certain(9.2e-7) == 9.2e-7
    peak = {"frequency_hz": 63.771488913938995, "x_db": 1.4740612903870745, "y_deg": 4.92010755e-7}
    kept = {"frequency_hz": 63.771, "x_db": 1.4740613, "y_deg": 4.92e-07}
    assert certain({"s_peak": peak}) == {"s_peak": kept}
    assert certain([40.0, -1.9e-15, None, "a", 7]) == [40.0, 0.0, None, "a", 7]
    columns, rows = [{"key": "a", "unit": "deg"}], [{"a": 4.9201e-7, "b": 4.9201e-7}]
    rounded = certain({"kind": "table", "columns": columns, "rows": rows})["rows"]
    assert rounded == [{"a": 4.92e-7, "b": 4.9201e-7}]
    assert certain(-0.0) == 0.0
    assert str(certain([-1e-17])) == "[0.0]"


ASKED = """
import os, sys
from reports.cli.main import main
{before}
assert main(["--version"]) == 0
import numpy
sys.stdout.write("|" + repr({{name: os.environ.get(name) for name in {names}}}))
"""


def settings_of_a_process(before: str, **environment: str) -> dict[str, str | None]:
    """What linear algebra was told in a process that runs a command."""
    names = (*same_order(), "OPENBLAS_CORETYPE")
    kept = tuple(name for name in os.environ if name not in names)
    said = ran("-c", ASKED.format(before=before, names=names), kept=kept, **environment)
    return ast.literal_eval(said.decode().partition("|")[2])


def test_the_command_line_fixes_the_order_at_its_start_unless_told_otherwise() -> None:
    usual = {"OPENBLAS_CORETYPE": None} | same_order()
    assert settings_of_a_process("") == usual
    two = {"OPENBLAS_NUM_THREADS": "2"}
    assert settings_of_a_process("", **two) == usual | two
    # one that adds up already changes nothing: those that it starts would have other numbers than its own
    assert set(settings_of_a_process("import numpy").values()) == {None}
    assert all(os.environ.get(name) for name in same_order())


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
