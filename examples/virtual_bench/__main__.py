"""Write the records of a simulated bench: ``python -m examples.virtual_bench FOLDER``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from examples.virtual_bench import (
    measure_bench,
    plan_for,
    reversal_record,
    simulate_bench,
    sweep_record,
    write_bench,
    write_record,
)
from reports.cli.options import load_drive, refuse_existing


def main(arguments: Sequence[str] | None = None) -> None:
    """Simulate, measure, write, and say what to do with the files."""
    parser = argparse.ArgumentParser(prog="python -m examples.virtual_bench", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument(
        "--design", default="ilr33-amber", help="name or path; a campaign needs a rotary drive"
    )
    parser.add_argument("--sweep", action="store_true", help="sweep and reversal of a compliant drive")
    parser.add_argument("--seed", type=int, default=0, help="of noise, shared errors and clocks")
    parser.add_argument("--set", action="append", metavar="KEY=VALUE", help="change the design; repeatable")
    parser.add_argument("--force", action="store_true", help="overwrite what is there")
    asked = parser.parse_args(arguments)
    try:
        refuse_existing(asked.folder / ("sweep.csv" if asked.sweep else "campaign.toml"), asked.force)
        drive = load_drive(asked.design, asked.set)
        write = _sweep if asked.sweep else _campaign
        sys.stdout.write(f"{write(asked.folder, asked.design, drive, asked.seed)}\n")
    except InputError as error:
        parser.error(str(error))


def _campaign(folder: Path, name: str, drive: Design, seed: int) -> str:
    logs, _ = measure_bench(simulate_bench(drive, seed=seed), seed)
    written = str(Path(name).resolve()) if name.endswith(".toml") else name
    path = write_bench(folder, logs, design=written, seed=seed)
    return f"{len(logs)} runs written; next: actuator-lti identify {path}"


def _sweep(folder: Path, name: str, drive: Design, seed: int) -> str:
    plan = plan_for(drive)
    sweep, reversal = folder / "sweep.csv", folder / "reversal.csv"
    write_record(sweep, sweep_record(drive, plan, seed=seed))
    more = ""
    if drive.coupling is not None and drive.coupling.play_rad > 0.0:
        write_record(reversal, reversal_record(drive, plan, seed=seed))
        more = f" --play {reversal}"
    return (
        f"lines every {1.0 / plan.period_s:.3g} Hz to {plan.highest_hz:.4g} Hz at {plan.speed_rad_s:.3g} "
        f"rad/s against {plan.moment_Nm:.3g} N m; next: actuator-lti identify --frequency-response "
        f"{sweep}{more} --design {name}"
    )


if __name__ == "__main__":
    main()
