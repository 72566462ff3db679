# Needs GNU make, bash and Python 3.11 or newer. Everything else goes into .venv, through pip as it is configured.

SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help
.NOTPARALLEL:
.DELETE_ON_ERROR:
MAKEFLAGS += --no-builtin-rules
# Python keeps what it has read of the sources, also where container images tell it not to: tests start some hundred
# processes, each of which would take half a second longer, and pytest would rewrite all tests in every one of its own.
unexport PYTHONDONTWRITEBYTECODE

PYTHON ?= python3
# A PYTHON that somebody names is the only one tried; otherwise newer names are, where python3 is too old.
CANDIDATES := $(PYTHON) $(if $(filter file,$(origin PYTHON)),python3.13 python3.12 python3.11)

# Exact versions and the SHA-256 of every file of them, for all platforms: what blocksim, its developers' tools, the site,
# the engines to compare with and VTK need. All but the first name only what they need beside it, and include it.
CONSTRAINTS := tests/constraints.txt
DEV_CONSTRAINTS := tests/constraints-dev.txt
DOCS_CONSTRAINTS := tests/constraints-docs.txt
BENCH_CONSTRAINTS := tests/constraints-bench.txt
VTK_CONSTRAINTS := tests/constraints-paraview-check.txt
VENV := .venv
VENV_PYTHON := $(VENV)/bin/python
BLOCKSIM := $(VENV)/bin/blocksim
PIP_INSTALL := $(VENV_PYTHON) -m pip install -qq --disable-pip-version-check
# Only wheels, as what a package would be built with has no hash here; then blocksim, and nothing that it asks for.
INSTALL_LOCKED := $(PIP_INSTALL) --require-hashes --only-binary :all: --requirement
INSTALL_BLOCKSIM := $(PIP_INSTALL) --no-deps --no-build-isolation --editable .

# The stamps say what is installed, and for which folder: an editable install does not survive a move of the checkout.
FOLDER := $(shell pwd | cksum | cut -d ' ' -f 1)
RUN_STAMP := $(VENV)/.installed-run-$(FOLDER)
DEV_STAMP := $(VENV)/.installed-dev-$(FOLDER)
DOCS_STAMP := $(VENV)/.installed-docs-$(FOLDER)
BENCH_STAMP := $(VENV)/.installed-bench-$(FOLDER)
FULL_STAMP := $(VENV)/.installed-full-$(FOLDER)
INSTALL_DECIDES := pyproject.toml $(CONSTRAINTS) $(DEV_CONSTRAINTS) $(DOCS_CONSTRAINTS) $(BENCH_CONSTRAINTS) \
    $(VTK_CONSTRAINTS) blocksim/__init__.py
# Without a Python (none yet, or it was upgraded away) the stamps are void.
VOID := $(if $(realpath $(VENV_PYTHON)),,void)

# Every process loads the kernels by itself, so more of them gain less and less. Compiled they are before that, once.
ON_ALL_CORES := --numprocesses auto --maxprocesses 4 --dist worksteal
COMPILE := $(VENV_PYTHON) -m tests.compiled

SCENARIO := scenarios/three_blocks.toml
DEMO := results/demo
SMOKE := results/make-smoke
PICTURES := results/make-pictures
PAPER := results/paper

.PHONY: help
help: ## List the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-12s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

.PHONY: run
run: $(RUN_STAMP) ## Let the three blocks collapse and compare with the measurement (sets up .venv first)
	$(BLOCKSIM) run $(SCENARIO)
	$(BLOCKSIM) compare $(SCENARIO)

.PHONY: test
test: $(DEV_STAMP) ## Run the tests (sets up .venv first); two to five minutes on two cores, once kernels are compiled
	@$(COMPILE)
	$(VENV_PYTHON) -m pytest $(ON_ALL_CORES)

