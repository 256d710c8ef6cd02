"""Every bound that keeps a hostile or mistaken input from taking the memory, the disk or the night.

Whoever allocates asks the bound first (`Bound.check`); ``python -m actuator_lti.bounds`` writes the table.
"""

import sys
from dataclasses import dataclass

from actuator_lti.errors import InputError


@dataclass(frozen=True)
class Bound:
    """The most of something that is taken in."""

    what: str  # in words, plural where it counts
    most: int
    reason: str
    unit: str = ""  # empty for a count
    asked_by: str = ""  # the option or key to change; empty where the input itself is too large

    @property
    def allowed(self) -> str:
        """The bound in words."""
        return f"at most {_readable(self.most, self.unit)}"

    def check(self, value: float, where: str | None = None, *, name: str = "") -> None:
        """Refuse more than the bound, and what is not a number.

        ``where``: the file; ``name``: the option or key in this place, where it is not the usual one.

        >>> TONES.check(20_000)
        Traceback (most recent call last):
        ...
        actuator_lti.errors.InputError: --count: 20000 tones of a signal; allowed: at most 10000
        """
        if value <= self.most:
            return
        asked = f"{name or self.asked_by}: ".removeprefix(": ")
        raise InputError(f"{asked}{_readable(value, self.unit)} {self.what}; allowed: {self.allowed}", where)


def _readable(value: float, unit: str) -> str:
    """A count or an amount of bytes, short whatever its size."""
    if unit == "bytes" and value >= 1 << 20:
        return f"{value / (1 << 20):.4g} MiB"
    text = str(int(value)) if abs(value) < 1e15 else f"{float(min(value, 1e308)):.3g}"
    return f"{text} {unit}".strip()


# fmt: off
# ---- files -----------------------------------------------------------------------------------------------

TOML_BYTES = Bound("of a design, study or settings file", 1 << 20,
    "two hundred times the largest shipped design", unit="bytes")
CAMPAIGN_BYTES = Bound("of a campaign or record file", 1 << 23,
    "a campaign lists its runs: 20000 of them in 400 bytes each", unit="bytes")
REPORT_BYTES = Bound("of a report.json", 1 << 28,
    "a comparison of 10000 designs fits; read whole into memory", unit="bytes")
TOML_DEPTH = Bound("levels of tables in a TOML file", 8, "a design needs five")
JSON_DEPTH = Bound("levels of a JSON file", 40, "details within details of a report")
TOML_VALUES = Bound("values in a TOML file", 20_000, "a design has a few hundred")
CAMPAIGN_VALUES = Bound("values in a campaign file", 250_000, "12 values for each run")
TEXT_CHARACTERS = Bound("characters of a text in a file", 10_000, "a page of description")
KEY_PARTS = Bound("parts of a dotted key", 64, "the time of the TOML reader grows with their square")
CSV_LINE_BYTES = Bound("of one line of a CSV file", 1 << 20, "a table of numbers has short lines",
    unit="bytes")
CSV_COLUMNS = Bound("columns of a CSV file", 4096, "no recorder writes more")
CSV_ROWS = Bound("rows of a record kept at full rate", 4_000_000,
    "longer records are averaged over neighbours while they are read; the record says so")
TABLE_BYTES = Bound("of a CSV file of a command, load or samples", 1 << 28, "read whole into memory",
    unit="bytes", asked_by="--record, --load-file")
TABLE_ROWS = Bound("rows of a command, load or sample file", 5_000_000, "eight minutes at the drive's 100 us",
    asked_by="--record, --load-file")
MAT_BYTES = Bound("of a .mat file", 1 << 28, "read whole into memory", unit="bytes")
MAT_VALUES = Bound("numbers of a .mat or Parquet file, unpacked", 50_000_000,
    "400 MB as floats; a compressed file of a megabyte can hold a thousand times its size")
MAT_MEMORY = Bound("of memory while a .mat file is read", 2_000_000_000, "five times what it may hold",
    unit="bytes")
MAT_SECONDS = Bound("to read a .mat file", 60, "five times as long as the largest takes", unit="s")
CAMPAIGN_RUNS = Bound("runs of a campaign", 20_000, "54 are a week at the bench", asked_by="[[run]]")

# ---- simulation ------------------------------------------------------------------------------------------

RUN_TICKS = Bound("ticks of one run", 1_000_000_000,
    "28 hours of motion at 100 us, some minutes to compute; a hole of years in a record asks for more",
    asked_by="--duration")
BATCH_TICKS = Bound("ticks of all runs of a batch", 20_000_000_000,
    "an hour on two cores; a design that moves a million times slower than it samples asks for more")
HISTORY_BYTES = Bound("of one run's history", 4_000_000_000, "it is held in memory", unit="bytes",
    asked_by="--duration, --every")
SIGNAL_ROWS = Bound("ticks of a tabled command", 50_000_000, "400 MB, held in memory beside the history",
    asked_by="--duration, --frequency, --cycles")
TONES = Bound("tones of a signal", 10_000, "a decade in steps of a fifth of a per mille", asked_by="--count")
TONE_TICKS = Bound("lines times ticks of a multisine", 20_000_000_000,
    "each line is summed at each tick: minutes", asked_by="--count, --duration")

# ---- studies ---------------------------------------------------------------------------------------------

STUDY_VARIANTS = Bound("variants of a study", 10_000, "a night on a cluster; each is a design of its own",
    asked_by="[[variant]], [[sweep]], [[grid]]")
GRID_AXES = Bound("axes of a grid", 20, "two values each are a million", asked_by="grid.axes")
AXIS_POINTS = Bound("values of an axis", 1000, "as many as a picture shows", asked_by="points")
LOOP_STATES = Bound("states of a loop in many designs, over all ticks of its period", 200,
    "some 100 MB of matrices; margins of one design take more, and long",
    asked_by="control.velocity.every, encoder.difference_samples, control.computing_delay")
SAMPLES = Bound("Monte Carlo samples", 1_000_000_000, "three days of one processor", asked_by="--samples")
NIGHTLY_JOBS = Bound("reports of a night", 20_000, "every variant of the largest study, twice")
JOB_BYTES = Bound("of one job's description", 256_000_000, "a comparison carries the text of all its designs",
    unit="bytes")
JOB_MEMORY = Bound("of memory of a nightly job", 4_000_000_000,
    "ten times what the largest shipped design takes; a job that asks for more is ended and named",
    unit="bytes", asked_by="--memory-limit")

# ---- time ------------------------------------------------------------------------------------------------

COMMAND_SECONDS = Bound("of one command", 3600,
    "sixty times the slowest command on a shipped design; it ends with status 3 and says so", unit="s",
    asked_by="--time-limit")
STUDY_SECONDS = Bound("of compare, montecarlo, nightly or tune", 7 * 86400,
    "their work is as large as what is asked for; a nightly job has its own --time-limit", unit="s",
    asked_by="--time-limit")
# fmt: on


def table() -> dict[str, Bound]:
    """All bounds by name, in the order of this file."""
    return {name: value for name, value in globals().items() if isinstance(value, Bound)}


def markdown() -> str:
    """The table of the documentation.

    >>> markdown().splitlines()[4].startswith("| ")
    True
    """
    lines = [
        "# Limits",
        "",
        "Made by `python -m actuator_lti.bounds`. More is refused in one line, before memory is taken.",
        "",
        "| what | at most | asked for by | why |",
        "|---|---:|---|---|",
    ]
    lines += [
        f"| {bound.what} | {_readable(bound.most, bound.unit)} | {bound.asked_by} | {bound.reason} |"
        for bound in table().values()
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.stdout.write(markdown())
