"""Dask without an open door: this machine only, TLS with certificates of the run, no page to look at."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import ssl
import warnings
from pathlib import Path

import pytest
from nightly_fakes import BUILD, CODE, job, study

from actuator_lti.errors import InputError, NumericalError
from analyses import engine
from analyses.engine import Engine
from reports.nightly.cache import Cache, CorruptEntry
from reports.nightly.night import Settings, run_night


def doubled(number: int) -> int:
    if number == 13:
        raise ValueError("no 13")
    return 2 * number


def listening() -> list[tuple[str, int]]:
    """Addresses on which this process and its children listen (Linux)."""
    import psutil

    family = [psutil.Process(), *psutil.Process().children(recursive=True)]
    result = [c for process in family for c in process.net_connections() if c.status == psutil.CONN_LISTEN]
    return [(c.laddr.ip, c.laddr.port) for c in result]


def pages(port: int) -> list[str]:
    """What a browser is given that does not speak TLS."""
    given = []
    for path in ("/", "/status", "/info/main/workers.html", "/metrics", "/json/identity.json", "/health"):
        try:
            with socket.create_connection(("127.0.0.1", port), timeout=5) as link:
                link.sendall(f"GET {path} HTTP/1.0\r\n\r\n".encode())
                answer = link.recv(65536).partition(b"\r\n")[0].decode("latin-1")
        except OSError:
            continue
        if answer.startswith("HTTP") and " 404 " not in f"{answer} ":
            given.append(f"{path}: {answer}")
    return given


def answers(address: str) -> bool:
    """Whether a scheduler talks to somebody without a certificate (TLS 1.3 tells only when one reads)."""
    host, port = address.removeprefix("tls://").split(":")
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    try:
        with (
            socket.create_connection((host, int(port)), timeout=5) as link,
            context.wrap_socket(link) as talk,
        ):
            talk.sendall(b"x" * 64)
            return talk.recv(1) != b""
    except OSError:
        return False


def test_the_local_cluster_opens_no_door() -> None:
    import distributed

    before = set(listening())
    with engine._local_cluster(1) as cluster:
        doors = set(listening()) - before
        assert doors
        assert {ip for ip, _ in doors} == {"127.0.0.1"}
        assert [page for _, port in doors for page in pages(port)] == []
        address = cluster.scheduler_address
        assert address.startswith("tls://")
        plain = address.replace("tls://", "tcp://")
        with pytest.raises((OSError, TimeoutError)):
            distributed.Client(plain, timeout=2)
        assert not answers(address)


def test_two_local_clusters_do_not_ask_for_the_same_port() -> None:
    with socket.socket() as taken:
        with contextlib.suppress(OSError):  # somebody else has it: as good
            taken.bind(("127.0.0.1", 8787))
            taken.listen()
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            before = set(listening())
            with engine._local_cluster(1), engine._local_cluster(1):
                doors = set(listening()) - before
                assert {ip for ip, _ in doors} == {"127.0.0.1"}
                assert [page for _, port in doors for page in pages(port)] == []


def test_items_come_back_whole_and_an_error_goes_its_way() -> None:
    got: dict[int, int] = {}
    steps: list[tuple[int, int]] = []
    both = (Engine(threads=2), Engine(workers=1))
    for one in both:
        got.clear()
        one.map(doubled, range(9), got.__setitem__, lambda *step: steps.append(step))
        assert got == {k: 2 * k for k in range(9)}
        assert steps[-1] == (9, 9)
        with pytest.raises(ValueError, match="no 13"):
            one.map(doubled, [13], got.__setitem__)


def test_the_version_covers_the_package_of_the_task(monkeypatch, tmp_path) -> None:
    assert engine._packages(doubled)[-1] == doubled.__module__.partition(".")[0]
    assert engine._packages(engine._evaluate) == ("actuator_lti", "nonlinear", "analyses")
    from reports.nightly.compute import build

    assert "reports" in engine._packages(build)
    package = tmp_path / "some_tasks"
    package.mkdir()
    (package / "__init__.py").write_text("")
    monkeypatch.syspath_prepend(str(tmp_path))
    before = engine.code_version(("some_tasks",))
    (package / "work.py").write_text("x = 1")
    assert engine.code_version(("some_tasks",)) != before
    assert engine.code_version(("is_not_there",)) != before


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"scheduler": "tls://h:1"}, "--tls"),
        ({"scheduler": "tcp://h:1", "tls": Path("x")}, "--scheduler tls://"),
        ({"workers": 1, "tls": Path("x")}, "--scheduler tls://"),
    ],
)
def test_certificates_and_addresses_belong_together(options, words) -> None:
    with pytest.raises(InputError, match=words):
        Engine(**options)


def test_certificates_that_are_none_are_named(tmp_path) -> None:
    for made in range(3):
        with pytest.raises(InputError, match=r"\.pem"):
            Engine(scheduler="tls://127.0.0.1:9", tls=tmp_path).map(doubled, [1], lambda *_: None)
        (tmp_path / list(engine._TLS_FILES.values())[made]).write_text("no certificate")
    with pytest.raises((InputError, NumericalError)):
        Engine(scheduler="tls://127.0.0.1:9", tls=tmp_path).map(doubled, [1], lambda *_: None)


HUNGRY = 1_500_000_000
LEAN = 1_000_000_000


@pytest.fixture
def cluster(tmp_path, monkeypatch):
    """A scheduler with TLS and two workers, known by its address and a folder of certificates."""
    import distributed
    from distributed.security import Security

    tests = Path(__file__).parents[1]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(map(str, (tests / "nightly", tests.parent))))
    made = Security.temporary()
    tls = tmp_path / "tls"
    tls.mkdir()
    for key, name in engine._TLS_FILES.items():
        (tls / name).write_text(getattr(made, key))
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", protocol="tls://", security=made,
        dashboard_address="127.0.0.1:0", silence_logs=50,
    ) as running:  # fmt: skip
        yield running, Engine(scheduler=running.scheduler_address, tls=tls)


def test_a_night_on_a_cluster_ends_like_one_here(cluster, tmp_path) -> None:
    _, remote = cluster
    jobs = [
        job("good"),
        job("fails", 5.0),
        job("raises", mode="raise"),
        job("never ends", mode="hang"),
        job("is killed", mode="die"),
        job("eats", mode="eat", bytes=HUNGRY),
    ]
    common = {"time_limit_s": 8.0, "build": BUILD, "memory_limit_bytes": LEAN}
    there = run_night(study(*jobs), tmp_path / "there", Settings(engine=remote, **common), code=CODE)
    here = run_night(study(*jobs), tmp_path / "here", Settings(workers=2, **common), code=CODE)
    ends = {d.name: d.result.status for d in there.designs}
    assert ends == {d.name: d.result.status for d in here.designs}
    assert ends == {
        "good": "pass", "fails": "fail", "raises": "error", "never ends": "timeout", "is killed": "crash",
        "eats": "error",
    }  # fmt: skip
    messages = {d.name: d.result.message for d in there.designs}
    assert "--memory-limit" in messages["eats"]
    assert "signal 9" in messages["is killed"]
    stores = [Cache(tmp_path / f"{name}.state" / "cache") for name in ("there", "here")]
    (good,) = (d for d in there.designs if d.name == "good")
    entries = [store.read(good.result.key) for store in stores]
    assert entries[0].meta == entries[1].meta
    assert entries[0].file("report.html") == entries[1].file("report.html")


def test_a_lost_worker_s_jobs_are_done_again(cluster, tmp_path) -> None:
    import distributed

    running, remote = cluster
    log = tmp_path / "log"
    jobs = [job(f"d{k}", log=str(log), pause=0.3) for k in range(5)]
    with distributed.Client(running) as client:
        workers = list(client.run(os.getpid).values())
    killed = []

    def kill_one(done: int, total: int) -> None:
        if done >= 2 and not killed:
            killed.append(workers[0])
            os.kill(workers[0], signal.SIGKILL)

    settings = Settings(engine=remote, build=BUILD)
    night = run_night(study(*jobs), tmp_path / "site", settings, code=CODE, progress=kill_one)
    assert killed
    assert {d.result.status for d in night.designs} == {"pass"}


def test_a_lost_worker_s_designs_of_a_comparison_are_done_again(cluster, tmp_path) -> None:
    """One of two workers dies while designs are computed; what is found is what one process finds."""
    import distributed

    from analyses.study import load_study
    from analyses.variants import compare

    running, remote = cluster
    (tmp_path / "study.toml").write_text(
        '[study]\nbase = "ctms-motor-position"\n[[sweep]]\nparameter = "control.position.gain"\n'
        'values = ["9 V/rad", "12 V/rad", "15 V/rad", "18 V/rad", "21 V/rad"]\n'
    )
    plan = load_study(tmp_path / "study.toml")
    with distributed.Client(running) as client:
        workers = list(client.run(os.getpid).values())
    killed = []

    def kill_one(done: int, total: int) -> None:
        if done >= 2 and not killed:
            killed.append(workers[0])
            os.kill(workers[0], signal.SIGKILL)

    result = compare(plan, engine=remote, folder=tmp_path / "designs", progress=kill_one)
    assert killed
    assert not result.refused
    assert len(result.all) == len(list((tmp_path / "designs").rglob("*.json"))) == 6
    here = compare(plan)
    assert [one.figures for one in result.all] == [one.figures for one in here.all]


def test_an_entry_that_comes_damaged_is_not_kept(tmp_path) -> None:
    store, other = Cache(tmp_path / "a"), Cache(tmp_path / "b")
    store.write("k" * 64, {"x": 1}, {"f": b"abc"})
    data = store.path("k" * 64).read_bytes()
    for damaged in (data[:-1], b"", data[:60] + b"\0" + data[61:]):
        with pytest.raises(CorruptEntry):
            other.take("k" * 64, damaged)
    with pytest.raises(CorruptEntry, match="another key"):
        other.take("j" * 64, data)
    assert not list((tmp_path / "b").rglob("*.entry"))
    other.take("k" * 64, data)
    assert other.read("k" * 64).meta["x"] == 1
