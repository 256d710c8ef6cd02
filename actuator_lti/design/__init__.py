"""The design file: one TOML text per drive, read into frozen dataclasses in SI units."""

from actuator_lti.asked.quantities import QUANTITIES
from actuator_lti.design.access import parameter_value, paths_of, with_values
from actuator_lti.design.checks import check_design
from actuator_lti.design.fields import FIELDS
from actuator_lti.design.loader import (
    SweepPoint,
    as_design,
    load_design,
    read_design_text,
    shipped_designs,
    sweep,
)
from actuator_lti.design.model import Design
from actuator_lti.design.plant import no_load_speed
from actuator_lti.design.suspicions import warnings_of
from actuator_lti.design.tolerances import tolerances
from actuator_lti.design.writing import design_hash, design_tree, with_overrides, write_design
from actuator_lti.start.public_arguments import guard

__all__ = [
    "FIELDS", "QUANTITIES", "Design", "SweepPoint", "as_design", "check_design", "design_hash", "design_tree",
    "load_design", "no_load_speed", "parameter_value", "paths_of", "read_design_text", "shipped_designs",
    "sweep", "tolerances", "warnings_of", "with_overrides", "with_values", "write_design"
]  # fmt: skip

guard(__name__)
