"""What is attacked: every loader and every command, with a valid input of each to start from."""

import contextlib
import io
import json
import random
import re
import tomllib
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType
from typing import Any
from unittest import mock

import numpy as np
import tomli_w
from command_lines import hostile, seeds
from mutate import damaged, damaged_tree, extreme

from actuator_lti.design import load_design, read_design_text, shipped_designs, with_overrides, write_design
from actuator_lti.design.controller_files import import_controller_file
from actuator_lti.design.loader import design_from_tree, design_text
from actuator_lti.design.model import Design
from actuator_lti.design.objects import import_objects
from actuator_lti.design.settings_file import parse_settings, write_settings_xml
from actuator_lti.design.units import parse_quantity
from actuator_lti.design.writing import design_tree
from actuator_lti.files import matlab
from actuator_lti.files.reading import decode
from analyses.linear.outer_loop import read_outer_loop
from analyses.records import campaign_file
from analyses.records.campaign_file import load_campaign
from analyses.records.csv_stream import read_csv_record
from analyses.records.open_record import open_record
from analyses.records.readers import read_record
from analyses.records.record import Record
from analyses.records.response import read_response
from analyses.records.spec import CsvFormat, RecordSpec, SignalColumn, TimeColumn
from analyses.studies import study
from analyses.studies.sampling import read_table
from nonlinear.runs.records import read_columns
from reports.nightly.cache import Cache, CorruptEntry, sealed
from reports.nightly.history import open_history
from reports.nightly.source import read_study
from reports.nightly.state import INDEX, NIGHTS, remembered
from tests.mat_reader import forked

Fault = Callable[[bytes, random.Random], bytes]


@dataclass(frozen=True)
class Target:
    name: str
    seeds: tuple[bytes, ...]  # valid inputs
    # Gets the path of a damaged file in a folder of its own; InputError is a good end
    attack: Callable[[Path], object]
    suffix: str = ".toml"
    fault: Fault = damaged


def example(module: ModuleType) -> bytes:
    """The file that a command prints with --example."""
    return (module.__doc__ or "").split("::", 1)[1].replace("\n    ", "\n").encode()


SETTINGS = b'[objects]\n"0x2342.01" = 20\n"0x2344.01" = { value = 120000, name = "x" }\n"0x3000.01" = -4\n'
STUDY = example(study) + b'tolerance = { "*margin*" = "0.5 deg" }\n'
CAMPAIGN = example(campaign_file)
RECORD = b"""file = "log.csv"
separator = ","
time = { column = "t", unit = "ms" }
signals.current = { column = "i", unit = "mA" }
signals.speed = { column = "n", unit = "rpm" }
"""
ROWS = b"t,i,n\n" + b"".join(b"%d,%d,%d.5\n" % (k, k * k % 7, 3 * k) for k in range(30))
KNOWN_ROWS = ROWS.replace(b"t,i,n", b"time_s,current_A,speed_rpm")
AROUND = (
    b'{"num": [1.5, 2], "den": [0.1, 1.0, 3], "dt": 0, "sampling_period": 0.01, "sign": -1, "name": "a"}',
    b'{"A": [[0.9, 0.1], [0.0, 0.8]], "B": [[0], [1]], "C": [[1, 0]], "D": [[0]], "dt": 0.001}',
)
CONTROLLERS = (
    b'{"axis0": {"motor": {"config": {"torque_constant": 0.04, "current_lim": 20.0}},'
    b' "encoder": {"config": {"bandwidth": 1000.0}},'
    b' "controller": {"config": {"pos_gain": 20.0, "vel_gain": 0.16, "vel_integrator_gain": 0.32}}}}',
    b"<MCConfiguration><foc_current_kp>0.01</foc_current_kp><s_pid_kp>0.004</s_pid_kp><s_pid_ki>8</s_pid_ki>"
    b"<l_current_max>60</l_current_max><si_motor_poles>14</si_motor_poles></MCConfiguration>",
    b"[30A0sub1]\nParameterValue=369404\n[30A0sub2]\nParameterValue=466187\n[30A2sub1]\nParameterValue=0xB",
    b'<a><CANopenObject index="30A0"><CANopenSubObject subIndex="1" actualValue="3694"/></CANopenObject></a>',
    b"motor.torque_controller = TorqueControlType::foc_current;\n"
    b"motor.PID_velocity.P = 0.5f;\nmotor.PID_velocity.I = 1;\n",
)
RESPONSE = b"f_hz,gain_db,phase_deg,coherence\n1,20,-90,0.99\n2,14,-95,0.98\n4,7.5,-102,0.9\n"
SAMPLED = ("motor.resistance", "motor.inductance")
SAMPLES = b"motor.resistance,motor.inductance\n0.05,1e-5\n0.06,2e-5\n"
SUMMARY = b'{"history": {"id": "x", "nights": 3, "approvals": 1}}'
JSON_ROWS = b'{"t": [0.0, 1.0, 2.0], "i": [0.5, null, 1.5], "note": "text", "n": [1, 2, 3]}'
SPEC = RecordSpec(
    format=CsvFormat(),
    time=TimeColumn(column="t"),
    signals=(
        SignalColumn(name="current", column="i", unit="A"),
        SignalColumn(name="speed", column="n", unit="rpm"),
    ),
)


