"""The same surroundings for every test process, whatever those are that it was started in.

One thread for linear algebra: small matrices gain nothing from more. What a shell or a build server says of
its terminal would change the words that tests look for.
"""

import os

for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")
for name in (
    "COLUMNS", "LINES", "TERMINAL_WIDTH", "FORCE_COLOR", "NO_COLOR", "PY_COLORS", "CLICOLOR_FORCE",
    "TTY_COMPATIBLE", "TTY_INTERACTIVE", "GITHUB_ACTIONS", "SOURCE_DATE_EPOCH", "ACTUATOR_LTI_KERNEL",
    "MPLBACKEND", "CC",
):  # fmt: skip
    os.environ.pop(name, None)
