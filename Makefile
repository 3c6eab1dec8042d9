# Everything runs in a virtual environment of its own, made on first use. `make` lists the targets.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# Modules start in the order of `SLOW` in tests/conftest.py.
ORDER := --dist loadscope --no-loadscope-reorder
SOURCES := pyproject.toml CMakeLists.txt $(shell find src -type f ! -name "*.pyc")

.PHONY: help demo test quick lowest newest lint workflows docs stub frontend figures reproduce bench timings fuzz sanitize compilers dist blender clean

help: ## list the targets
	@grep -hE '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

demo: $(BIN)/superfacets ## segment the sample mesh, write a labeled mesh and a picture
	@tools/ensure-gl $(BIN)/python
	$(BIN)/superfacets demo -o demo

test: $(VENV)/group-test $(VENV)/vsa ## run all tests; those of the front end only if Node is installed
	@tools/check-frontend test
	@tools/ensure-gl $(BIN)/python
	@tools/ensure-chromium
	$(BIN)/python -m pytest -n auto --maxprocesses 4 $(ORDER)

quick: $(VENV)/group-test ## run four tests of five in about a minute
	$(BIN)/python -m pytest -n auto --maxprocesses 4 $(ORDER) -m "not slow"

lowest: $(VENV)/group-bounds ## run tests with the lowest versions declared of all dependencies
	@tools/ensure-gl $(BIN)/python
	tools/test-bounds lowest $(BIN)/python $(BOUNDS_TESTS)

newest: $(VENV)/group-bounds ## run tests with the newest; BOUNDS_PYTHON=3.14 takes another Python
	@tools/ensure-gl $(BIN)/python
	tools/test-bounds newest $(BIN)/python

workflows: $(VENV)/group-dev ## check the files in .github/workflows with actionlint and zizmor
	tools/lint-workflows
	$(BIN)/zizmor --offline --quiet .github/workflows

lint: $(VENV)/group-dev ## formats, lints and types of Python and C++, and of the front end if Node is installed
	@tools/check-frontend lint
	$(BIN)/ruff check . tools/fuzz
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/clang-format --dry-run --Werror $$(find src/core -name "*.[ch]pp")
	$(BIN)/clang-tidy --quiet $(TIDY) $$(find src/core -name "*.cpp") -- -std=c++20 -Isrc/core $$($(BIN)/python tools/include-flags)

docs: $(VENV)/group-dev ## build the documentation, gallery and notebooks; warnings are errors
	@tools/ensure-gl $(BIN)/python
	@rm -rf docs/api  # pages of names that no longer exist
	$(BIN)/sphinx-build -W --keep-going -q -E docs docs/_build/html
	$(BIN)/python docs/notebooks.py
	@echo docs/_build/html/index.html

stub: $(VENV)/group-test ## write the types of the core anew, from the core itself
	$(BIN)/python -m nanobind.stubgen -q -m superfacets._core -o src/superfacets/_core.pyi

frontend: ## build the scripts of the studio and of pages (needs Node 20.19 or newer)
	cd frontend && npm ci --no-fund --no-audit && npm run build

figures: $(BIN)/superfacets ## draw the pictures of the README and the documentation anew
	@tools/ensure-gl $(BIN)/python
	$(BIN)/python docs/make_figures.py
	$(BIN)/python docs/shrink_images.py

reproduce: $(VENV)/group-research $(VENV)/vsa ## repeat the paper's study; PSB=folder of the benchmark, OUT=results
	@tools/ensure-gl $(BIN)/python
	$(BIN)/python -m research reproduce $(PSB) -o $(or $(OUT),reproduction) $(REPRODUCE)

bench: $(VENV)/group-bench ## time everything, side by side with rivals; BENCH="all --quick" for less
	$(BIN)/python -m benchmarks $(or $(BENCH),all) --json bench.json

timings: $(VENV)/group-bench ## print the timing table of the README
	$(BIN)/python -m benchmarks timings

fuzz: $(VENV)/group-test ## search a minute for inputs that break a promise; FUZZ="--seconds 3600 --seed 7" for more
	$(BIN)/python tools/fuzz $(FUZZ)

sanitize: $(VENV)/group-test ## run the tests of the core under ASan, UBSan and TSan; SANITIZERS=thread for one
	tools/sanitize $(BIN)/python $(SANITIZE_TESTS)

compilers: $(BIN)/superfacets ## check that labels are the same with GCC, less optimized, and clang
	tools/compare-compilers $(BIN)/python

dist: $(VENV)/group-dist ## build sdist and wheel, and try the wheel where there is no compiler
	tools/try-dist $(BIN)/python

blender: ## zip the Blender extension; WHEELS="dist/*.whl" puts wheels of superfacets into it
	$(PYTHON) tools/make-blender-extension dist/superfacets-blender.zip $(WHEELS)

clean: ## remove all that was built
	rm -rf $(VENV) build dist wheelhouse demo docs/_build docs/api docs/gallery docs/help docs/notebooks bench.json

$(VENV)/made:
	@tools/ensure-toolchain $(PYTHON)
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	@touch $@

$(BIN)/superfacets: $(VENV)/made $(SOURCES)
	@tools/ensure-toolchain $(BIN)/python
	$(BIN)/python -m pip install --quiet ".[all]"
	@touch $@

$(VENV)/vsa: $(BIN)/superfacets $(wildcard research/vsa_core/*)
	$(BIN)/python -m pip install --quiet research/vsa_core
	@touch $@

$(VENV)/group-%: $(BIN)/superfacets
	$(BIN)/python -m pip install --quiet --group $*
	@touch $@
