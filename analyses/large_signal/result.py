"""Everything that is said of large signals, in one result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from actuator_lti.design.model import Design
from actuator_lti.loops import assemble_loops
from analyses.large_signal.bode import AmplitudeBode, amplitude_bode
from analyses.large_signal.border import BorderCheck, check_border
from analyses.large_signal.map import AMPLITUDES, FREQUENCIES, AmplitudeMap, amplitude_map
from analyses.large_signal.sawtooth import Sawtooth, sawtooth

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from actuator_lti.loops import Loops

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class LargeSignals:
    """Map, border, amplitude Bode and sawtooth of a design.

    Attributes
    ----------
    design : Design
    map : AmplitudeMap
        With friction, no load.
    border : BorderCheck or None
        Without dry friction: held to `border.TOLERANCE`. ``None`` where the loop is unstable.
    border_with_friction : BorderCheck or None
        The same with friction: how far it moves the border; ``None`` without dry friction.
    bode : AmplitudeBode
    sawtooth : Sawtooth
    """

    design: Design
    map: AmplitudeMap
    border: BorderCheck | None
    border_with_friction: BorderCheck | None
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
    progress: Progress | None = None,
) -> LargeSignals:
    """Look at large signals from every side (model.md section 5).

    Parameters
    ----------
    design : Design
    loops : Loops, optional
        Sampled and sliding, of this design, if they are there already.
    counts : (int, int)
        Amplitudes and frequencies of the map.
    progress : callable, optional
        Called with (steps done, steps in all).

    Raises
    ------
    InputError, NumericalError
        As `assemble_loops` and `simulate`.
    """

    def step(done: int) -> None:
        if progress is not None:
            progress(done, 4)

    loops = assemble_loops(design) if loops is None else loops
    map_ = amplitude_map(design, loops, counts=counts)
    step(1)
    border = check_border(design, loops)
    step(2)
    dry = design.friction.dry_Nm(0.0, 1) + design.friction.dry_Nm(0.0, -1) > 0.0
    shifted = check_border(design, loops, friction_on=True) if dry else None
    step(3)
    teeth = sawtooth(design)
    step(4)
    return LargeSignals(design, map_, border, shifted, amplitude_bode(design, loops, map_), teeth)
