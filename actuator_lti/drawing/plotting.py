"""Figures of loops, runs and maps with matplotlib, in one style; every function returns its axes.

matplotlib is imported when a figure is drawn, not before. Results have these as methods:
``loops.position.plot_bode()``, ``run.plot()``, ``survey.plot_map()``. Each takes ``axes`` of a figure of your
own; without, it makes one. The figures of reports are drawn elsewhere (`reports.charts`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator_lti.bandwidth import closed_loop_bandwidth
from actuator_lti.design.field import unit_on
from actuator_lti.errors import InputError, positive_number, shown
from actuator_lti.margins import stability_margins
from actuator_lti.margins.given import given_of
from actuator_lti.margins.measured.margins import measured_points
from actuator_lti.measured.response import is_measured, measured_response, refuse_measured
from actuator_lti.start.extras import need
from actuator_lti.start.public_arguments import guard
from actuator_lti.systems.phase import unwrapped_phase_deg
from actuator_lti.systems.resolvent import apart_about_minus_one, refined

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from actuator_lti.loops.limiters import Onset
    from actuator_lti.loops.result import Loop
    from actuator_lti.margins.results import StabilityMargins

__all__ = [
    "plot_bode", "plot_map", "plot_nyquist", "plot_onset", "plot_run", "plot_step", "style",
]  # fmt: skip

# Those of the reports (`reports.charts.chart`), of Okabe and Ito, darkened for white paper.
COLOURS = ("#0072b2", "#c46200", "#00805f", "#8e4585", "#c0392b", "#3a8fc4", "#7a5c1e", "#1f2933", "#66727f")
RED, GREEN, INK, MUTED = "#c0392b", "#00805f", "#1f2933", "#66727f"
STYLE: dict[str, Any] = {
    "axes.grid": True, "axes.spines.right": False, "axes.spines.top": False, "axes.titlesize": "medium",
    "figure.figsize": (6.4, 4.6), "grid.alpha": 0.35, "grid.linewidth": 0.6, "legend.fontsize": "small",
    "legend.frameon": False, "lines.linewidth": 1.6, "svg.fonttype": "none",
}  # fmt: skip
_POINTS = 600


@contextmanager
def style() -> Iterator[Any]:
    """matplotlib.pyplot in the style of all figures, for figures of your own beside them.

    Raises `InputError`: where matplotlib is not installed.

    Examples
    --------
    >>> with style() as pyplot:
    ...     figure, axes = pyplot.subplots()
    >>> pyplot.close(figure)
    """
    pyplot = need("matplotlib.pyplot", "plot", "plotting")
    cycler = need("cycler", "plot", "plotting").cycler
    import matplotlib

    look: dict[Any, Any] = {**STYLE, "axes.prop_cycle": cycler(color=COLOURS)}
    with matplotlib.rc_context(look):
        yield pyplot


def _panels(axes: Any, rows: int, **options: Any) -> list[Axes]:
    """The axes given, or those of a new figure, one above the other."""
    if axes is not None:
        given = list(np.atleast_1d(np.asarray(axes, dtype=object)).ravel())
        if len(given) != rows or not all(hasattr(one, "plot") for one in given):
            raise InputError(f"axes: allowed: {rows} of matplotlib's axes")
        return given
    with style() as pyplot:
        made = pyplot.subplots(rows, 1, sharex=rows > 1, layout="constrained", **options)[1]
    return list(np.atleast_1d(made))


def frequencies(system: Any, margins: StabilityMargins | None = None) -> np.ndarray:
    """Frequencies in rad/s that show a system: about its crossovers, up to Nyquist where it is sampled."""
    import control

    with np.errstate(all="ignore"):
        usual = np.asarray(control.frequency_response(system).omega)
    result: list[Any] = [] if margins is None else [*margins.gain_margins, *margins.phase_margins]
    at = [one.frequency_rad_s for one in result if 0.0 < one.frequency_rad_s < np.inf]
    low, high = (min(at) / 30.0, max(at) * 10.0) if at else (usual[usual > 0.0][0], usual[-1])
    if system.isdtime(strict=True):
        high = np.pi / system.dt
    return np.geomspace(min(low, high / 100.0), high * (1.0 - 1e-9), _POINTS)


def response(system: Any, omega_rad_s: np.ndarray) -> np.ndarray:
    """Complex response of a SISO system at real frequencies, sampled or continuous."""
    s = 1j * omega_rad_s
    return np.asarray(system(np.exp(s * system.dt) if system.isdtime(strict=True) else s)).ravel()


def _drawable(system: Any) -> Any:
    """A system that python-control draws: of scipy.signal the same as its own; refused where it is none."""
    if not hasattr(system, "delays_s"):
        given = given_of(system)
        if not hasattr(system, "isdtime"):
            from control import ss, tf

            parts = (getattr(given, name) for name in given.entries)
            return (tf if given.A is None else ss)(*parts, given.period_s or 0)
    return system


def _curve(system: Any, margins: StabilityMargins | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies that show a system and its response there; of measured data their own points."""
    if is_measured(system):
        omega, L, _ = measured_points(measured_response(system), None)
        return omega, L
    system = _drawable(system)
    omega = frequencies(system, margins)
    return omega, response(system, omega)