.PHONY: test-long
test-long: $(DEV_STAMP) ## Full sizes: verification, kills, resumed runs, fuzz, soak, clusters, browser; half an hour
	@$(COMPILE)
	$(VENV_PYTHON) -m pytest -m long $(ON_ALL_CORES) --ignore tests/browser $(LONG)
	$(VENV_PYTHON) -m pytest -m long tests/browser

.PHONY: test-nojit
test-nojit: $(DEV_STAMP) ## Run the tests of the kernels as plain Python, without the compiler
	NUMBA_DISABLE_JIT=1 $(VENV_PYTHON) -m pytest $(ON_ALL_CORES) tests/kernels

.PHONY: golden
golden: $(DEV_STAMP) ## Write the texts that tests expect, tests/**/golden/*.txt, as they are printed; read git diff then
	@$(COMPILE)
	$(VENV_PYTHON) -m pytest -n 0 --update-golden $(TESTS)

.PHONY: faults
faults: $(DEV_STAMP) ## Put deliberate faults into the code, one at a time: does make test notice every one of them?
	@$(COMPILE)
	$(VENV_PYTHON) -m tests.faults.run $(FAULTS)

.PHONY: verify-table
verify-table: $(DEV_STAMP) ## Measure all verification cases and write their table into blocksim/verification/README.md
	$(VENV_PYTHON) -m tests.verification.reference blocksim/verification/README.md --measure

.PHONY: findings
findings: $(DEV_STAMP) ## Run what results/README.md quotes and write its table
	$(VENV_PYTHON) -m tests.verification.findings results/README.md --measure

WALLS := 40:36.15 100:96.15 250:246.15  # vertical load in the name of a test, and its part that is not the beam's, kN
.PHONY: walls
walls: $(RUN_STAMP) ## Push three measured walls: their curves, bounds of statics, and the comparison
	for wall in $(WALLS); do number=$${wall%%:*}; run=results/granite_wall_$$number; \
	$(BLOCKSIM) run scenarios/walls/pushed_granite_wall.toml --quiet --out $$run \
	  --set "loads.weight.magnitude=$${wall##*:} kN" --set experiment.table=granite_wall_$$number.csv; \
	$(BLOCKSIM) capacity $$run; \
	$(BLOCKSIM) compare $$run --tolerance 0.1 || [ $$? -eq 1 ]; \
	$(BLOCKSIM) plot $$run --kind capacity --out $$run.png --overwrite; done

.PHONY: bench
bench: $(RUN_STAMP) ## Measure speed and memory, some minutes; nothing else should run
	$(BLOCKSIM) bench --out results/bench.json

.PHONY: bench-peers
bench-peers: $(BENCH_STAMP) ## The same scenes by pymunk and Box2D too, some minutes; draws the picture in results/
	$(VENV_PYTHON) -m tests.bench.peers --out results/bench-peers.json

.PHONY: smoke
smoke: $(RUN_STAMP) ## Short run, 2 x 2 sweep and compare, for your CI: does this installation work?
	@rm -rf $(SMOKE); step() { echo "$$*"; "$$@"; }; \
	step $(BLOCKSIM) run $(SCENARIO) --set time.end=0.05 --out $(SMOKE)/run --overwrite --quiet; \
	step $(BLOCKSIM) sweep $(SCENARIO) --set time.end=0.05 --out $(SMOKE)/sweep --overwrite --quiet \
	    --vary friction.block_block.kinetic=0.19,0.2 --vary contact.stiffness_scale=0.001,0.01; \
	code=0; step $(BLOCKSIM) compare $(SMOKE)/run || code=$$?; \
	if [ $$code -gt 1 ]; then echo "smoke: compare failed with exit code $$code" >&2; exit $$code; fi; \
	echo "smoke: ok in $$SECONDS s (nothing has landed after 0.05 s, so \"outside\" is right here)"

.PHONY: figures
figures: $(DEV_STAMP) ## Measure the plan of the package: lines, imports, repetitions; beside a reference and limits
	$(VENV_PYTHON) -m tests.plan.figures

