# The things one does here, each from a fresh clone. They need Python >= 3.11, a C++20 compiler, git and make.
PYTHON ?= python3
VENV   ?= .venv
DB     ?= sqlite:///tracker.db
OUT    ?= public
WORKERS ?= auto  # of the tests in Python: as many as there are cores
BIN    := $(VENV)/bin
export PIP_BUILD_CONSTRAINT ?= $(CURDIR)/.ci/build-constraints.txt

.PHONY: help lint tools tidy tidy-deep engines engine-releases recorded wasm three-scene formulas-font nightly test check bench pictures looks heaps campaign campaign-wide mechanisms mutants mutants-tonight past mutation tolerances detectors pairs aa package release site docs crashes hostile executors serve clean require install develop native-tests fuzz fuzz-keep sanitize sanitize-python FORCE
help:
	@echo "make nightly   set up, run every scalar test, record it in $(DB), publish the website in $(OUT)/"
	@echo "make test      set up, pass all tests (C++ and Python)"
	@echo "make check     formatting, lint, types, import contracts"
	@echo "make tidy-deep the core read along every path by clang's analyser: weekly"
	@echo "make bench     what things cost, as ratios measured side by side in one run: a night of its own, with pages in public-bench/"
	@echo "make bench-growth_sqlite bench-heaps bench-replay bench-scenes   one of them alone: these take minutes"
	@echo "make sanitize  the C++ tests with every access and every overflow watched"
	@echo "make sanitize-python   the Python tests of the engine on a module whose every access is watched"
	@echo "make fuzz MINUTES=10   each fuzz target, guided by what it reaches: shapes, scenes, documents, settings"
	@echo "make fuzz-keep         the least of what they have reached goes into the tree"
	@echo "make pictures  the pictures in docs/ again, of the nights in $(DB) and of a red night"
	@echo "make looks     every page of the website in every width and theme, to axe"
	@echo "make engines   every engine that can be had on every scene: docs/engines.md"
	@echo "make engine-releases  the newest releases of MuJoCo, Exudyn and Rapier that are not measured yet"
	@echo "make recorded  both as files that come with the sources, for the website of a fresh clone"
	@echo "make heaps     piles of 1000 and 10 000 bodies as scalar tests, and their error against run time"
	@echo "make campaign  2000 random heaps, others every week: does their energy ever rise?"
	@echo "make campaign-wide  the same with every shape and ground, of 1e-6 to 1e9 kg"
	@echo "make mechanisms  4500 random lifts, ladders, trusses and linkages: is one that moves ever refused?"
	@echo "make mutants   engines wrong on purpose: is each of them named?"
	@echo "make mutants-tonight  four of them, others every night"
	@echo "make past      a wrong commit planted in this history and found, and ten old commits asked: many builds"
	@echo "make mutation SAMPLE=20   the judge's rules, and so many random places of each room, changed: do the tests notice?"
	@echo "make tolerances the numbers contacts are tuned by, times and by ten: which tests and bits notice?"
	@echo "make pairs      how many unchanged changes are blocked beside their base, and how many slower ones found"
	@echo "make detectors  what the judge of run times finds and cries over, beside asv, Otava and ruptures"
	@echo "make aa        twenty nights of one build beside two busy processes: is any of them red?"
	@echo "make crashes   200 commands killed at random moments, on each database: is the history whole?"
	@echo "make hostile   10 000 documents that mean harm, on each database: refused, or stored as what they say?"
	@echo "make executors the whole catalogue on processes and on a Dask cluster of three workers: the same bits?"
	@echo "make package   a wheel built from the archive of the sources, installed by pip, at work, and weighed"
	@echo "make release VERSION=1.2.3   check, test and package, then the changelog dated and the commit tagged"
	@echo "make wasm      the engine for the website's live page (Debian's clang-19; see the page it makes)"
	@echo "make site      publish the website again from what is recorded"
	@echo "make docs      the documentation as a site in build/docs, and the man pages in build/man"
	@echo "make serve     look at the website on this machine"
	@echo "make clean     remove what was built (the database stays)"

nightly: install
	$(BIN)/tracker nightly --db $(DB) --out $(OUT) --mutants bench/mutants.json --recorded bench/recorded

