"""What the toolkit says of some hundred loops, as JSON: run as a script, once for each kind of machine.

Random loops are given to it: what draws them would not draw the same doubles on every machine. ``discrete``
has to be the same on every machine, ``figures`` to 1e-9.
"""

import json
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
POPULATION = 24


def made_of(*parts: Any) -> control.LTI:
    """A transfer function of three parts, a state space of five."""
    if len(parts) == 3:
        return control.tf(*parts)
    return control.StateSpace(*parts, remove_useless_states=False)


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
    for k, parts in enumerate(json.load(sys.stdin)):
        facts.of_loop(f"random {k}", made_of(*parts))
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