@cache
def base() -> Design:
    return load_design("ilr33-amber")


def design_round(path: Path) -> None:
    design = load_design(path)
    assert read_design_text(write_design(design)).name == design.name


def override(path: Path) -> None:
    key, _, value = path.read_bytes().decode("utf-8", "replace").partition("=")
    with_overrides(base(), {key: value})


def settings(path: Path) -> None:
    import_objects(parse_settings(decode(path.read_bytes(), "f"), "f"), base())


def controller_file(path: Path) -> None:
    tree = {key: value for key, value in design_tree(base()).items() if key not in ("requirement", "objects")}
    if b"30A0" in path.read_bytes():  # no velocity loop inside a position loop
        del tree["control"]["position"]
    import_controller_file(path, design_from_tree(tree, "base"))


def accounted(found: Record) -> None:
    """Every row is used, or counted among those that are not."""
    assert found.counts.rows_in == found.counts.rows_out + sum(found.counts.dropped.values())


def mat(read: Callable[[Path], object]) -> Callable[[Path], None]:
    def attack(path: Path) -> None:
        with mock.patch.object(matlab, "run", forked):
            read(path)

    return attack


def record(path: Path) -> None:
    (path.parent / "log.csv").write_bytes(ROWS)
    open_record(path)


def report(path: Path) -> None:
    from reports.document import dumps, load
    from reports.html import page
    from reports.pdf import printable

    made = load(path)
    dumps(made)
    printable(made)
    own = {"name": "d", "revision": "1"}, dict.fromkeys(("version", "time", "commit", "design_hash"))
    page({**made, "design": own[0], "provenance": own[1], "live": None})  # as --include puts it into another


def history(path: Path) -> None:
    path.rename(path.parent / INDEX)
    (path.parent / NIGHTS).mkdir(exist_ok=True)
    for name, data in history_files().items():
        if name != INDEX:
            (path.parent / NIGHTS / name).write_bytes(data)
    opened = open_history(path.parent)
    opened.memory()
    for run in opened.runs:
        for one in opened.night(run.id).results:
            opened.figures(one)


def entry(path: Path) -> None:
    with contextlib.suppress(CorruptEntry):
        Cache(path.parent).take("k" * 64, path.read_bytes())


def summary(path: Path) -> None:
    path.rename(path.parent / "summary.json")
    remembered(path.parent)


def command(*words: str) -> Callable[[Path], None]:
    """Run a command on the file (``FILE`` among the words); its status and its words are looked at."""

    def run(path: Path) -> None:
        given = [str(path) if word == "FILE" else word.replace("FOLDER", str(path.parent)) for word in words]
        called(given)

    return run


def command_line(path: Path) -> None:
    words = json.loads(path.read_bytes())
    with contextlib.chdir(path.parent):
        called([word.replace("OUT", str(path.parent)).replace("FILE", str(path)) for word in words])


