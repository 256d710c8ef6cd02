"""Samples of toleranced parameters: scrambled Sobol points (Owen 1998), each one reproducible alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtr, ndtri

from actuator_lti.bounds import CSV_COLUMNS, TABLE_BYTES, TABLE_ROWS
from actuator_lti.design.fields import field_of
from actuator_lti.design.model import Design, Tolerance
from actuator_lti.design.tolerances import drawn, together
from actuator_lti.design.writing import value_as_stated
from actuator_lti.errors import InputError
from actuator_lti.files.reading import read_bytes, shown, shown_path
from actuator_lti.start.extras import need

if TYPE_CHECKING:
    import pandas as pd

_BITS = 32
_SINGULAR = 1e-12  # what is left of a variance below this is rounding
_HALF_STEP = 0.5**33  # keeps every coordinate off 0 and 1
MOST_SAMPLES = 2**31
BOX_SIGMA = 3.0  # half width of the tolerance box of a normal distribution, in standard deviations


@dataclass(frozen=True)
class Factor:
    """One parameter (dotted key, SI value) with its distribution."""

    path: str
    nominal: float
    tolerance: Tolerance

    def quantile(self, u: np.ndarray) -> np.ndarray:
        """SI values at cumulative probabilities u in (0, 1)."""
        t = self.tolerance
        if t.kind == "uniform":
            return self.nominal + t.width * (2.0 * u - 1.0)
        if t.kind == "truncated-normal":
            low = ndtr((t.lower - self.nominal) / t.width)
            u = low + u * (ndtr((t.upper - self.nominal) / t.width) - low)
        return self.nominal + t.width * ndtri(u)

    @property
    def box(self) -> tuple[float, float]:
        """Smallest and largest value of the tolerance box; +-3 standard deviations of a normal one."""
        t = self.tolerance
        half_range = t.width if t.kind == "uniform" else BOX_SIGMA * t.width
        return max(self.nominal - half_range, t.lower), min(self.nominal + half_range, t.upper)


@dataclass(frozen=True)
class Table:
    """Samples from an identification: rows (SI) drawn with equal chance, all columns of a row together."""

    paths: tuple[str, ...]
    rows: np.ndarray
    origin: str = ""


@dataclass(frozen=True)
class Sampler:
    """Samples of the toleranced parameters of a design."""

    factors: tuple[Factor, ...]
    correlation: np.ndarray = field(repr=False)  # of the normal scores (Gaussian copula)
    table: Table | None = None  # drawn by a further coordinate
    seed: int = 0  # any integer from 0 on

    def __post_init__(self) -> None:
        if not self.paths:
            how = 'resistance = { value = "1 ohm", tolerance = "10 %" }'
            raise InputError(
                f"no parameter has a tolerance: give one in the design ({how}), or a file of samples"
            )
        if isinstance(self.seed, bool) or self.seed < 0:
            raise InputError(f"seed = {self.seed}: an integer from 0 on")

    @property
    def paths(self) -> tuple[str, ...]:
        """Dotted keys of the columns of `draw`."""
        return tuple(f.path for f in self.factors) + (self.table.paths if self.table else ())

    @property
    def dimensions(self) -> int:
        return len(self.factors) + (self.table is not None)

    def points(self, first: int, count: int) -> np.ndarray:
        """Points number first to first + count - 1 in the unit cube, shape (count, dimensions)."""
        from scipy.stats import qmc

        if first < 0 or count < 0 or first + count > MOST_SAMPLES:
            raise InputError(f"samples {first} to {first + count}: at most {MOST_SAMPLES}")
        rng = np.random.default_rng(self.seed)
        engine = qmc.Sobol(self.dimensions, scramble=True, bits=_BITS, rng=rng)
        if count == 0:
            return np.empty((0, self.dimensions))
        if first == 0:  # asked for alone, so that a count that is no power of two is no complaint
            return np.vstack([engine.random(1), engine.random(count - 1)]) + _HALF_STEP
        engine.fast_forward(first)
        return engine.random(count) + _HALF_STEP

    def draw(self, first: int, count: int) -> np.ndarray:
        """SI values of samples first to first + count - 1, shape (count, len(paths))."""
        points = self.points(first, count)
        size = len(self.factors)
        columns = self._correlated(points[:, :size])
        values = [factor.quantile(columns[:, k]) for k, factor in enumerate(self.factors)]
        if self.table is not None:
            rows = np.minimum((points[:, size] * len(self.table.rows)).astype(int), len(self.table.rows) - 1)
            values += list(self.table.rows[rows].T)
        return np.column_stack(values)

    def _correlated(self, points: np.ndarray) -> np.ndarray:
        """Uniform coordinates whose normal scores have the wanted correlation."""
        if np.array_equal(self.correlation, np.eye(len(self.factors))):
            return points
        root, scores = semidefinite_root(self.correlation), ndtri(points)
        mixed = np.zeros_like(scores)
        for i in range(len(root)):  # by hand, so that the bits do not depend on a library's blocking
            for j in range(i + 1):
                mixed[:, i] += root[i, j] * scores[:, j]
        return ndtr(mixed)

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner of the tolerance box, in the order of `paths`."""
        ends = [factor.box for factor in self.factors]
        if self.table is not None:
            rows = self.table.rows
            ends += list(zip(rows.min(axis=0), rows.max(axis=0), strict=True))
        lower, upper = np.array(ends).T
        return lower, upper

    @property
    def nominal(self) -> np.ndarray:
        """Nominal point (median of a table), in the order of `paths`."""
        middle = [factor.nominal for factor in self.factors]
        if self.table is not None:
            middle += list(np.median(self.table.rows, axis=0))
        return np.array(middle)


