# The daily commands. `make` alone lists them.

PYTHON := .venv/bin/python

.DEFAULT_GOAL := help
.PHONY: help setup test integrations lint docs demo card clean

help: ## list the targets
	@grep -hE '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):.*## /  make \1\t/' | expand -t 16

setup: ## make .venv and see to a Vulkan driver; quick when there is nothing to do
	@scripts/setup

lint: setup ## ruff and mypy
	$(PYTHON) -m ruff check .
	$(PYTHON) -m ruff format --check .
	$(PYTHON) -m mypy

# Two workers: every one that renders takes a core and 0.5 GiB.
test: lint ## lint, then every test
	$(PYTHON) -m pytest -n 2

integrations: ## the plug-ins in the real LeRobot, vla-eval and Inspect, in environments of their own
	@scripts/test-integrations

docs: setup ## the documentation site, in build/site; a warning or dead link is an error
	NO_MKDOCS_2_WARNING=1 $(PYTHON) -m mkdocs build --strict

demo: setup ## the main job: three policies, every task and setting; ends with a table and a page
	.venv/bin/roboirg demo --out runs/demo

card: setup ## write docs/language-card.md anew, after a change of words or episodes
	.venv/bin/roboirg language card --out docs/language-card.md

clean: ## remove what the tools left behind; .venv and runs stay
	rm -rf build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find src tests -name __pycache__ -type d -prune -exec rm -rf {} +
