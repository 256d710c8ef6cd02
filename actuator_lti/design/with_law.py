"""A system of python-control or scipy as a law of one's own of a design."""

import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from actuator_lti.asked.quantities import LOOPS
from actuator_lti.design.law import BESIDE_A_LAW, LAW_WORDS, StateSpace, balance
from actuator_lti.design.law_sources import PARTS, law_tree
from actuator_lti.design.mistakes import nearest
from actuator_lti.design.model import Design
from actuator_lti.design.writing import design_tree, with_overrides
from actuator_lti.errors import InputError
from actuator_lti.files.reading import shown

METHODS = {"tustin": "bilinear", "zoh": "zoh"}
"""How a continuous system may be sampled, and scipy's word for it."""
SETTINGS: dict[str, Any] = {"L": (), "gain": 1.0, "every": None, "method": None, "continuous": None}
"""What may be said of a law besides, and what holds where it is not."""


def _proper(made: Callable[..., Any], *given: Any) -> Any:
    """A state space made of transfer functions; one of more zeros than poles is an InputError."""
    try:
        return made(*given)
    except ValueError as error:
        raise InputError("system: improper; allowed: no more zeros than poles") from error


def _columns(system: Any) -> tuple[Any, ...]:
    from scipy.linalg import block_diag
    from scipy.signal import tf2ss

    if len(system.num) != 1:
        raise InputError(f"system: {len(system.num)} outputs; allowed: one, that of the stage")
    columns = [_proper(tf2ss, *one) for one in zip(system.num[0], system.den[0], strict=True)]
    A, B, C, D = zip(*columns, strict=True)
    return block_diag(*A), block_diag(*B), np.hstack(C), np.hstack(D)


def _state_space(system: Any, name: str = "system") -> tuple[Any, Any, Any, Any, Any]:
    """A, B, C, D and dt of what somebody calls a system; dt is ``None`` where it does not say."""
    if isinstance(system, tuple | list) and len(system) in (4, 5):
        return (*system[:4], system[4] if len(system) == 5 else None)
    dt = getattr(system, "dt", None)
    if type(system).__module__.startswith("scipy.signal"):
        dt = 0 if dt is None else dt
        system = _proper(system.to_ss)
    elif hasattr(system, "num") and hasattr(system, "den"):
        return (*_columns(system), dt)
    if not all(hasattr(system, part) for part in PARTS):
        raise InputError(
            f"{name} = {shown(system)}: allowed: a state space or transfer function of python-control or "
            "scipy.signal, or (A, B, C, D, dt)"
        )
    return system.A, system.B, system.C, system.D, dt


def _inputs(system: Any, inputs: Sequence[str] | None) -> list[str]:
    given = getattr(system, "input_labels", None) if inputs is None else inputs
    given = given.tolist() if isinstance(given, np.ndarray) else given
    listed: list[Any] = list(given) if isinstance(given, Sequence) and not isinstance(given, str) else [given]
    for name in listed:
        if name not in LAW_WORDS or given is name:
            raise InputError(f"inputs = {shown(name)}: allowed: a list of {', '.join(LAW_WORDS)}")
    return listed


def with_law(
    design: Design, stage: str, system: Any, inputs: Sequence[str] | None, settings: Mapping[str, Any]
) -> Design:
    """A copy of a design with a law of one's own at a stage, see `Design.with_law`."""
    for name, value in settings.items():
        if name not in SETTINGS:
            allowed = f"unknown{nearest(name, SETTINGS)}; allowed: {', '.join(SETTINGS)}"
            raise InputError(f"{name} = {shown(value)}: {allowed}")
    L, gain, every, method, continuous = {**SETTINGS, **settings}.values()
    if not isinstance(stage, str) or stage not in LOOPS:
        raise InputError(f"stage = {shown(stage)}: allowed: {', '.join(LOOPS)}")
    control: Mapping[str, Any] = design_tree(design)["control"]
    present = [one for one in LOOPS if one in control]
    if outer := [one for one in present if stage not in present and LOOPS.index(one) > LOOPS.index(stage)]:
        gains = f"the drive has none, and its {outer[0]} stage has gains for a drive without"
        raise InputError(f"stage = {shown(stage)}: {gains}; allowed: {', '.join(present)}")
    table = {key: value for key, value in control.get(stage, {}).items() if key in BESIDE_A_LAW}
    table |= {} if every is None else {"every": every}
    unit = {"inputs": ["error"], "D": [1.0]}  # whatever the law will be, the stage's period is this one's
    period_s = _staged(design, stage, table, unit).controller.period_of(stage)
    A, B, C, D, dt = _state_space(system)
    if method is not None and continuous is not None:
        raise InputError("continuous: allowed: without method, of which the continuous form is the system")
    if method is not None:
        continuous, (A, B, C, D), dt = (A, B, C, D), _sampled((A, B, C, D), dt, period_s, method), period_s
    elif dt is None or dt is True or dt == 0:
        kind = "continuous" if dt is not None and dt is not True else "of no stated period"
        raise InputError(
            f"system: {kind}; allowed: a sampled one of dt = {period_s:g} s, the {stage} stage's period, "
            f"or a continuous one with method = {' or '.join(METHODS)}"
        )
    law = {**law_tree(A, B, C, D, L, dt), "inputs": _inputs(system, inputs), "gain": gain}
    if continuous is not None:
        *parts, step = _state_space(continuous, "continuous")
        if step:
            raise InputError(f"continuous: sampled, dt = {step}; allowed: a continuous system")
        law["continuous"] = law_tree(*parts)
    return _staged(design, stage, table, law)


def _staged(design: Design, stage: str, table: Mapping[str, Any], law: Mapping[str, Any]) -> Design:
    return with_overrides(design, {f"control.{stage}": {**table, "law": law}})


def _sampled(parts: tuple[Any, ...], dt: Any, period_s: float, method: str) -> tuple[Any, ...]:
    from scipy.linalg import LinAlgError, LinAlgWarning
    from scipy.signal import cont2discrete

    if not isinstance(method, str) or method not in METHODS:
        raise InputError(f"method = {shown(method)}: allowed: {' or '.join(METHODS)}")
    if dt not in (None, 0) or dt is False:
        raise InputError(f"method = {shown(method)}: the system is sampled already, dt = {dt}")
    plain = StateSpace(**law_tree(*parts))
    m = len(plain.B[0] if plain.B else plain.D)
    for key, (shape, fits) in plain.sizes(m).items():
        if not fits:
            raise InputError(f"{key}: other sizes; allowed: {shape}")
    A, B, C, D, _ = plain.matrices(m)
    if not A.size:
        return A, B, C, D
    t = balance(A, B, C)  # what is sampled is well scaled; its states stay those of the system
    scaled = A * t / t[:, None], B / t[:, None], (C * t)[None], D[None]
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", LinAlgWarning)  # singular to rounding
            A, B, C, D = cont2discrete(scaled, period_s, METHODS[method])[:4]
    except (LinAlgError, LinAlgWarning) as error:
        reason = f"a pole at 2/T = {2.0 / period_s:g} 1/s, where Tustin's form is infinite"
        raise InputError(f"system: {reason}; allowed: none there, or method = zoh") from error
    return A / t * t[:, None], B * t[:, None], C / t, D