# Each worker has a core of its own: linear algebra with threads beside them only waits for them. Tests as pytest rewrites
# them are kept, or each worker of each run does it again: half of what they are collected in.
test: export OPENBLAS_NUM_THREADS = 1
test: export PYTHONDONTWRITEBYTECODE =
test: develop native-tests
	@! command -v clang++-19 >/dev/null || $(MAKE) --no-print-directory wasm
	@$(BIN)/python -m compileall -q engine tracker scalar_tests migrations tests  # once, not in each of its processes
	$(BIN)/pytest -q -n $(WORKERS) --dist loadfile --no-loadscope-reorder

check: lint tidy

lint: develop
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	sh .ci/subjects
	$(BIN)/python .ci/words.py
	$(BIN)/clang-format --dry-run -Werror $$(git ls-files 'engine/native/*.[ch]pp' 'engine/native/*.inl')

# Over the core; again only when something in it has changed since it passed.
tidy tidy-deep: tools
	$(BIN)/cmake -S engine/native -B build/tidy $(NINJA) -DSPOOK_PYTHON=OFF -DCMAKE_EXPORT_COMPILE_COMMANDS=ON \
	    -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON >/dev/null  # each source as it stands
	sh .ci/tidy $(BIN)/clang-tidy build/tidy $(patsubst tidy-%,%,$@)

# The archive of the sources, a wheel built from it, and that wheel installed by pip into environments of its own.
package: develop
	$(BIN)/pip install -q $$(sed -n 's/^package = \[\(.*\)\]$$/\1/p' pyproject.toml | tr -d '",')
	SPOOK_TEST_REAL_WHEEL=1 $(BIN)/pytest -q -s -p no:cacheprovider --timeout 1800 -m "package or not package" tests/test_packaging.py

docs: develop
	$(BIN)/mkdocs build --quiet
	$(BIN)/python .ci/manual_pages.py build/man "$$($(BIN)/python -m spook_tracker --version | cut -d, -f1 | cut -d" " -f2)"

crashes: develop
	SPOOK_CRASH_ROUNDS=200 $(BIN)/pytest -q -n 2 --timeout 7200 tests/tracker/store/test_crashes.py  # a database each

# Every picture in docs/: of the website of $(DB), and of a red night that is measured once and kept in build/.
RED := build/red-night
pictures: develop
	@! command -v clang++-19 >/dev/null || $(MAKE) --no-print-directory wasm
	$(BIN)/tracker publish --db $(DB) --out $(OUT) --mutants bench/mutants.json --recorded bench/recorded
	mkdir -p $(RED) && rm -f $(RED)/red.db
	$(BIN)/python bench/red_night.py --keep $(RED)/measured --db sqlite:///$(RED)/red.db --out $(RED)/public
	$(BIN)/python bench/pictures.py $(OUT) $(RED)/public

# Every page in every width and theme to axe; `make test` shows it each page in two of the eight.
looks: develop
	@! command -v clang++-19 >/dev/null || $(MAKE) --no-print-directory wasm
	SPOOK_TEST_EVERY_LOOK=1 $(BIN)/pytest -q --timeout 1800 tests/website/test_access.py
	@! command -v clang++-19 >/dev/null || $(BIN)/python bench/live_tasks.py

hostile: develop
	SPOOK_HOSTILE_DOCUMENTS=10000 $(BIN)/pytest -q --timeout 7200 tests/tracker/store/test_hostile.py tests/tracker/store/test_damaged.py

executors: develop
	SPOOK_WHOLE_CATALOGUE=yes $(BIN)/pytest -q --timeout 7200 tests/tracker/measure/test_executors.py -k "same_bits"

release:
	@sh .ci/release --check "$(VERSION)"
	$(MAKE) check test package
	@sh .ci/release "$(VERSION)"

heaps: develop
	$(BIN)/python bench/piles.py

# Two thousand of each kind; others every week.
campaign: develop
	$(BIN)/python bench/campaign.py --this-week --workers 2

campaign-wide: develop
	$(BIN)/python bench/campaign.py --this-week --workers 2 --wide

mechanisms: develop
	$(BIN)/python bench/mechanisms.py

mutants: develop
	$(BIN)/python bench/mutants.py --record bench/mutants.json

# A few of them, chosen by the date: all have had their turn within a fortnight.
mutants-tonight: develop
	$(BIN)/python bench/mutants.py --tonight 4

past: develop
	$(BIN)/python bench/past.py --page docs/past.md

SAMPLE ?= 20  # random mutants of each room
mutation: develop
	$(BIN)/python bench/mutation.py
	$(BIN)/python bench/mutation.py --rooms all --sample $(SAMPLE)

tolerances: develop
	$(BIN)/python bench/tolerances.py $(PARTS)

