"""Command lines with hostile values: every option of every command that starts no other process."""

import json
import random
from functools import cache

from tests.command_line import commands

DESIGN = "ctms-motor-position"
# What each command needs besides, so that it is quick. OUT is a folder of the run, FILE a file that is none.
QUICK: dict[str, tuple[str, ...]] = {
    "simulate": (DESIGN, "--duration", "0.01"), "margins": (DESIGN,), "stiffness": (DESIGN,),
    "corners": (DESIGN,), "duty": (DESIGN,), "keys": (), "designs": (), "pdf": ("FILE",),
    "init": ("OUT/new.toml",), "objects export": (DESIGN,), "identify": ("FILE",), "correlate": ("FILE",),
}  # fmt: skip
LEFT_OUT = {"--help", "--workers", "--scheduler"}
VALUES = (
    "", "nan", "inf", "-inf", "-1", "0", "1", "1e-320", "1e308", "1e400", "9" * 5000, "-" + "9" * 30,
    "a\x1b[31mb\r\n", "\u202e", "\udc80", "x" * 300, "-", "--", "%s%n", "every", "=", "0x10", "1_000",
    "\u0663", "1000000000", "/dev/full", "/dev/zero", "/dev/null", "/proc/self/mem", "/nonexistent/x", "OUT",
    "FILE", "3 N*m", "5 deg", "-5 deg", "1e400 deg", "1e-300 deg", "1e300 deg", "motor.resistance=1 ohm",
    "motor.resistance", "position.gain_margin>=nan", DESIGN,
)  # fmt: skip


@cache
def options() -> dict[str, tuple[str, ...]]:
    """The options of each command of `QUICK`, those that take a value first."""
    found, known = {}, commands()
    for name in QUICK:
        named = [next((o for o in p.opts if o.startswith("--")), "") for p in known[name].params]
        found[name] = tuple(option for option in named if option and option not in LEFT_OUT)
    return found


def seeds() -> tuple[bytes, ...]:
    """A good line of each command, but those whose file is none."""
    lines = [[*name.split(), *words] for name, words in QUICK.items() if "FILE" not in words]
    return tuple(json.dumps(line).encode() for line in lines)


def hostile(_line: bytes, draw: random.Random) -> bytes:
    """A line of any command with one to three options that hold anything."""
    name = draw.choice(tuple(QUICK))
    words = [*name.split(), *QUICK[name]]
    for _ in range(draw.choice((1, 1, 2, 3))):
        option = draw.choice(options()[name])
        words += [option] if draw.random() < 0.1 else [f"{option}={draw.choice(VALUES)}"]
    if draw.random() < 0.1:
        words.append(draw.choice(VALUES))
    return json.dumps(words).encode()
