# Everything on a machine that has only python3, make and a network.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT ?= out
SECONDS ?= 600
SEED ?= 1
# Seeds of the processors that are not at hand (make machines).
PROCESSORS ?= 1 2 3 4 5 6 7 8 9 10
CORE := $(VENV)/.core
ALL := $(VENV)/.all
RELEASE := $(VENV)/.release
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
LOCKED := $(PIP) install --no-compile --require-hashes --requirement requirements.lock
# Each package is pinned with the hashes of its files; "make lock" writes them anew from constraints.txt.
EXTRAS := $(patsubst %,--extra %,cluster dev docs export nightly pdf plot tables)
COMPILE := $(BIN)/pip-compile --quiet --generate-hashes --allow-unsafe --strip-extras --no-annotate --no-header \
  --no-emit-options --no-emit-index-url --no-emit-find-links --constraint constraints.txt

# Where the environment says so (many containers do), Python keeps no bytecode: each process would compile its
# libraries anew, which doubles the time of its start.
unexport PYTHONDONTWRITEBYTECODE
BOTH_CORES := --jobs=2
# Each process takes tests that lie together, and goes on with the other's last ones: what a file makes is made once.
ON_BOTH := -n 2 --dist worksteal

.PHONY: page style types contracts doctests d3 differential newest newest-wheel newest-report installs wasm report test test-all machines check bench clean install browser fuzz lock limits docs release

# The main job.
report: $(CORE)
	@echo "report of ilr33-amber: every prediction is checked by simulation"
	@$(BIN)/actuator-lti report ilr33-amber --out $(OUT)
	@echo "done: open $(OUT)/report.html"

test: $(ALL)
	@echo "tests, on two cores; make test-all has the slow ones too"
	@$(BIN)/python -m pytest -q $(ON_BOTH) -m "not slow"

test-all: $(ALL)
	$(BIN)/python -m pytest $(ON_BOTH)

install: $(ALL)

$(CORE): pyproject.toml requirements.lock
	@echo "1/4 environment: $(VENV)"
	@$(PYTHON) -m venv $(VENV)
	@echo "2/4 packages: $$(grep -c == requirements.lock) of requirements.lock, by their hashes (0.5 GB)"
	@$(LOCKED)
	@echo "3/4 toolkit: actuator-lti, from here"
	@$(PIP) install --no-deps --no-build-isolation --editable .
	@echo "4/4 simulator: compiled"
	@$(BIN)/python -m nonlinear.native || \
	  { $(PIP) install --constraint constraints.txt ziglang && $(BIN)/python -m nonlinear.native; }
	@touch $@

$(ALL): $(CORE) requirements-all.lock
	@echo "more packages: $$(grep -c == requirements-all.lock) of requirements-all.lock, for tests, documentation, clusters, PDF, FMUs (2 GB)"
	@$(LOCKED) --requirement requirements-all.lock
	@touch $@

# The tests of margins, loops, studies and reports again, as on ten processors that are not at hand (beside.py in
# tests/machines), each with one of the kernels of linear algebra that run here but the one that all tests run on.
MACHINE_TESTS := tests/margins/test_margin_reference_loops.py tests/margins/test_margin_edges.py \
  tests/margins/test_unstable_inner_loops.py \
  tests/margins/test_delay_margins.py tests/margins/test_step_random.py \
  tests/margins/test_bandwidth.py tests/loops/test_loops_forms.py tests/loops/test_loops_published.py \
  tests/loops/test_rest_mode.py tests/study/test_compiled_figures.py \
  tests/validation/test_limit_cycles.py tests/reports/test_certified_report.py tests/identification/test_response_fit.py \
  tests/export/test_wasm_loops.py
AS_MACHINE := $(BIN)/python -m pytest -q -p no:cacheprovider -m "not slow" $(MACHINE_TESTS)

# Two machines at once.
machines: $(ALL)
	@set -e; machines="$$($(BIN)/python tests/machines/machine_kinds.py $(PROCESSORS))"; echo "$$machines" | \
	  xargs -P 2 -I MACHINE sh -c 'env MACHINE $(AS_MACHINE) && echo "as MACHINE: passed" || { echo "as MACHINE: FAILED"; exit 1; }'

