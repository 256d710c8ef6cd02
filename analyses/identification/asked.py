"""What is asked of an identification."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from actuator_lti.errors import InputError
from analyses.estimation.parameters import parameter
from analyses.request import Option

if TYPE_CHECKING:
    from actuator_lti.design.model import Design

Friction = Literal["symmetric", "per-direction", "map"]
Criterion = Literal["margins", "D"]
Of = Literal["L", "T", "S", "closed"]


@dataclass(frozen=True, kw_only=True)
class Settings:
    """What is looked for in records of a motion, and how."""

    fix: Annotated[
        list[str] | None, Option("Hold a value, as friction.viscous=0; repeatable.", "KEY=VALUE")
    ] = None
    residual_limit: Annotated[float, Option("Largest relative residual of a written design; 20.", "%")] = 20.0
    inertia_to: Annotated[
        str,
        Option(
            "Of records: where the inertia goes, less the design's others: motor.rotor_inertia (default) or "
            "load.inertia.",
            "KEY",
        ),
    ] = "motor.rotor_inertia"
    friction: Annotated[
        Friction,
        Option(
            "Of records: symmetric (default), per-direction, or map (over the speed, where it is "
            "clearly better)."
        ),
    ] = "symmetric"
    gravity: Annotated[bool, Option("Of records: find a pendulum at the output, m g l sin(angle).")] = False
    electrical: Annotated[bool, Option("Of records: R, kE, kM by u = R i + kE w first (L if shown).")] = False
    refine: Annotated[bool, Option("Of records: refine by simulation what the design gets.")] = False
    cutoff_hz: Annotated[
        float | None, Option("Of records: low-pass cut-off (default 100, or 0.1 of the rate).", "Hz")
    ] = None
    decimation: Annotated[int | None, Option("Of records: decimation (default: to the cut-off).", "N")] = None


@dataclass(frozen=True, kw_only=True)
class Asked(Settings):
    """Identify a drive from bench records, and write the result as a design with tolerances.

    Five ways to call it:

    identify campaign.toml --out result: C0, Cv and CM from the steady parts of many runs. A bad run is set
    aside and named, the others go on. --example prints a campaign file.

    identify A.csv B.csv --validate C.csv --design my.toml: inertia, friction and offset from records of a
    motion together, by the inverse dynamic model; --refine simulates the drive as well. The EMPS benchmark's
    file is known as it is.

    identify --frequency-response chirp.csv --play reversal.csv --design my.toml: inertias, stiffness,
    damping and play of a two-mass drive.

    identify --response loop.csv --of T --design my.toml: inertias, stiffness, damping and delay from a
    measured frequency response of any loop.

    identify --plan my.toml --within 2 --out result: motions that make the intervals as small as asked; with
    records after it, what to measure next.

    Every column of every file is accounted for. Each record is held against itself and against the design's
    limits, and the written design against the record that it came from. Where a check fails the status is 1,
    and no design is written without --accept; with --out, page and JSON are. What the records do not tell is
    not proven: it is said, and the status is 0 (PASS, 2 not proven).

    Try: actuator-lti identify DATA_EMPS.mat --design emps --out result
    """

    files: Annotated[
        list[Path],
        Option(
            "A campaign file (TOML), or records: CSV, Parquet, .mat, record files (TOML).",
            "FILE...",
            argument=True,
        ),
    ]
    validate: Annotated[list[Path] | None, Option("Record unseen by the fit; repeatable.", "RECORD")] = None
    response: Annotated[
        bool, Option("FILE is a measured frequency response of a loop: inertias, stiffness, damping, delay.")
    ] = False
    loop: Annotated[
        str | None, Option("With --response: which stage or break point; the outermost stage.", "NAME")
    ] = None
    response_of: Annotated[
        Of,
        Option("With --response: L (open), T = L/(1+L), S = 1/(1+L), closed (from the command).", flag="of"),
    ] = "L"
    averages: Annotated[
        int | None,
        Option("With --response: averages behind its coherence, which weighs the frequencies.", "N"),
    ] = None
    frequency_response: Annotated[
        bool, Option("Of one record with a periodic excitation: a compliant two-mass drive.")
    ] = False
    play: Annotated[
        Path | None, Option("With --frequency-response: a reversing motion, both angles.", "RECORD")
    ] = None
    period_s: Annotated[float | None, Option("Period of the excitation; found from the command.", "s")] = None
    plan: Annotated[
        bool, Option("FILE is a design: motions that tell its values as closely as asked (then records).")
    ] = False
    within: Annotated[float, Option("With --plan: half of each 95 % interval, of the value; 5.", "%")] = 5.0
    noise: Annotated[
        float | None,
        Option(
            "With --plan: noise of the recorded current (without one, voltage), rms; "
            "current_noise of the design.",
            "A",
        ),
    ] = None
    accept: Annotated[bool, Option("Write the design even where a check fails (the status stays 1).")] = False
    suggest: Annotated[int, Option("Suggest so many further runs of a campaign; 6.", "N")] = 6
    criterion: Annotated[Criterion, Option("What suggested runs serve: margins (default), or D.")] = "margins"

    def __post_init__(self) -> None:
        """Refuse what no identification can do."""
        for option, value, low, high in (
            ("residual-limit", self.residual_limit, 0.0, None),
            ("decimation", self.decimation or 1, 1, None),
            ("suggest", self.suggest, 0, 50),
            ("within", self.within, 0.01, 100.0),
            ("noise", self.noise or 0.0, 0.0, None),
        ):
            if not low <= value or (high is not None and value > high):
                allowed = f"{low:g} or more" if high is None else f"{low:g} to {high:g}"
                raise InputError(f"--{option} {value:g}; allowed: {allowed}")
        if self.frequency_response and len(self.files) != 1:
            raise InputError("--frequency-response takes one record (and --play RECORD for the play)")
        if self.response and len(self.files) != 1:
            raise InputError(
                "--response takes one file; allowed: CSV, JSON, Parquet or .mat of a frequency response"
            )
        if not self.response and (self.loop is not None or self.response_of != "L" or self.averages):
            raise InputError("--loop, --of and --averages go with --response")
        if (self.response or self.frequency_response) and self.inertia_to != Settings.inertia_to:
            hold = "hold the other one (--fix motor.rotor_inertia=VALUE)"
            raise InputError(f"--inertia-to goes with records; a response writes each inertia itself: {hold}")
        if self.is_campaign and (self.validate or self.refine):
            raise InputError("--validate and --refine go with records, not with a campaign")

    @cached_property
    def is_campaign(self) -> bool:
        """Whether a single TOML file is given that lists runs, and is no record file."""
        first = self.files[0]
        alone = len(self.files) == 1 and not (self.frequency_response or self.plan or self.response)
        if not alone or first.suffix.lower() != ".toml":
            return False
        from actuator_lti.files.reading import read_campaign_toml

        return not {"file", "record"} & set(read_campaign_toml(first))

    @classmethod
    def design_of(cls, chosen: Mapping[str, Any]) -> str:
        """The design where none is named: the campaign's, looked for beside its file too, or emps."""
        if chosen.get("plan"):
            return str(chosen["files"][0])
        if chosen.get("frequency_response") or chosen.get("response"):
            return "ilr33-amber"
        asked = cls(files=chosen["files"])
        if not asked.is_campaign:
            return "emps"
        from analyses.records.campaign_file import load_campaign

        design = load_campaign(asked.files[0]).design
        near = asked.files[0].parent / design
        return str(near) if near.suffix == ".toml" and near.exists() else design


