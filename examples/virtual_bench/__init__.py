"""A test bench in the computer, for tests and for who has no bench at hand.

The simulator is driven through a campaign of constant speeds and clutch loads (`campaign`), or a compliant
drive through a sweep and a reversal (`two_mass`, with a `plan` that fits the drive); `instruments` with
noise, shared errors and clocks of their own measure it, and `files` writes the logs as a bench would.

    python -m examples.virtual_bench bench --seed 1
    actuator-lti identify bench/campaign.toml

    python -m examples.virtual_bench bench --sweep --design joint --set "instruments.current_noise=30 mA"
    actuator-lti identify --frequency-response bench/sweep.csv --design joint
"""

from examples.virtual_bench.campaign import BenchPlan, TrueRun, simulate_bench
from examples.virtual_bench.files import write_bench, write_record
from examples.virtual_bench.instruments import BenchInstruments, RunLogs, measure_bench
from examples.virtual_bench.plan import plan_for
from examples.virtual_bench.two_mass import TwoMassPlan, reversal_record, sweep_record

__all__ = [
    "BenchInstruments",
    "BenchPlan",
    "RunLogs",
    "TrueRun",
    "TwoMassPlan",
    "measure_bench",
    "plan_for",
    "reversal_record",
    "simulate_bench",
    "sweep_record",
    "write_bench",
    "write_record",
]
