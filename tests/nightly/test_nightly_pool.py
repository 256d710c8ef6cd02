"""Worker processes: one design that raises, dies or never ends does not stop the others."""

from pathlib import Path

import pytest
from nightly_fakes import BUILD, CODE, Calendar, job, study
from site_checks import check_whole

from analyses.studies.engine import Engine
from reports.nightly.apart import Done, Limits, Task, build_each
from reports.nightly.cache import Cache
from reports.nightly.night import Settings, run_night


@pytest.fixture(scope="module")
def troubled(tmp_path_factory):
    """One night with every kind of trouble, on two worker processes."""
    site = tmp_path_factory.mktemp("pool") / "site"
    jobs = [
        job("first"),
        job("raises", mode="raise", words="gear <b>lost</b>\nin line two"),
        job("never ends", mode="hang"),
        job("is killed", mode="die"),
        job("leaves", mode="exit"),
        job("fails", 5.0),
        *(job(f"good {k}") for k in range(4)),
    ]
    settings = Settings(workers=2, time_limit_s=6.0, build=BUILD)
    seen: list[tuple[int, int]] = []
    clock = Calendar()
    night = run_night(
        study(*jobs), site, settings, code=CODE, clock=clock, progress=lambda *pair: seen.append(pair)
    )
    return site, night, seen


def test_every_design_gets_its_own_end(troubled) -> None:
    _, night, _ = troubled
    ends = {d.name: d.result.status for d in night.designs}
    assert ends.pop("raises") == "error"
    assert ends.pop("never ends") == "timeout"
    assert ends.pop("is killed") == "crash"
    assert ends.pop("leaves") == "crash"
    assert ends.pop("fails") == "fail"
    assert set(ends.values()) == {"pass"}
    assert len(ends) == 5


def test_the_page_and_the_exit_status_name_who_failed_and_why(troubled) -> None:
    site, night, _ = troubled
    assert night.exit_status == 1
    page = check_whole(site)
    assert "did not end within 6 s" in page.text
    assert "signal 9" in page.text
    assert "ValueError: gear <b>lost</b> in line two" in page.text
    junit = (site / "junit.xml").read_text()
    assert 'errors="4"' in junit


def test_progress_counts_to_the_end(troubled) -> None:
    _, _, seen = troubled
    assert seen[0] == (0, 10)
    assert seen[-1] == (10, 10)
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)


def workers_left() -> list[list[str]]:
    import psutil

    lines = [child.cmdline() for child in psutil.Process().children()]
    return [line for line in lines if "nightly.worker" in str(line)]


def test_no_worker_stays_behind(troubled) -> None:
    assert workers_left() == []


def ends_of(build: str, tasks: list[Task], folder: Path) -> list[Done]:
    ends: list[Done] = []
    limits = Limits(build=build, time_limit_s=5.0, memory_bytes=10**10)
    build_each(tasks, limits, Engine(threads=2), Cache(folder), ends.append)
    return ends


def test_a_build_that_cannot_be_imported_fails_every_task_and_ends(tmp_path) -> None:
    ends = ends_of("no_such_module:build", [Task(key=f"k{k}", payload={}) for k in range(3)], tmp_path)
    assert [d.status for d in ends] == ["crash"] * 3
    assert all("could not start" in d.message and "no_such_module" in d.detail for d in ends)


def test_nothing_to_do_starts_no_process(tmp_path) -> None:
    assert ends_of("no_such_module:build", [], tmp_path) == []


def test_a_process_goes_from_job_to_job(tmp_path) -> None:
    tasks = [Task(key=f"{k:064d}", payload=job(f"d{k}", mode="pid").payload) for k in range(6)]
    assert {d.status for d in ends_of(BUILD, tasks, tmp_path)} == {"done"}
    entries = [Cache(tmp_path).read(task.key) for task in tasks]
    assert 1 <= len({entry.meta["pid"] for entry in entries if entry is not None}) <= 2


def test_a_process_that_died_while_it_waited_is_replaced(tmp_path) -> None:
    """By the system, short of memory, say: the next job does not pay for it."""
    from reports.nightly.apart import _Warm

    warm = _Warm(Limits(build=BUILD, time_limit_s=60.0, memory_bytes=10**10))
    try:
        first, _ = warm.build(Task(key="0" * 64, payload=job("a", mode="pid").payload))
        (waiting,) = warm._idle
        waiting._process.kill()
        waiting._process.wait()
        second, _ = warm.build(Task(key="1" * 64, payload=job("b", mode="pid").payload))
    finally:
        warm.close()
    assert (first.status, second.status) == ("done", "done")
    assert workers_left() == []


def test_an_interrupted_night_ends_the_jobs_under_way(tmp_path) -> None:
    """Ctrl-C beside a job that never ends: no wait for its time limit, no process left."""

    def interrupt(_done: Done) -> None:
        raise KeyboardInterrupt

    tasks = [Task(key=f"{k:064d}", payload=job(f"d{k}", mode=m).payload) for k, m in enumerate(["hang", ""])]
    limits = Limits(build=BUILD, time_limit_s=500.0, memory_bytes=10**10)
    with pytest.raises(KeyboardInterrupt):
        build_each(tasks, limits, Engine(threads=2), Cache(tmp_path), interrupt)
    assert workers_left() == []
