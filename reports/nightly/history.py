"""The history: a JSON file a night, and an index over them.

``nights/000001.json`` holds the results of a night, its figures in full; what is as it was before refers to
the night that has it. ``history.json`` is the index: the nights with the checksums of their files, and the
approvals, under a checksum of its own. A night's file is written first, the index put in place after it: a
night is there whole, or not at all.
"""

import secrets
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any, Final, Literal, TypeVar

import numpy as np
from pydantic import TypeAdapter, ValidationError

from actuator_lti.errors import InputError
from actuator_lti.files.atomic import write_bytes
from reports.nightly.figures import Figure
from reports.nightly.records import Baseline, Content, Index, Named, Night, Result, Run, packed, unpacked
from reports.nightly.state import INDEX, NIGHTS, Memory
from reports.nightly.text import one_line, sha256

SCHEMA: Final = "actuator-lti/nightly-history"
VERSION = 1
_REMEDY = f"restore it from a copy, or move {INDEX} away and begin anew on purpose with --accept-lost-history"
Shape = TypeVar("Shape")
Reported = tuple[Sequence[Figure], dict[str, Any]]  # figures and inputs


@dataclass(frozen=True, kw_only=True)
class _Head:
    schema: Literal["actuator-lti/nightly-history"]
    version: int


@dataclass(frozen=True, kw_only=True)
class _Sealed(_Head):
    sha256: str
    index: Index


_HEAD, _SEALED = TypeAdapter(_Head), TypeAdapter(_Sealed)
_INDEX, _NIGHT = TypeAdapter(Index), TypeAdapter(Night)


