"""The Nichols chart: its outlines are where S and T are 6 dB, about every critical point in sight."""

import numpy as np

from reports.charts import style
from reports.sections.loop_charts import nichols


def chart(phase_deg: list[float], gain_db: list[float]) -> dict[str, list[tuple[np.ndarray, np.ndarray]]]:
    made = nichols(np.array([1.0, 10.0]), np.array(gain_db), np.array(phase_deg))
    panel = made.columns[0].panels[0]
    curves: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {"S": [], "T": [], "+": []}
    for item in panel.items:
        if getattr(item, "x", None) is not None:
            kind = {style.ORANGE: "S", style.PURPLE: "T"}.get(item.look.colour, "")
            if item.look.marker == "+":
                kind = "+"
            if kind:
                curves[kind].append((item.x, item.y))
    return curves


def test_every_point_of_an_outline_has_that_peak() -> None:
    made = chart([-90.0, -700.0], [20.0, -30.0])
    for kind, magnitude in (("S", lambda L: 1 / abs(1 + L)), ("T", lambda L: abs(L / (1 + L)))):
        assert len(made[kind]) == 2  # about -180 and about -540 degrees
        for x, y in made[kind]:
            L = 10 ** (y / 20.0) * np.exp(1j * np.radians(x))
            np.testing.assert_allclose(20 * np.log10(magnitude(L)), 6.0, atol=1e-9)
            assert np.abs(np.diff(x)).max() < 60.0  # no jump of a turn


def test_the_critical_points_are_odd_half_turns() -> None:
    assert sorted(float(x[0]) for x, _ in chart([10.0, -700.0], [20.0, -30.0])["+"]) == [
        -540.0,
        -180.0,
        180.0,
    ]
