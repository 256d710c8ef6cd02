"""What the toolkit says of some hundred loops, as JSON: run as a script, once for each kind of machine.

``discrete`` has to be the same on every machine, ``figures`` to 1e-9.
"""

import cmath
import json
import math
import sys
from typing import Any

import control
import numpy as np

from actuator_lti import assemble_loops, closed_loop_bandwidth, load_design, stability_margins, step_figures
from actuator_lti.batch import Population, linear_figures
from actuator_lti.design import parameter_value
from actuator_lti.errors import InputError, NumericalError

DESIGNS = ("ilr33-amber", "ilr33-amber-multirate", "ctms-motor-position", "emps")
FORMS = ("sampled", "continuous", "ideal")
RANDOM = 60
POPULATION = 24


def random_loop(rng: np.random.Generator, k: int) -> control.LTI:
    """Loop of order 2 to 8 over three decades: k decides whether sampled, and whether as matrices.

    In plain Python: numpy's exp and products differ in the last place from processor to processor, and the
    loop has to be the same.
    """
    sampled = bool(k % 2)
    order = int(rng.integers(2, 9))
    roots: list[complex] = []
    while len(roots) < order:
        w = 10.0 ** float(rng.uniform(-1.0, 2.0))
        if len(roots) + 2 <= order and rng.random() < 0.5:
            zeta = 10.0 ** float(rng.uniform(-2.0, 0.0)) * 0.99
            roots += [w * complex(-zeta, sign * math.sqrt(1.0 - zeta**2)) for sign in (1.0, -1.0)]
        else:
            roots.append(complex(-w if rng.random() < 0.9 else 0.0))
    zeros = [complex(-(10.0 ** float(rng.uniform(-1.0, 2.0)))) for _ in range(int(rng.integers(0, order)))]
    if sampled:
        roots, zeros = [cmath.exp(0.01 * p) for p in roots], [cmath.exp(0.01 * q) for q in zeros]
    num, den = polynomial(zeros), polynomial(roots)
    at = cmath.exp(0.1j) if sampled else 10j
    gain = 10.0 ** float(rng.uniform(-1.0, 1.0)) * abs(value(den, at) / value(num, at))
    num = [gain * c for c in num]
    dt = 0.01 if sampled else 0
    if not k % 4 < 2:
        return control.tf(num, den, dt)
    A = np.diag(np.ones(order - 1), -1)
    A[0] = [-c for c in den[1:]]
    c = np.array([[0.0] * (order - len(num)) + num])
    return control.StateSpace(A, np.eye(order)[:, :1], c, [[0.0]], dt, remove_useless_states=False)


def polynomial(roots: list[complex]) -> list[float]:
    """Coefficients, highest power first, one root after the other."""
    p = [1.0 + 0j]
    for root in roots:
        p = [a - root * b for a, b in zip([*p, 0j], [0j, *p], strict=True)]
    return [c.real for c in p]


def value(p: list[float], x: complex) -> complex:
    """Horner."""
    total = 0j
    for c in p:
        total = total * x + c
    return total


class Facts:
    """Collects facts by name."""

    def __init__(self) -> None:
        self.discrete: dict[str, Any] = {}
        self.figures: dict[str, list[float]] = {}

    def of_loop(self, name: str, loop: Any) -> None:
        """Verdict, crossings and their figures of an open loop."""
        try:
            m = stability_margins(loop)
        except (InputError, NumericalError) as error:
            self.discrete[name] = type(error).__name__
            return
        self.discrete[name] = [
            m.verdict, m.withheld, len(m.gain_margins), len(m.phase_margins), len(m.delay_margins)
        ]  # fmt: skip
        crossings = [x for g in m.gain_margins for x in (g.db, g.frequency_rad_s)]
        crossings += [x for p in m.phase_margins for x in (p.deg, p.frequency_rad_s)]
        self.figures[name] = [*crossings, m.modulus_margin or 0.0]

    def of_response(self, name: str, response: Any) -> None:
        """Bandwidth and step of a closed loop."""
        try:
            band, step = closed_loop_bandwidth(response), step_figures(response)
        except (InputError, NumericalError) as error:
            self.discrete[name] = type(error).__name__
            return
        given = (band.minus3db_rad_s, band.minus90deg_rad_s)
        self.discrete[name] = [x is not None for x in given] + [len(band.crossings_rad_s)]
        self.figures[name] = [
            *(x or 0.0 for x in given), band.resonance_peak_db, step.rise_time_s, step.settling_time_s,
            step.overshoot_percent, step.final_value,
        ]  # fmt: skip

    def of_designs(self, name: str) -> None:
        """The compiled figures of designs around a shipped one."""
        design = load_design(name)
        rng = np.random.default_rng(3)
        path = "control.position.gain"
        factors = rng.uniform(0.2, 5.0, POPULATION)
        resistance = parameter_value(design, "motor.resistance") * rng.uniform(0.7, 1.3, POPULATION)
        values = {path: parameter_value(design, path) * factors, "motor.resistance": resistance}
        result = linear_figures(Population(design, values, POPULATION))
        for loop in result.loops:
            gain, phase = result.gain_crossovers(loop), result.phase_crossovers(loop)
            self.discrete[f"many {name} {loop}"] = [
                result.stable(loop).tolist(), gain.crossings.tolist(), phase.crossings.tolist()
            ]  # fmt: skip
            table = [
                result.quantity(q, loop)
                for q in ("gain_margin", "phase_margin", "modulus_margin", "bandwidth")
            ]
            self.figures[f"many {name} {loop}"] = np.nan_to_num(np.concatenate(table), posinf=1e300).tolist()


def main() -> None:
    """Print everything."""
    facts = Facts()
    rng = np.random.default_rng(11)
    for k in range(RANDOM):
        facts.of_loop(f"random {k}", random_loop(rng, k))
    for name in DESIGNS:
        for form in FORMS:
            loops = assemble_loops(load_design(name), form=form)
            for loop_name, loop in loops.present.items():
                facts.of_loop(f"{name} {form} {loop_name}", loop.open_loop)
                facts.of_response(f"{name} {form} {loop_name} closed", loop.closed_loop)
    for name in ("ilr33-amber", "ilr33-amber-multirate"):
        facts.of_designs(name)
    json.dump({"discrete": facts.discrete, "figures": facts.figures}, sys.stdout)


if __name__ == "__main__":
    main()
