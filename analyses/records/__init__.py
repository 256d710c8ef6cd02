"""Measured records: reading them, counting every row, and putting two recorders on one clock."""

from analyses.records.campaign_file import Campaign, load_campaign
from analyses.records.campaign_import import ImportedCampaign, import_campaign
from analyses.records.clocks import ClockJoin, join_records
from analyses.records.csv_stream import read_csv_record, stream_csv
from analyses.records.mat_reader import read_mat_record
from analyses.records.open_record import open_record, open_records
from analyses.records.record import Record, RowCounts
from analyses.records.spec import CsvFormat, RecordSpec, SignalColumn, TimeColumn

__all__ = [
    "Campaign",
    "ClockJoin",
    "CsvFormat",
    "ImportedCampaign",
    "Record",
    "RecordSpec",
    "RowCounts",
    "SignalColumn",
    "TimeColumn",
    "import_campaign",
    "join_records",
    "load_campaign",
    "open_record",
    "open_records",
    "read_csv_record",
    "read_mat_record",
    "stream_csv",
]
