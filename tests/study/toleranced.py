"""The baseline with tolerances of one's own."""

import tomllib

import tomli_w

from actuator_lti import load_design, write_design


def toleranced(**percent: dict[str, float]) -> str:
    """A design file of the baseline, by table and key the tolerance in percent."""
    tree = tomllib.loads(write_design(load_design("ilr33-amber")))
    for table, keys in percent.items():
        for key, share in keys.items():
            tree[table][key]["tolerance"] = f"{share:g} %"
    return tomli_w.dumps(tree)
