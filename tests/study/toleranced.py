"""What tests of studies are made of: tolerances of one's own, distributions, requirements."""

import tomllib
from dataclasses import replace

import tomli_w

from actuator_lti import load_design, write_design
from actuator_lti.design.model import Design, Requirement, Tolerance
from analyses.studies.sampling import Factor
from analyses.tuning import TuningSettings

QUICK = TuningSettings(curve=False, check=False)


def toleranced(**percent: dict[str, float]) -> str:
    """A design file of the baseline, by table and key the tolerance in percent."""
    tree = tomllib.loads(write_design(load_design("ilr33-amber")))
    for table, keys in percent.items():
        for key, share in keys.items():
            tree[table][key]["tolerance"] = f"{share:g} %"
    return tomli_w.dumps(tree)


def asked_twice(design: Design) -> Design:
    """Of its requirements the current of the motor and the gain margin of every loop: a search for each."""
    kept = tuple(one for one in design.requirements if one.id in ("motor-current", "gain-margin"))
    return replace(design, requirements=kept)


def normal(path: str, nominal: float = 0.0, std: float = 1.0) -> Factor:
    return Factor(path, nominal, Tolerance(kind="normal", std=std))


def uniform(path: str, nominal: float, half: float) -> Factor:
    return Factor(path, nominal, Tolerance(kind="uniform", half_width=half))


def need(quantity, minimum, loop="velocity", unit="deg") -> Requirement:
    return Requirement(id=f"{loop}-{quantity}", quantity=quantity, unit=unit, minimum=minimum, loop=loop)
