"""The line that says what is being waited for: on a terminal, once, and only where there is a wait."""

import io
import sys
import threading

import pytest

from nonlinear.runs import watch as waiting


class Stream(io.StringIO):
    """Standard error of a terminal or of a log; says when something was written."""

    def __init__(self, terminal: bool) -> None:
        super().__init__()
        self.terminal, self.written = terminal, threading.Event()

    def isatty(self) -> bool:
        return self.terminal

    def flush(self) -> None:
        super().flush()
        if self.getvalue():
            self.written.set()


@pytest.mark.parametrize(
    ("terminal", "after_s", "said"), [(True, 0.0, "the kettle boils\n"), (True, 1e3, ""), (False, 0.0, "")]
)
def test_a_wait_is_told_once_on_a_terminal(terminal: bool, after_s: float, said: str, monkeypatch) -> None:
    stream = Stream(terminal)
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr(waiting, "_told", set())
    for wait_s in (10.0 if said else 0.0, 0.2):
        stream.written.clear()
        with waiting.told_if_slow("the kettle boils", after_s):
            assert stream.written.wait(wait_s) is (wait_s > 1.0)
    assert stream.getvalue() == said
