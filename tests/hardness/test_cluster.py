"""Dask without an open door: this machine only, TLS with certificates of the run, no page to look at."""

import contextlib
import gc
import http.client
import os
import signal
import socket
import ssl
import subprocess
import sys
import time
import warnings
from collections.abc import Iterator
from pathlib import Path

import pytest
from kill_cluster import Cluster
from nightly_fakes import CODE, Fakes, job, study, wait_for

from actuator_lti.errors import InputError, NumericalError
from analyses.monte_carlo import SampleTask
from analyses.studies import engine as clusters
from analyses.studies import proof
from analyses.studies.engine import Engine
from reports.nightly.cache import Cache
from reports.nightly.night import run_night
from tests.refusals import refused


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
        door = contextlib.closing(http.client.HTTPConnection("127.0.0.1", port, timeout=5))
        with contextlib.suppress(OSError, http.client.HTTPException), door as link:
            link.request("GET", path)
            status = link.getresponse().status
            given += [f"{path}: {status}"] if status != 404 else []
    return given


def answers(address: str) -> bool:
    """Whether a scheduler talks to somebody without a certificate (TLS 1.3 tells only when one reads)."""
    host, port = address.removeprefix("tls://").split(":")
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    with (
        contextlib.suppress(OSError),
        socket.create_connection((host, int(port)), timeout=5) as link,
        context.wrap_socket(link) as talk,
    ):
        talk.sendall(b"x" * 64)
        return talk.recv(1) != b""
    return False


def test_local_clusters_open_no_door_and_do_not_ask_for_the_same_port() -> None:
    import distributed

    with contextlib.ExitStack() as stack:
        taken = stack.enter_context(socket.socket())
        with contextlib.suppress(OSError):  # somebody else has it: as good
            taken.bind(("127.0.0.1", 8787))
            taken.listen()
        before = set(listening())
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            address, _ = (stack.enter_context(clusters.local_cluster(1)).scheduler_address for _ in range(2))
        doors = set(listening()) - before
        assert {ip for ip, _ in doors} == {"127.0.0.1"}
        assert [page for _, port in doors for page in pages(port)] == []
        assert address.startswith("tls://")
        with pytest.raises((OSError, TimeoutError)):
            distributed.Client(address.replace("tls://", "tcp://"), timeout=2)
        gc.collect()  # its client is closed now, not while another one starts: that would wait for ever
        assert not answers(address)


def test_items_come_back_whole_and_an_error_goes_its_way() -> None:
    got: dict[int, int] = {}
    steps: list[tuple[int, int]] = []
    for one in (Engine(threads=2), Engine(workers=1)):
        got.clear()
        one.map(doubled, range(9), got.__setitem__, lambda *step: steps.append(step))
        assert got == {k: 2 * k for k in range(9)}
        assert steps[-1] == (9, 9)
        with pytest.raises(ValueError, match="no 13"):
            one.map(doubled, [13], got.__setitem__)


def test_the_version_covers_the_package_of_the_task(monkeypatch, tmp_path) -> None:
    from reports.nightly.compute import build

    assert proof.packages_of(doubled)[-1] == doubled.__module__.partition(".")[0]
    assert proof.packages_of(SampleTask) == proof.CODE
    assert "reports" in proof.packages_of(build)
    package = tmp_path / "some_tasks"
    package.mkdir()
    (package / "__init__.py").write_text("")
    monkeypatch.syspath_prepend(str(tmp_path))
    before = proof.code_version(("some_tasks",))
    (package / "work.py").write_text("x = 1")
    assert proof.code_version(("some_tasks",)) != before
    assert proof.code_version(("is_not_there",)) != before


@pytest.fixture
def paths(monkeypatch) -> None:
    """Workers find the tasks of these tests."""
    tests = Path(__file__).parents[1]
    found = os.pathsep.join(map(str, (tests / "hardness", tests / "nightly", tests.parent)))
    monkeypatch.setenv("PYTHONPATH", found)


@pytest.fixture
def bare(tmp_path, paths) -> Iterator[Cluster]:
    """A scheduler alone, which can be killed, and to which workers can be added."""
    cluster = Cluster(tmp_path)
    try:
        cluster.start(workers=0)
        yield cluster
    finally:  # also where it did not come up: a process left behind is seen by the next test
        cluster.end()


@pytest.mark.parametrize(("environment", "words"), [
    ({"OPENBLAS_CORETYPE": "Prescott"}, "OPENBLAS_CORETYPE is Prescott, here"),
    ({"OPENBLAS_NUM_THREADS": "3"}, "start it with .*OPENBLAS_NUM_THREADS=1"),
])  # fmt: skip
def test_a_worker_that_adds_up_otherwise_gets_no_work(bare, environment, words, tmp_path, cli) -> None:
    bare.add_worker(**environment)
    got: list[int] = []
    engine = Engine(scheduler=bare.address)
    said = rf"worker tcp://\S+ is refused: .*{words}"
    refused(engine.map, doubled, range(3), lambda item, _: got.append(item), match=said)
    assert got == []
    command = ["montecarlo", "ilr33-amber", "--out", str(tmp_path / "out"), "--quiet"]
    assert "is refused" in cli.refused(*command, "--scheduler", bare.address)
    assert not (tmp_path / "out").exists()


