"""Moved to `actuator_lti.reading`; stands until every branch imports from there."""

from actuator_lti.bounds import TEXT_CHARACTERS, TOML_BYTES, TOML_DEPTH
from actuator_lti.reading import decode, parse_toml, read_bytes, shown

MAX_BYTES, MAX_STRING, MAX_DEPTH = TOML_BYTES.most, TEXT_CHARACTERS.most, TOML_DEPTH.most

__all__ = ["MAX_BYTES", "MAX_DEPTH", "MAX_STRING", "decode", "parse_toml", "read_bytes", "shown"]
