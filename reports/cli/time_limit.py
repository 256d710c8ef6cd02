"""Every command ends within a stated time: first by an error that says so, then the hard way."""

import os
import signal
import sys
import threading

from actuator_lti.errors import OutOfTime

HARD_FACTOR, HARD_EXTRA_S = 1.25, 30.0  # the rest of a report is written between the two
_timers: list[threading.Timer] = []
_struck: list[str] = []


def start(seconds: float) -> None:
    """Set both limits: the error after ``seconds``, the end of the process some time later.

    Compiled code and libraries keep the interpreter from raising the error while they run; the second
    limit does not depend on them.
    """
    stop()
    if threading.current_thread() is threading.main_thread() and hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, lambda _number, _frame: _refuse(seconds))
        signal.setitimer(signal.ITIMER_REAL, seconds)
    most = min(HARD_FACTOR * seconds + HARD_EXTRA_S, threading.TIMEOUT_MAX)
    timer = threading.Timer(most, _end, (seconds,))
    timer.daemon = True
    timer.start()
    _timers.append(timer)


def stop() -> None:
    _struck.clear()
    while _timers:
        _timers.pop().cancel()
        if threading.current_thread() is threading.main_thread() and hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, signal.SIG_DFL)


def struck() -> str:
    """What is said of the limit once it has been met; empty before.

    A library may be in the middle of a conversion then, and give the error as one of its own.
    """
    return _struck[0] if _struck else ""


def _refuse(seconds: float) -> None:
    _struck.append(_words(seconds))
    raise OutOfTime(_struck[0])


def _end(seconds: float) -> None:
    """End the process where the error did not get through."""
    sys.stderr.write(f"actuator-lti: {_words(seconds)}\n")
    sys.stderr.flush()
    os._exit(3)


def _words(seconds: float) -> str:
    return f"not finished within {seconds:g} s; allow more with 'actuator-lti --time-limit SECONDS ...'"
