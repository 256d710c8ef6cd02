"""The words of reports, one line each: the glossary and what a table's heading says are made of it."""

from functools import cache

from actuator_lti.asked.quantities import QUANTITIES

TERMS: dict[str, str] = {
    "Antiresonance": "frequency at which the load, on its spring, holds the motor still: sqrt(k/J_l)",
    "Break point": "place where one signal is cut while all other loops stay closed: u, i_ref, w_ref, output",
    "Breakaway": "the torque that starts motion from rest; its ratio to dry friction",
    "Certified": "margins whose list of crossings is proven complete in exact or interval arithmetic",
    "Coupling": "the spring and damper, perhaps with play, between the motor's side and the load's side",
    "Closed loop": "the loop with its feedback; stable or not, judged by its poles and by the Nyquist count",
    "Compliance": "output angle per load torque over frequency; its inverse is the dynamic stiffness",
    "Computing delay": "time from the sampling instant to the voltage acting",
    "Conditionally stable": "stable, and unstable when the loop gain falls",
    "Describing function": "gain of a nonlinear element for a sine, over its amplitude",
    "Disk margin": "gain and phase that may change together, balanced between S and T",
    "Driven": "operating point in which the load pushes the motor through the coupling",
    "Driving": "operating point in which the motor pushes the load through the coupling",
    "Duty cycle": "the motion that the drive has to repeat within its continuous rating",
    "Evidence": "how margins are known: certified, checked by two ways, or withheld",
    "Feed-forward": "what the controller adds from the command alone",
    "Gap": "operating point inside the play, where motor and load are apart",
    "Grade": "of a source: A maker's document, B file of a device, C transcription, D derived, X assumed",
    "Hunting": "limit cycle about the target by integral action and dry friction",
    "Initial-condition response": "motion of the drive from a deflection, without a command",
    "Limit cycle": "oscillation that keeps its amplitude by itself: play, dry friction, counts, limits",
    "Limiter": "a bound on a signal or on its change: speed, acceleration, current, its slope, voltage",
    "Linear limit": "amplitude, over frequency, at which the first limiter acts; below it the loops hold",
    "Lost motion": "deflection of the output over a load cycle of +-3 % of load.moment_max",
    "Met": "a requirement that the figure keeps; else not met, or not proven where the figure is not known",
    "Not proven": "neither met nor not met: the figure is not known; status 1 unless waived",
    "Onset": "amplitude of the command at which a limiter is first reached",
    "Operating motion": "the steady motion about which a drive is made linear",
    "Overload protection": "I2t: falls back to the continuous current after the stated time at the peak",
    "Peak of T": "largest gain of the closed loop over frequency",
    "Rotor locked": "the current loop without back-EMF, as it is measured on a blocked shaft",
    "Sampled": "exact in z at the drive's own instants, with hold and computing delay",
    "Self-locking": "load path through which the load brakes the motor and cannot turn it",
    "Sliding": "operating point in motion: the slope of viscous friction",
    "Stability limit": "gain, phase or delay at which a closed-loop pole reaches the axis or the circle",
    "Tangent": "linear model of the running simulator by differences of one tick",
    "Tolerance": "how far a value may lie from its nominal, uniform or normal",
    "Twist": "motor angle over N_c minus the angle behind the coupling",
    "Verdict": "met, not met or not proven",
    "Waiver": "leave to go on while a requirement is not proven, with reason and date",
}
"""Terms that are no figure; those are in `actuator_lti.asked.quantities`."""


def glossary() -> dict[str, str]:
    """Every term and its line, in the order of the alphabet."""
    figures = {quantity.title or quantity.words: quantity.description for quantity in QUANTITIES.values()}
    return dict(sorted({**figures, **TERMS}.items(), key=lambda item: item[0].lower()))


def meaning(heading: str) -> str:
    """The line of a term as a table heads its column; empty where there is none.

    >>> meaning("Disk margin").partition(",")[0]
    'gain and phase that may change together'
    """
    return _by_heading().get(heading.strip().lower(), "")


@cache
def _by_heading() -> dict[str, str]:
    headings = {of.heading: of.description for of in QUANTITIES.values() if of.heading}
    return {term.lower(): line for term, line in {**headings, **glossary()}.items()}
