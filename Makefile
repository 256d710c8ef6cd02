# Everything on a machine that has only python3, make and a network.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT ?= out
SECONDS ?= 600
SEED ?= 1
STAMP := $(VENV)/.installed
RELEASE := $(VENV)/.release
PIP := $(BIN)/python -m pip --disable-pip-version-check
# Each package is pinned with the hashes of its files; "make lock" writes them anew from constraints.txt.
EXTRAS := $(patsubst %,--extra %,cluster dev docs export nightly pdf plot tables)
COMPILE := $(BIN)/pip-compile --quiet --generate-hashes --allow-unsafe --strip-extras --no-annotate --no-header \
  --no-emit-options --no-emit-index-url --no-emit-find-links

.PHONY: differential newest installs wasm report test machines check bench clean install browser fuzz lock limits docs release

install: $(STAMP)

$(STAMP): pyproject.toml requirements.lock
	$(PYTHON) -m venv $(VENV)
	$(PIP) install --quiet --require-hashes --requirement requirements.lock
	$(PIP) install --quiet --no-deps --no-build-isolation --editable .
	$(BIN)/python -m nonlinear.native
	touch $(STAMP)

report: $(STAMP)
	$(BIN)/actuator-lti report ilr33-amber --out $(OUT)

test: $(STAMP)
	$(BIN)/python -m pytest -n 2

# The tests of margins, loops and many designs again, as on processors with other linear algebra kernels.
MACHINE_TESTS := tests/margins/test_margin_cases.py tests/margins/test_margin_edges.py \
  tests/margins/test_margin_reference_loops.py tests/margins/test_unstable_inner_loops.py \
  tests/margins/test_delay_margins.py tests/margins/test_step_random.py tests/margins/test_bandwidth.py \
  tests/loops/test_loops_forms.py tests/loops/test_loops_published.py tests/study/test_compiled_figures.py

machines: $(STAMP)
	set -e; for kernel in $$($(BIN)/python tests/machines/machine_kinds.py); do \
	  echo "OPENBLAS_CORETYPE=$$kernel"; \
	  OPENBLAS_CORETYPE=$$kernel $(BIN)/python -m pytest -q -n 2 $(MACHINE_TESTS); \
	done

check: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m pytest -q --doctest-modules actuator_lti nonlinear analyses reports

# Damaged files and extreme values for every loader and command: make fuzz SECONDS=3600 SEED=7
fuzz: $(STAMP)
	$(BIN)/python -m tests.hardness.fuzz --seconds $(SECONDS) --seed $(SEED)

# Harsh loops in all their forms against exact polynomials: make differential SECONDS=120 SEED=$$(date +%j)
differential: $(STAMP)
	$(BIN)/python -m tests.margins.differential --seconds $(SECONDS) --seed $(SEED)

bench: $(STAMP)
	$(BIN)/python -m benchmarks.run

limits: $(STAMP)
	$(BIN)/python -m actuator_lti.bounds > docs/limits.md

# The documentation in out/docs: opens from disk, asks no network; its tutorials are run while it is built.
docs: $(STAMP)
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs $(OUT)/docs

$(RELEASE): $(STAMP)
	$(PIP) install --quiet --constraint constraints.txt '.[release]'
	touch $(RELEASE)

# The wheel in a clean environment with the newest versions of what it needs, and nothing else; skipped offline.
newest:
	$(PYTHON) -m tests.install.clean_install

# The same with every Python that is here, and from the sources with the pinned versions.
installs: newest
	$(PYTHON) -m tests.install.clean_install --pinned --sources
	set -e; for each in python3.12 python3.13 python3.14; do \
	  if $$each --version >/dev/null 2>&1; then $(PYTHON) -m tests.install.clean_install --python $$each; \
	  else echo "$$each: not here"; fi; done

lock: $(RELEASE)
	$(COMPILE) $(EXTRAS) --all-build-deps --constraint constraints.txt --output-file requirements.lock pyproject.toml

# Wheel, sources and the bill of materials of what they need to run.
release: $(RELEASE)
	rm -rf dist && mkdir dist
	$(COMPILE) --constraint constraints.txt --output-file dist/runtime.lock pyproject.toml
	$(BIN)/cyclonedx-py requirements --output-reproducible --pyproject pyproject.toml \
	  --output-file dist/actuator-lti.cdx.json dist/runtime.lock
	$(BIN)/python -m build --no-isolation --outdir dist

wasm: $(STAMP)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[export]'
	$(BIN)/python -m nonlinear.export.wasm_module

clean:
	rm -rf $(OUT) .pytest_cache .mypy_cache .ruff_cache .hypothesis
