"""Linear figures of many designs at once, compiled: what sampling studies and optimisers call.

`Population` says which designs; `linear_figures` gives margins, bandwidths and step figures of all their
sampled loops; `drive_figures` the static figures that requirements may ask for.
"""

from actuator_lti.batch.figures import Crossovers, LinearFigures, linear_figures
from actuator_lti.batch.parameters import Population, variable_paths
from actuator_lti.batch.static import drive_figures

__all__ = [
    "Crossovers",
    "LinearFigures",
    "Population",
    "drive_figures",
    "linear_figures",
    "variable_paths",
]
