# The daily commands. `make` alone lists them.

PYTHON := .venv/bin/python
CFFCONVERT := build/citation/bin/cffconvert
DIST_TOOLS := build/dist-tools/bin/twine

.DEFAULT_GOAL := help
.PHONY: help setup dev learn style types test fast-tests test-slow test-all test-learn every-test net integrations lint docs dist dist-hub try-dist demo play card clean

help: ## list the targets
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## /  make \1\t/' | expand -t 21

setup: ## make .venv and a Vulkan driver, for playing and results; quick when nothing is missing
	@scripts/setup

dev: ## the same, and what tests, lint and documentation need
	@scripts/setup dev

learn: setup ## roboirg learn from this checkout, with PyTorch
	$(PYTHON) -m pip install --quiet --editable packages/learn

lint: style ## ruff, mypy and cffconvert
	$(PYTHON) -m mypy

style: dev $(CFFCONVERT)
	$(PYTHON) -m ruff check .
	$(PYTHON) -m ruff format --check .
	$(CFFCONVERT) --validate

# Needs an older jsonschema than the packages of .venv.
$(CFFCONVERT): | dev
	$(PYTHON) -m venv build/citation
	build/citation/bin/pip install --quiet --disable-pip-version-check cffconvert==2.0.0

# More workers than cores, as many tests wait for processes; each has 0.5 GiB. What the tests of a
# file make for all of them is made once. conftest.py has the order of the files;
# scripts/test_costs.py reads the report.
PYTEST = $(PYTHON) -m pytest -n 4 --dist loadfile --no-loadscope-reorder --max-worker-restart 3 --junitxml build/$@.xml

test: style ## lint, and every test but the slow ones
	@$(MAKE) --no-print-directory --jobs 2 types fast-tests

types:
	$(PYTHON) -m mypy

fast-tests:
	$(PYTEST) -m "not slow"

test-slow: dev ## the slow tests alone
	$(PYTEST) -m slow

test-all: lint every-test ## lint, then every test; both at once with --jobs 2

every-test: dev
	$(PYTEST)

test-learn: dev learn ## the tests of what learns, with PyTorch
	$(PYTEST) packages/learn/tests tests/scripts/test_play_experiment.py

net: dev ## compare words, prints, golden runs and packs with what is stored of them; takes minutes
	$(PYTHON) tests/net/net.py compare

integrations: ## the plug-ins in the real LeRobot, vla-eval and Inspect, in environments of their own
	@scripts/test-integrations

docs: dev ## the documentation site, in build/site; a warning or dead link is an error
	NO_MKDOCS_2_WARNING=1 $(PYTHON) -m mkdocs build --strict

dist: dev $(DIST_TOOLS) ## what can be published, in dist/: distributions, site, hub files, licenses, checksums
	@scripts/dist

dist-hub: dev ## add samples of questions and demonstrations to dist/hub; plays episodes for three minutes
	@scripts/dist-hub

# Their versions are written into wheels, or change what is checked.
$(DIST_TOOLS): | dev
	$(PYTHON) -m venv build/dist-tools
	build/dist-tools/bin/pip install --quiet --disable-pip-version-check build==1.6.1 hatchling==1.33.0 twine==7.0.0

try-dist: ## install and play what is in dist/, in a new environment; with another Python: TRY_WITH=python3.12
	@scripts/try-dist $(TRY_WITH)

demo: setup ## the main job: three policies, every task and setting; ends with a table and a page
	.venv/bin/roboirg run --plan demo --out runs/demo
	@.venv/bin/roboirg report runs/demo >/dev/null && echo runs/demo/report.html

play: learn ## a policy that learned, from its two files in results/weights; ends with a table and a page
	.venv/bin/roboirg run --policy 'small=trained:results/weights/recurrent-0.body.safetensors?reader=results/weights/all-0.reader.safetensors' --tasks PickXtimes,VideoRepick --episodes 2 --video all --out runs/small
	@.venv/bin/roboirg report runs/small >/dev/null && echo runs/small/report.html

card: dev ## write docs/language-card.md anew, after a change of words or episodes
	$(PYTHON) scripts/write_language_card.py

clean: ## remove what the tools left behind; .venv and runs stay
	rm -rf build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find src packages tests -name __pycache__ -type d -prune -exec rm -rf {} +