pairs: develop
	$(BIN)/python bench/pairs.py --page docs/pairs.md

# The other detectors stand in an environment of their own: Otava pins its NumPy.
detectors:
	$(PYTHON) -m venv build/detectors
	build/detectors/bin/pip install -q msgspec asv==0.6.6 apache-otava==0.8.0 ruptures==1.1.10
	PYTHONPATH=. build/detectors/bin/python bench/detectors.py --page docs/detectors.md

aa: develop
	$(BIN)/python bench/aa.py

# Limits hold at once; history and verdicts are kept beside them. What takes minutes runs when named.
BENCHES  ?= $(shell $(BIN)/python -c "from bench.catalogue import QUICK; print(*QUICK)")
BENCH_DB ?= sqlite:///bench.db
BENCH    := $(BIN)/tracker run --catalogue bench.catalogue --db $(BENCH_DB) --workers 1 --memory 0 --time-limit 36000 --all
bench: develop
	$(BENCH) $(BENCHES); kept=$$?; $(BIN)/tracker publish --db $(BENCH_DB) --out public-bench --title "What it costs"; exit $$kept

bench-growth_sqlite bench-growth_postgresql bench-heaps bench-huge_heap bench-replay bench-scenes: bench-%:
	$(MAKE) bench BENCHES=$*

# Every engine that can be had on every scene, and the page that says which is first where; TESTS="door pendulum": those alone.
engines engine-releases: export TRACKER_NODE_MODULES ?= $(CURDIR)/build/engines/node_modules
engines: develop
	.ci/engines all
	$(BIN)/python bench/engines.py $(TESTS:%=--test %) $(BUDGET:%=--minutes %)

# Releases of MuJoCo, Exudyn and Rapier that are not measured yet, the newest of each.
engine-releases: develop
	$(BIN)/python bench/recorded.py --releases

# Both as files in bench/recorded, which the website of `make nightly` shows; with TESTS the rest stays as it was.
recorded: develop
	$(if $(TESTS),$(BIN)/python bench/recorded.py --restore)
	$(MAKE) engines $(if $(TESTS),,engine-releases)
	$(BIN)/python bench/recorded.py

# Where clang-19 and its WebAssembly libraries are; .ci/install-system gets them on Debian.
wasm: tools
	$(BIN)/cmake -S engine/native -B build/wasm $(NINJA) \
	    -DCMAKE_TOOLCHAIN_FILE=$(CURDIR)/engine/native/wasm/toolchain.cmake -DCMAKE_BUILD_TYPE=Release \
	    -DSPOOK_PYTHON=OFF -DSPOOK_WASM=ON
	$(BIN)/cmake --build build/wasm --target live
	cp build/wasm/live.wasm site/static/live.wasm

# The vendored part of three.js again; needs npm and a network.
three-scene:
	mkdir -p build/three && cp site/vendor/three-scene.js build/three/
	cd build/three && npm install --no-save three@0.187.0 esbuild && npx esbuild three-scene.js --bundle --minify \
	    --format=iife --global-name=THREE --legal-comments=none \
	    --banner:js="/* three.js 0.187.0, MIT licence: three-LICENSE.txt */" --outfile=$(CURDIR)/site/static/three-scene.min.js

# The vendored part of the font of formulas again: STIX Two Math, the signs that formulas have.
formulas-font: develop
	mkdir -p build/font && cd build/font && npm install --no-save @fontsource/stix-two-math@5.3.0
	$(BIN)/pip install -q fonttools brotli
	$(BIN)/pyftsubset build/font/node_modules/@fontsource/stix-two-math/files/stix-two-math-latin-400-normal.woff2 \
	    --unicodes="U+20-7E,U+B1,U+B7,U+D7,U+BC-BE,U+393-3C9,U+2032-2033,U+207A-208E,U+210E,U+2153-215A,U+2192,U+2202,U+2211,U+2212,U+221A,U+221E,U+222B,U+2248,U+2264,U+2265,U+22C5,U+1D434-1D467,U+1D6E2-1D71B,U+302,U+307,U+308" \
	    --flavor=woff2 --layout-features=ssty --no-hinting --output-file=site/static/formulas.woff2

site: install
	$(BIN)/tracker publish --db $(DB) --out $(OUT) --mutants bench/mutants.json --recorded bench/recorded

serve: install
	$(BIN)/tracker serve $(OUT)

