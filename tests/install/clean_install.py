"""The wheel and the sources in a clean environment, as a stranger installs them: no extras.

    python -m tests.install.clean_install                     this Python, newest versions of everything
    python -m tests.install.clean_install --python python3.13
    python -m tests.install.clean_install --pinned            the versions of constraints.txt

What is run there: the margins, a report, a run of the simulator, and a command that lacks its extra.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[2]
TELL = (
    "import importlib.metadata as m, platform;"
    "print('Python', platform.python_version(), *(f'{n} {m.version(n)}' for n in "
    "('control', 'numpy', 'scipy', 'numba', 'pydantic', 'typer', 'rich')))"
)
RUN = (
    "from nonlinear import commands, simulate;"
    "run = simulate('ilr33-amber', commands.step(0.01), 0.1);"
    "assert abs(run.output_angle_rad[-1] - 0.01) < 1e-3, run"
)
HEAVY = ("dask", "distributed", "pyarrow", "pandas", "typst", "ziglang", "fmpy", "ruptures")


def call(
    command: list[str | Path], folder: Path, wanted: int = 0, words: str = "", quiet: bool = False
) -> str:
    """Run a command away from the checkout; another status, or words that are missing, end it."""
    kept = {
        name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL_ENV"))
    }
    done = subprocess.run(
        list(map(str, command)),
        cwd=folder,
        env=kept,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    said = done.stdout + done.stderr
    if done.returncode != wanted or words not in said:
        raise SystemExit(f"{' '.join(map(str, command))}: status {done.returncode}, not {wanted}\n{said}")
    if not quiet:
        sys.stdout.write(f"ok: {' '.join(str(part) for part in command[1:])[:90]}\n")
    return said


def reached(python: Path, folder: Path) -> bool:
    """Whether the registry answers."""
    asked = [python, "-m", "pip", "download", "--quiet", "--no-deps", "--dest", folder / "asked", "tomli-w"]
    done = subprocess.run(list(map(str, asked)), cwd=folder, capture_output=True, timeout=120, check=False)
    return done.returncode == 0


def install(python: str, pinned: bool, sources: bool, folder: Path) -> Path | None:
    """An environment with the package alone in it, and its folder of programs; None without a registry."""
    call([python, "-m", "venv", folder / "there"], folder, quiet=True)
    bin_folder = folder / "there" / "bin"
    if not reached(bin_folder / "python", folder):
        return None
    pip = [bin_folder / "python", "-m", "pip", "--disable-pip-version-check", "--quiet"]
    call([*pip, "install", "build"], folder, quiet=True)
    kind = "--sdist" if sources else "--wheel"
    call([bin_folder / "python", "-m", "build", kind, "--outdir", folder / "dist", ROOT], folder, quiet=True)
    (built,) = (folder / "dist").iterdir()
    held = ["--constraint", ROOT / "constraints.txt"] if pinned else []
    call([*pip, "install", *held, built], folder, quiet=True)
    return bin_folder


def use(bin_folder: Path, folder: Path) -> None:
    """What has to work with nothing but the core."""
    program, python = bin_folder / "actuator-lti", bin_folder / "python"
    sys.stdout.write(call([python, "-c", TELL], folder, quiet=True))
    for name in HEAVY:
        call([python, "-c", f"import {name}"], folder, 1, "ModuleNotFoundError", quiet=True)
    call([program, "margins", "ilr33-amber"], folder, 0, "PASS  ilr33-amber")
    call([program, "report", "ctms-motor-position", "--no-validation", "--out", "out"], folder, 0)
    call([python, "-c", RUN], folder)
    call([program, "init", "mine.toml"], folder)
    call([program, "margins", "mine.toml"], folder)
    call(
        [program, "montecarlo", "ilr33-amber", "--samples", "4"],
        folder,
        2,
        'pip install "actuator-lti[tables]"',
    )
    call([program, "pdf", "out/report.json"], folder, 2, 'pip install "actuator-lti[pdf]"')


def main() -> None:
    """Install and use."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--python", default=sys.executable)
    parser.add_argument("--pinned", action="store_true")
    parser.add_argument("--sources", action="store_true", help="from the sdist")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="install-") as name:
        result = install(given.python, given.pinned, given.sources, Path(name))
        if result is None:
            sys.stdout.write("clean install: skipped, no package registry is reached\n")
            return
        use(result, Path(name))


if __name__ == "__main__":
    main()
