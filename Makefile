# Everything runs in a private environment, .venv; `make clean` removes it.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
# One by one, so that a peer that does not install keeps no other away; the extra `peers` has the same names.
PEERS := casadi heyoka jax numba pin pydy symengine symforce
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check

.PHONY: demo test lint bench clean

demo: $(VENV)/.demo
	$(BIN)/eomgen compile --links 5 --method matrix
	$(BIN)/python examples/five_links.py

test: $(VENV)/.test
	$(BIN)/python -m pytest

lint: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

bench: $(VENV)/.bench
	$(BIN)/python tests/test_sincos.py
	$(BIN)/eomgen bench table1
	$(BIN)/eomgen bench speed
	$(BIN)/eomgen bench pareto
	$(BIN)/eomgen bench stability
	$(BIN)/eomgen bench claims

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "eomgen needs Python 3.11 or newer; set PYTHON=... to one"; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/.demo: $(BIN)/python pyproject.toml
	$(PIP) --editable .
	@touch $@

$(VENV)/.test: $(BIN)/python pyproject.toml
	$(PIP) --editable '.[test]'
	@touch $@ $(VENV)/.demo

$(VENV)/.bench: $(BIN)/python pyproject.toml
	$(PIP) --editable '.[bench]'
	for peer in $(PEERS); do $(PIP) $$peer || echo "$$peer does not install; its cells will say so"; done
	@touch $@ $(VENV)/.test $(VENV)/.demo

clean:
	rm -rf $(VENV)