NINJA = -G Ninja -DCMAKE_MAKE_PROGRAM=$(CURDIR)/$(BIN)/ninja
# Against the library that the Python module was linked from: what is tested is what runs, and compiled once.
native-tests: develop
	$(BIN)/cmake -S engine/native/tests -B build/cpp-tests $(NINJA) -DCMAKE_BUILD_TYPE=Release \
	    -DSPOOK_LIBRARY="$$(ls -t $(CURDIR)/build/cp*/libspook.a | head -n 1)"
	$(BIN)/cmake --build build/cpp-tests
	$(BIN)/ctest --test-dir build/cpp-tests --output-on-failure

sanitize: develop
	$(BIN)/cmake -S engine/native -B build/$@ $(NINJA) -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS="-O1 -g1" \
	    -DSPOOK_PYTHON=OFF -DSPOOK_TESTS=ON -DSPOOK_SANITIZE=address,undefined
	$(BIN)/cmake --build build/$@
	$(BIN)/ctest --test-dir build/$@ --output-on-failure

# The module is laid over the one in the environment by the tests' own path; what Python itself never frees is no leak.
sanitize-python: develop
	$(BIN)/cmake -S engine/native -B build/$@ $(NINJA) -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS="-O1 -g1" \
	    -DPython_EXECUTABLE=$(CURDIR)/$(BIN)/python -DSKBUILD_SABI_VERSION=3.11 -DSPOOK_SANITIZE=address,undefined
	$(BIN)/cmake --build build/$@
	sh .ci/sanitize-python $(BIN)/python build/$@

# Coverage-guided fuzzing: clang with libFuzzer for C++ (.ci/install-system), atheris for Python.
MINUTES ?= 10
fuzz: develop
	$(BIN)/cmake -S engine/native -B build/fuzz $(NINJA) -DCMAKE_CXX_COMPILER=clang++-19 -DCMAKE_BUILD_TYPE=None \
	    -DCMAKE_CXX_FLAGS="-O2 -g1" -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON -DSPOOK_PYTHON=OFF -DSPOOK_FUZZ=ON \
	    -DSPOOK_SANITIZE=address,undefined
	$(BIN)/cmake --build build/fuzz
	$(BIN)/pip install -q atheris
	sh .ci/fuzz $(BIN)/python $(MINUTES) $(TARGETS)

fuzz-keep:
	sh .ci/fuzz $(BIN)/python keep $(TARGETS)

clean:
	rm -rf build $(VENV) public .mypy_cache .ruff_cache .pytest_cache .hypothesis

# --- set-up ---------------------------------------------------------------------------------------------
# The engine carries the commit it was built from, so a new commit or a changed tree builds again.
require:
	@sh .ci/require "$(PYTHON)"

$(VENV)/source-state: FORCE | require
	@mkdir -p $(VENV)
	@{ git rev-parse HEAD; git diff HEAD; git describe --tags --always; cat pyproject.toml; } 2>/dev/null | cksum > $@.new
	@cmp -s $@.new $@ && rm $@.new || mv $@.new $@

$(BIN)/pip: | require
	@test -x $@ || { $(PYTHON) -m venv $(VENV) && $(BIN)/pip install -q --upgrade pip; }

$(VENV)/installed: $(VENV)/source-state | $(BIN)/pip
	@version="$$(sh .ci/version)" && { [ -z "$$version" ] || export VCS_VERSIONING_PRETEND_VERSION="$$version"; } && \
	    echo "installing into $(VENV)" && $(BIN)/pip install -q -e ".[standard]"
	@touch $@

# The same with the tools of development; one installation does for both.
$(VENV)/developed: $(VENV)/source-state | $(BIN)/pip
	@version="$$(sh .ci/version)" && { [ -z "$$version" ] || export VCS_VERSIONING_PRETEND_VERSION="$$version"; } && \
	    echo "installing into $(VENV), with the tools of development" && $(BIN)/pip install -q -e '.[dev]'
	@ln -sf "$$(cd build && ls -t cp*/compile_commands.json | head -n 1)" build/compile_commands.json  # where clangd looks
	@touch $(VENV)/installed $@

# What compiles and reads C++ without Python: what needs no more need not wait for the rest.
$(VENV)/tools: pyproject.toml | $(BIN)/pip
	grep -oE '"(clang-tidy|cmake|ninja)[<>=][^"]*"' pyproject.toml | xargs $(BIN)/pip install -q
	@touch $@

tools: $(VENV)/tools
install: $(VENV)/installed
develop: $(VENV)/developed
