"""`actuator-lti export linear`: every loop and response of a design as state space, for other programs.

The sampled form is exact; the continuous one carries its delays apart (`actuator_lti.systems.delay_system`).
What is written is one tree of names, units, matrices and margins.
"""

import io
import json
from dataclasses import asdict
from math import isfinite
from pprint import pformat
from typing import Any

import numpy as np

from actuator_lti.design import design_hash
from actuator_lti.design.model import Design
from actuator_lti.drive.profile import command_mean
from actuator_lti.errors import InputError
from actuator_lti.files.reading import Tree
from actuator_lti.loops import Form, Loop, Loops, assemble_loops, exact_margins
from actuator_lti.margins import stability_margins
from nonlinear.export.c_files import amperes_words, stage_words

SCHEMA = "actuator-lti/linear"
SUFFIXES = {"json": ".json", "mat": ".mat", "python": ".py"}
FORMS: tuple[Form, ...] = ("sampled", "continuous")
_MATRICES = ("A", "B", "C", "D")
_DELAYED = ("A", "B1", "B2", "C1", "C2", "D11", "D12", "D21", "D22", "delays_s")

_PYTHON = '''"""Linear models of the design {name}, hash {hash}; written by actuator-lti.

    system(MODELS["sampled"]["loops"]["position"]["open_loop"])      a python-control system
"""

# fmt: off
MODELS = {tree}
# fmt: on


def system(entry):
    """The python-control system of an entry of matrices; one with delays is actuator-lti's DelaySystem."""
    names = {{"inputs": [entry["input"]], "outputs": [entry["output"]], "name": entry["name"]}}
    if "delays_s" in entry:
        from actuator_lti.systems.delay_system import DelaySystem

        parts = ("A", "B1", "B2", "C1", "C2", "D11", "D12", "D21", "D22", "delays_s")
        return DelaySystem(*(entry[part] for part in parts), **names)
    import control

    return control.ss(entry["A"], entry["B"], entry["C"], entry["D"], entry["dt"], **names)
'''


def linear_models(design: Design) -> Tree:
    """The tree of a design at its usual operating point: per form its loops, break points and responses."""
    about = {"name": design.name, "revision": design.revision or "", "hash": design_hash(design)}
    about |= {"amperes": words} if (words := amperes_words(design)) else {}
    tree: Tree = {"schema": SCHEMA, "version": 1, "design": about}
    for form in FORMS[:1] if design.controller.sampled_only else FORMS:
        tree[form] = _form(assemble_loops(design, form))
    return tree


def _form(loops: Loops) -> Tree:
    design = loops.design
    length, force = ("m", "N") if design.axis == "linear" else ("rad", "N*m")
    responses: Tree = {}
    if loops.plain_response is not None:
        _, unit = stage_words(design)
        command = _system(loops.plain_response, unit, f"{length}/s" if unit == "V" else unit)
        mean = command_mean(design)  # as states a chain of its samples
        responses["command"] = command | {"behind_mean_of_samples": mean.samples if mean else 1}
    if loops.load_torque_system is not None:
        responses["load"] = _system(loops.load_torque_system(), force, length)
    return {
        "operating_point": loops.operating_point,
        "load": loops.load_Nm,
        "loops": {name: _loop(loop, loops) for name, loop in loops.present.items()},
        "break_points": {name: _loop(loop, loops) for name, loop in loops.break_points.items()},
        "responses": responses,
    }


def _loop(loop: Loop, loops: Loops) -> Tree:
    """Open loop, closed loop, sensitivity, and margins: of a periodic loop those of its whole period."""
    if loop.periodic:  # the open loop of the fundamental is not all of it
        exact = asdict(exact_margins(loops, loop.break_point))
        margins = {name: value for name, value in exact.items() if value is not None and isfinite(value)}
    else:
        margins = margins_tree(loop.plain_open)
    systems = {"open_loop": loop.plain_open, "closed_loop": loop.plain_closed}
    systems["sensitivity"] = loop.plain_sensitivity
    made = {name: _system(system, loop.unit_in, loop.unit_out) for name, system in systems.items()}
    return {**made, "periodic": loop.periodic, "margins": margins}


def margins_tree(system: Any) -> Tree:
    """Verdict, evidence and every margin of an open loop; why there are none, where it is refused."""
    try:
        found = stability_margins(system)
    except InputError as refusal:
        return {"verdict": "undecided", "evidence": "withheld", "evidence_reason": refusal.message}
    return {
        **{name: getattr(found, name) for name in ("verdict", "evidence", "evidence_reason")},
        "gain_margins": [one.ratio for one in found.gain_margins],
        "gain_margins_rad_s": [one.frequency_rad_s for one in found.gain_margins],
        "phase_margins_deg": [one.deg for one in found.phase_margins],
        "phase_margins_rad_s": [one.frequency_rad_s for one in found.phase_margins],
        "delay_margins_s": [one.seconds for one in found.delay_margins],
        "delay_margins_rad_s": [one.frequency_rad_s for one in found.delay_margins],
        "modulus_margin": [] if found.modulus_margin is None else [found.modulus_margin],
    }


def _system(system: Any, unit_in: str, unit_out: str) -> Tree:
    parts = _DELAYED if hasattr(system, "delays_s") else _MATRICES
    ends = {"input": system.source, "input_unit": unit_in, "output": system.signal, "output_unit": unit_out}
    about = {"name": system.name, **ends, "states": list(system.states), "dt": float(system.dt)}
    return about | {part: np.asarray(getattr(system, part), dtype=float).tolist() for part in parts}


def written_models(tree: Tree, to: str) -> bytes:
    """The file of a tree; an InputError for an unknown format."""
    if to == "json":
        return (json.dumps(tree, indent=1, allow_nan=False) + "\n").encode()
    if to == "python":
        about = tree["design"]
        text = pformat(tree, width=110, compact=True, sort_dicts=False)
        return _PYTHON.format(name=about["name"].replace('"', "'"), hash=about["hash"], tree=text).encode()
    if to == "mat":
        from scipy.io import savemat

        held = io.BytesIO()
        savemat(held, _for_matlab(tree), long_field_names=True, oned_as="column")
        return held.getvalue()
    raise InputError(f"to = {to}: allowed: {', '.join(SUFFIXES)}")


def _for_matlab(value: Any) -> Any:
    """Lists of texts as cells; empty lists and texts as MATLAB has them."""
    if isinstance(value, dict):
        return {name: _for_matlab(item) for name, item in value.items()}
    if isinstance(value, list):
        return np.array(value, dtype=object if any(isinstance(item, str) for item in value) else float)
    return value
