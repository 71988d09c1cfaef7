# Everything a user or CI needs; only python3 (3.11 or newer), make and a Debian-like system are taken for granted.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed

# Graphviz lays out the drawings of machines; EGL draws robots without a screen; tests open pages in a browser and read logs
# with node. Where nobody may install packages, each is named when something needs it.
NEEDS := dot:graphviz chromium:chromium node:nodejs npm:npm patch:patch
LIBRARIES := libegl1 libgl1-mesa-dri
SUDO := $(shell [ "$$(id -u)" = 0 ] || echo "sudo -n")

.PHONY: setup demo test lint types unit bench validate docs clean

setup: $(STAMP)

$(STAMP): pyproject.toml tests/log/node/package-lock.json
	@missing="$(foreach need,$(NEEDS),$$(command -v $(firstword $(subst :, ,$(need))) >/dev/null || echo $(lastword $(subst :, ,$(need)))))"; \
	  for package in $(LIBRARIES); do dpkg -s $$package >/dev/null 2>&1 || missing="$$missing $$package"; done; \
	  set -- $$missing; [ $$# = 0 ] || { $(SUDO) apt-get -qq update && $(SUDO) apt-get -qq install -y "$$@" >/dev/null; } \
	  || echo "could not install $$*: pictures, drawings or tests need them"
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[test,docs]'
	@# the reader of logs that Foxglove and Lichtblick use, for a test
	npm ci --prefix tests/log/node --ignore-scripts --no-audit --no-fund --silent || echo "no npm ci: a test needs it"
	@# compile the control law and what reads logs once, so that no first run pays for it
	$(BIN)/python -m teleop_sim.robot.warm_up
	$(BIN)/python -m teleop_sim.log.warm_up
	touch $(STAMP)

demo: setup
	$(BIN)/teleop-sim run src-dish --uplink 380bps --latency 10s --autonomy full --seed 1 --out runs
	$(BIN)/teleop-sim report runs/src-dish_seed1.mcap

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports

types: setup
	$(BIN)/mypy

unit: setup
	$(BIN)/python -m pytest -n 2 --dist loadfile -m 'not slow'

test: lint types unit

bench: setup
	$(BIN)/python benchmarks/link_rate.py
	$(BIN)/python benchmarks/physics_rate.py
	$(BIN)/python benchmarks/crank_rate.py
	$(BIN)/python benchmarks/memo.py 12
	$(BIN)/python benchmarks/engine_rate.py
	$(BIN)/python benchmarks/whole_run.py
	$(BIN)/python benchmarks/sweep.py
	$(BIN)/python benchmarks/load_rate.py
	$(BIN)/python benchmarks/report_rate.py

validate: setup
	$(BIN)/python benchmarks/study.py --seeds 1:21
	$(BIN)/python benchmarks/walk_study.py
	$(BIN)/python benchmarks/crank_study.py
	$(BIN)/python benchmarks/table2.py --seeds 20 --workers 2
	$(BIN)/python -m pytest -m slow

docs: setup
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

clean:
	rm -rf $(VENV) build dist site *.egg-info
