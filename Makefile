# Targets set up their own environment in .venv from requirements.lock; a second run reinstalls nothing.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
# Compiled modules are kept, whatever the caller's shell says: every test of a process of its own loads them.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: study test suite slow-test coverage kernels docs lint format studies lock clean

study: $(STAMP)
	$(BIN)/python studies/02_twin.py

# The checks of `lint` take one core for three quarters of a minute: the other need not wait for them.
test: $(STAMP)
	$(MAKE) --no-print-directory --jobs=3 lint suite

suite: kernels
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder

# Compiles what the tests need, once and beside the checks of `lint`, instead of in every worker; nothing where no
# source has changed since. The simulators of drive trains and those of cascades share next to nothing.
kernels: $(VENV)/.kernels-chains $(VENV)/.kernels-cascades
$(VENV)/.kernels-%: $(STAMP) $(shell find bayes_hw -name '*.py')
	@$(BIN)/python -m pytest -m compiles $$(grep -rl --include='test_*.py' 'compiles("$*")' tests) > /dev/null
	@touch $@

# What `make test` leaves out, before a release: whole runs beyond the first of a kind, statistical studies of the
# estimators and study scripts of minutes.
slow-test: $(STAMP)
	$(BIN)/python -m pytest -n 2 -m slow

# Lines of the package that `make test` runs, child processes included; compiled functions are not traced and
# do not count. Ends in a table of the files with a line that is not run, worst first.
coverage: $(STAMP) kernels
	$(BIN)/python -m coverage erase
	$(BIN)/python -m coverage run -m pytest -n 2 --dist loadfile --no-loadscope-reorder
	$(BIN)/python -m coverage combine -q
	$(BIN)/python -m coverage report

lint: $(STAMP)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/python .ci/types
	$(BIN)/lint-imports --no-logo

# Offline: pages with what they run, warnings as errors, doctests. Ends in docs/_build/html/index.html.
docs: $(STAMP)
	$(BIN)/python -m sphinx --fail-on-warning --keep-going -q -d docs/_build/doctrees -b html docs docs/_build/html
	$(BIN)/python -m sphinx --fail-on-warning --keep-going -q -d docs/_build/doctrees -b doctest docs docs/_build/doctest

format: $(STAMP)
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

# Goes on where it stopped: what this code has made before is left alone, unless FORCE=1 is given.
studies: $(STAMP)
	set -e; for script in studies/[0-9]*.py; do $(BIN)/python $$script $(if $(FORCE),,--unless-done); done
	$(BIN)/python studies/index.py

$(STAMP): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "bayes_hw needs Python 3.11 or newer; set PYTHON=/path/to/python3.11" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile --no-deps --no-build-isolation -e .
	@touch $(STAMP)

# Needs uv on the PATH: resolves pyproject.toml for CPython 3.11 to 3.13 on every platform.
lock:
	uv pip compile --universal --python-version 3.11 --generate-hashes --extra dev --extra docs --no-emit-index-url \
	  --quiet pyproject.toml -o requirements.lock

clean:
	rm -rf $(VENV) .coverage .pytest_cache .mypy_cache .ruff_cache .import_linter_cache docs/_build docs/generated
