# Everything is set up inside .venv; nothing outside the repository is touched.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# The demo needs what a user installs; everything else also needs the developers' tools.
USER_STAMP := $(VENV)/.installed-user
STAMP := $(VENV)/.installed
INSTALL = $(BIN)/python -m pip install --quiet --disable-pip-version-check --editable
# ROS 1 comes from the distribution's packages: where this Python has it, .venv sees it.
VENV_ARGS ?= $(shell $(PYTHON) -c 'import rospy' 2>/dev/null && echo --system-site-packages)
CASES ?= $(wildcard ../shared/cases/*/)
# Where Python may not keep what it parsed, every process of a test parses everything again.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test check kernels style bench recording docs dist sign release-matrix lock clean

# Python compiles what it imports, which is a small part of what pip would compile.
$(USER_STAMP): pyproject.toml
	$(PYTHON) -m venv $(VENV_ARGS) $(VENV)
	$(INSTALL) '.[plot]' --no-compile
	touch $@

$(STAMP): $(USER_STAMP)
	$(INSTALL) '.[dev]'
	touch $@

demo: $(USER_STAMP)
	$(BIN)/firstfix demo --headless $(DEMO_ARGS)
	@if [ -t 0 ] && [ -t 1 ]; then \
	    printf '\nOpen the live page of this robot now? [Y/n] '; read answer; \
	    case "$$answer" in [Nn]*) ;; *) exec $(BIN)/firstfix demo $(DEMO_ARGS);; esac; \
	fi

# A cluster of Ray fills the machine: its tests run after the others, and one by one.
test: kernels
	$(BIN)/python -m pytest -n 4 --dist worksteal $(or $(TEST_ARGS),-m "not cluster")
	$(if $(TEST_ARGS),,$(BIN)/python -m pytest -m cluster tests/fleet)

check: $(STAMP)
	$(MAKE) -j 2 kernels style
	$(BIN)/python -m pytest -n 3 --dist worksteal -q -m "not slow" $(TEST_ARGS)

# In a fresh clone every process that runs tests would compile the same kernels at the same time.
kernels: $(STAMP)
	$(BIN)/firstfix doctor

style: $(STAMP)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(STAMP)
	$(BIN)/firstfix bench --suite paper --out out/paper.json --report out/paper
	$(if $(strip $(CASES)),$(BIN)/firstfix bench $(CASES) --method fast --method paper --wrong-map \
	    --out out/bench.json --report out/bench,@echo 'no cases in ../shared/cases: to try some, \
	    name folders with map.yaml and scans.npz: make bench CASES="folder ..."')

recording: $(STAMP)
	$(BIN)/python benchmarks/record_demo.py docs/demo.gif

docs: $(STAMP)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

$(VENV)/.release: $(STAMP)
	$(INSTALL) '.[release]'
	touch $@

dist: $(VENV)/.release
	.ci/release $(BIN)/python

# KEY is the file of a private SSH key whose public one is in allowed_signers.
sign:
	ssh-keygen -Y sign -f $(KEY) -n firstfix-release dist/SHA256SUMS

release-matrix: dist
	$(BIN)/python .ci/release_matrix.py

lock: $(VENV)/.release
	$(BIN)/uv pip compile --quiet --upgrade --universal --python-version 3.10 --generate-hashes --no-annotate \
	    --custom-compile-command 'make lock' --output-file requirements.lock pyproject.toml

clean:
	rm -rf $(VENV) out dist build