def plot_bode(
    system: Any, *, label: str = "", margins: StabilityMargins | None = None, axes: Any = None
) -> list[Axes]:
    """Magnitude in dB and unwrapped phase in degrees over frequency in Hz.

    ``system``: python-control system, DelaySystem or measured data, SISO.
    ``label``: for the legend.
    ``margins``: of this open loop: each gain and phase margin is drawn where it is.
    ``axes``: two of matplotlib's axes; several systems go into one figure this way.

    Examples
    --------
    >>> from actuator_lti import assemble_loops
    >>> from actuator_lti.drawing.plotting import plot_bode
    >>> loops = assemble_loops("ilr33-amber")
    >>> both = plot_bode(loops.position.closed_loop, label="T")
    >>> _ = plot_bode(loops.position.sensitivity, label="S", axes=both)
    >>> both[1].get_xlabel()
    'frequency, Hz'
    """
    magnitude, phase = _panels(axes, 2)
    omega, L = _curve(system, margins)
    hertz = omega / (2.0 * np.pi)
    turned = np.degrees(np.unwrap(np.angle(L))) if is_measured(system) else unwrapped_phase_deg(system, omega)
    with np.errstate(divide="ignore"):
        magnitude.semilogx(hertz, 20.0 * np.log10(np.abs(L)), label=label or None)
    phase.semilogx(hertz, turned)
    magnitude.set_ylabel("magnitude, dB")
    phase.set(xlabel="frequency, Hz", ylabel="phase, deg")
    if margins is not None:
        _mark_margins(magnitude, phase, margins, omega, turned)
    if label:
        magnitude.legend()
    return [magnitude, phase]


def _mark_margins(
    magnitude: Axes, phase: Axes, margins: StabilityMargins, omega: np.ndarray, turned: np.ndarray
) -> None:
    magnitude.axhline(0.0, color=INK, linewidth=0.8)
    words: dict[str, Any] = {"xytext": (4, 0), "textcoords": "offset points", "fontsize": "small"}
    words["bbox"] = {"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.5}
    for gain, part in _at_heights(margins.gain_margins):
        at = gain.frequency_rad_s / (2.0 * np.pi)
        magnitude.plot([at, at], [0.0, -gain.db], color=RED, linewidth=2.4)
        magnitude.annotate(f"{gain.db:+.1f} dB", (at, -gain.db * part), color=RED, **words)
    for margin, part in _at_heights(margins.phase_margins):
        at = margin.frequency_rad_s / (2.0 * np.pi)
        here = float(np.interp(margin.frequency_rad_s, omega, turned))
        phase.plot([at, at], [here - margin.deg, here], color=GREEN, linewidth=2.4)
        phase.annotate(f"{margin.deg:+.1f}°", (at, here - margin.deg * part), color=GREEN, **words)
        phase.axhline(here - margin.deg, color=INK, linewidth=0.8)


def _at_heights(margins: Sequence[Any]) -> Iterator[tuple[Any, float]]:
    """Each margin, and at which part of its bar its words stand: those of neighbours at different heights."""
    return ((one, (k + 1) / (len(margins) + 1)) for k, one in enumerate(margins))


def plot_nyquist(system: Any, *, label: str = "", axes: Any = None) -> Axes:
    """The locus of an open loop near -1, in the square that holds the unit circle twice.

    Examples
    --------
    >>> from actuator_lti import assemble_loops
    >>> from actuator_lti.drawing.plotting import plot_nyquist
    >>> plot_nyquist(assemble_loops("ilr33-amber").position.open_loop).get_xlabel()
    'real part'
    """
    (panel,) = _panels(axes, 1, figsize=(4.8, 4.8))
    omega, L = _curve(system)
    if not is_measured(system):
        L = refined(partial(response, _drawable(system)), omega, partial(apart_about_minus_one, frame=2.0))[1]
    turn = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 200))
    panel.plot(turn.real, turn.imag, color=MUTED, linewidth=0.8, linestyle="--")
    panel.plot(L.real, L.imag, label=label or None)
    panel.plot([-1.0], [0.0], "+", color=RED, markersize=10)
    panel.set(xlim=(-2, 2), ylim=(-2, 2), aspect="equal", xlabel="real part", ylabel="imaginary part")
    if label:
        panel.legend()
    return panel


