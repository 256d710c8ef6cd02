"""Everything that is said of large signals, in one result."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from actuator_lti.design.model import Design
from actuator_lti.drive.operating import rubs
from actuator_lti.loops import assemble_loops
from analyses.large_signal.bode import AmplitudeBode, amplitude_bode
from analyses.large_signal.border import LimitShift, limit_shift
from analyses.large_signal.map import AMPLITUDES, FREQUENCIES, AmplitudeMap, amplitude_map
from analyses.large_signal.sawtooth import Sawtooth, sawtooth

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from actuator_lti.loops import Loops


@dataclass(frozen=True)
class LargeSignals:
    """Map, shift of the linear limit, amplitude Bode and sawtooth of a design.

    ``map``: with friction, no load.
    ``shift``: how far dry friction moves the linear limit; ``None`` without it, and where the loop is
    unstable.
    """

    design: Design
    map: AmplitudeMap
    shift: LimitShift | None
    bode: AmplitudeBode
    sawtooth: Sawtooth

    def plot_map(self, axes: Any = None) -> Axes:
        """Draw what acts at each amplitude and frequency; gives matplotlib's axes."""
        return self.map.plot_map(axes, linear_axis=self.design.axis == "linear")


def large_signals(
    design: Design,
    loops: Loops | None = None,
    *,
    counts: tuple[int, int] = (AMPLITUDES, FREQUENCIES),
) -> LargeSignals:
    """Look at large signals from every side (model.md section 5).

    Parameters
    ----------
    design : Design
    loops : Loops, optional
        Sampled and sliding, of this design, if they are there already.
    counts : (int, int)
        Amplitudes and frequencies of the map.

    Raises
    ------
    InputError, NumericalError
        As `assemble_loops` and `simulate`.
    """
    loops = assemble_loops(design) if loops is None else loops
    map_ = amplitude_map(design, loops, counts=counts)
    shift = limit_shift(design, loops) if rubs(design) else None
    return LargeSignals(design, map_, shift, amplitude_bode(design, loops, map_), sawtooth(design))
