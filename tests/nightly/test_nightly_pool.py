"""Processes of a night: who raises, dies or hangs stops no other; killed, it goes on; the command itself."""

import json
import os
import signal
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import psutil
import pytest
from nightly_fakes import BUILD, CODE, INLINE, Calendar, Fakes, job, study, wait_for
from site_checks import check_whole

from analyses.studies.engine import Engine
from reports.nightly.cache import Cache
from reports.nightly.night import run_night
from reports.nightly.processes import Answer, Limits, Task, Warm, build_each
from reports.nightly.source import read_study
from tests.refusals import refused


def test_every_design_gets_its_own_end_and_the_page_says_why(tmp_path) -> None:
    """One night with every kind of trouble, on two worker processes."""
    raises = job("raises", mode="raise", words="gear <b>lost</b>\nin line two")
    modes = {"never ends": "hang", "is killed": "die", "leaves": "exit"}
    bad = [raises, *(job(name, mode=mode) for name, mode in modes.items()), job("fails", 5.0)]
    made = study(job("first"), *bad, *(job(f"good {k}") for k in range(4)))
    settings, seen, site = Fakes(workers=2, time_limit_s=6.0), list[tuple[int, int]](), tmp_path / "site"
    how = {"code": CODE, "clock": Calendar(), "progress": lambda *pair: seen.append(pair)}
    night = run_night(made, site, settings, **how)
    assert workers_left() == []
    (took_s,) = (d.result.seconds for d in night.designs if d.name == "never ends")
    assert 6.0 <= took_s < 15.0
    ends = {"raises": "error", "never ends": "timeout", "is killed": "crash", "leaves": "crash"}
    good = dict.fromkeys(("first", *(f"good {k}" for k in range(4))), "pass")
    assert {d.name: d.result.status for d in night.designs} == {**ends, "fails": "fail", **good}
    assert [seen[0], seen[-1]] == [(0, 10), (10, 10)]
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)
    assert not night.passed
    page = check_whole(site)
    for words in ("did not end within 6 s", "signal 9", "ValueError: gear <b>lost</b> in line two"):
        assert words in page.text
    assert 'errors="4"' in (site / "junit.xml").read_text()


def workers_left() -> list[list[str]]:
    lines = [child.cmdline() for child in psutil.Process().children()]
    return [line for line in lines if "nightly.processes" in str(line)]


def ends_of(build: str, tasks: list[Task]) -> dict[str, Answer]:
    ends: dict[str, Answer] = {}
    limits = Limits(build=build, time_limit_s=5.0, memory_bytes=10**10)
    build_each(tasks, limits, Engine(threads=2), lambda task, answer: ends.update({task.key: answer}))
    return ends


def test_a_build_that_cannot_be_imported_fails_and_a_process_goes_from_job_to_job(tmp_path) -> None:
    ends = ends_of("no_such_module:build", [Task(key=f"k{k}", payload={}) for k in range(3)])
    assert [d.status for d in ends.values()] == ["crash"] * 3
    assert all("could not start" in d.message and "no_such_module" in d.detail for d in ends.values())
    assert ends_of("no_such_module:build", []) == {}
    tasks = [Task(key=f"{k:064d}", payload=job(f"d{k}", mode="pid").payload) for k in range(6)]
    ends = ends_of(BUILD, tasks)
    assert {answer.status for answer in ends.values()} == {"done"}
    pids = {Cache(tmp_path).take(key, answer.entry).meta["pid"] for key, answer in ends.items()}
    assert 1 <= len(pids) <= 2


def test_a_process_that_died_is_replaced_and_an_interrupted_night_ends_its_jobs() -> None:
    """By the system, short of memory, say: the next job does not pay for it."""
    with closing(Warm(Limits(build=BUILD, time_limit_s=60.0, memory_bytes=10**10))) as warm:
        assert warm.build(Task(key="0" * 64, payload=job("a").payload)).status == "done"
        (waiting,) = warm._children.values()
        waiting._process.kill()
        waiting._process.wait()
        assert warm.build(Task(key="1" * 64, payload=job("b").payload)).status == "done"
    assert workers_left() == []

    # Ctrl-C beside a job that never ends: no wait for its time limit, no process left
    def interrupt(_task: Task, _answer: Answer) -> None:
        raise KeyboardInterrupt

    tasks = [Task(key=f"{k:064d}", payload=job(f"d{k}", mode=m).payload) for k, m in enumerate(["hang", ""])]
    limits = Limits(build=BUILD, time_limit_s=500.0, memory_bytes=10**10)
    with pytest.raises(KeyboardInterrupt):
        build_each(tasks, limits, Engine(threads=2), interrupt)
    assert workers_left() == []


