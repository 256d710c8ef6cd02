"""A word for what TOML and JSON hold."""

from typing import Any

Tree = dict[str, Any]
"""A table of TOML or an object of JSON as a file has it: a schema checks its keys, or has done so."""
