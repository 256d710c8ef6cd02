"""The wheel and the sources in a clean environment, as a stranger installs them: no extras.

    python -m tests.install.clean_install                     this Python, newest versions of everything
    python -m tests.install.clean_install --python python3.13
    python -m tests.install.clean_install --pinned            the versions of constraints.txt

What is run there: the margins, a report, runs of the simulator, and a command that lacks its extra; without a
compiler, without a home, packages in a folder that is only read, by another user where there is one who may.

    python -m tests.install.clean_install --report            `make report` in a fresh copy of the checkout

What that takes of disk and processor time has a bound.
"""

import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
TELL = (
    "import importlib.metadata as m, platform;"
    "print('Python', platform.python_version(), *(f'{n} {m.version(n)}' for n in "
    "('control', 'numpy', 'scipy', 'pydantic', 'typer', 'rich')))"
)
RUN = (
    "import time; start = time.perf_counter();"
    "from nonlinear import commands, simulate;"
    "run = simulate('ilr33-amber', commands.step(0.01), 0.1);"
    "assert abs(run.output_angle_rad[-1] - 0.01) < 1e-3, run;"
    "print(f'first run: {time.perf_counter() - start:.2f} s')"
)
MOST_BYTES, MOST_S = 1_000_000_000, 60.0  # of make report
MOST_FIRST_S = 1.0
HEAVY = ("dask", "distributed", "pyarrow", "pandas", "typst", "ziglang", "fmpy", "ruptures")


def call(command: list[str | Path], folder: Path, wanted: int = 0, words: str = "", **how: bool) -> str:
    """Run a command away from the checkout; another status, or words that are missing, end it.

    ``quiet``: nothing is said of it; ``stranger``: by one without compiler and home.
    """
    user, place = None, Path(command[0]).parent
    kept = {name: own for name, own in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL_ENV"))}
    if how.get("stranger"):
        user, kept = other_user(place / "python"), {"PATH": str(place)}
    streams = {"capture_output": True, "text": True, "timeout": 600, "check": False}
    done = subprocess.run(list(map(str, command)), cwd=folder, env=kept, user=user, **streams)
    said = done.stdout + done.stderr
    right = done.returncode in (0, 1) if wanted < 0 else done.returncode == wanted
    if not right or words not in said:
        raise SystemExit(f"{' '.join(map(str, command))}: status {done.returncode}, not {wanted}\n{said}")
    if not how.get("quiet"):
        sys.stdout.write(f"ok: {' '.join(str(part) for part in command[1:])[:90]}\n")
    return said


@cache
def other_user(python: Path) -> str | None:
    """Whom root can be besides, if he may start this Python."""
    if os.geteuid() != 0:
        return None
    try:
        subprocess.run([python, "-c", ""], user="nobody", check=True)
    except OSError:
        return None
    return "nobody"


def reached(python: Path, folder: Path) -> bool:
    """Whether the registry answers."""
    asked = [python, "-m", "pip", "download", "--quiet", "--no-deps", "--dest", folder / "asked", "tomli-w"]
    done = subprocess.run(list(map(str, asked)), cwd=folder, capture_output=True, timeout=120, check=False)
    return done.returncode == 0


def install(bin_folder: Path, pinned: bool, sources: bool, folder: Path) -> None:
    """The package alone in an environment."""
    pip = [bin_folder / "python", "-m", "pip", "--disable-pip-version-check", "--quiet"]
    call([*pip, "install", "build"], folder, quiet=True)
    kind = "--sdist" if sources else "--wheel"
    call([bin_folder / "python", "-m", "build", kind, "--outdir", folder / "dist", ROOT], folder, quiet=True)
    (built,) = (folder / "dist").iterdir()
    held = ["--constraint", ROOT / "constraints.txt"] if pinned else []
    call([*pip, "install", *held, built], folder, quiet=True)


def use(bin_folder: Path, folder: Path) -> None:
    """What has to work with nothing but the core."""
    program, python = bin_folder / "actuator-lti", bin_folder / "python"
    sys.stdout.write(call([python, "-c", TELL], folder, quiet=True))
    for name in HEAVY:
        call([python, "-c", f"import {name}"], folder, 1, "ModuleNotFoundError", quiet=True)
    opened = folder / "work"
    opened.mkdir()
    opened.chmod(0o777)
    folder.chmod(0o755)
    subprocess.run(["chmod", "-R", "a-w,a+rX", bin_folder.parent], check=True)

    def stranger(*command: str | Path, wanted: int = 0, words: str = "") -> str:
        return call([*command], opened, wanted, words, stranger=True)

    said = stranger(python, "-c", RUN, words="first run: ")
    sys.stdout.write(said)
    if float(said.split()[2]) > MOST_FIRST_S:
        raise SystemExit(f"the first run takes more than {MOST_FIRST_S} s")
    stranger(program, "margins", "ilr33-amber", words="PASS  ilr33-amber")
    stranger(program, "report", "ctms-motor-position", "--no-validation", "--out", "out")
    for name in ("simulate", "validate", "corners", "failures", "stiffness", "cycles", "duty"):
        stranger(program, name, "ilr33-amber", wanted=-1)
    stranger(program, "init", "mine.toml")
    stranger(program, "margins", "mine.toml")
    tables, pdf = 'pip install "actuator-lti[tables]"', 'pip install "actuator-lti[pdf]"'
    stranger(program, "montecarlo", "ilr33-amber", "--samples", "4", wanted=2, words=tables)
    stranger(program, "pdf", "out/report.json", wanted=2, words=pdf)
    subprocess.run(["chmod", "-R", "u+w", bin_folder.parent], check=True)


def report(folder: Path) -> None:
    """The main job as a newcomer does it: what it says, and what it takes."""
    files = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in files.splitlines():
        (folder / "copy" / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, folder / "copy" / name)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    said = call(["make", "--directory", folder / "copy", f"PYTHON={sys.executable}", "report"], folder)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    taken = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    size = sum(path.lstat().st_blocks * 512 for path in (folder / "copy/.venv").rglob("*"))
    sys.stdout.write(f"make report: {size / 1e9:.2f} GB, {taken:.0f} s of processor time\n")
    lines = [line for line in said.splitlines() if not line.startswith(("make", "WARNING"))]
    steps = [line[:3] for line in lines[:4]]
    if size > MOST_BYTES or taken > MOST_S or steps != ["1/4", "2/4", "3/4", "4/4"] or "done: " not in said:
        raise SystemExit(f"make report: at most {MOST_BYTES} bytes, {MOST_S} s; a line a step\n{said}")


def main() -> None:
    """Install and use."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--python", default=sys.executable)
    parser.add_argument("--pinned", action="store_true")
    parser.add_argument("--sources", action="store_true", help="from the sdist")
    parser.add_argument("--report", action="store_true", help="make report, in a copy of the checkout")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="install-") as name:
        folder = Path(name)
        bin_folder = folder / "there" / "bin"
        call([given.python, "-m", "venv", folder / "there"], folder, quiet=True)
        if not reached(bin_folder / "python", folder):
            sys.stdout.write("clean install: skipped, no package registry is reached\n")
        elif given.report:
            report(folder)
        else:
            install(bin_folder, given.pinned, given.sources, folder)
            use(bin_folder, folder)


if __name__ == "__main__":
    main()