def test_a_worker_that_joins_late_proves_itself_first(bare) -> None:
    bare.add_worker()
    got: list[int] = []

    def take(item: int, _: int) -> None:
        got.append(item)
        if len(got) == 1:
            bare.add_worker(OPENBLAS_CORETYPE="Prescott")

    with pytest.raises(InputError, match=r"process \d+ on \S+ is refused: OPENBLAS_CORETYPE is Prescott"):
        Engine(scheduler=bare.address).map(slowly, range(1000), take)
    assert 0 < len(got) < 1000


def test_a_worker_that_is_lost_over_its_proof_is_no_refusal(bare) -> None:
    import distributed

    bare.add_worker()
    got: dict[int, int] = {}
    with distributed.Client(bare.address) as client:

        class Losing:
            def __getattr__(self, name: str) -> object:
                return getattr(client, name)

            def run(self, *asked: object, **how: object) -> dict[str, object]:
                return {**client.run(*asked, **how), "tcp://lost": OSError("closed")}

        clusters.submit(Losing(), doubled, [1, 2], got.__setitem__)
    assert got == {1: 2, 2: 4}


def deadly(number: int) -> int:
    os._exit(number)


def test_a_part_that_kills_its_workers_is_one_line(monkeypatch) -> None:
    import dask

    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        pytest.raises(NumericalError, match="workers keep dying over one part"),
    ):
        Engine(workers=1).map(deadly, [3], lambda *_: None)


def slowly(number: int) -> int:
    time.sleep(0.1)
    return number


def test_every_part_of_a_proof_counts() -> None:
    class Study:
        def sample(self) -> bytes:
            return b"1.5"

    here = proof.prove(proof.CODE, Study())
    assert len(here) == 6 + len(proof.ARITHMETIC)
    proof.hold_against(here, dict(here), "w")
    for name, own in here.items():
        for there in ({**here, name: "other"}, {key: value for key, value in here.items() if key != name}):
            with pytest.raises(InputError, match=f"worker w is refused: {name} is .*, here {own}"):
                proof.hold_against(here, there, "w")
    with pytest.raises(InputError, match="does not say what it computes with"):
        proof.hold_against(here, AttributeError("prove"), "w")


def test_a_scheduler_that_dies_is_one_line_and_what_is_done_is_kept(bare, tmp_path, cli) -> None:
    """The command ends with status 3; again, without a cluster, it computes only the rest."""
    bare.add_worker()
    out = tmp_path / "out"
    words = ["montecarlo", "ilr33-amber", "--samples", "24000", "--no-worst", "--out", str(out), "--quiet"]
    command = [str(Path(sys.executable).with_name("actuator-lti")), *words, "--scheduler", bare.address]
    study = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    wait_for(lambda: len(list(out.rglob("*.parquet"))) >= 2 or study.poll() is not None)
    assert study.poll() is None
    bare.scheduler.kill()
    _, said = study.communicate(timeout=120)
    assert (study.returncode, said.count("\n")) == (3, 1), said
    assert "the same command goes on" in said

    def times() -> dict[Path, int]:
        return {path: path.stat().st_mtime_ns for path in out.rglob("*.parquet")}

    kept = times()
    cli(*words)
    after = times()
    assert len(after) == 6 > len(kept) >= 2
    assert kept.items() <= after.items()


@pytest.mark.parametrize(("address", "told"), [
    ("tcp://10.0.0.7:8786", True), ("tcp://cluster:8786", True), ("cluster:8786", True),
    ("tcp://127.0.0.1:8786", False), ("tcp://localhost:8786", False), ("tcp://[::1]:8786", False),
])  # fmt: skip
def test_an_address_that_anybody_can_reach_is_warned_about(address, told, tmp_path, cli) -> None:
    assert bool(Engine(scheduler=address).caution) is told
    words = ["nightly", "approve", "emps", "--site", str(tmp_path / "s"), "--by", "x", "--reason", "y"]
    status, _, said = cli(*words, "--scheduler", address)
    assert (status, "tls://" in said, said.count("\n")) == (
        2,
        told,
        1 + told,
    )  # and that there is no night yet


