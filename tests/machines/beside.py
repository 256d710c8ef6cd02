"""A processor that is not at hand: every result of linear algebra lies a few ulp beside what it was.

What a kernel returns is right to some ulp; which of the doubles near it comes out is the processor's affair.
Here it is drawn: each number that numpy.linalg and scipy.linalg return moves by up to `MOST` ulp. By how much
follows from the number and a seed alone, so that equal numbers stay equal (conjugate pairs pairs, symmetric
matrices symmetric, the same question has the same answer) and zero stays zero.
"""

import functools
import types
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.lib._polynomial_impl as polynomials
import scipy.linalg
import scipy.linalg.lapack

MOST = 4  # ulp
# They place or copy numbers, scale by powers of two, multiply, or tell a sign: no decomposition.
EXACT = {
    "block_diag", "circulant", "companion", "convolution_matrix", "cross", "dft", "dgebal", "diagonal",
    "diagsvd", "fiedler", "fiedler_companion", "find_best_blas_type", "get_blas_funcs", "get_lapack_funcs",
    "hadamard", "hankel", "helmert", "hilbert", "invhilbert", "invpascal", "kron", "leslie", "matmul",
    "matrix_balance", "matrix_transpose", "outer", "pascal", "slogdet", "test", "toeplitz", "trace", "tril",
    "triu", "vecdot", "zgebal",
}  # fmt: skip


def moved(result: Any, seed: int) -> Any:
    """Move every float of a result, in tuples too; what holds other things is given back as it is."""
    if isinstance(result, tuple):
        parts = [moved(part, seed) for part in result]
        return type(result)(*parts) if hasattr(result, "_fields") else tuple(parts)
    kind = getattr(result, "dtype", np.dtype(type(result)) if isinstance(result, float | complex) else None)
    if kind not in (np.float64, np.complex128):
        return result
    array = np.array(result, order="K", copy=True)
    parts = np.ascontiguousarray(array).reshape(-1).view(np.float64)
    new = _moved(parts, seed).view(kind).reshape(array.shape)
    array[...] = new
    return array if isinstance(result, np.ndarray) else array[()]


def _moved(values: np.ndarray, seed: int) -> np.ndarray:
    """Sizes moved by -MOST to MOST ulp, drawn by a mixing of their bits (splitmix64)."""
    bits = np.abs(values).view(np.uint64)
    with np.errstate(over="ignore"):
        h = bits + np.uint64((0x9E3779B97F4A7C15 * (seed + 1)) % 2**64)
        h = (h ^ (h >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        h = (h ^ (h >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        h ^= h >> np.uint64(31)
    by = (h % np.uint64(2 * MOST + 1)).astype(np.int64) - MOST
    free = np.isfinite(values) & (np.abs(values) > 1e-290)  # never to zero, never to infinity
    sizes = np.where(free, (bits.astype(np.int64) + np.where(free, by, 0)), bits.astype(np.int64))
    return np.copysign(sizes.view(np.float64), values)


def beside(function: Callable[..., Any], seed: int) -> Callable[..., Any]:
    """A function with its results moved."""

    @functools.wraps(function)
    def call(*given: Any, **named: Any) -> Any:
        return moved(function(*given, **named), seed)

    return call


def install(seed: int) -> None:
    """Move every result of linear algebra from now on; before the toolkit is imported."""
    for module in (np.linalg, scipy.linalg, scipy.linalg.lapack):
        for name, each in list(vars(module).items()):
            if name.startswith("_") or name in EXACT or isinstance(each, type | types.ModuleType):
                continue
            if callable(each):
                setattr(module, name, beside(each, seed))
    polynomials.eigvals = np.linalg.eigvals  # of numpy.roots
