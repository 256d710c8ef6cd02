"""A drive as it is put on the bench for its linear predictions."""

from __future__ import annotations

from dataclasses import replace

from actuator_lti.design.model import Command, Design, Instruments, Sensor


def on_the_bench(design: Design) -> Design:
    """A drive as its loops are tested: ideal instruments, and the command taken as it is."""
    return replace(quiet(design), command=Command())


def quiet(design: Design) -> Design:
    """A drive without counts and noise: what they keep moving is a finding of its own."""
    return replace(without_counts(design), instruments=Instruments())


def without_counts(design: Design, *sensors: Sensor) -> Design:
    """The same drive with some encoders free of counts, by default with both."""
    if "motor" in sensors or not sensors:
        design = replace(design, encoder=replace(design.encoder, counts_per_rev=None))
    if "output" in sensors or not sensors:
        design = replace(design, output_encoder=replace(design.output_encoder, counts_per_rev=None))
    return design
