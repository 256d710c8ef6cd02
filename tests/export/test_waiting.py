"""The line that says what is being waited for: on a terminal, once, and only where there is a wait."""

from __future__ import annotations

import io
import sys
import threading

import numpy as np
import pytest

import nonlinear._kernels.call as numba_call
import nonlinear.native as native
import nonlinear.waiting as waiting
from nonlinear._kernels import layout


class Terminal(io.StringIO):
    """Standard error that is a terminal, and says when something was written."""

    def __init__(self) -> None:
        super().__init__()
        self.written = threading.Event()

    def isatty(self) -> bool:
        return True

    def flush(self) -> None:
        super().flush()
        if self.getvalue():
            self.written.set()


def terminal_of(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    """Not a fixture: pytest puts its own stream in place between a fixture and its test."""
    made = Terminal()
    monkeypatch.setattr(sys, "stderr", made)
    monkeypatch.setattr(waiting, "_told", set())
    return made


def test_a_wait_is_told_once(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = terminal_of(monkeypatch)
    for _ in range(2):
        with waiting.told_if_slow("the kettle boils", 0.0):
            assert terminal.written.wait(10.0)
    assert terminal.getvalue() == "the kettle boils\n"


def test_no_wait_no_line(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = terminal_of(monkeypatch)
    with waiting.told_if_slow("the kettle boils", 1e3):
        pass
    assert terminal.getvalue() == ""


def test_nothing_is_said_to_a_log(monkeypatch: pytest.MonkeyPatch) -> None:
    log = io.StringIO()
    monkeypatch.setattr(sys, "stderr", log)
    with waiting.told_if_slow("the kettle boils", 0.0):
        pass

    assert log.getvalue() == ""


def test_compiling_by_numba_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = terminal_of(monkeypatch)

    def slow(*_: object) -> int:
        assert terminal.written.wait(10.0)
        return 0

    monkeypatch.setenv(native.SWITCH, "numba")
    monkeypatch.setattr(numba_call, "resume", slow)
    nothing = np.zeros(0)
    native.resume(np.zeros(layout.SIZE), *[nothing] * 3, np.zeros(0, np.uint16), *[nothing] * 2)
    assert "numba compiles the simulator" in terminal.getvalue()
    assert terminal.getvalue().count("\n") == 1
