"""What is asked of the margins: form, operating point, and a loop around the drive."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from actuator_lti.start.public_arguments import asked
from analyses.request import LOAD, POINT, Option


@asked
@dataclass(frozen=True, kw_only=True)
class Asked:
    """Print margins, bandwidths and verdicts of every loop; the margins are certified.

    Requirements are judged on the sampled loops with sliding friction, whatever form is printed.

    Try: actuator-lti margins joint --set control.position.gain="12 1/s", or actuator-lti margins joint
    --operating-point rest --load "60 N*m"
    """

    form: Annotated[str, Option("Linear form: sampled, continuous or ideal; sampled.", "FORM")] = "sampled"
    operating_point: Annotated[str, POINT] = "sliding"
    load_Nm: Annotated[float, LOAD] = 0.0
    around: Annotated[
        Path | None,
        Option(
            "JSON file of a linear system that is closed around the drive, from its output to its "
            "command (an airframe with its autopilot): num and den, or A, B, C and D; dt in s, or 0 for a "
            "continuous one, then with sampling_period in s; sign -1 or 1; name, input, output.",
            "FILE",
        ),
    ] = None
    response: Annotated[
        Path | None,
        Option(
            "Measured response of a loop, laid over the model: CSV, JSON, Parquet or .mat with frequency, "
            "dB and deg or real and imaginary part, perhaps coherence or deviation (rms of the complex error "
            "over the size of the value, or in dB of the gain, in deg of the phase).",
            "FILE",
        ),
    ] = None
    response_of: Annotated[
        str,
        Option(
            "What --response was measured of: a loop or break point, and :T for its closed loop, "
            ":S for its sensitivity; the open outermost loop.",
            "LOOP",
        ),
    ] = ""
    averages: Annotated[
        int | None, Option("Averages behind the coherence of --response, which tells the noise with them.")
    ] = None
