"""A tick written into the history, or gathered for the reducers."""

from __future__ import annotations

from nonlinear._kernels import layout
from nonlinear._kernels.compiled import inlined


@inlined
def record(history, flag_history, row, flags, ref, y, w, i, u, i_ref, w_ref, th):  # type: ignore[no-untyped-def]
    """Write the columns that every run has."""
    history[0, row] = ref
    history[1, row] = y
    history[2, row] = w
    history[3, row] = i
    history[4, row] = u
    history[5, row] = i_ref
    history[6, row] = w_ref
    history[7, row] = th
    flag_history[row] = flags


@inlined
def record_probes(p, history, row, u0, u, i0, i_ref, w0, w_ref, y0, y1):  # type: ignore[no-untyped-def]
    """Write what stands in front of and behind each active probe, in the order of the points."""
    col = layout.HISTORY_PROBES
    if p[layout.PROBES + layout.POINT_VOLTAGE * layout.PROBE_SIZE] > 0.0:
        history[col, row], history[col + 1, row] = u0, u
        col += 2
    if p[layout.PROBES + layout.POINT_CURRENT * layout.PROBE_SIZE] > 0.0:
        history[col, row], history[col + 1, row] = i0, i_ref
        col += 2
    if p[layout.PROBES + layout.POINT_SPEED * layout.PROBE_SIZE] > 0.0:
        history[col, row], history[col + 1, row] = w0, w_ref
        col += 2
    if p[layout.PROBES + layout.POINT_OUTPUT * layout.PROBE_SIZE] > 0.0:
        history[col, row], history[col + 1, row] = y0, y1


@inlined
def collect(sig, ref, y, w, i, u, i_ref, w_ref, u0, i0, w0, y0, y1):  # type: ignore[no-untyped-def]
    """Gather the signals in the order of ``layout.SIGNALS``."""
    sig[0], sig[1], sig[2], sig[3], sig[4] = ref, y, w, i, u
    sig[5], sig[6] = i_ref, w_ref
    sig[7], sig[8], sig[9], sig[10] = u0, u, i0, i_ref
    sig[11], sig[12], sig[13], sig[14] = w0, w_ref, y0, y1
