"""Margins, bandwidths and step figures of many designs at once, compiled: what studies and optimisers call.

`Population` says which designs; `linear_figures` gives margins, bandwidths and step figures of all their
sampled loops; `drive_figures` the static figures that requirements may ask for.
"""

from actuator_lti.start.on_first_use import on_first_use

_PUBLIC = {
    "Crossovers": "actuator_lti.batch.figures",
    "LinearFigures": "actuator_lti.batch.figures",
    "Population": "actuator_lti.batch.parameters",
    "drive_figures": "actuator_lti.asked.drive_figure",
    "linear_figures": "actuator_lti.batch.figures",
    "variable_paths": "actuator_lti.batch.parameters",
}

__getattr__, __dir__ = on_first_use(__name__, _PUBLIC)
