"""Processor time that a validation may take: every part has its share, and what is cut is said."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TypeVar

from nonlinear.watch import watched

T = TypeVar("T")
U = TypeVar("U")
SECONDS = 20.0
RESERVED = 0.07  # of it, for what runs outside: the start of the command, its output


class OutOfTime(Exception):
    """The share of a part is used up."""


@dataclass
class Budget:
    """Processor time of a whole validation, all threads together.

    A part may use at most its share of what is left, so that no part starves those behind it; what a part
    leaves over goes to them.

    Attributes
    ----------
    seconds : float
        For the whole.
    clock : callable
        Processor time in s.
    cut : list of str
        What was not done for lack of time, in words.
    """

    seconds: float = SECONDS
    clock: Callable[[], float] = time.process_time
    cut: list[str] = field(default_factory=list)
    began: float = field(init=False)
    until: float = field(init=False)

    def __post_init__(self) -> None:
        """Start the clock."""
        self.began = self.clock()
        self.until = self.began + (1.0 - RESERVED) * self.seconds

    @property
    def left(self) -> float:
        """Seconds left, at least 0."""
        return max(self.began + self.seconds - self.clock(), 0.0)

    def look(self) -> None:
        """Stop where the share of the part under way is used up.

        Raises
        ------
        OutOfTime
        """
        if self.clock() > self.until:
            raise OutOfTime

    @contextmanager
    def part(self, share: float) -> Iterator[None]:
        """Let what is inside use a share of the time left; parts may hold parts."""
        outer = self.until
        self.until = min(outer, self.clock() + share * max(outer - self.clock(), 0.0))
        try:
            with watched(self.look):
                yield
        finally:
            self.until = outer

    def within(self, share: float, name: str, work: Callable[[], T], otherwise: U) -> T | U:
        """Do some work within a share; give ``otherwise`` and note it where the time does not suffice."""
        before = self.clock()
        try:
            with self.part(share):
                self.look()
                return work()
        except OutOfTime:
            spent = self.clock() - before
            self.cut.append(
                f"{name}: cut after {spent:.1f} s, its share of {self.seconds:g} s of processor time"
            )
            return otherwise
