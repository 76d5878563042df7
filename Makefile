# `make demo` and `make test` each install what is missing by themselves and say what.
# Prerequisites: git, make, Python 3.11 or newer. Linux, x86_64.
#
#   make demo ARGS="--seed 7"      the rule-learning demo with another world
#   make test ARGS="tests/hmm"     some of the tests

BIN := .venv/bin
ARGS ?=
SEEDS ?= 0-9
# Of linear algebra in each process: with small matrices threads mostly wait for each other, and keep processors busy with it.
ONE_THREAD := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
# One more than processors, up to four: a third of the time tests wait, for arms that move in real time and for each other.
WORKERS := $(shell n=$$(getconf _NPROCESSORS_ONLN); echo $$((n < 4 ? n + 1 : 4)))

FINDINGS ?= $(wildcard findings/*.sh)

.PHONY: help wheel demo test test-long test-hardware check docs results findings ci format setup messages lock benchmark-seeds coverage mutation bare clean

help: ## this list
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## /\t/' | expand -t 18

demo: setup ## the robot learns where three objects belong and tidies them up, in simulation
	@$(BIN)/paramove launch rule_learning $(ARGS)

test: setup ## all tests that need neither hardware nor minutes each, several at once
	@$(ONE_THREAD) $(BIN)/python -m pytest -m "not hardware and not long" -n $(WORKERS) --dist worksteal $(ARGS)

test-long: setup ## tests that take minutes each (hours in all): rehearsals in real time, what can go wrong at the table, two hosts
	@$(ONE_THREAD) $(BIN)/python -m pytest -m long $(ARGS)

test-hardware: setup ## tests of a real servo arm, which moves a little: make test-hardware PORT=/dev/serial/by-id/… ROBOT=koch_v1_1
	@test -n "$(PORT)" || { echo "which port? make test-hardware PORT=/dev/serial/by-id/…" >&2; exit 2; }
	@$(BIN)/python -m pytest tests/hardware --servo-port $(PORT) --robot $(or $(ROBOT),open_manipulator_x) $(ARGS)

check: setup ## formatting, lint, types, generated messages
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/python msgs/generate.py --check

docs: setup ## the documentation as HTML in build/docs: all pages, and the API from docstrings
	@$(BIN)/python docs/build.py $(ARGS)

wheel: setup ## the package as one file in build/dist, to be installed anywhere by pip
	@rm -rf build/dist
	@$(BIN)/python -m pip wheel . --quiet --disable-pip-version-check --no-deps --no-build-isolation --wheel-dir build/dist
	@ls build/dist/*.whl

results: setup ## measures again what the pages print (hours), or some of it: make results ARGS="imitation pointing"
	@$(BIN)/python docs/results.py --run $(or $(ARGS),all)

findings: ## repeats what was found in other packages, each in an environment of its own: make findings FINDINGS=findings/NAME.sh
	@failed=0; for finding in $(FINDINGS); do echo "== $$finding"; bash "$$finding" || { failed=1; echo "changed: $$finding"; }; done; exit $$failed

ci: ## check and test as on a machine that lacks everything; as root it installs Debian packages
	@.ci/run

format: setup ## puts the code into its standard form
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

benchmark-seeds: setup ## the demo with many worlds: make benchmark-seeds SEEDS=0-29
	@$(BIN)/paramove evaluate rule_learning --seeds $(SEEDS) $(ARGS)

coverage: setup ## is every line and branch of the safety gate tested? ends with 1 if not
	@$(BIN)/python -m coverage run -m pytest -q --durations=0 --durations-min=60 tests/safety $(ARGS)
	@$(BIN)/python -m coverage report

mutation: setup ## changes the safety gate in thousands of ways: do the tests notice? (build/mutation, ten minutes or more)
	rm -rf build/mutation && mkdir -p build/mutation
	python3 -m venv build/mutation/venv
	build/mutation/venv/bin/python -m pip install --quiet mutmut==3.8.1
	cp -R pyproject.toml src tests benchmarks nodes sim robot_description build/mutation
	cd build/mutation && PYTHONPATH=$$(echo venv/lib/python3*/site-packages) OMP_NUM_THREADS=1 \
	  ../../$(BIN)/python -m mutmut run $(ARGS)
	cd build/mutation && PYTHONPATH=$$(echo venv/lib/python3*/site-packages) ../../$(BIN)/python -m mutmut results

setup: ## installs what is missing; done by the others too
	@sh docker/setup.sh

messages: setup ## generates src/paramove/msgs from msgs/*.proto
	$(BIN)/python msgs/generate.py

lock: ## finds newer versions and writes requirements.lock, and those of the extras peers and ros2
	python3 -m venv build/lock
	build/lock/bin/python -m pip install --quiet uv
	build/lock/bin/uv pip compile pyproject.toml --extra robot --extra c3d --extra dev --extra docs --universal --python-version 3.11 --upgrade \
	  --generate-hashes --no-emit-index-url --no-emit-find-links --custom-compile-command "make lock" \
	  --output-file requirements.lock
	build/lock/bin/uv pip compile pyproject.toml --extra peers --extra cluster --universal --python-version 3.11 --upgrade \
	  --constraint requirements.lock --generate-hashes --no-emit-index-url --no-emit-find-links \
	  --custom-compile-command "make lock" --output-file requirements-peers.lock
	build/lock/bin/uv pip compile pyproject.toml --extra ros2 --universal --python-version 3.11 --upgrade \
	  --constraint requirements.lock --generate-hashes --no-emit-index-url --no-emit-find-links \
	  --custom-compile-command "make lock" --output-file requirements-ros2.lock

bare: ## demo and tests in a bare Debian, as root and as an ordinary user (needs root and debootstrap)
	docker/bare.sh $(ARGS)

clean: ## removes what can be made again, but not the runs
	rm -rf .venv build .pytest_cache .mypy_cache .ruff_cache .hypothesis
