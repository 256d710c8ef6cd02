"""One thread for linear algebra in every test process: small matrices gain nothing from more."""

import os

for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")
