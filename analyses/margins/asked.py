"""What is asked of the margins: form, operating point, and a loop around the drive."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from analyses.request import LOAD, POINT, Option


@dataclass(frozen=True, kw_only=True)
class Asked:
    """Where the loops are looked at."""

    form: Annotated[
        str, Option(words="Linear form: sampled, continuous or ideal; sampled.", metavar="FORM")
    ] = "sampled"
    operating_point: Annotated[str, POINT] = "sliding"
    load_Nm: Annotated[float, LOAD] = 0.0
    around: Annotated[
        Path | None,
        Option(
            words="JSON file of a linear system that is closed around the drive, from its output to its "
            "command (an airframe with its autopilot): num and den, or A, B, C and D; dt in s, or 0 for a "
            "continuous one, then with sampling_period in s; sign -1 or 1; name, input, output.",
            metavar="FILE",
        ),
    ] = None
    response: Annotated[
        Path | None,
        Option(
            words="Measured response of a loop, laid over the model: CSV or .mat with frequency, dB and "
            "deg or real and imaginary part, perhaps coherence or deviation.",
            metavar="FILE",
        ),
    ] = None
    response_of: Annotated[
        str,
        Option(
            words="What --response was measured of: a loop or break point, and :T for its closed loop, "
            ":S for its sensitivity; the open outermost loop.",
            metavar="LOOP",
        ),
    ] = ""
    averages: Annotated[int | None, Option(words="Averages behind the coherence of --response.")] = None
