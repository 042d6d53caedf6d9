# make demo: a measured push rim drives the manual chair; a replay, tables and figures in out/demo
# make test: format, lint, types and tests
# make bench: the table of figures to reach
# make docs: the documentation as a site in out/site; warnings are errors
# make pictures: every picture of README.md and docs/ again, by the scripts that make them
# All in .venv, which is rebuilt when requirements.lock or pyproject.toml change.

SHELL := /bin/bash
VENV ?= .venv
PYTHON ?= $(shell command -v python3.11 || command -v python3)
READY := $(VENV)/ready
RUN := $(VENV)/bin/python

.PHONY: demo test bench pictures docs graphics clean

demo: $(READY) graphics
	$(RUN) scripts/demo.py --out out/demo

test: $(READY) graphics
	$(RUN) -m ruff format --check .
	$(RUN) -m ruff check .
	$(RUN) -m mypy
	$(RUN) -m pytest -n 2 --dist loadfile --no-loadscope-reorder

pictures: $(READY) graphics
	$(RUN) scripts/pictures.py

docs: $(VENV)/docs-ready graphics
	NO_MKDOCS_2_WARNING=1 $(RUN) -m mkdocs build
	@echo "Open this file in a browser: $(CURDIR)/out/site/index.html"
	@echo "Its search needs a server: $(RUN) -m http.server --directory out/site"

bench: $(READY)
	$(RUN) benchmarks/bench.py

graphics: $(READY)
	@scripts/graphics.sh $(RUN)

$(READY): requirements.lock pyproject.toml
	@scripts/environment.sh $(PYTHON) $(VENV)
	@touch $@

$(VENV)/docs-ready: $(READY) requirements-docs.lock
	@$(VENV)/bin/pip install --quiet --no-deps --requirement requirements-docs.lock
	@touch $@

clean:
	rm -rf .venv out build dist