def semidefinite_root(matrix: np.ndarray) -> np.ndarray:
    """Lower triangular L with ``L L' = matrix``, also where two are one; an indefinite one is refused."""
    size = len(matrix)
    root = np.zeros((size, size))
    for j in range(size):
        left = float(matrix[j, j] - sum(root[j, k] ** 2 for k in range(j)))
        if left < -_SINGULAR:
            raise InputError("the correlations contradict each other: no such distribution exists")
        root[j, j] = np.sqrt(left) if left > _SINGULAR else 0.0
        for i in range(j + 1, size):
            rest = float(matrix[i, j] - sum(root[i, k] * root[j, k] for k in range(j)))
            if root[j, j] > 0.0:
                root[i, j] = rest / root[j, j]
            elif abs(rest) > _SINGULAR**0.5:
                raise InputError("the correlations contradict each other: no such distribution exists")
    return root


def correlation_of(design: Design, names: Sequence[str]) -> np.ndarray:
    """The correlation matrix of some toleranced parameters of a design; pairs beyond them are left out."""
    matrix = np.eye(len(names))
    for pair in design.correlations:
        if pair.first in names and pair.second in names:
            i, j = names.index(pair.first), names.index(pair.second)
            matrix[i, j] = matrix[j, i] = pair.coefficient
    return matrix


def sampler_of(design: Design, *, seed: int = 0, table: Table | None = None) -> Sampler:
    """The sampler of a design's tolerances and correlations; columns of a table replace tolerances.

    Refused where nothing has a tolerance, where one reaches values that its key does not allow, or a
    correlation names a key that has none.

    >>> from actuator_lti import load_design
    >>> sampler_of(load_design("ilr33-amber")).draw(5, 1).shape
    (1, 4)
    """
    taken, where = set(table.paths) if table else set(), design.origin or None
    factors = tuple(Factor(p, value, t) for p, value, t in drawn(design) if p not in taken)
    for factor in factors:
        allowed, ends = field_of(factor.path), factor.quantile(np.array([_HALF_STEP, 1.0 - _HALF_STEP]))
        if allowed is not None and not all(allowed.accepts(float(end)) for end in ends):
            end = value_as_stated(design, factor.path, float(ends[0]))
            said = f"{factor.path}: its {factor.tolerance.kind} tolerance reaches {end}, not allowed"
            raise InputError(f'{said}; take kind "truncated-normal" with lower and upper', where=where)
    names = [factor.path for factor in factors]
    for pair in design.correlations:
        for name in (pair.first, pair.second):
            if name not in names and not taken & {pair.first, pair.second}:
                raise InputError(f"correlation of {name}: it has no tolerance", where=where)
    return Sampler(factors, correlation_of(design, names), table, seed)


def read_table(path: str | Path, known: Sequence[str]) -> Table:
    """Read samples of parameters (one row a sample, columns by dotted key, SI) from CSV or Parquet."""
    need("pandas", "tables", "--from-samples")
    need("pyarrow", "tables", "--from-samples")
    import pandas as pd
    import pyarrow as pa

    where = shown_path(path)
    data = read_bytes(path, "CSV or Parquet file", TABLE_BYTES)
    try:
        frame = _parquet(data, where) if where.endswith(".parquet") else pd.read_csv(BytesIO(data))
    except InputError:
        raise
    except (OSError, ValueError, pa.ArrowException) as error:
        raise InputError(f"cannot be read as a table: {error}", where=where) from error
    TABLE_ROWS.check(len(frame), where, name="--from-samples")
    names = tuple(map(str, frame.columns))
    if unknown := [name for name in names if name not in known]:
        raise InputError(f"column {shown(unknown[0])}: no parameter of this design", where=where)
    try:
        rows = frame.to_numpy(dtype=float)
    except (ValueError, OverflowError, TypeError) as error:
        raise InputError(f"a value is no number: {error}", where=where) from error
    if rows.size == 0 or not np.all(np.isfinite(rows)):
        raise InputError("a table with at least one row of finite numbers is needed", where=where)
    return Table(names, rows, where)


def _parquet(data: bytes, where: str) -> pd.DataFrame:
    """A Parquet file, refused by what its head announces before it is unpacked."""
    import pyarrow.parquet as pq

    file = pq.ParquetFile(BytesIO(data))
    TABLE_ROWS.check(file.metadata.num_rows, where, name="--from-samples")
    CSV_COLUMNS.check(file.metadata.num_columns, where)
    return file.read().to_pandas()


def as_values(design: Design, paths: Sequence[str], draws: np.ndarray) -> Mapping[str, np.ndarray]:
    """Columns of draws by dotted key, as `actuator_lti.batch.Population` takes them, and what they move."""
    return together(design, {path: np.ascontiguousarray(draws[:, k]) for k, path in enumerate(paths)})
