# make demo: a measured push rim drives the manual chair; figures, tables and a film in out/demo
# make test: format, lint, types and tests
# make bench: the table of figures to reach
# All in .venv, which is rebuilt when requirements.lock or pyproject.toml change.

SHELL := /bin/bash
VENV ?= .venv
PYTHON ?= $(shell command -v python3.11 || command -v python3)
READY := $(VENV)/ready
RUN := $(VENV)/bin/python

.PHONY: demo test bench graphics clean

demo: $(READY) graphics
	$(RUN) scripts/demo.py --out out/demo

test: $(READY) graphics
	$(RUN) -m ruff format --check .
	$(RUN) -m ruff check .
	$(RUN) -m mypy
	$(RUN) -m pytest

bench: $(READY)
	$(RUN) benchmarks/bench.py

graphics: $(READY)
	@scripts/graphics.sh $(RUN)

$(READY): requirements.lock pyproject.toml
	@scripts/environment.sh $(PYTHON) $(VENV)
	@touch $@

clean:
	rm -rf .venv out build dist
