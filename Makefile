# `make demo` and `make test` set up everything they need; each is quick when that has been done before.
# Named by the caller: VENV, the folder of the environment; PYTHON, what it is made with; OUT, where pictures go.
VENV ?= .venv
OUT  ?= demo-output
RUN  := "$(VENV)/bin/python"

# Compiling what a run of the tests imports takes ten seconds in each of its processes: it is kept, whatever the shell
# says of other programs.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: help edit demo test quick bench bench-peers docs devices lint types set-up-demo set-up-test clean

help:
	@echo "make edit    open the visual editor; FILE=workspaces/brain.json opens a workspace"
	@echo "make demo    render the shipped workspaces into $(OUT)/"
	@echo "make test    everything that must hold: style, types, import rules, generated docs, all tests"
	@echo "make quick   the same without what is slow, on OpenGL alone"
	@echo "make bench   speed and memory against hand-written peers; writes docs/performance.md"
	@echo "make bench-peers   the same pictures by VTK, which it installs (640 MB); writes docs/peers.md"
	@echo "make docs    write the generated pages of docs/"

edit: set-up-edit
	@$(RUN) -m nodegraph edit $(FILE)

demo: set-up-demo
	@for file in workspaces/*.json; do \
	    $(RUN) -m nodegraph run "$$file" --out "$(OUT)/$$(basename "$$file" .json)" || exit 1; \
	done

test: set-up-test devices lint types
	$(RUN) -m nodegraph docs --check
	$(RUN) -m pytest -q -n 2 --dist loadfile

quick: set-up-test devices lint types
	$(RUN) -m pytest -q -n 2 --dist loadfile -m "not slow"

bench: set-up-test
	$(RUN) -m tests.benchmarks

bench-peers: set-up-peers
	$(RUN) -m tests.benchmarks.peers

docs: set-up-test
	$(RUN) -m nodegraph docs

devices: set-up-test
	$(RUN) -m nodegraph check --require gl --require cl --require cl64 --quiet

lint: set-up-test
	$(RUN) -m ruff check .
	$(RUN) -m ruff format --check .
	"$(VENV)/bin/lint-imports"

types: set-up-test
	$(RUN) -m mypy

set-up-edit:
	@VENV="$(VENV)" sh scripts/set_up.sh edit

set-up-demo:
	@VENV="$(VENV)" sh scripts/set_up.sh demo

set-up-test:
	@VENV="$(VENV)" sh scripts/set_up.sh test

set-up-peers:
	@VENV="$(VENV)" sh scripts/set_up.sh peers

clean:
	rm -rf "$(OUT)" build dist .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