@pytest.mark.parametrize(("options", "words"), [
    ({"scheduler": "tls://h:1"}, "--tls"),
    ({"scheduler": "tcp://h:1", "tls": Path("x")}, "--scheduler tls://"),
    ({"workers": 1, "tls": Path("x")}, "--scheduler tls://"),
    ({"workers": 2, "scheduler": "tcp://x"}, "one of them"),
    ({"workers": 0}, "at least 1"),
    ({"scheduler": "nowhere"}, "tcp://host:8786"),
])  # fmt: skip
def test_an_engine_that_cannot_be_is_refused(options, words) -> None:
    fails(InputError, words, **options)


def fails(kind, words: str | None, **options: object) -> None:
    with pytest.raises(kind, match=words):
        Engine(**options).map(doubled, [1], lambda *_: None)


def test_a_scheduler_that_is_not_there_or_left_and_certificates_that_are_none(monkeypatch, tmp_path) -> None:
    """The client of one that left has closed itself when the study is sent to it."""
    from distributed.client import ClosedClientError

    monkeypatch.setattr(clusters, "CONNECT_S", 0.5)
    monkeypatch.setattr("distributed.Client.__del__", lambda client: states.append(client.status))
    states = list[str]()
    here, tls = {"scheduler": "tcp://127.0.0.1:9"}, {"scheduler": "tls://127.0.0.1:9", "tls": tmp_path}
    fails(NumericalError, "127", **here)
    fails(InputError, "tcp://host:8786", scheduler="nowhere")
    for name in clusters.TLS_FILES.values():
        fails(InputError, r"\.pem", **tls)
        (tmp_path / name).write_text("no certificate")
    fails((InputError, NumericalError), None, **tls)
    gc.collect()
    assert set(states) == {"closed", "newly-created"}  # none is left to wait where it is collected

    class Left:
        def __getattr__(self, name: str) -> object:
            return lambda *_asked, **_how: {}

        def submit(self, *_asked: object, **_how: object) -> None:
            raise ClosedClientError("Client is closed. Can't send update-graph message.")

    monkeypatch.setattr(Engine, "_client", lambda _self: contextlib.nullcontext(Left()))
    fails(NumericalError, r"the connection is lost; .* the same command goes on", **here)


def test_a_cluster_that_is_slow_to_close_takes_no_result_back(monkeypatch):
    """Time-outs while the workers stop, after the last result: the study is whole all the same."""

    @contextlib.contextmanager
    def slow_to_close(self):
        yield None
        raise TimeoutError

    def in_place(client, work, todo, sink):
        for part in todo:
            sink(part, work(part))

    monkeypatch.setattr(Engine, "_client", slow_to_close)
    monkeypatch.setattr("analyses.studies.engine.submit", in_place)
    sums = {}
    Engine(workers=1).map(sum, [(1, 2), (3, 4)], sums.__setitem__)
    assert sums == {(1, 2): 3, (3, 4): 7}

    def lost(item, result):
        raise TimeoutError

    with pytest.raises(NumericalError, match="no answer in time"):
        Engine(workers=1).map(sum, [(1, 2)], lost)


HUNGRY = 1_500_000_000
LEAN = 1_000  # MB


@pytest.fixture
def cluster(tmp_path, paths):
    """A scheduler with TLS and two workers, known by its address and a folder of certificates."""
    import distributed
    from distributed.security import Security

    made = Security.temporary()
    tls = tmp_path / "tls"
    tls.mkdir()
    for key, name in clusters.TLS_FILES.items():
        (tls / name).write_text(getattr(made, key))
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", protocol="tls://", security=made,
        dashboard_address="127.0.0.1:0", silence_logs=50,
    ) as running:  # fmt: skip
        yield running, {"scheduler": running.scheduler_address, "tls": tls}


def test_a_night_on_a_cluster_ends_like_one_here(cluster, tmp_path) -> None:
    _, remote = cluster
    modes = {"raise": "error", "hang": "timeout", "die": "crash", "eat": "error"}
    jobs = [job("good"), job("fails", 5.0), *(job(mode, mode=mode, bytes=HUNGRY) for mode in modes)]
    bounds = {"time_limit_s": 8.0, "memory_limit": LEAN}
    here, there = (
        run_night(study(*jobs), tmp_path / place, Fakes(**bounds, **where), code=CODE)
        for place, where in (("here", {}), ("there", remote))
    )
    for night in (here, there):
        ends = {d.name: d.result.status for d in night.designs}
        assert ends == {"good": "pass", "fails": "fail", **modes}
    results = {d.name: d.result for d in there.designs}
    assert "--memory-limit" in results["eat"].message
    assert "signal 9" in results["die"].message
    stores = [Cache(tmp_path / f"{name}.state" / "cache") for name in ("there", "here")]
    one, other = (store.read(results["good"].key) for store in stores)
    assert (one.meta, one.file("report.html")) == (other.meta, other.file("report.html"))


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

    night = run_night(study(*jobs), tmp_path / "site", Fakes(**remote), code=CODE, progress=kill_one)
    assert killed
    assert {d.result.status for d in night.designs} == {"pass"}
