# make demo   the machine-table and machine-tool start-ups, computed against published values
# make test   the formats, the types, the layers, and all tests that are not slow: ten minutes on two cores
# make slow   the slow tests; continuous integration runs them, too
# make site   the documentation as pages for a browser, in build/site/html
# make release   the wheel for all platforms and the sdist, in dist/, tried in a new environment
# make try   the wheel in dist/, in a new environment
# make browser   Chromium for the tests of pages, by the system's package manager, where no browser is
# make shells   fish, for the tests of completion, likewise
# make emulators   qemu and wine, for the tests of the run-time of other platforms, likewise
# make fmus   the reference FMUs, from their C sources, to build/fmus
# make benchmark   times as ratios to hand-written baselines of the same run; fails where one grows with more than the parts

PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
BIN := .venv/$(if $(filter Windows_NT,$(OS)),Scripts,bin)
C := $(wildcard modelica_like/engine/*.[ch] fmus/*/*.[ch] tests/fmi/*.c tests/fmus/*/*.c)
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt

# Bytecode of the project is kept, whatever the environment says: tests start its command hundreds of times.
unexport PYTHONDONTWRITEBYTECODE

# Without a C compiler zig compiles, which the build asks for; the extra `dev` has it for the tests.
COMPILED := ls modelica_like/fmi/runtimes/* >/dev/null 2>&1 || echo "The run-time is not compiled: this is done at \
first use. Install cc, gcc or clang, or zig by $(BIN)/pip install 'modelica-like[cross]'."

.PHONY: demo test lint types layers pytest slow browser shells emulators benchmark release try fmus format clean site

demo: .venv/installed
	$(BIN)/modelica-like demo

test: lint types layers pytest

lint: .venv/installed-dev
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/clang-format --dry-run --Werror $(C)

types: .venv/installed-dev
	$(BIN)/basedpyright

layers: .venv/installed-dev
	$(BIN)/lint-imports

pytest: .venv/installed-dev
	$(BIN)/python -m pytest -q -n auto -m "not slow"

slow: .venv/installed-dev
	$(BIN)/python -m pytest -q -n auto -m slow

# Only Debian's family is served here; elsewhere the tests say what is missing.
browser:
	@for name in "$$BROWSER_FOR_TESTS" chromium chromium-browser google-chrome; do \
		command -v "$$name" >/dev/null && exit; done; \
	AS=$$(test "$$(id -u)" = 0 || echo sudo); \
	$$AS apt-get update --quiet --quiet && \
	$$AS apt-get install --yes --quiet --quiet --no-install-recommends chromium || \
	{ echo "No browser was found, and Chromium could not be installed by apt-get: install one, or name one by \$$BROWSER_FOR_TESTS." >&2; exit 1; }

shells:
	@command -v fish >/dev/null && exit; \
	AS=$$(test "$$(id -u)" = 0 || echo sudo); \
	$$AS apt-get update --quiet --quiet && $$AS apt-get install --yes --quiet --quiet --no-install-recommends fish || \
	{ echo "fish could not be installed by apt-get: install it." >&2; exit 1; }

emulators:
	@{ command -v qemu-aarch64 && test -d /usr/aarch64-linux-gnu && { command -v wine64 || test -x /usr/lib/wine/wine64; }; } >/dev/null && exit; \
	AS=$$(test "$$(id -u)" = 0 || echo sudo); \
	$$AS apt-get update --quiet --quiet && \
	$$AS apt-get install --yes --quiet --quiet --no-install-recommends qemu-user libc6-arm64-cross wine64 || \
	{ echo "qemu-user, libc6-arm64-cross and wine64 could not be installed by apt-get: install them." >&2; exit 1; }

# Of each what it measures; `make -j 2 --output-sync benchmark` does two at a time.
BENCHMARKS := growth import_time bad_input energy segments events precision chain large fmu_export gradient linearize sweep
benchmark-chain: SIZES = 10 100 1000 5000
benchmark-large: SIZES = 60 10
benchmark-fmu_export: SIZES = 10 100 1000
benchmark-linearize: SIZES = 100 1000
benchmark-sweep: SIZES = 900

benchmark: $(BENCHMARKS:%=benchmark-%)

# Times are those of the CPU: threads of BLAS that wait would count.
benchmark-%: export OPENBLAS_NUM_THREADS = 1
benchmark-%: .venv/installed-dev
	$(BIN)/python benchmarks/$*.py $(SIZES)

site: .venv/installed-dev
	$(BIN)/python docs/site/build.py

release: .venv/installed-dev
	rm -rf dist
	MODELICA_LIKE_PLATFORMS=all $(BIN)/python -m build
	$(MAKE) try

try: .venv/installed-dev
	MODELICA_LIKE_PLATFORMS=all MODELICA_LIKE_WHEEL=$$(ls dist/*.whl) $(BIN)/python -m pytest -q -n 0 tests/wheel

fmus: .venv/installed
	$(BIN)/python fmus/build.py

format: .venv/installed-dev
	$(BIN)/ruff check --fix
	$(BIN)/ruff format
	$(BIN)/clang-format -i $(C)

clean:
	rm -rf .venv build

.venv/python:
	@test -n "$(PYTHON)" || { echo "Python 3.11 or newer is needed; set PYTHON=/path/to/python." >&2; exit 1; }
	$(PYTHON) -m venv .venv
	@touch $@

.venv/installed: .venv/python pyproject.toml constraints.txt
	test -f .venv/installed-dev || $(PIP) --editable .
	@$(COMPILED)
	@touch $@

.venv/installed-dev: .venv/python pyproject.toml constraints.txt
	$(PIP) --editable '.[dev,data]'
	@$(COMPILED)
	@touch $@ .venv/installed
