# `make demo` and `make test` set up everything they need; each is quick when that has been done before.
VENV   ?= .venv
PYTHON := $(VENV)/bin/python
OUT    ?= demo-output

.PHONY: help demo test quick bench docs lint types set-up-demo set-up-test clean

help:
	@echo "make demo    render the shipped workspaces into $(OUT)/"
	@echo "make test    everything that must hold: style, types, import rules, generated docs, all tests"
	@echo "make quick   the same without what is slow: under 90 seconds"
	@echo "make bench   speed and memory against hand-written peers; writes docs/performance.md"
	@echo "make docs    write the generated pages of docs/"

demo: set-up-demo
	@for file in workspaces/*.json; do \
	    $(PYTHON) -m nodegraph run "$$file" --out "$(OUT)/$$(basename "$$file" .json)" || exit 1; \
	done

test: set-up-test lint types
	$(PYTHON) -m nodegraph check --require gl --require cl --require cl64 --quiet
	$(PYTHON) -m nodegraph docs --check
	$(PYTHON) -m pytest -q -n 2 --dist loadfile

quick: set-up-test lint types
	$(PYTHON) -m pytest -q -n 2 --dist loadfile -m "not slow"

bench: set-up-test
	$(PYTHON) -m tests.benchmarks

docs: set-up-test
	$(PYTHON) -m nodegraph docs

lint: set-up-test
	$(PYTHON) -m ruff check .
	$(PYTHON) -m ruff format --check .
	$(VENV)/bin/lint-imports

types: set-up-test
	$(PYTHON) -m mypy

set-up-demo:
	@VENV=$(VENV) sh scripts/set_up.sh demo

set-up-test:
	@VENV=$(VENV) sh scripts/set_up.sh test

clean:
	rm -rf $(OUT) build dist .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
