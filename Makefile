# Everything runs in a virtual environment of the project's own; only Python >= 3.11, pip, venv
# and make are needed. `make demo` and `make test` set it up by themselves.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT ?= out
BILL := .venv-bill
PACK := .venv-package
DOCS_VENV := .venv-site
# What is imported is compiled then; to compile all of it first took half of an installation's time.
INSTALL := install --quiet --disable-pip-version-check --no-compile

# A test that starts a process would else compile the whole package for each.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: setup demo test study check test-browser test-office test-versions lint types docs site package bill figures benchmarks clean help

help:
	@echo "make demo        set up, then run the whole study on a simulated subject -> $(OUT)/demo"
	@echo "make test        set up, then run the tests"
	@echo "make study       the slow tests too: many sessions, whole figures (SINCE=revision: what it touched)"
	@echo "make check       lint, types and the touched tests, under a minute (SINCE=revision)"
	@echo "make test-browser  the pages in a real browser (Chromium, installed where it is missing)"
	@echo "make test-office  workbooks in LibreOffice, MATLAB files in Octave (installed where missing)"
	@echo "make figures     the source's figures from simulated subjects -> $(OUT)/figures"
	@echo "make lint types docs   what continuous integration checks beside the tests"
	@echo "make site        the documentation with its tutorials, run -> $(OUT)/site/index.html"
	@echo "make package     wheel and source distribution, built, checked and used without the repository"
	@echo "make test-versions RESOLUTION=lowest-direct PYTHON=python3.11   tests with the oldest versions"
	@echo "make bill        licences and versions of everything installed -> $(OUT)/armimpedance.cdx.json"
	@echo "make benchmarks  accuracy and speed studies, measured against what is asked (slow)"

setup: $(VENV)/.ready

$(VENV)/.ready: requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else "armimpedance needs Python 3.11 or newer; try: make PYTHON=python3.12 ...")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip $(INSTALL) --require-hashes -r requirements.lock
	$(BIN)/python -m pip $(INSTALL) --no-deps --no-build-isolation -e .
	@touch $@

demo: setup
	$(BIN)/python -m armimpedance demo --out $(OUT)/demo $(if $(QUICK),--quick)

test: setup
	$(BIN)/python -m pytest -q -n 2

# Studies: coverage on many sessions, whole figures, starters, long fits. All of them, or with SINCE
# those that changes since that revision touch, for at most MINUTES.
study: setup
	$(if $(SINCE),$(BIN)/python tests/touched.py --study --since $(SINCE) --minutes $(or $(MINUTES),3),$(BIN)/python -m pytest -q -n 2 -m study)

# Under a minute: lint, types (the first run fills a cache), and the tests of what is not committed.
check: lint types
	$(BIN)/python tests/touched.py $(if $(SINCE),--since $(SINCE))

test-browser: setup
	$(BIN)/python tests/browser/set_up.py
	$(BIN)/python -m pytest -q tests/browser

test-office: setup
	$(BIN)/python tests/office/set_up.py
	$(BIN)/python -m pytest -q tests/office

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: setup
	$(BIN)/mypy

docs: setup
	$(BIN)/python docs/check.py
	$(BIN)/python docs/check_faces.py
	$(BIN)/python docs/english.py
	$(BIN)/python docs/licences.py --check
	$(BIN)/codespell

site: setup $(DOCS_VENV)/.ready
	OMP_NUM_THREADS=1 $(DOCS_VENV)/bin/python docs/_site/command_runs.py
	$(DOCS_VENV)/bin/python -m sphinx --quiet --fail-on-warning --keep-going --jobs 2 -d $(OUT)/site_doctrees docs $(OUT)/site
	$(DOCS_VENV)/bin/python docs/check_site.py $(OUT)/site

# Beside what the project needs: a theme, a reader of Markdown, and what runs notebooks.
$(DOCS_VENV)/.ready: docs/site_requirements.lock $(VENV)/.ready
	$(PYTHON) -m venv --without-pip $(DOCS_VENV)
	$(BIN)/python -m pip --python $(DOCS_VENV)/bin/python $(INSTALL) --no-deps --require-hashes -r docs/site_requirements.lock
	$(DOCS_VENV)/bin/python docs/set_up_site.py $(VENV)
	@touch $@

package: setup $(PACK)/.ready
	$(PACK)/bin/python release/check.py $(OUT)/dist --python $(PYTHON) $(if $(NEWEST),--newest)

test-versions: $(PACK)/.ready
	$(PACK)/bin/python release/versions.py $(OUT)/dist --python $(PYTHON) --resolution $(or $(RESOLUTION),highest)

$(PACK)/.ready: release/requirements.lock
	$(PYTHON) -m venv $(PACK)
	$(PACK)/bin/python -m pip $(INSTALL) --require-hashes -r release/requirements.lock
	@touch $@

bill: setup $(BILL)/.ready
	@mkdir -p $(OUT)
	$(BILL)/bin/cyclonedx-py environment $(BIN)/python --pyproject pyproject.toml --output-reproducible -o $(OUT)/armimpedance.cdx.json
	$(BIN)/python docs/licences.py --bill $(OUT)/armimpedance.cdx.json

# The tool that lists an environment stands outside it.
$(BILL)/.ready: docs/bill_requirements.lock $(VENV)/.ready
	$(PYTHON) -m venv --without-pip $(BILL)
	$(BIN)/python -m pip --python $(BILL)/bin/python $(INSTALL) --require-hashes -r docs/bill_requirements.lock
	@touch $@

figures: setup
	$(BIN)/python -m armimpedance figures --out $(OUT)/figures

benchmarks: setup
	for script in benchmarks/[a-z]*.py; do $(BIN)/python $$script || exit 1; done

clean:
	rm -rf $(VENV) $(BILL) $(PACK) $(DOCS_VENV) $(OUT) build *.egg-info
