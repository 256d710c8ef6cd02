"""Questions to a drive: requirements, validation, large signals, identification, variants, tuning.

The public names are loaded on first use. Packages of one question each (``stiffness``, ``monte_carlo``,
``friction_effects``, ``specification``) hold a function of their own name.

Examples
--------
>>> import analyses
>>> "survey_loops" in dir(analyses)
True
"""

from importlib import import_module
from typing import Any

_PUBLIC = {
    "LoopFigures": "analyses.loop_figures",
    "LoopSurvey": "analyses.loop_survey",
    "amplitude_map": "analyses.large_signal.map",
    "compare": "analyses.variants",
    "correlate_record": "analyses.correlation",
    "evaluate_requirements": "analyses.requirements",
    "identify_campaign": "analyses.identification.campaign",
    "import_campaign": "analyses.records",
    "large_signals": "analyses.large_signal",
    "load_campaign": "analyses.records",
    "load_study": "analyses.study",
    "open_record": "analyses.records",
    "sawtooth": "analyses.large_signal.sawtooth",
    "survey_loops": "analyses.loop_survey",
    "tune": "analyses.tuning",
    "validate": "analyses.validation",
}
_PACKAGES = ("friction_effects", "monte_carlo", "specification", "stiffness")

__all__ = sorted([*_PUBLIC, *_PACKAGES])


def __getattr__(name: str) -> Any:
    """Load a public name on first use (PEP 562)."""
    if name in _PACKAGES:
        return import_module(f"analyses.{name}")
    if name not in _PUBLIC:
        raise AttributeError(f"module 'analyses' has no attribute {name!r}")
    return getattr(import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
