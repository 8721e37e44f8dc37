# Every target builds what it needs in .venv of this checkout; only Python 3.11+, make and a package index are assumed.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
SOURCES := workers svaedc cluster tests $(wildcard benchmarks docs examples studies)

# Nothing here reports home.
export RAY_USAGE_STATS_ENABLED := 0
export MLFLOW_DISABLE_TELEMETRY := true

.DEFAULT_GOAL := help
.PHONY: help install demo test test-docs test-slow chaos bench studies docs check format clean

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' $(MAKEFILE_LIST) | expand -t 12

install: $(STAMP) ## create .venv with the pinned dependencies

$(STAMP): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; v = sys.version_info; sys.exit(0 if v >= (3, 11) else "svaedc needs Python 3.11 or newer, $(PYTHON) is %d.%d: run make PYTHON=python3.11" % v[:2])'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	@touch $@

demo: $(STAMP) ## the whole pipeline, small and real: collect, train, compare
	$(BIN)/svaedc demo

# Tests of clusters and servers wait more than they compute: three runs side by side, two of them shown afterwards.
DRIVERS := tests/cluster/comparison tests/cluster/hardware tests/cluster/training
COMMANDS := tests/cluster tests/end_to_end
LOGS := .pytest_cache
test: $(STAMP) ## tests of everything, those that take seconds
	@mkdir -p $(LOGS)
	@$(BIN)/python -m pytest tests $(COMMANDS:%=--ignore=%) > $(LOGS)/computing.log 2>&1 & computing=$$!; \
	$(BIN)/python -m pytest $(DRIVERS) > $(LOGS)/drivers.log 2>&1 & drivers=$$!; \
	$(BIN)/python -m pytest $(COMMANDS) $(DRIVERS:%=--ignore=%); failed=$$?; \
	for run in $$computing $$drivers; do wait $$run || failed=1; done; \
	cat $(LOGS)/computing.log $(LOGS)/drivers.log; exit $$failed

test-docs: $(STAMP) ## run every command of the documentation and compare what it prints; ten minutes
	$(BIN)/python -m pytest -m documentation

test-slow: $(STAMP) ## the tests that take longer, and the property tests with fresh examples; an hour or two
	HYPOTHESIS_PROFILE=exploring $(BIN)/python -m pytest -m "slow or hypothesis"

chaos: $(STAMP) ## the tests that kill processes on purpose
	$(BIN)/python -m pytest -m chaos

bench: $(STAMP) ## measure speed and memory; prints ratios
	@for script in benchmarks/*.py; do echo "== $$script"; $(BIN)/python $$script || exit 1; done

DATASET ?= data/franka
studies: $(STAMP) ## the learning curve and appendix A on DATASET=data/franka; hours, and goes on where it was
	$(BIN)/python -m studies.learning_curve --dataset $(DATASET)
	$(BIN)/python -m studies.appendix_a --dataset $(DATASET)

docs: $(STAMP) ## build the documentation into site/; warnings are errors
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

check: $(STAMP) ## ruff, mypy and the import contracts
	$(BIN)/ruff check $(SOURCES)
	$(BIN)/ruff format --check $(SOURCES)
	$(BIN)/mypy
	$(BIN)/lint-imports

format: $(STAMP) ## sort imports and format
	$(BIN)/ruff check --fix $(SOURCES)
	$(BIN)/ruff format $(SOURCES)

clean: ## remove the environment and the tools' caches; data and results stay
	rm -rf $(VENV) build dist site .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