.PHONY: lint
lint: $(DEV_STAMP) ## Check style, types and the direction of imports
	$(VENV_PYTHON) -m ruff check
	$(VENV_PYTHON) -m ruff format --check
	$(VENV_PYTHON) -m mypy
	$(VENV_PYTHON) $(VENV)/bin/lint-imports --no-logo

.PHONY: format
format: $(DEV_STAMP) ## Bring the code into shape
	$(VENV_PYTHON) -m ruff format
	$(VENV_PYTHON) -m ruff check --fix

.PHONY: readme
readme: $(DEV_STAMP) ## Write the table of scenario keys in scenarios/README.md from the models
	$(VENV_PYTHON) -m tests.key_table scenarios/README.md

.PHONY: pictures
pictures: $(RUN_STAMP) ## Draw the pictures of the findings in results/
	$(BLOCKSIM) run $(SCENARIO) --quiet
	$(BLOCKSIM) plot $(SCENARIO) --out results/three_blocks.png
	$(BLOCKSIM) sweep scenarios/stiffness_levels.toml --out $(PICTURES)/stiffness --overwrite --quiet
	$(BLOCKSIM) plot $(PICTURES)/stiffness --out results/stiffness_levels.png
	$(BLOCKSIM) sweep scenarios/start_jitter.toml --out $(PICTURES)/jitter --overwrite --quiet
	$(BLOCKSIM) plot $(PICTURES)/jitter --out results/start_jitter.png
	$(BLOCKSIM) sweep scenarios/impact_laws.toml --out $(PICTURES)/laws --overwrite --quiet
	$(BLOCKSIM) plot $(PICTURES)/laws --out results/impact_laws.png
	$(BLOCKSIM) sweep scenarios/sweep_readings.toml --out $(PICTURES)/readings --overwrite --quiet
	$(BLOCKSIM) plot $(PICTURES)/readings --out results/readings.png
	$(BLOCKSIM) sweep scenarios/sweep_friction_stiffness.toml --out $(PICTURES)/friction --overwrite --quiet
	$(BLOCKSIM) plot $(PICTURES)/friction --out results/friction_stiffness.png
	$(BLOCKSIM) sweep scenarios/ensemble_three_blocks.toml --out $(PICTURES)/ensemble --overwrite --quiet
	$(BLOCKSIM) plot $(PICTURES)/ensemble --out results/ensemble_matrix.png
	$(BLOCKSIM) plot $(PICTURES)/ensemble --kind histogram --out results/ensemble.png
	$(BLOCKSIM) sensitivity scenarios/ensemble_three_blocks.toml --samples 24 --out $(PICTURES)/morris.csv --overwrite --quiet
	$(BLOCKSIM) plot $(PICTURES)/morris.csv --out results/sensitivity.png
	$(BLOCKSIM) limit scenarios/arch.toml --vary structures.0.thickness=1m:2.1m --stands "outcome == stands" --to 1% \
	    --over friction.block_block=0.3125,0.325,0.3375,0.35,0.3625,0.375,0.3875,0.4,0.45,0.5 \
	    --out $(PICTURES)/arch --overwrite --quiet
	$(BLOCKSIM) plot $(PICTURES)/arch --experiment scenarios/published/arch_thickness.csv --out results/arch_thickness.png
	$(BLOCKSIM) run scenarios/soil/retaining_wall_falls.toml --quiet
	$(BLOCKSIM) plot scenarios/soil/retaining_wall_falls.toml --out results/retaining_wall.png
	mkdir -p $(PICTURES) && rm -f $(PICTURES)/my_retaining_wall.toml
	cd $(PICTURES) && $(abspath $(BLOCKSIM)) new retaining-wall my_retaining_wall --quiet > /dev/null
	$(BLOCKSIM) run $(PICTURES)/my_retaining_wall.toml --out $(PICTURES)/retaining_joints --overwrite --quiet
	$(BLOCKSIM) plot $(PICTURES)/retaining_joints --kind joints --out results/retaining_joints.png
	$(BLOCKSIM) limit scenarios/tilting_wall.toml --vary ground.tilt=20deg:40deg --stands "outcome != fell" \
	    --out $(PICTURES)/tilting_wall --overwrite --quiet
	$(BLOCKSIM) plot $(PICTURES)/tilting_wall --kind mechanism --out results/tilting_wall.png
	$(BLOCKSIM) run scenarios/walls/pushed_granite_wall.toml --out $(PICTURES)/granite_wall --overwrite --quiet
	$(BLOCKSIM) plot $(PICTURES)/granite_wall --kind capacity --out results/granite_wall.png

