"""Quick stand-ins for a report, where no number matters; apart, as each process of a night loads them."""

import os
import signal
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from reports.document import column, document, section, table, verdict, verdicts
from reports.nightly.figures import digest
from reports.verdict_summary import role


def fake_document(payload: Mapping[str, Any]) -> dict[str, Any]:
    """A small report: one requirement on ``margin`` (not proven where ``unknown``), a table of margins."""
    name, margin, limit = str(payload["name"]), float(payload["margin"]), float(payload.get("limit", 6.0))
    found = {"value": margin, "distance": margin - limit, "passed": margin >= limit}
    if payload.get("unknown"):
        found = dict.fromkeys(found) | {"reason": "not determined"}
    if payload.get("unstable"):
        found = {"passed": False, "reason": "the position loop is unstable"}
    named = str(payload.get("requirement", "GM")), str(payload.get("label", "gain margin"))
    about = {"limit": limit, "comparison": "≥", "unit": "dB", "source": "test"}
    item = {**verdict(*named, **about, **found), "waiver": str(payload.get("waiver", ""))}
    loops = ("current", "velocity", str(payload.get("loop", "position")))
    rows = [(loop, 40.0 + margin + k, 100.0 * (k + 1)) for k, loop in enumerate(loops)]
    columns = [
        column("loop", "loop"),
        column("phase_margin", "phase margin", "deg", format="fix:1", better=1),
        column("crossover", "crossover", "rad/s", format="sig:4"),
    ]
    sections = [
        section("verdicts", "Requirements", [verdicts([item])], status=role(item)),
        section("margins", "Margins", [table("Margins", columns, rows)], status=payload.get("part", "info")),
    ]
    design = {"name": name, "revision": str(payload.get("revision", "A"))}
    origin = {"version": "0", "commit": None, "time": None}
    title = str(payload.get("title", name))
    return document(title=title, subtitle="", design=design, provenance=origin, sections=sections)


def build(payload: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, bytes]]:
    """Do as the payload says: raise, hang, die, or return a report."""
    mode = payload.get("mode", "")
    if mode == "raise":
        raise ValueError(str(payload.get("words", "this design cannot be built")))
    if mode == "hang":
        time.sleep(600)
    if mode == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    if mode == "eat":
        bytearray(int(payload["bytes"]))
    if mode == "exit":
        raise SystemExit(7)
    if "log" in payload:
        with Path(str(payload["log"])).open("a", encoding="utf-8") as log:
            log.write(f"{payload['name']}\n")
    time.sleep(float(payload.get("pause", 0.0)))
    made = fake_document(payload)
    html = f"<!doctype html><meta charset=utf-8><title>report</title><h1>report {len(str(payload))}</h1>"
    meta = digest(made) | ({"pid": os.getpid()} if mode == "pid" else {})
    return meta, {"report.html": html.encode(), "report.json": b"{}"}
