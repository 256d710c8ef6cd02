"""A loop about which nothing is known is not passed off as a good one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest

from analyses.linear import loop_figures
from analyses.margins import run
from reports.cli.main import main


def test_a_loop_whose_stability_is_not_known_is_no_pass(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    known = loop_figures.all_loop_figures

    def undecided(*args: Any, **options: Any) -> Mapping[str, loop_figures.LoopFigures]:
        figures = known(*args, **options)
        current = figures["current"]
        return {**figures, "current": replace(current, margins=replace(current.margins, stable=None))}

    monkeypatch.setattr(run, "all_loop_figures", undecided)
    assert main(["margins", "ilr33-amber"]) == 1
    first = capsys.readouterr().out.splitlines()[0]
    assert first.startswith("NOT PROVEN  ilr33-amber: stability not known: Current loop.")