def fixed_values(design: Design, texts: Sequence[str] | None) -> dict[str, float]:
    """``KEY=VALUE`` texts as SI values by key; a bare number is in SI."""
    from actuator_lti.design.writing import read_value

    result = {}
    for text in texts or ():
        key, equals, value = (part.strip() for part in text.partition("="))
        if not equals or not value:
            raise InputError(f'--fix "{text}": KEY=VALUE is wanted, such as friction.load_coefficient=0')
        try:
            result[key] = read_value(design, key, value)
        except InputError as error:
            raise InputError(f"--fix {error.message}") from None
    return result


def refuse_linear(design: Design, what: str) -> None:
    """Refuse what is read in the units of a shaft alone: rad, N m."""
    if design.axis == "linear":
        allowed = "allowed for a linear axis: records of a motion, the response of a loop"
        raise InputError(f'design.axis = "linear": {what} is of a rotary drive; {allowed}', design.name)


def held_by_name(
    fixed: Mapping[str, float], names: Sequence[str], more: Mapping[str, str] | None = None
) -> dict[str, float]:
    """Fixed keys by the names of a fit; ``more`` are keys that no single name has."""
    known = {parameter(name).key: name for name in names if parameter(name).key} | dict(more or {})
    for key in fixed:
        if key not in known:
            raise InputError(f"--fix {key}: can be fixed here: {', '.join(sorted(known))}")
    return {known[key]: value for key, value in fixed.items()}