# The page's scripts: types, rules, and their pure parts by node's own runner.
page:
	@if command -v npm >/dev/null 2>&1 && npm ci --silent --no-audit --no-fund; then \
	  node d3.bundle.js --check && npx tsc -p jsconfig.json && npx eslint reports/templates/page && node --test tests/page/*.test.mjs; \
	else echo "no npm here, or no registry: the page's scripts are not checked"; fi

# d3's axes and zoom for the page, anew from the versions in package-lock.json.
d3:
	npm ci --silent --no-audit --no-fund && node d3.bundle.js

style: $(ALL)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(ALL)
	$(BIN)/mypy

contracts: $(ALL)
	$(BIN)/lint-imports

doctests: $(ALL)
	$(BIN)/python -m pytest -q --doctest-modules actuator_lti nonlinear analyses reports

check: $(ALL)
	$(MAKE) $(BOTH_CORES) types doctests page style contracts

# Damaged files and extreme values for every loader and command: make fuzz SECONDS=3600 SEED=7
fuzz: $(ALL)
	$(BIN)/python -m tests.hardness.fuzz --seconds $(SECONDS) --seed $(SEED)

# Harsh loops in all their forms against exact polynomials: make differential SECONDS=120 SEED=$$(date +%j)
differential: $(ALL)
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.margins.differential --seconds $(SECONDS) --seed $(SEED)

bench: $(ALL)
	$(BIN)/python -m benchmarks.run

limits: $(CORE)
	$(BIN)/python -m actuator_lti.bounds > docs/limits.md

# The documentation in out/docs: opens from disk, asks no network; its tutorials are run while it is built.
docs: $(ALL)
	$(BIN)/python -m sphinx -W --keep-going -q -j 2 -b html docs $(OUT)/docs

$(RELEASE): $(CORE)
	$(PIP) install --constraint constraints.txt '.[release]'
	touch $(RELEASE)

# The wheel in a clean environment with the newest versions of what it needs, and nothing else; make report in a
# fresh copy: what it takes has a bound. Skipped offline.
newest:
	$(MAKE) $(BOTH_CORES) newest-wheel newest-report

newest-wheel:
	$(PYTHON) -m tests.install.clean_install

newest-report:
	$(PYTHON) -m tests.install.clean_install --report

# The same with every Python that is here, and from the sources with the pinned versions.
installs: newest
	$(PYTHON) -m tests.install.clean_install --pinned --sources
	set -e; for each in python3.12 python3.13 python3.14; do \
	  if $$each --version >/dev/null 2>&1; then $(PYTHON) -m tests.install.clean_install --python $$each; \
	  else echo "$$each: not here"; fi; done

# What the toolkit itself needs, and apart from that what its extras, tests and documentation need besides.
lock: $(RELEASE)
	$(COMPILE) --all-build-deps --output-file requirements.lock pyproject.toml
	$(COMPILE) $(EXTRAS) --all-build-deps --output-file $(VENV)/all.lock pyproject.toml
	awk '/^[^ ]/ {new = !($$1 in core)} NR == FNR {core[$$1]; next} new' requirements.lock $(VENV)/all.lock > requirements-all.lock

# A wheel for each kind of machine with the compiled simulator inside, sources, and the bill of materials of what
# they need to run.
release: $(RELEASE)
	rm -rf dist && mkdir dist
	$(COMPILE) --output-file dist/runtime.lock pyproject.toml
	$(BIN)/cyclonedx-py requirements --output-reproducible --pyproject pyproject.toml \
	  --output-file dist/actuator-lti.cdx.json dist/runtime.lock
	$(BIN)/python -m build --sdist --no-isolation --outdir dist
	set -e; for target in $$($(BIN)/python -m actuator_lti.compiled.compiler); do \
	  ACTUATOR_LTI_TARGET=$$target $(BIN)/python -m build --wheel --no-isolation --outdir dist; done

wasm: $(ALL)
	$(BIN)/python -m nonlinear.export.wasm_module

clean:
	rm -rf $(OUT) .pytest_cache .mypy_cache .ruff_cache .hypothesis
