"""Every bound that keeps a hostile or mistaken input from taking the memory, the disk or the night.

One table: what is bounded, by how much, which option or key asks for it, and why so much. Whoever
allocates asks the bound first (`Bound.check`); ``python -m actuator_lti.bounds`` writes the table as
Markdown for the documentation.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

from actuator_lti.errors import InputError


@dataclass(frozen=True, kw_only=True)
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
        """Refuse more than the bound.

        Parameters
        ----------
        value : float
            What is asked for; not a number is refused, too.
        where : str, optional
            The file.
        name : str, optional
            The option or key in this place, where it is not the usual one.

        Raises
        ------
        InputError
            One line: option or key, what was asked for, what is allowed.

        Examples
        --------
        >>> TONES.check(20_000)
        Traceback (most recent call last):
        ...
        actuator_lti.errors.InputError: --count: 20000 tones of a signal; allowed: at most 10000
        """
        if value <= self.most:
            return
        asked = name or self.asked_by
        shown = _readable(value, self.unit)
        raise InputError(
            f"{asked + ': ' if asked else ''}{shown} {self.what}; allowed: {self.allowed}", where
        )


def _readable(value: float, unit: str) -> str:
    """A count or an amount of bytes, short whatever its size."""
    if unit == "bytes" and value >= 1 << 20:
        return f"{value / (1 << 20):.4g} MiB"
    text = str(int(value)) if abs(value) < 1e15 else f"{float(min(value, 1e308)):.3g}"
    return f"{text} {unit}".strip()


# ---- files -----------------------------------------------------------------------------------------------

TOML_BYTES = Bound(
    what="of a design, study or settings file", most=1 << 20, unit="bytes",
    reason="two hundred times the largest shipped design",
)  # fmt: skip
CAMPAIGN_BYTES = Bound(
    what="of a campaign or record file", most=1 << 23, unit="bytes",
    reason="a campaign lists its runs: 20000 of them in 400 bytes each",
)  # fmt: skip
REPORT_BYTES = Bound(
    what="of a report.json", most=1 << 28, unit="bytes",
    reason="a comparison of 10000 designs fits; read whole into memory",
)  # fmt: skip
TOML_DEPTH = Bound(what="levels of tables in a TOML file", most=8, reason="a design needs five")
JSON_DEPTH = Bound(what="levels of a JSON file", most=40, reason="details within details of a report")
TOML_VALUES = Bound(what="values in a TOML file", most=20_000, reason="a design has a few hundred")
CAMPAIGN_VALUES = Bound(what="values in a campaign file", most=250_000, reason="12 values for each run")
TEXT_CHARACTERS = Bound(what="characters of a text in a file", most=10_000, reason="a page of description")
KEY_PARTS = Bound(
    what="parts of a dotted key", most=64, reason="the time of the TOML reader grows with their square"
)
CSV_LINE_BYTES = Bound(
    what="of one line of a CSV file", most=1 << 20, unit="bytes", reason="a table of numbers has short lines"
)
CSV_COLUMNS = Bound(what="columns of a CSV file", most=4096, reason="no recorder writes more")
CSV_ROWS = Bound(
    what="rows of a record kept at full rate", most=4_000_000,
    reason="longer records are averaged over neighbours while they are read; the record says so",
)  # fmt: skip
TABLE_BYTES = Bound(
    what="of a CSV file of a command, load or samples", most=1 << 28, unit="bytes",
    asked_by="--record, --load-file", reason="read whole into memory",
)  # fmt: skip
TABLE_ROWS = Bound(
    what="rows of a command, load or sample file", most=5_000_000, asked_by="--record, --load-file",
    reason="eight minutes at the drive's 100 us",
)  # fmt: skip
MAT_BYTES = Bound(what="of a .mat file", most=1 << 28, unit="bytes", reason="read whole into memory")
MAT_VALUES = Bound(
    what="numbers of a .mat or Parquet file, unpacked", most=50_000_000,
    reason="400 MB as floats; a compressed file of a megabyte can hold a thousand times its size",
)  # fmt: skip
MAT_DIMENSIONS = Bound(what="dimensions of an array in a .mat file", most=32, reason="numpy holds no more")
CAMPAIGN_RUNS = Bound(
    what="runs of a campaign", most=20_000, asked_by="[[run]]", reason="54 are a week at the bench"
)

# ---- simulation ------------------------------------------------------------------------------------------

RUN_TICKS = Bound(
    what="ticks of one run", most=1_000_000_000, asked_by="--duration",
    reason="28 hours of motion at 100 us, some minutes to compute; a hole of years in a record asks for more",
)  # fmt: skip
BATCH_TICKS = Bound(
    what="ticks of all runs of a batch", most=20_000_000_000,
    reason="an hour on two cores; a design that moves a million times slower than it samples asks for more",
)  # fmt: skip
HISTORY_BYTES = Bound(
    what="of one run's history", most=4_000_000_000, unit="bytes", asked_by="--duration, --every",
    reason="it is held in memory",
)  # fmt: skip
SIGNAL_ROWS = Bound(
    what="ticks of a tabled command", most=50_000_000, asked_by="--duration, --frequency, --cycles",
    reason="400 MB, held in memory beside the history",
)  # fmt: skip
TONES = Bound(
    what="tones of a signal", most=10_000, asked_by="--count",
    reason="a decade in steps of a fifth of a per mille",
)  # fmt: skip
TONE_TICKS = Bound(
    what="lines times ticks of a multisine", most=20_000_000_000, asked_by="--count, --duration",
    reason="each line is summed at each tick: minutes",
)  # fmt: skip

# ---- studies ---------------------------------------------------------------------------------------------

STUDY_VARIANTS = Bound(
    what="variants of a study", most=10_000, asked_by="[[variant]], [[sweep]], [[grid]]",
    reason="a night on a cluster; each is a design of its own",
)  # fmt: skip
GRID_AXES = Bound(
    what="axes of a grid", most=20, asked_by="grid.axes", reason="two values each are a million"
)
AXIS_POINTS = Bound(
    what="values of an axis", most=1000, asked_by="points", reason="as many as a picture shows"
)
SAMPLES = Bound(
    what="Monte Carlo samples", most=1_000_000_000, asked_by="--samples", reason="three days of one processor"
)
NIGHTLY_JOBS = Bound(
    what="reports of a night", most=20_000, reason="every variant of the largest study, twice"
)
JOB_BYTES = Bound(
    what="of one job's description", most=256_000_000, unit="bytes",
    reason="a comparison carries the text of all its designs",
)  # fmt: skip
JOB_MEMORY = Bound(
    what="of memory of a nightly job", most=4_000_000_000, unit="bytes", asked_by="--memory-limit",
    reason="ten times what the largest shipped design takes; a job that asks for more is ended and named",
)  # fmt: skip

# ---- time ------------------------------------------------------------------------------------------------

COMMAND_SECONDS = Bound(
    what="of one command", most=3600, unit="s", asked_by="--time-limit",
    reason="sixty times the slowest command on a shipped design; it ends with status 3 and says so",
)  # fmt: skip
STUDY_SECONDS = Bound(
    what="of compare, montecarlo, nightly or tune", most=7 * 86400, unit="s", asked_by="--time-limit",
    reason="their work is as large as what is asked for; a nightly job has its own --time-limit",
)  # fmt: skip


def table() -> dict[str, Bound]:
    """All bounds by name, in the order of this file."""
    return {name: value for name, value in globals().items() if isinstance(value, Bound)}


def markdown() -> str:
    """The table of the documentation.

    Examples
    --------
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