def plot_step(system: Any, *, duration_s: float | None = None, label: str = "", axes: Any = None) -> Axes:
    """Unit step response of a closed loop; without a duration, eight times 1/bandwidth (in rad/s).

    Examples
    --------
    >>> from actuator_lti import assemble_loops
    >>> from actuator_lti.drawing.plotting import plot_step
    >>> plot_step(assemble_loops("ilr33-amber").position.closed_loop).get_ylabel()
    'response to a unit step'
    """
    import control

    refuse_measured(system)
    if duration_s is None:
        result = closed_loop_bandwidth(system).minus3db_rad_s
        duration_s = 8.0 / result if result and np.isfinite(result) else 1.0
    duration_s, system = positive_number("duration_s", duration_s), _drawable(system)
    (panel,) = _panels(axes, 1)
    sampled = system.isdtime(strict=True)
    times = np.arange(0.0, duration_s, system.dt) if sampled else np.linspace(0.0, duration_s, _POINTS)
    values = np.asarray(control.step_response(system, times).y).ravel()
    panel.plot(1e3 * times, values, drawstyle="steps-post" if sampled else "default", label=label or None)
    panel.axhline(1.0, color=INK, linewidth=0.8)
    panel.set(xlabel="time, ms", ylabel="response to a unit step")
    if label:
        panel.legend()
    return panel


def loop_bode(loop: Loop, axes: Any = None) -> list[Axes]:
    """Bode figure of the open loop of a `Loop`, its margins drawn; see `Loop.plot_bode`."""
    return plot_bode(loop.open_loop, label=loop.name, margins=stability_margins(loop.open_loop), axes=axes)


def plot_run(run: Any, axes: Any = None) -> list[Axes]:
    """Angle, speed, current, voltage of a run over time; grey: the rotor rests, red: a limit acts.

    ``axes``: four of matplotlib's axes, see `nonlinear.Trajectory.plot`.
    """
    if not hasattr(run, "reference_rad"):
        raise InputError(f"run = {shown(run)}: must be a Trajectory, as nonlinear.simulate gives")
    angle, speed, current, voltage = _panels(axes, 4, figsize=(6.4, 7.2))
    factor, unit = _shown_angle(run.axis == "linear")
    scale, time_unit = (1e3, "ms") if run.time_s[-1] < 1.0 else (1.0, "s")
    time = scale * run.time_s
    panels = {"position": (angle, factor), "velocity": (speed, run.ratio), "current": (current, 1.0)}
    ordered, size = panels.get(run.stage, (voltage, 1.0))
    ordered.plot(time, size * run.reference_rad, color=MUTED, linewidth=1.0, label="command")
    angle.plot(time, factor * run.output_angle_rad, label="output")
    speed.plot(time, run.motor_speed_rad_s)
    current.plot(time, run.current_A)
    voltage.step(time, run.voltage_V, where="post")
    angle.set(ylabel=f"output, {unit}", title=run.design_name)
    speed.set_ylabel(f"motor, {unit_on(run.axis, '{angle}/s')}")
    current.set_ylabel("current, A")
    voltage.set(ylabel="voltage, V", xlabel=f"time, {time_unit}")
    for panel in (angle, speed, current, voltage):
        _shade(panel, time, run.at_rest, MUTED)
        _shade(panel, time, run.limited, RED)
    ordered.legend()
    return [angle, speed, current, voltage]