HERE = Path(__file__).parent
PATHS = os.pathsep.join([str(HERE), *filter(None, [os.environ.get("PYTHONPATH")])])
QUIET = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "PYTHONPATH": PATHS}


WITH_WORKERS = """
import sys
from pathlib import Path
from nightly_fakes import CODE, Fakes, job, study
from reports.nightly.night import run_night
if __name__ == "__main__":
    jobs = [job(f"d{k}", log=sys.argv[2], pause=0.15) for k in range(8)] + [job("hangs", mode="hang")]
    run_night(study(*jobs), Path(sys.argv[1]), Fakes(workers=2), code=CODE)
"""


def test_a_killed_nightly_takes_its_workers_along_and_resumes(tmp_path) -> None:
    site, log, script = tmp_path / "site", tmp_path / "log", tmp_path / "night.py"
    run_night(study(job("d0", 3.0)), site, INLINE, code=CODE)
    before = (site / "index.html").read_bytes()
    script.write_text(WITH_WORKERS)
    nightly = subprocess.Popen([sys.executable, str(script), str(site), str(log)], env=QUIET)
    cache = tmp_path / "site.state" / "cache"
    wait_for(lambda: len(list(cache.glob("*/*.entry"))) >= 4)  # one of them is of the night before
    workers = psutil.Process(nightly.pid).children()
    nightly.send_signal(signal.SIGKILL)
    nightly.wait()
    assert workers
    assert psutil.wait_procs(workers, timeout=60.0)[1] == []
    assert (site / "index.html").read_bytes() == before
    check_whole(site)
    kept = len(list(cache.glob("*/*.entry"))) - 1
    jobs = [job(f"d{k}", log=str(log), pause=0.15) for k in range(8)]
    night = run_night(study(*jobs), site, INLINE, code=CODE)
    assert sum(d.result.cached for d in night.designs) == kept >= 3
    assert night.interrupted
    assert "did not end" in check_whole(site).text


STUDY = """
[study]
name = "gears"
title = "Gears"
base = "ctms-motor-position"

[[variant]]
name = "slower"
override = { "control.position.gain" = "12 V/rad" }

[[variant]]
name = "no <b>motor</b>"
override = { "motor.resistance" = "-1 ohm" }

[nightly]
tolerance = { "*phase margin*" = "0.5 deg" }
"""


def test_nights_of_real_designs_their_approval_and_a_report_as_pdf(tmp_path, cli) -> None:
    """The first one on worker processes; it names the broken variant and builds the others."""
    (tmp_path / "study.toml").write_text(STUDY)
    words = [tmp_path / "study.toml", "--site", tmp_path / "site", "--no-validation"]
    command = [Path(sys.executable).with_name("actuator-lti"), "nightly", *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 1, done.stderr
    said = " ".join(done.stdout.split())  # where a cell is wrapped depends on the length of the folder's name
    for part in ("FAIL night 1: 1 no result", "no <b>motor</b>", "motor.resistance = ", "allowed: above 0"):
        assert part in said
    summary = json.loads((tmp_path / "site" / "summary.json").read_text())
    names = {"ctms-motor-position", "slower", "no <b>motor</b>", "Comparison of all variants"}
    assert {d["name"] for d in summary["designs"]} == names
    assert summary["counts"]["broken"] == 1
    check_whole(tmp_path / "site")
    assert "(3 unchanged)" in cli.text("nightly", *words, "--workers", 1, status=1)
    cli("nightly", "approve", *words, "--by", "A. Engineer", "--reason", "review 3")
    good = [d for d in cli("nightly", *words, "--json").data["designs"] if d["state"] != "broken"]
    assert {d["approved_by"] for d in good} == {"A. Engineer"}
    # any report becomes a PDF
    report = next((tmp_path / "site" / "reports").glob("slower-*/*/report.json"))
    cli.text("pdf", report, "--out", tmp_path / "r.pdf")
    assert (tmp_path / "r.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(("table", "expected"), [
    ("nightly = 1", "nightly: must be a table"),
    ("[nightly]\npdff = true", 'nightly.pdff: unknown key; did you mean "pdf"? Allowed: pdf, tolerance'),
    ("[nightly]\npdf = 1", "nightly.pdf = 1: true or false"),
    ("[nightly]\ntolerance = 3", "nightly.tolerance: must be a table"),
    ('[nightly.tolerance]\n"*" = "much"', "a number of at least 0"),
])  # fmt: skip
def test_a_wrong_nightly_table_is_told_in_one_line(tmp_path, table: str, expected: str) -> None:
    path = tmp_path / "s.toml"
    path.write_text(f'{table}\n[study]\nbase = "emps"\n')
    refused(read_study, str(path), words=("s.toml", expected))
