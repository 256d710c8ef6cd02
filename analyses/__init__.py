"""Questions to a drive: requirements, validation, large signals, identification, variants, tuning.

The public names are loaded on first use. Packages of one question each (``stiffness``, ``monte_carlo``,
``friction_effects``, ``specification``) hold a function of their own name.

>>> import analyses
>>> "survey_loops" in dir(analyses)
True
"""

from actuator_lti.start.on_first_use import on_first_use

_PUBLIC = {
    "LoopFigures": "analyses.linear.loop_figures",
    "LoopSurvey": "analyses.linear.loop_survey",
    "amplitude_map": "analyses.large_signal.map",
    "compare": "analyses.comparison.variants",
    "correlate_record": "analyses.correlation.closed_loop",
    "evaluate_requirements": "analyses.specification.requirements",
    "identify_campaign": "analyses.identification.campaign",
    "import_campaign": "analyses.records.campaign_import",
    "large_signals": "analyses.large_signal",
    "load_campaign": "analyses.records.campaign_file",
    "load_study": "analyses.studies.study",
    "open_record": "analyses.records.open_record",
    "sawtooth": "analyses.large_signal.sawtooth",
    "survey_loops": "analyses.linear.loop_survey",
    "tune": "analyses.tuning",
    "validate": "analyses.validation",
}
_PACKAGES = ("friction_effects", "monte_carlo", "specification", "stiffness")

__getattr__, __dir__ = on_first_use(__name__, _PUBLIC, _PACKAGES)