.PHONY: paper
paper: $(RUN_STAMP) ## The paper's figures, tables and equations from the shipped scenarios, into results/paper
	$(VENV_PYTHON) -m tests.verification.paper $(PAPER)

.PHONY: demo
demo: $(RUN_STAMP) ## Run the three blocks with contact forces; strip, animation and report in results/demo
	$(BLOCKSIM) run $(SCENARIO) --set output.contacts=true --out $(DEMO)/run --overwrite --quiet
	$(BLOCKSIM) plot $(DEMO)/run --forces --out $(DEMO)/strip.png
	$(BLOCKSIM) animate $(DEMO)/run --forces --speed 0.1 --fps 20 --width 640 --out $(DEMO)/animation.gif --overwrite
	$(BLOCKSIM) report $(DEMO)/run --out $(DEMO)/report.html

.PHONY: dist
dist: $(DOCS_STAMP) ## Build sdist and wheel into dist/, twice, and try the wheel in an empty environment; some minutes
	$(VENV_PYTHON) -m tests.dist

.PHONY: docs
docs: $(DOCS_STAMP) ## Build the site into build/site: pages, keys, commands, gallery, notebooks; four minutes
	$(VENV_PYTHON) -m tests.site

.PHONY: setup
setup: $(DEV_STAMP) ## Create or update .venv, with the tools for developers

.PHONY: setup-full
setup-full: $(FULL_STAMP) ## As setup, with the engines to compare with and VTK, large: no test is skipped for them

.PHONY: lock
lock: ## Rewrite the locked versions and hashes: the newest that fit pyproject.toml
	@folder=$$(mktemp -d); trap 'rm -rf "$$folder"' EXIT; \
	echo "Resolving for Python 3.11 and newer, with uv in a fresh environment"; \
	$(PYTHON) -m venv "$$folder/venv"; \
	"$$folder/venv/bin/python" -m pip install -qq --disable-pip-version-check uv; \
	index=$${PIP_INDEX_URL:-$$("$$folder/venv/bin/python" -m pip config get global.index-url 2>/dev/null || true)}; \
	if [ -n "$$index" ]; then export UV_DEFAULT_INDEX="$$index"; fi; \
	sed -n 's/^requires = \["\(hatchling==[^"]*\)"\].*/\1/p' pyproject.toml >"$$folder/build.in"; \
	printf '%s\n' editables pip >>"$$folder/build.in"; \
	names() { sed -n 's/^\([a-z0-9][^= ]*\)==.*/\1/p' "$$1"; }; \
	resolve() { "$$folder/venv/bin/uv" pip compile -q --universal --python-version 3.11 --generate-hashes --no-header \
	    --no-annotate --fork-strategy fewest "$$@"; }; \
	none="--no-emit-package colorama"; \
	resolve pyproject.toml "$$folder/build.in" --extra study $$none -o "$$folder/run.txt"; \
	known=$$(names "$$folder/run.txt" | sed 's/^/--no-emit-package /'); \
	resolve pyproject.toml --extra dev -c "$$folder/run.txt" $$known $$none -o "$$folder/dev.txt"; \
	resolve pyproject.toml --extra docs --extra dist -c "$$folder/run.txt" -c "$$folder/dev.txt" $$known \
	    -o "$$folder/docs.txt"; \
	resolve pyproject.toml --extra bench --extra study -c "$$folder/run.txt" $$known $$none -o "$$folder/bench.txt"; \
	resolve pyproject.toml --extra paraview-check --extra study -c "$$folder/run.txt" $$known $$none \
	    -o "$$folder/paraview-check.txt"; \
	head() { echo "# $$1. Written by: make lock"; }; \
	{ head "Exact versions, with hashes, of what make run installs"; cat "$$folder/run.txt"; } >$(CONSTRAINTS); \
	for extra in dev docs bench paraview-check; do \
	    { head "What the extra $$extra needs beside"; echo "-r constraints.txt"; cat "$$folder/$$extra.txt"; } \
	        >tests/constraints-$$extra.txt; \
	done; \
	echo "Wrote tests/constraints*.txt; see the difference, then make test"

