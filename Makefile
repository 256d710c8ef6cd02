# Everything on a machine that has only python3, make and a network.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT ?= out
STAMP := $(VENV)/.installed

.PHONY: report test machines check bench clean install browser

install: $(STAMP)

$(STAMP): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[dev]'
	touch $(STAMP)

report: $(STAMP)
	$(BIN)/actuator-lti report ilr33-amber --out $(OUT)

test: $(STAMP)
	$(BIN)/python -m pytest -n 2

# The tests of margins, loops and many designs again, as on processors with other linear algebra kernels.
MACHINE_TESTS := tests/margins/test_margin_cases.py tests/margins/test_margin_edges.py \
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

bench: $(STAMP)
	$(BIN)/python -m benchmarks.run

clean:
	rm -rf $(OUT) .pytest_cache .mypy_cache .ruff_cache .hypothesis
