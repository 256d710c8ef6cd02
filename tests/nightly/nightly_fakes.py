"""Nights whose reports are those of `nightly_builds`: jobs, studies, a calendar."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from reports.nightly.asked import Settings
from reports.nightly.source import CodeVersion, Job, Study

CODE = CodeVersion(sources="s", libraries={"numpy": "2"}, commit="c" * 40)
BUILD = "nightly_builds:build"


class Fakes(Settings):
    """Settings of nights that build such reports."""

    build = BUILD


INLINE = Fakes(workers=0)


def job(name: str, margin: float = 10.0, **more: Any) -> Job:
    """A job for `nightly_builds.build`."""
    payload, gain = {"name": name, "margin": margin, **more}, f"{margin:g} 1/s"
    parameters = {"control.position.gain": gain}
    return Job(name=name, payload=payload, design_hash=f"{margin}", parameters=parameters)


def study(*jobs: Job, name: str = "fake study", **more: Any) -> Study:
    """A study of such jobs."""
    return Study(name=name, jobs=tuple(jobs), title=more.pop("title", "Fin actuators"), **more)


def wait_for(condition: Callable[[], bool], seconds: float = 120.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "did not come true in time"
        time.sleep(0.02)


class Calendar:
    """A clock that moves on by a day with every night (it is read twice a night)."""

    def __init__(self, day: int = 1) -> None:
        self.day = day

    def __call__(self) -> str:
        return f"2026-{1 + (self.day - 1) // 28:02d}-{1 + (self.day - 1) % 28:02d}T02:00:00Z"

    def next(self, days: int = 1) -> Calendar:
        self.day += days
        return self