def _shade(panel: Axes, time: np.ndarray, where: np.ndarray, colour: str) -> None:
    if np.any(where):
        panel.fill_between(time, 0.0, 1.0, where=where, step="post", color=colour, alpha=0.15, linewidth=0.0,
                           transform=panel.get_xaxis_transform())  # fmt: skip


def plot_onset(onset: Onset, *, linear_axis: bool = False, axes: Any = None) -> Axes:
    """The limit of linear validity: the command amplitude over frequency at which each limiter sets in.

    Examples
    --------
    >>> import numpy as np
    >>> from actuator_lti import assemble_loops, onset
    >>> from actuator_lti.drawing.plotting import plot_onset
    >>> plot_onset(onset(assemble_loops("ilr33-amber"), np.geomspace(1, 1000, 50))).get_yscale()
    'log'
    """
    (panel,) = _panels(axes, 1)
    hertz = onset.omega_rad_s / (2.0 * np.pi)
    factor = _amplitude_axes(panel, linear_axis)
    for name, amplitude in onset.each_rad.items():
        there = np.isfinite(amplitude)
        if np.any(there):
            label = name if name == "cogging" else f"{name} limit"
            panel.loglog(hertz[there], factor * amplitude[there], label=label)
    panel.legend(title="first reached, linear loop")
    return panel


def plot_map(
    frequency_hz: np.ndarray, amplitude_rad: np.ndarray, kind: np.ndarray, names: Sequence[str], *,
    onset_rad: Mapping[str, np.ndarray] | None = None, linear_axis: bool = False, axes: Any = None
) -> Axes:  # fmt: skip
    """A map of amplitude and frequency: a colour for what acts at each point, lines for the linear onset."""
    frequency_hz, amplitude_rad, kind = map(np.asarray, (frequency_hz, amplitude_rad, kind))
    if kind.ndim != 2 or (amplitude_rad.shape, frequency_hz.shape) != (kind.shape[:1], kind.shape[1:]):
        raise InputError("kind: must have a row for each of amplitude_rad, a column for each of frequency_hz")
    (panel,) = _panels(axes, 1)
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    factor = _amplitude_axes(panel, linear_axis)
    present = [k for k in range(len(names)) if np.any(kind == k)]
    shades = {k: COLOURS[k % len(COLOURS)] if names[k] != "none" else "#ffffff" for k in present}
    colours, codes = ListedColormap(list(shades.values())), np.searchsorted(present, kind)
    look: Any = {"vmin": -0.5, "vmax": len(present) - 0.5, "alpha": 0.45, "shading": "nearest"}
    panel.pcolormesh(frequency_hz, factor * amplitude_rad, codes, cmap=colours, **look)
    for amplitude in (onset_rad or {}).values():
        panel.plot(frequency_hz, factor * amplitude, color=INK, linewidth=1.0)
    low, high = factor * amplitude_rad.min(), factor * amplitude_rad.max()
    panel.set(ylim=(low, high), xlim=(frequency_hz.min(), frequency_hz.max()))
    patches = [Patch(facecolor=c, edgecolor=MUTED, alpha=0.6, label=names[k]) for k, c in shades.items()]
    panel.legend(
        handles=patches, title="what acts;\nlines: linear onset", loc="upper left", bbox_to_anchor=(1, 1)
    )
    return panel


def _amplitude_axes(panel: Axes, linear_axis: bool) -> float:
    """Logarithmic axes of a command's amplitude over frequency; what an amplitude is drawn times."""
    factor, unit = _shown_angle(linear_axis)
    panel.set(xscale="log", yscale="log", xlabel="frequency, Hz", ylabel=f"command amplitude, {unit}")
    return factor


def _shown_angle(linear_axis: bool) -> tuple[float, str]:
    return (1e3, "mm") if linear_axis else (float(np.degrees(1.0)), "deg")


guard(__name__)
