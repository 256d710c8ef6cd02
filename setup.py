"""The wheel holds the compiled kernels of one kind of machine.

This one's, by its own C compiler or else by the one of ziglang, which is then asked for; or for every machine
of the kind that ``ACTUATOR_LTI_TARGET`` names (`actuator_lti.compiled.compiler.TARGETS`), by ziglang.
"""

import os
import shutil
import sys
from pathlib import Path

from setuptools import Distribution, setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_py import build_py

sys.path.insert(0, str(Path(__file__).parent))
sys.dont_write_bytecode = True

from actuator_lti.compiled.compiler import TARGETS, system_compiler  # noqa: E402

TARGET = os.environ.get("ACTUATOR_LTI_TARGET", "")
EMITTED = ["numpy>=2.0", "tomli-w>=1.1"]  # imported by the kernels that C is emitted from


class WithKernels(build_py):
    """Beside the modules, the libraries of their kernels."""

    def run(self) -> None:
        """Copy the modules, compile into the copy; ``python -m nonlinear.native`` compiles a checkout."""
        super().run()
        if self.editable_mode:
            return
        from actuator_lti.axis.library import LIBRARY as axis
        from actuator_lti.batch.library import LIBRARY as figures
        from nonlinear.native import LIBRARY as run

        for library in (run, figures, axis):
            package = Path(self.build_lib) / library.folder.relative_to(Path(__file__).parent)
            shutil.rmtree(package / "_native", ignore_errors=True)
            library.write(package, TARGET)


class ForOneKind(bdist_wheel):
    """The name of the wheel says which machines it is for; any Python 3 runs it."""

    def get_tag(self) -> tuple[str, str, str]:
        """Of any Python, without an ABI."""
        return "py3", "none", TARGETS[TARGET].wheel if TARGET else super().get_tag()[2]


class WithLibraries(Distribution):
    """What it installs depends on the machine."""

    def has_ext_modules(self) -> bool:
        """As if: the libraries are compiled beside the modules."""
        return True


setup(
    distclass=WithLibraries,
    cmdclass={"build_py": WithKernels, "bdist_wheel": ForOneKind},
    setup_requires=EMITTED + ([] if system_compiler() and not TARGET else ["ziglang>=0.13"]),
)