def called(given: list[str]) -> None:
    from reports.cli.main import main

    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = main(given)
    said = err.getvalue()
    lines = [line for line in said.splitlines() if line.startswith("actuator-lti:")]
    for text in (out.getvalue(), said):
        assert all(c in "\n\t" or unicodedata.category(c) not in ("Cc", "Cs") for c in text), text
    assert all(len(line) <= 1100 for line in said.splitlines()), said
    assert not re.search("unexpected [A-Z]", said), said
    assert "Traceback" not in said, said
    assert status in (0, 1, 2, 3), (status, said)
    assert len(lines) > 0 if status == 2 else len(lines) == (status == 3), (status, said)


@cache
def small_report() -> bytes:
    from reports import document as doc
    from reports.charts.chart import Chart

    columns = [doc.column("a", "A", "deg", format="sig:3"), doc.column("b", "B")]
    rows = [{"a": 1.5, "b": {"text": "x", "status": "pass"}, "_status": "fail"}, {"a": None, "b": True}]
    judged = {"value": 1.0, "limit": 2.0, "unit": "dB", "distance": 1.0, "passed": True, "comparison": "<="}
    verdict = doc.verdict("i", "I", **judged)
    drawn = Chart(width=300.0)
    panel = drawn.panel()
    panel.points([1.0, 2.0, None], [0.0, -3.0, 1.0], "k")
    panel.rule_y(1.0, label="l")
    panel.note("n", corner="top left")
    near = {"limit": 6.0, "comparison": ">=", "distance": 1.5, "verdict": "met"}
    glance = {
        "kind": "glance", "more": 2, "weakest": {"label": "l", "words": "w", "status": "pass"},
        "loops": [{
            "loop": "Position", "anchor": "a", "stable": {"text": "yes", "status": "pass"},
            "figures": [{"label": "Gain margin", "value": 7.5, "unit": "dB", "format": "fix:2", **near}],
        }],
        "findings": [{"severity": "warn", "text": "t", "where": "one"}],
    }  # fmt: skip
    blocks = [
        glance, doc.table("T", columns, rows, "n"), doc.text("x\n\ny"), doc.facts([doc.fact("l", 3.5, "m")]),
        doc.verdicts([verdict]), doc.details("more", [doc.text("z"), doc.table("U", columns, [])]),
        doc.figure("curves", drawn, caption="c", alt="a"),
    ]  # fmt: skip
    head = {"design": {"name": "d", "revision": "1"}, "provenance": {"time": None, "version": "1"}}
    made = doc.document(
        title="t", subtitle="s", **head,
        sections=[doc.section("one", "One", blocks, status="warn"), doc.section("two", "Two", [])],
    )  # fmt: skip
    return doc.dumps(made).encode()


def tree_fault(data: bytes, draw: random.Random) -> bytes:
    """Half of the JSON files are damaged as trees, so that they still are JSON."""
    if draw.random() < 0.3:
        return damaged(data, draw)
    return json.dumps(damaged_tree(json.loads(data), draw)).encode("utf-8", "surrogatepass")


def toml_fault(data: bytes, draw: random.Random) -> bytes:
    """A TOML file damaged as a tree; TOML knows no null, and not every text."""
    made = damaged_tree(tomllib.loads(data.decode()), draw)
    with contextlib.suppress(TypeError, ValueError, AttributeError):
        return tomli_w.dumps(without_none(made)).encode()
    return damaged(data, draw)


def without_none(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(k): without_none(v) for k, v in value.items() if v is not None}
    return [without_none(v) for v in value if v is not None] if isinstance(value, list) else value


@cache
def mat_files() -> tuple[bytes, ...]:
    from scipy.io import savemat

    made = []
    for packed in (False, True):
        stream = io.BytesIO()
        f, t = np.arange(1.0, 5.0), np.arange(20.0)
        values = {"t": t, "i": t**2, "n": np.ones((1, 20)), "k": 3.5, "f": f, "H": f * 1j}
        savemat(stream, values, do_compression=packed)
        made.append(b"MATLAB 5.0 MAT-file".ljust(116) + stream.getvalue()[116:])  # without the date
    return tuple(made)


