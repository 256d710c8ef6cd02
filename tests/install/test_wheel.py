"""What the wheel and the sources hold: all that runs needs, and nothing of the tests."""

import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest

from actuator_lti.axis.library import LIBRARY as axis
from actuator_lti.batch.library import LIBRARY as figures
from nonlinear.native import LIBRARY as run

ROOT = Path(__file__).parents[2]
PACKAGES = ("actuator_lti", "nonlinear", "analyses", "reports")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
(BACK_END,) = PROJECT["build-system"]["requires"]
BUILD = """\
import os, re, sys
from importlib.machinery import PathFinder
from importlib.metadata import packages_distributions
from setuptools import build_meta

class AsAsked(PathFinder):  # an environment made for the build holds what it asks for, and nothing else
    asked, here = {"setuptools", "actuator-lti"}, packages_distributions()

    @classmethod
    def find_spec(cls, name, *how):
        from_ = {each.replace("_", "-").lower() for each in cls.here.get(name, cls.asked)}
        return super().find_spec(name, *how) if from_ & cls.asked else None

source, dist = sys.argv[1:]
os.chdir(source)
AsAsked.asked |= {re.match(r"[\\w-]+", one)[0] for one in build_meta.get_requires_for_build_wheel()}
sys.meta_path[sys.meta_path.index(PathFinder)] = AsAsked
sys.path.insert(0, source)
from actuator_lti.compiled import compiler, library

compiler.LIBRARY_FLAGS = ("-O0",)  # named as usual, compiled in half the time: none is run
build_meta.build_wheel(dist)
build_meta.build_sdist(dist)
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory) -> tuple[set[str], set[str], str]:
    """Names in the wheel and in the sources, and the metadata."""
    if f"setuptools=={version('setuptools')}" != BACK_END:
        pytest.skip(f"the build back-end of this environment is not {BACK_END}")
    source, dist = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("dist")
    for name in (*PACKAGES, "tests"):
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__", "_native"))
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source / name)
    done = subprocess.run(
        [sys.executable, "-c", BUILD, str(source), str(dist)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    (wheel,), (sources,) = dist.glob("*.whl"), dist.glob("*.tar.gz")
    with zipfile.ZipFile(wheel) as file:
        names = set(file.namelist())
        about = file.read(next(name for name in names if name.endswith("/METADATA"))).decode()
    with tarfile.open(sources) as file:
        inside = {member.name.partition("/")[2] for member in file.getmembers() if member.isfile()}
    return names, inside, about


def needed() -> set[str]:
    """Every file under version control's packages: modules, designs, templates, types, the wasm module."""
    kept = {".py", ".toml", ".html", ".css", ".js", ".typ", ".c", ".h", ".md", ".typed", ".wasm", ".json"}
    return {
        str(path.relative_to(ROOT))
        for package in PACKAGES
        for path in (ROOT / package).rglob("*")
        if path.is_file() and path.suffix in kept and "__pycache__" not in path.parts
    }


def test_nothing_that_is_needed_is_left_out_and_nothing_else_installed(built) -> None:
    names, inside, _ = built
    wanted = needed()
    some = {"reports/templates/report.html", "nonlinear/export/wasm/drive.wasm", "nonlinear/native.py"}
    some |= {f"{package}/py.typed" for package in PACKAGES}
    assert some | {"actuator_lti/design/shipped/ilr33-amber.toml"} <= wanted
    assert wanted - names == set()
    assert wanted - inside == set()
    assert any(name.endswith("licenses/LICENSE") for name in names)
    assert {"LICENSE", "README.md", "pyproject.toml", "setup.py"} <= inside
    tops = {name.partition("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == set(PACKAGES)
    assert not [name for name in names if re.search(r"(^|/)(tests?|conftest)(/|\.py|_)", name)]
    assert not [name for name in names if name.endswith(".pyc")]


def test_the_wheel_holds_the_compiled_kernels_of_this_machine_and_a_light_core(built) -> None:
    names, inside, about = built
    libraries = {name for name in names if "_native/" in name}
    assert libraries == {str(each.path().relative_to(ROOT)) for each in (figures, axis, run)}
    assert not [name for name in inside if "_native" in name]
    core = {
        re.match(r"[\w-]+", line.partition(": ")[2])[0].lower()
        for line in about.splitlines()
        if line.startswith("Requires-Dist") and "extra ==" not in line
    }
    assert core == {
        "control", "numpy", "scipy", "pydantic", "typer", "rich", "jinja2", "tomli-w", "tomlkit",
        "defusedxml", "python-flint",
    }  # fmt: skip
