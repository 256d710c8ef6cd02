"""The same surroundings for every test process, whatever those are that it was started in.

Linear algebra as on the command line (`reports.arithmetic`); `make machines` asks for other kernels. What a
shell or a build server says of its terminal would change the words that tests look for.
"""

import os

from reports import arithmetic

arithmetic.settle()
os.environ.setdefault("PYTHONWARNINGS", "error::RuntimeWarning")  # of numpy, in processes that tests start
for name in (
    "COLUMNS", "LINES", "TERMINAL_WIDTH", "FORCE_COLOR", "NO_COLOR", "PY_COLORS", "CLICOLOR_FORCE",
    "TTY_COMPATIBLE", "TTY_INTERACTIVE", "GITHUB_ACTIONS", "SOURCE_DATE_EPOCH", "MPLBACKEND", "CC",
):  # fmt: skip
    os.environ.pop(name, None)
