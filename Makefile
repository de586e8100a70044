PYTHON ?= python3
CORES ?= 2
SCENARIO ?= demo

VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/pip --disable-pip-version-check -qq
LOCKED := $(VENV)/.locked
INSTALLED := $(VENV)/.installed
MUTATION := .mutation
CRATE := .crate
SITE := .site

# Of Debian packages, by root or by sudo.
INSTALL = as_root=$$([ "$$(id -u)" -eq 0 ] || echo sudo); \
	$$as_root apt-get update --quiet=2 && \
	$$as_root env DEBIAN_FRONTEND=noninteractive apt-get install --quiet=2 --yes

# An environment $(1)/venv that holds what a lock names and sees the packages of .venv.
define beside
@$(PYTHON) -m venv --clear $(1)/venv
@packages=$$(echo $(CURDIR)/$(VENV)/lib/python*/site-packages); \
	cd $(1)/venv/lib/python*/site-packages && \
	echo "import site; site.addsitedir('$$packages')" > environment.pth
@$(1)/venv/bin/pip --disable-pip-version-check -qq install --requirement $(2)
@touch $(1)/.installed
endef

SNAKEFILES := Snakefile workflow
SOURCES := src tests workflow docs

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help env run dist browser slurm test test-slurm architecture reliability mutation crate-check docs check format lock clean

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "make %-12s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

env: $(INSTALLED) ## build the environment .venv

# Built from nothing, so that it holds what the lock names and no more.
$(LOCKED): requirements.lock
	@echo "Building $(VENV)"
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || $(MAKE) --no-print-directory python3-venv
	@$(PYTHON) -m venv --clear $(VENV)
	@$(PIP) install --requirement requirements.lock
	@touch $@

$(INSTALLED): $(LOCKED) pyproject.toml
	@echo "Installing softslip in $(VENV)"
	@$(PIP) install --no-deps --no-build-isolation --editable .
	@touch $@

# Debian ships Python's venv module without what it needs to run.
.PHONY: python3-venv
python3-venv:
	@echo "Installing python3-venv"
	@$(INSTALL) python3-venv

# Beside the packages of .venv, which it sees, so that the tests run with the same versions.
$(MUTATION)/.installed: $(INSTALLED) requirements-mutation.lock
	@echo "Installing cosmic-ray in $(MUTATION)"
	$(call beside,$(MUTATION),requirements-mutation.lock)

# Beside the packages of .venv too, which have the command line that a page is made of.
$(SITE)/.installed: $(INSTALLED) requirements-docs.lock
	@echo "Installing Sphinx in $(SITE)"
	$(call beside,$(SITE),requirements-docs.lock)

# Apart from .venv: the validator wants another version of rich.
$(CRATE)/.installed: requirements-crate.lock
	@echo "Installing roc-validator in $(CRATE)"
	@$(PYTHON) -m venv --clear $(CRATE)/venv
	@$(CRATE)/venv/bin/pip --disable-pip-version-check -qq install \
		--requirement requirements-crate.lock
	@touch $@

browser: ## install Chromium on Debian, for the tests of explorer and report (½ min, 120 MB)
	@command -v chromium >/dev/null && command -v chromedriver >/dev/null || { \
	echo "Installing chromium and chromium-driver"; \
	$(INSTALL) --no-install-recommends chromium chromium-driver; }

slurm: ## install Slurm and munge on Debian, for the tests of profiles/slurm
	@command -v slurmctld >/dev/null && command -v munged >/dev/null || { \
	echo "Installing slurm-wlm and munge"; \
	$(INSTALL) --no-install-recommends slurm-wlm munge; }

run: env ## run the workflow (CORES=2 SCENARIO=demo)
	@$(BIN)/snakemake --cores $(CORES) --config scenario=$(SCENARIO)

dist: env ## build the source distribution and the wheel in dist/
	@$(BIN)/hatchling build -d dist

test: check ## run the checks and the fast tests
	@$(BIN)/pytest --numprocesses $(CORES)

test-slurm: env slurm ## run the workflow on a cluster of one machine, with trouble (50 min, 2 cores, as root)
	@SOFTSLIP_SLURM=results/slurm.json $(BIN)/pytest tests/slurm -m slurm

reliability: env ## kill, fill and damage what runs depend on, at full size (½ h, 1 core)
	@SOFTSLIP_RELIABILITY=results/reliability.json $(BIN)/pytest tests/reliability -m reliability

mutation: $(MUTATION)/.installed ## count the small faults that the tests notice (½ h, 1 core)
	@$(MUTATION)/venv/bin/python tests/mutation/run.py --folder $(MUTATION) --fresh --survivors

crate-check: env $(CRATE)/.installed ## hold research objects against their profiles (4 min)
	@$(BIN)/python tests/crate/make.py $(CRATE) --cores $(CORES)
	@$(CRATE)/venv/bin/python tests/crate/check.py --cache $(CRATE)/http \
		$(CRATE)/whole.zip $(CRATE)/partial.zip
	@$(CRATE)/venv/bin/python tests/crate/check.py --cache $(CRATE)/http --named $(CRATE)/named

docs: env $(SITE)/.installed ## build the documentation's site in .site/html (2 min)
	@$(SITE)/venv/bin/sphinx-build --quiet --fail-on-warning --jobs $(CORES) docs $(SITE)/html
	@echo "Open $(SITE)/html/index.html"

check: env ## check style, types, imports and workflow
	@$(BIN)/ruff check --quiet $(SOURCES)
	@$(BIN)/ruff format --check --quiet $(SOURCES)
	@$(BIN)/snakefmt --check $(SNAKEFILES)
	@$(BIN)/mypy --no-error-summary
	@$(BIN)/lint-imports --no-logo
	@$(BIN)/snakemake --lint

format: env ## format the sources
	@$(BIN)/ruff check --fix --quiet $(SOURCES)
	@$(BIN)/ruff format --quiet $(SOURCES)
	@$(BIN)/snakefmt $(SNAKEFILES)

lock: env ## bring requirements.lock to the newest versions
	@CUSTOM_COMPILE_COMMAND="make lock" $(BIN)/pip-compile --quiet --upgrade --extra dev \
		--allow-unsafe --no-strip-extras --no-emit-index-url --no-emit-trusted-host --no-emit-find-links \
		--output-file requirements.lock pyproject.toml
	@# pip-compile drops conditions that hold where it runs.
	@sed --in-place 's/^snakedeploy==.*/& ; python_version < "3.13"/' requirements.lock

architecture: env ## write the pictures and the list of modules of ARCHITECTURE.md
	@$(BIN)/python docs/architecture.py

clean: ## remove the environment and the caches, but no results
	@rm -rf $(VENV) $(MUTATION) $(CRATE) $(SITE) build dist .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	@find src tests workflow -name __pycache__ -type d -prune -exec rm -rf {} + 2>/dev/null || true
