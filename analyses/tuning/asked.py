"""What is asked of tuning, in words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

from actuator_lti.start.public_arguments import asked
from analyses.request import Option

if TYPE_CHECKING:
    from actuator_lti.design.model import Design, Requirement

Aim = Literal["least-change", "reserve"]


@asked
@dataclass(frozen=True)
class TuningSettings:
    """What tuning is to do; the words of `Asked`, read."""

    requirements: tuple[Requirement, ...] = ()  # in place of the design's on the same figure of a loop
    rounded: bool = True
    curve: bool = True  # the trade-off curve; and the nonlinear check
    check: bool = True
    aim: Aim = "least-change"
    place: tuple[str, ...] = ()  # of `analyses.tuning.start.ELEMENTS`


@dataclass(frozen=True, kw_only=True)
class Asked:
    """Find gains that meet the requirements at every corner of the tolerances, or say by how much none can.

    Searched for are requirements on loops, and on the output rate that a P velocity loop bounds; all others
    are judged on the tuned design, as by margins.

    By default the least change of the design. With --place also a notch, a low-pass, feed-forward where
    gains alone do not do.

    The result is confirmed by certified margins, nominal and at each requirement's worst corner.

    Writes tune.html, tune.json and, where all that is searched for is met, tuned.toml (a design). Exit status
    1 where any requirement is not met.

    Try: actuator-lti tune joint --require "position.bandwidth>=60 Hz" --place notch,feedforward
    """

    require: Annotated[
        list[str] | None,
        Option('In place of the design\'s: "position.bandwidth>=30 Hz"; repeatable.', "LOOP.QUANTITY>=LIMIT"),
    ] = None
    aim: Annotated[
        Aim,
        Option(
            "The least change of the design that meets every requirement, or the largest distance to "
            "all limits (up to 30 %); least-change."
        ),
    ] = "least-change"
    place: Annotated[
        list[str] | None,
        Option(
            "What may be added where gains alone do not do: notch, lowpass, feedforward; "
            "the fewest that do are kept.",
            "ELEMENT,...",
        ),
    ] = None
    rounded: Annotated[
        bool, Option("Round to the steps of the motion controller's objects.", flag="round/--no-round")
    ] = True
    curve: Annotated[bool, Option("Trade-off curve.", flag="curve/--no-curve")] = True

    @classmethod
    def of(cls, design: Design, **chosen: Any) -> TuningSettings:
        """The settings; raises `InputError` for a requirement that cannot be read."""
        from analyses.tuning.problem import read_requirement

        asked = cls(**chosen)
        wanted = tuple(read_requirement(words, design) for words in asked.require or ())
        elements = tuple(word.strip() for words in asked.place or () for word in words.split(","))
        return TuningSettings(wanted, asked.rounded, asked.curve, aim=asked.aim, place=elements)
