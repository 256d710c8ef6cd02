"""A drive as it is put on the bench for its linear predictions."""

from __future__ import annotations

from dataclasses import replace

from actuator_lti.design.model import Command, Design, Instruments


def on_the_bench(design: Design) -> Design:
    """A drive as its loops are tested: ideal instruments, and the command taken as it is."""
    return replace(
        design,
        encoder=replace(design.encoder, counts_per_rev=None),
        output_encoder=replace(design.output_encoder, counts_per_rev=None),
        instruments=Instruments(),
        command=Command(),
    )
