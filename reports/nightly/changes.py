"""What changed between two results of a design, how much it matters, and what is behind it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from reports.nightly.figures import Figure
from reports.nightly.records import Run
from reports.nightly.tolerance import Tolerances


@dataclass(frozen=True, kw_only=True)
class Change:
    """One figure that moved beyond its tolerance; ``worse`` is ``None`` where no direction is known."""

    figure: str
    unit: str
    kind: str
    before: float | None
    after: float | None
    tolerance: float
    worse: bool | None
    flapping: bool = False

    @property
    def delta(self) -> float | None:
        """How far it moved."""
        return None if self.before is None or self.after is None else self.after - self.before

    @property
    def size(self) -> float:
        """How far it moved in tolerances; what appeared or vanished counts most."""
        if self.delta is None:
            return float("inf")
        return abs(self.delta) / self.tolerance if self.tolerance else float("inf")


@dataclass(frozen=True, kw_only=True)
class Cause:
    """What differs between the two nights that a result comes from."""

    parameters: tuple[tuple[str, str, str], ...] = ()
    settings: tuple[tuple[str, str, str], ...] = ()
    libraries: tuple[tuple[str, str, str], ...] = ()
    commits: tuple[tuple[str, str], ...] = ()
    code: bool = False

    @property
    def known(self) -> bool:
        """Whether anything differs at all."""
        return bool(self.parameters or self.settings or self.libraries or self.commits or self.code)


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A design tonight against one earlier night; without ``run`` there was nothing to compare with."""

    run: Run | None = None
    changes: tuple[Change, ...] = ()
    cause: Cause = Cause()
    note: str = ""

    @property
    def regressions(self) -> tuple[Change, ...]:
        """The changes for the worse."""
        return tuple(c for c in self.changes if c.worse)


def compare_figures(
    before: Mapping[str, Figure], after: Mapping[str, Figure], tolerances: Tolerances
) -> tuple[Change, ...]:
    """List every figure that moved beyond its tolerance, appeared or vanished; the worst first."""
    changes = []
    for name in [*after, *(n for n in before if n not in after)]:
        change = _change(name, before.get(name), after.get(name), tolerances)
        if change is not None:
            changes.append(change)
    return tuple(sorted(changes, key=lambda c: (not c.worse, c.kind != "verdict", -c.size, c.figure)))


def _change(name: str, old: Figure | None, new: Figure | None, tolerances: Tolerances) -> Change | None:
    figure = new or old
    assert figure is not None
    a, b = old.value if old else None, new.value if new else None
    if a is None and b is None:
        return None
    tolerance = tolerances.of(figure, max(abs(a or 0.0), abs(b or 0.0)))
    if a is not None and b is not None and abs(b - a) <= tolerance:
        return None
    worse: bool | None = None
    if figure.kind == "verdict":
        worse = b == 0.0 or (b is None and a == 1.0)
    elif a is not None and b is not None and figure.better:
        worse = (b - a) * figure.better < 0.0
    return Change(
        figure=name, unit=figure.unit, kind=figure.kind, before=a, after=b, tolerance=tolerance, worse=worse
    )


def cause_of(
    old: Run,
    new: Run,
    inputs: tuple[Mapping[str, Any], Mapping[str, Any]],
    commits: tuple[tuple[str, str], ...],
) -> Cause:
    """Say what differs: parameters and settings of the design, libraries, sources, commits between."""
    before, after = inputs
    return Cause(
        parameters=_differences(before.get("parameters", {}), after.get("parameters", {})),
        settings=_differences(before.get("settings", {}), after.get("settings", {})),
        libraries=_differences(old.libraries, new.libraries),
        commits=commits,
        code=old.code != new.code,
    )


def _differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> tuple[tuple[str, str, str], ...]:
    names = [*new, *(n for n in old if n not in new)]
    return tuple((str(n), _text(old.get(n)), _text(new.get(n))) for n in names if old.get(n) != new.get(n))


def _text(value: object) -> str:
    return "(none)" if value is None else str(value)