class History:
    """Reader and writer of the history in a state folder; see `open_history`."""

    def __init__(self, state: Path, index: Index) -> None:
        self.state, self.index = state, index
        self._nights: dict[int, Night] = {}

    # ---- writing -----------------------------------------------------------------------------------

    def start_run(self, **about: Any) -> Run:
        """Note that a night has begun (see `Run`); an earlier one that never ended is ``interrupted``."""
        unended = [*self.index.interrupted, *filter(None, [self.index.running])]
        run = Run(id=self.index.begun + 1, **about)
        self._put(replace(self.index, begun=run.id, running=run.started, interrupted=unended))
        return run

    def finish_run(self, run: Run, finished: str, results: Iterable[tuple[Result, Reported | None]]) -> None:
        """Write a whole night: results, each with what was reported of it."""
        layouts: dict[tuple[Named, ...], int] = {}
        stored = [one if of is None else self._stored(one, *of, layouts) for one, of in results]
        night = Night(id=run.id, layouts=[list(layout) for layout in layouts], results=stored)
        data = _NIGHT.dump_json(night)
        write_bytes(self._path(run.id), data)
        ended = replace(run, finished=finished, sha256=sha256(data))
        self._put(replace(self.index, running="", runs=[*self.runs, ended]))

    def _stored(
        self, result: Result, figures: Sequence[Figure], inputs: dict[str, Any],
        layouts: dict[tuple[Named, ...], int],
    ) -> Result:  # fmt: skip
        """The result with its content, or with the night that has the same of this design."""
        layout, values = tuple((f.name, f.unit, f.better, f.kind) for f in figures), packed(figures)
        before = self.first(result.name, reversed(self.runs))
        if before is not None and before.home is not None:
            night, content = self.night(before.home), self._content(before)
            known = (tuple(night.layouts[content.layout]), content.values, content.inputs)
            if known == (layout, values, inputs):
                return replace(result, home=before.home)
        place = layouts.setdefault(layout, len(layouts))
        return replace(result, home=result.run, content=Content(layout=place, values=values, inputs=inputs))

    def approve(self, run: int, names: Sequence[str] | None, **about: str) -> None:
        """Make a night the baseline (see `Baseline`) of some designs, or of all (``None``)."""
        every: Sequence[str | None] = [None] if names is None else names
        more = [Baseline(run=run, name=name, **about) for name in every]
        self._put(replace(self.index, baselines=[*self.index.baselines, *more]))

    def claim(self, study: str) -> None:
        """Note whose history this is; that of another study is refused."""
        known = self.index.study
        if not known:
            self._put(replace(self.index, study=study))
        elif known != study:
            of = f"{known[:80]!r}, not of {study[:80]!r}"
            raise InputError(f"holds the nights of study {of}: use another --site")

    def _put(self, index: Index) -> None:
        checksum = sha256(_INDEX.dump_json(index))
        sealed = _Sealed(schema=SCHEMA, version=VERSION, sha256=checksum, index=index)
        write_bytes(self.state / INDEX, _SEALED.dump_json(sealed))
        self.index = index

    # ---- reading -----------------------------------------------------------------------------------

    @property
    def runs(self) -> list[Run]:
        return self.index.runs

    def memory(self) -> Memory:
        """How much there is, for the site to remember."""
        return Memory(self.index.id, len(self.runs), len(self.index.baselines))

    def night(self, run: int) -> Night:
        """The results of a finished night; a file that is missing, or not what was written, is refused."""
        if run not in self._nights:
            wanted, path = next(one for one in self.runs if one.id == run), self._path(run)
            data = _read(path)
            if sha256(data) != wanted.sha256:
                raise _damaged(path, "is not what was written")
            self._nights[run] = _valid(_NIGHT, data, path)
        return self._nights[run]

    def results(self, name: str, last: int | None = None) -> list[Result]:
        """Results of a design in the order of the nights; only of the last so many that have one."""
        from_last = (self.night(run.id).by_name for run in reversed(self.runs))
        found = (by_name[name] for by_name in from_last if name in by_name)
        return list(islice(found, last))[::-1]

    def first(self, name: str, runs: Iterable[Run]) -> Result | None:
        """What a design came to in the first of some nights that has figures of it."""
        found = (self.night(run.id).by_name.get(name) for run in runs)
        return next((result for result in found if result is not None and result.home is not None), None)

    def _content(self, result: Result) -> Content:
        content = self.night(result.home or 0).by_name[result.name].content
        assert content is not None
        return content

    def numbers(self, result: Result) -> tuple[tuple[Figure, ...], np.ndarray]:
        """Figures of a result without their values, and the values; none where there is no result."""
        if result.home is None:
            return (), np.empty(0)
        content = self._content(result)
        return self.night(result.home).figures[content.layout], unpacked(content.values)

    def inputs(self, result: Result) -> dict[str, Any]:
        return {} if result.home is None else self._content(result).inputs

    def figures(self, result: Result) -> dict[str, Figure]:
        layout, values = self.numbers(result)
        pairs = zip(layout, values.tolist(), strict=True)
        return {figure.name: replace(figure, value=None if v != v else v) for figure, v in pairs}

    def matrix(self, results: Sequence[Result], names: Sequence[str]) -> np.ndarray:
        """Values of some figures over some results, (results x names); NaN where there is none."""
        column = {name: j for j, name in enumerate(names)}
        places: dict[int, np.ndarray] = {}
        values = np.full((len(results), len(names)), np.nan)
        for row, result in zip(values, results, strict=True):
            layout, numbers = self.numbers(result)
            if id(layout) not in places:
                pairs = [(i, column[f.name]) for i, f in enumerate(layout) if f.name in column]
                places[id(layout)] = np.array(pairs, dtype=int).reshape(-1, 2).T
            source, target = places[id(layout)]
            row[target] = numbers[source]
        return values

    def _path(self, run: int) -> Path:
        return self.state / NIGHTS / f"{run:06d}.json"


def open_history(state: Path) -> History:
    """Open (or begin) the history of a state folder; one that is damaged or newer is refused."""
    path = state / INDEX
    if not path.exists() or not path.stat().st_size:
        return History(state, Index(id=secrets.token_hex(16)))
    data = _read(path)
    try:
        head = _HEAD.validate_json(data, strict=True)
    except ValidationError as error:
        raise InputError(f"is no history of a nightly build: {_REMEDY}", where=str(path)) from error
    if head.version > VERSION:
        reason = f"has version {head.version}, this actuator-lti knows up to {VERSION}: use a newer one"
        raise InputError(reason, where=str(path))
    sealed = _valid(_SEALED, data, path)
    if sha256(_INDEX.dump_json(sealed.index)) != sealed.sha256:
        raise _damaged(path, "is not what was written")
    return History(state, sealed.index)


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError as error:
        raise _damaged(path, "is missing") from error
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", where=str(path)) from error


def _valid(shape: TypeAdapter[Shape], data: bytes, path: Path) -> Shape:
    try:
        return shape.validate_json(data, strict=True)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        at = ".".join(map(str, first["loc"]))
        raise _damaged(path, one_line(f"{at}: {first['msg']}", 200)) from error


def _damaged(path: Path, what: str) -> InputError:
    return InputError(f"is damaged ({what}): {_REMEDY}", where=str(path))