@cache
def parquet_file() -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as pq

    stream = io.BytesIO()
    columns = {"t": np.arange(20.0), "i": np.arange(20), "n": np.ones(20, np.float32)}
    pq.write_table(pa.table(columns), stream)
    return stream.getvalue()


@cache
def history_files() -> dict[str, bytes]:
    from nightly_fakes import CODE, INLINE, job
    from nightly_fakes import study as of

    from reports.nightly.night import run_night

    with TemporaryDirectory() as folder:
        for margin in (10.0, 11.0):
            run_night(of(job("a", margin), job("b")), Path(folder) / "s", INLINE, code=CODE)
        return {path.name: path.read_bytes() for path in (Path(folder) / "s.state").rglob("*.json")}


@cache
def targets() -> tuple[Target, ...]:
    designs = tuple(design_text(name).encode() for name in shipped_designs())
    to_pdf = command("pdf", "FILE", "--out", "FOLDER/x.pdf")
    kept = sealed("k" * 64, {"x": [1, 2]}, {"report.html": b"<p>" * 40})
    xml = write_settings_xml(parse_settings(SETTINGS.decode(), "f"))
    move = ("simulate", "FILE", "--duration", "0.02", "--quiet", "--json")
    return (
        Target("quantity", (b"2.25e-3 N*m", b"12 mN*m", b"-5 N*cm"),
               lambda p: parse_quantity(p.read_bytes().decode("utf-8", "replace"), "N*m")),
        Target("override", (b"motor.resistance=55 mohm", b"gear.worm.ratio=50"), override),
        Target("design", designs, design_round),
        Target("extreme design", designs, design_round, fault=extreme),
        Target("design tree", designs, design_round, fault=toml_fault),
        Target("settings", (SETTINGS,), settings),
        Target("settings xml", (xml.encode(),), settings, ".xml"),
        Target("controller file", CONTROLLERS, controller_file, ".xml"),
        Target("response", (RESPONSE,), read_response, ".csv"),
        Target("mat response", mat_files(), mat(read_response), ".mat"),
        Target("study", (STUDY,), lambda p: read_study(str(p))),
        Target("study tree", (STUDY,), lambda p: read_study(str(p)), fault=toml_fault),
        Target("campaign", (CAMPAIGN,), load_campaign),
        Target("record file", (RECORD,), record),
        Target("record", (ROWS,), lambda p: accounted(read_csv_record(p, SPEC)), ".csv"),
        Target("record by itself", (KNOWN_ROWS,), open_record, ".csv"),
        Target("mat record", mat_files(), mat(lambda p: accounted(read_record(p, SPEC))), ".mat"),
        Target("JSON record", (JSON_ROWS,), lambda p: read_record(p, SPEC), ".json", tree_fault),
        Target("parquet", (parquet_file(),), lambda p: read_record(p, SPEC), ".parquet"),
        Target("command or load", (ROWS,), lambda p: read_columns(p, (0, 1)), ".csv"),
        Target("samples", (SAMPLES,), lambda p: read_table(p, SAMPLED), ".csv"),
        Target("outer loop", AROUND, read_outer_loop, ".json", tree_fault),
        Target("report", (small_report(),), report, ".json", tree_fault),
        Target("site", (SUMMARY,), summary, ".json", tree_fault),
        Target("history", (history_files()[INDEX],), history, ".json", tree_fault),
        Target("cache entry", (kept,), entry, ".entry"),
        Target("command line", seeds(), command_line, ".json", hostile),
        Target("command margins", designs, command("margins", "FILE", "--json"), fault=extreme),
        Target("command simulate", designs, command(*move), fault=extreme),
        Target("command objects", designs, command("objects", "export", "FILE"), fault=extreme),
        Target("command pdf", (small_report(),), to_pdf, ".json", tree_fault),
    )  # fmt: skip
