"""Attack every loader and command: ``python -m tests.hardness.fuzz --seconds 600 --seed 1``.

Each input is damaged on purpose, reproducible from seed and number. A good end is a result, or a refusal in
one printable line. Everything else is a find: it is kept in --keep and named; exit status 1 then.
"""

import argparse
import atexit
import os
import random
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from itertools import count, cycle
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent / "nightly")]

from targets import Target, targets  # noqa: E402 - needs the path

from actuator_lti.errors import InputError, NumericalError  # noqa: E402

LIMIT_S, SLICE_S = 120, 0.5


@dataclass(frozen=True)
class Find:
    target: str
    number: int
    what: str
    where: str
    data: bytes


class TooSlow(BaseException):
    pass


def attack(target: Target, seed: int, number: int) -> Find | None:
    draw = random.Random(f"{seed}/{target.name}/{number}")
    data = target.fault(draw.choice(target.seeds), draw)
    path = written(data, target.suffix)
    try:
        with limited(), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            target.attack(path)
    except NumericalError:
        return None
    except InputError as error:
        if all(line.isprintable() and len(line) < 2000 for line in str(error).split("\n")):
            return None
        said = "no printable line", repr(str(error)[:300])
    except TooSlow as error:
        said = f"more than {LIMIT_S} s", place(error)
    except Exception as error:  # noqa: BLE001 - whatever it is, it is a find
        said = f"{type(error).__name__}: {str(error)[:300]}", place(error)
    else:
        return None
    return Find(target.name, number, *said, data)


@cache
def own_folder(process: int) -> Path:
    """A folder of this process, in memory where the system has such a place."""
    memory = Path("/dev/shm")
    folder = tempfile.mkdtemp(prefix="fuzz-", dir=memory if os.access(memory, os.W_OK) else None)
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


def written(data: bytes, suffix: str) -> Path:
    """A file with these bytes, alone in the folder; what the input before it left there is removed."""
    folder = own_folder(os.getpid())
    for name in os.listdir(folder):
        left = folder / name
        shutil.rmtree(left) if left.is_dir() and not left.is_symlink() else left.unlink()
    path = folder / f"input{suffix}"
    path.write_bytes(data)
    return path


@contextmanager
def limited() -> Iterator[None]:
    def end(_number: int, _frame: object) -> None:
        raise TooSlow

    before = signal.signal(signal.SIGALRM, end)
    signal.alarm(LIMIT_S)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def place(error: BaseException) -> str:
    frames = traceback.extract_tb(error.__traceback__)
    ours = [f for f in frames if "site-packages" not in f.filename and "/lib/python" not in f.filename]
    last = (ours or frames)[-1] if frames else None
    return f"{Path(last.filename).name}:{last.lineno} {last.name}" if last else ""


def rounds(chosen: tuple[Target, ...]) -> Iterator[tuple[Target, int]]:
    """Inputs without end, of each target for some time."""
    numbers = {target: count() for target in chosen}
    for target in cycle(chosen):
        end = time.monotonic() + SLICE_S
        while time.monotonic() < end:
            yield target, next(numbers[target])


def main() -> int:
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("--seconds", type=float, default=600.0)
    words.add_argument("--seed", type=int, default=1)
    words.add_argument("--keep", type=Path, default=Path("out/fuzz"))
    asked = words.parse_args()
    finds: dict[tuple[str, str], Find] = {}
    done, end = Counter[str](), time.monotonic() + asked.seconds
    for target, number in rounds(targets()):
        if time.monotonic() > end:
            break
        find = attack(target, asked.seed, number)
        done[target.name] += 1
        if find is not None and (find.what.partition(":")[0], find.where) not in finds:
            finds[find.what.partition(":")[0], find.where] = find
            asked.keep.mkdir(parents=True, exist_ok=True)
            file = asked.keep / f"{target.name.replace(' ', '-')}-{asked.seed}-{number}{target.suffix}"
            file.write_bytes(find.data)
            sys.stdout.write(f"{target.name} {number}: {find.what} at {find.where}; kept: {file}\n")
            sys.stdout.flush()
    sys.stdout.write(f"{sum(done.values())} inputs, {len(finds)} finds; {dict(done)}\n")
    return 1 if finds else 0


if __name__ == "__main__":
    sys.exit(main())
