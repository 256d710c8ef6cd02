"""The line that says what is being waited for: on a terminal, once, and only where there is a wait."""

import io
import sys
import threading

from nonlinear.runs import watch as waiting


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


def terminal_of(monkeypatch) -> Terminal:
    """Not a fixture: pytest puts its own stream in place between a fixture and its test."""
    made = Terminal()
    monkeypatch.setattr(sys, "stderr", made)
    monkeypatch.setattr(waiting, "_told", set())
    return made


def test_a_wait_is_told_once(monkeypatch) -> None:
    terminal = terminal_of(monkeypatch)
    for _ in range(2):
        with waiting.told_if_slow("the kettle boils", 0.0):
            assert terminal.written.wait(10.0)
    assert terminal.getvalue() == "the kettle boils\n"


def test_no_wait_no_line(monkeypatch) -> None:
    terminal = terminal_of(monkeypatch)
    with waiting.told_if_slow("the kettle boils", 1e3):
        pass
    assert terminal.getvalue() == ""


def test_nothing_is_said_to_a_log(monkeypatch) -> None:
    log = io.StringIO()
    monkeypatch.setattr(sys, "stderr", log)
    with waiting.told_if_slow("the kettle boils", 0.0):
        pass
    assert log.getvalue() == ""
