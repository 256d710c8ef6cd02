"""A campaign's records: each run read and joined; a bad run set aside and named, the others go on."""

from dataclasses import dataclass, replace

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.types import Progress
from analyses.records.campaign_file import Campaign, RunEntry
from analyses.records.clocks import ClockJoin, Mismatch, clock_join, joined_by
from analyses.records.inputs import InputUse, account
from analyses.records.load_clock import by_current
from analyses.records.readers import read_record
from analyses.records.record import Record, RowCounts

USED = {"current": "torque kM i", "speed": "steady speed", "torque": "load", "angle": "check of the speed"}
"""What a campaign uses its signals for."""


@dataclass(frozen=True, kw_only=True)
class ImportedRun:
    """One run, on one clock, with the sensor's own record where there is one."""

    entry: RunEntry
    record: Record
    join: ClockJoin | None = None
    sensor: Record | None = None

    @property
    def id(self) -> str:
        """As the campaign lists it."""
        return self.entry.id

    @property
    def load_is_zero(self) -> bool:
        """Whether the clutch is disconnected: the load torque is exactly zero, and none is needed."""
        return self.entry.load_Nm == 0.0

    @property
    def sensor_file(self) -> str:
        """SHA-256 of the load sensor's own file; empty where the run does not use one."""
        return "" if self.load_is_zero or self.sensor is None else self.sensor.sha256


@dataclass(frozen=True)
class SetAside:
    """A run that could not be used, and why; ``contradicts``: its records do not agree, with what is said."""

    id: str
    reason: str
    contradicts: bool = False


@dataclass(frozen=True, kw_only=True)
class ImportedCampaign:
    """All runs of a campaign; ``len(runs) + len(set_aside)`` is the number of runs listed."""

    campaign: Campaign
    runs: tuple[ImportedRun, ...]
    set_aside: tuple[SetAside, ...]

    @property
    def counts(self) -> list[RowCounts]:
        """The account of each file of the runs that are used."""
        return [read.counts for run in self.runs for read in (run.record, run.sensor) if read is not None]

    @property
    def inputs(self) -> tuple[InputUse, ...]:
        """The columns of the runs' files, their ranges over all runs."""
        whole: dict[tuple[str, str], InputUse] = {}
        for run in self.runs:
            for file, read in (("drive", run.record), ("sensor", run.sensor)):
                for one in account(replace(run.record, inputs=read.inputs), USED) if read else ():
                    if file == "sensor" and one.use == "time":
                        one = InputUse(column=one.column, meaning="time, on a clock of its own", use="time")
                    key = (file, one.column)
                    whole[key] = _over(replace(one, file=file), whole.get(key))
        return tuple(whole.values())


def _over(one: InputUse, known: InputUse | None) -> InputUse:
    """A column of one run and of those before it; a run without load does not use the sensor."""
    if known is None or known.low is None or known.high is None:
        return one
    if one.low is None or one.high is None:
        return known
    return replace(known, low=min(known.low, one.low), high=max(known.high, one.high))


def import_campaign(campaign: Campaign, *, progress: Progress = None) -> ImportedCampaign:
    """Read every run that the campaign lists; set aside is one whose file is missing, broken or not joined.

    Raises `InputError`: if no run at all can be used.
    """
    runs, aside = [], []
    for k, entry in enumerate(campaign.runs, 1):
        try:
            drive, sensor = read_record(entry.drive, campaign.drive), None
            if entry.sensor is not None:
                if campaign.sensor is None:
                    why = f"run {entry.id} has a sensor file, but there is no [sensor]"
                    raise InputError(why, where=campaign.origin)
                sensor = read_record(entry.sensor, campaign.sensor)
            runs.append(assemble_run(campaign, entry, drive, sensor))
        except InputError as error:
            aside.append(SetAside(entry.id, str(error), contradicts=isinstance(error, Mismatch)))
        if progress is not None:
            progress(k, len(campaign.runs))
    if not runs:
        why = f"none of the {len(aside)} runs can be used; the first: {aside[0].reason}"
        raise InputError(why, where=campaign.origin)
    return ImportedCampaign(campaign=campaign, runs=tuple(runs), set_aside=tuple(aside))


def assemble_run(campaign: Campaign, entry: RunEntry, drive: Record, sensor: Record | None) -> ImportedRun:
    """One run of records that are read already: joined, or with its load known to be zero."""
    record, join = drive, None
    if entry.load_Nm == 0.0:
        note = "clutch disconnected: the load torque is zero, the torque record is not needed"
        record = replace(drive, notes=(*drive.notes, note))
    elif "torque" not in drive.signals:
        if sensor is None:
            raise InputError(f"run {entry.id}: no torque signal and no sensor file", where=campaign.origin)
        how = campaign.join
        join = clock_join(drive, sensor, how, entry.offset_s)
        join = join if how.method == "given" else by_current(drive, sensor, join, how.sensor_signal)
        record = joined_by(drive, sensor, join)
    if not np.any(record["speed"]):
        raise InputError("the speed is zero throughout", where=drive.name)
    return ImportedRun(entry=entry, record=record, join=join, sensor=sensor)
