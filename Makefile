# Two commands do all the set-up: `make demo` runs the main job, `make test` passes the tests; where there is no make,
# `python dev.py demo` and `python dev.py test` are the same.
PYTHON ?= python3.11
MADE := $(if $(shell command -v $(PYTHON)),$(PYTHON),python3)
BIN := .venv/bin
UV := $(BIN)/python -m uv
export OMP_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1

.PHONY: demo test exam release lowest docs browser screenshots lint format bench lock clean

demo:
	$(MADE) dev.py demo

test:
	$(MADE) dev.py test

# Long tests that the suite leaves out, with what they found in tests/benchmarks/results/exam.json.
exam:
	$(MADE) dev.py exam

# Wheel and sdist in dist/, each tried in a bare environment.
release:
	$(MADE) dev.py release

# The lowest versions of dependencies that pyproject.toml allows, tried in a bare environment.
lowest:
	$(MADE) dev.py lowest

# The documentation as a website: docs/_build/html/index.html.
docs: .venv/ready
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html

# What tests of reports need beside the environment, on Debian; they are skipped, saying so, where it is not installed.
browser:
	$(if $(filter 0,$(shell id -u)),,sudo) apt-get update -qq
	$(if $(filter 0,$(shell id -u)),,sudo) apt-get install -y -qq --no-install-recommends chromium poppler-utils

# The README's pictures of reports, from runs in reports/.
screenshots: .venv/ready
	$(BIN)/python -m tests.reports.screenshots $(RUNS)

lint: .venv/ready
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

format: .venv/ready
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

bench: .venv/ready
	for name in $$(ls tests/benchmarks/*.py | grep -v __init__); do $(BIN)/python -m $$(echo $${name%.py} | tr / .); done

# Versions and hashes of everything, for all platforms; run after changing dependencies.
lock: .venv/ready
	$(UV) lock -q && $(UV) export -q --no-emit-project --all-groups --no-header --no-annotate -o requirements.lock && rm uv.lock

.venv/ready: requirements.lock pyproject.toml
	$(MADE) dev.py ready

clean:
	rm -rf .venv .mypy_cache .ruff_cache .pytest_cache .hypothesis