.PHONY: clean
clean: ## Remove .venv, caches and what make smoke left; your results stay
	rm -rf $(VENV) $(SMOKE) .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find blocksim tests -name __pycache__ -type d -prune -exec rm -rf {} +

.PHONY: void
void: ;

$(VENV_PYTHON):
	@for python in $(CANDIDATES); do \
	    if $$python -c 'import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then \
	        echo "Creating $(VENV) with $$($$python --version)"; \
	        exec $$python -m venv --clear $(VENV); \
	    fi; \
	    tried="$${tried-}  $$python: $$($$python --version 2>/dev/null || echo 'does not run')"$$'\n'; \
	done; \
	printf '%s\n%s%s\n' >&2 "blocksim needs Python 3.11 or newer with its venv module. Tried:" "$$tried" \
	    "Install one (Debian, Ubuntu: python3-venv too) or name it: make PYTHON=/path/to/python3.12 run"; \
	exit 1

$(RUN_STAMP): $(INSTALL_DECIDES) $(VOID) | $(VENV_PYTHON)
	@echo "Installing blocksim into $(VENV), a minute or so (versions: $(CONSTRAINTS))"
	@$(INSTALL_LOCKED) $(CONSTRAINTS)
	@$(INSTALL_BLOCKSIM)
	@touch $@

$(DEV_STAMP): $(INSTALL_DECIDES) $(VOID) | $(VENV_PYTHON)
	@echo "Installing blocksim and its developers' tools into $(VENV), a minute or so (versions: $(DEV_CONSTRAINTS))"
	@$(INSTALL_LOCKED) $(DEV_CONSTRAINTS)
	@$(INSTALL_BLOCKSIM)
	@touch $(RUN_STAMP) $@

$(BENCH_STAMP): $(INSTALL_DECIDES) $(VOID) | $(VENV_PYTHON)
	@echo "Installing the engines to compare with into $(VENV) (versions: $(BENCH_CONSTRAINTS))"
	@$(INSTALL_LOCKED) $(BENCH_CONSTRAINTS)
	@$(INSTALL_BLOCKSIM)
	@touch $(RUN_STAMP) $@

$(DOCS_STAMP): $(INSTALL_DECIDES) $(VOID) | $(VENV_PYTHON)
	@echo "Installing what builds the site and checks the package into $(VENV) (versions: $(DOCS_CONSTRAINTS))"
	@$(INSTALL_LOCKED) $(DOCS_CONSTRAINTS)
	@$(INSTALL_BLOCKSIM)
	@touch $(RUN_STAMP) $@

# One call for all of them: most of its time goes into what they share.
$(FULL_STAMP): $(INSTALL_DECIDES) $(VOID) | $(VENV_PYTHON)
	@echo "Installing all that tests use into $(VENV) (versions: $(CONSTRAINTS:.txt=*.txt))"
	@$(INSTALL_LOCKED) $(DEV_CONSTRAINTS) --requirement $(DOCS_CONSTRAINTS) --requirement $(BENCH_CONSTRAINTS) \
	    --requirement $(VTK_CONSTRAINTS)
	@$(INSTALL_BLOCKSIM)
	@touch $(RUN_STAMP) $(DEV_STAMP) $(DOCS_STAMP) $(BENCH_STAMP) $@
