# Two commands are all a newcomer needs: `make run` and `make test`. Both install what is missing into .venv.

PYTHON ?= python3
BIN := .venv/bin
# Small matrices: threads of the linear algebra cost more than they bring.
export OMP_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1
# Where it is set, every process compiles all modules again, and pytest rewrites the assertions of the tests: 12 s a process.
unexport PYTHONDONTWRITEBYTECODE
.DEFAULT_GOAL := run

.PHONY: run test suite check tutorial coverage nightly test-long test-vcan interoperability seeds bench panel-load panel-pictures wafer-handler fuzz fuzz-files unbroken soak realtime-run blind position-only measured sensitivity accept tshark accept-repeats mutants docs lock clean

run: .venv/.installed
	$(BIN)/drivetwin identify --machine scara --out out/identify

TESTS := pytest --numprocesses auto --dist worksteal

# Side by side: tests that wait for a clock leave a processor to the type checker.
test: .venv/.installed
	$(MAKE) --no-print-directory --jobs=2 check suite

suite: .venv/.installed
	$(BIN)/$(TESTS)

check: .venv/.installed
	$(BIN)/ruff check .
	$(BIN)/mypy
	MYPYPATH=$(TYPED_PATH) $(BIN)/mypy $(TYPED)
	for one in $(CONFTESTS); do MYPYPATH=$(TYPED_PATH) $(BIN)/mypy $$one || exit 1; done
	$(BIN)/lint-imports

# The tutorial's own machine, command by command: out/gantry*, out/arm6*. Both, or TUTORIAL="--machine gantry".
tutorial: .venv/.installed
	$(BIN)/python scripts/tutorial.py $(TUTORIAL)

# The same tests with every branch of the product counted that they take, printed by file: out/coverage. On Python 3.11 the
# tracer makes them three times as long.
coverage: .venv/.installed
	rm -rf out/coverage && mkdir -p out/coverage
	$(BIN)/coverage run -m $(TESTS)
	$(BIN)/coverage combine --quiet
	$(BIN)/coverage report

# The type checker reads tests as strictly as the product. To it a conftest.py is the module `conftest`: one at a time.
CONFTESTS := $(shell find tests -mindepth 2 -name conftest.py)
TYPED := $(filter-out $(CONFTESTS),$(shell find tests -name '*.py' -not -path '*/node_modules/*'))
EMPTY :=
TYPED_PATH := scripts:docs/examples:$(subst $(EMPTY) $(EMPTY),:,$(sort $(dir $(TYPED))))

# What takes too long for every change.
nightly: coverage test-long tutorial mutants

# Tests that repeat a claim over more cases than they do in `make test`, at their full length.
LONG := $(addprefix tests/,blind/test_record.py blind/wide/test_wide_draw.py diagnosis/excitation/test_distinguished.py \
	diagnosis/test_channel.py diagnosis/test_diagnose.py diagnosis/test_invariances.py diagnosis/test_restart.py \
	drive_profiles/test_eds_fuzz.py drivetwin/test_container.py emulator/canopen/test_fuzz_frames.py hil_tests/test_arithmetic.py \
	identification/test_calibration.py integration/test_effect_of_ones_own.py integration/test_wafer_handler.py)
test-long: .venv/.installed
	DRIVETWIN_LONG=1 DRIVETWIN_REPETITIONS=150 $(BIN)/pytest --numprocesses auto --dist worksteal $(LONG)

# The bus tests on a real vcan0: of this kernel, or of a small User-Mode Linux booted from Debian packages.
test-vcan: .venv/.installed
	scripts/vcan/test-vcan

# Every foreign stack that is on this machine, those of no package registry too: lely-core (by pkg-config), its coctl, and canopend
# and cocomm (on the PATH), gocanopen (GOCANOPEN=FOLDER of its sources). out/interoperability/*.xml says which tests ran and which
# client was missing; its last lines are the figures, and each cell of the table that nothing has shown.
interoperability: .venv/.installed
	rm -f out/interoperability/*.xml
	scripts/vcan/install-foreign
	$(BIN)/pytest tests/integration/test_lely.py tests/integration/test_boot_order.py tests/integration/test_modbus_clients.py \
		tests/integration/test_foreign_master_402.py tests/integration/test_foreign_master_modes.py -rs \
		--junitxml=out/interoperability/integration.xml
	scripts/vcan/test-vcan -rs --junitxml=out/interoperability/vcan.xml
	$(BIN)/python scripts/interoperability_report.py

seeds: .venv/.installed
	$(BIN)/python scripts/seeds.py --seeds 20 --out out/seeds

bench: .venv/.installed
	$(BIN)/python scripts/bench.py

# Late cycles with a panel and without in turn, its memory, a page that reads nothing beside one that does; about 22 minutes.
panel-load: .venv/.installed
	$(BIN)/python scripts/panel_load.py

# The panel's pictures in docs/images, of the product as it runs, by headless Chromium; some five minutes.
panel-pictures: .venv/.installed
	$(BIN)/python scripts/panel_pictures.py

# A million random and mutated frames at a live emulator, judged after each one, then twenty thousand at the Modbus ports.
fuzz: .venv/.installed
	$(BIN)/python scripts/fuzz.py --frames 1000000 --seed 0 --modbus

# Thousands of spoiled files at everything that reads a foreign file.
fuzz-files: .venv/.installed
	$(BIN)/python scripts/fuzz_files.py --cases 2000 --seed 0

# An hour of simulated life with random faults, commands killed at random moments, disks that fail: docs/reliability.md.
unbroken: .venv/.installed
	PYTHONPATH=scripts $(BIN)/python -m unbroken --soak 3600 --kills 20 --out out/unbroken

# Of it the hour of simulated life alone, whose memory has to stay flat; some 15 minutes: out/soak.
soak: .venv/.installed
	PYTHONPATH=scripts $(BIN)/python -m unbroken --soak 3600 --kills 0 --no-disks --out out/soak

# Three moving axes at 1 kHz on the wall clock for ten minutes, in two processes; wants a machine that does nothing else.
realtime-run: .venv/.installed
	$(BIN)/python scripts/realtime_run.py --out out/realtime-run

# The machine of the published study, link by link through the bus: out/wafer-handler/report.html and wafer-handler.json.
wafer-handler: .venv/.installed
	PYTHONPATH=docs/examples $(BIN)/python -m wafer_handler --out out/wafer-handler

# 300 machines whose true effects are withheld, recorded over the bus and diagnosed: out/blind/score.html; resumes where it was.
blind: .venv/.installed
	$(BIN)/drivetwin blind --generator bus --cases 300 --seed 2030 --nominal both --out out/blind

# 40 blind cases by position and demand alone, a line a case; resumes where it was.
position-only: .venv/.installed
	$(BIN)/python scripts/position_only.py write --count 40 --seed 5201 --family rotary --family pendulum --family linear \
		--family lift --without coupling --out out/position_only
	$(BIN)/python scripts/position_only.py ask --way without --out out/position_only

# Machines whose gap to their simulation is known, diagnosed and held against least squares: out/measured/score.html; resumes.
measured: .venv/.installed
	PYTHONPATH=scripts $(BIN)/python -m measured --data ../shared/data --out out/measured

# Each number of the diagnosis's settings halved and doubled on measured and blind cases: docs/sensitivity.md; resumes where it was.
SENSITIVE := kinova_joint_7 kinova_joint_5 epos2_turn_a epos2_turn_b epos_screw laas_no_gap
sensitivity: .venv/.installed
	test -e out/sensitivity/blind/key.json || $(BIN)/python -m drivetwin.blind.wide.write --count 4 --seed 5 --family rotary \
		--family linear --out out/sensitivity/blind
	$(BIN)/python scripts/sensitivity.py --data ../shared/data $(addprefix --measured ,$(SENSITIVE)) --blind out/sensitivity/blind

# The reference controller through the acceptance suite: out/accept/report.html and junit.xml.
accept: .venv/.installed
	$(BIN)/drivetwin accept --bench hil_tests/benches/scara.yaml --out out/accept

# Every bus log of that suite as Wireshark's CANopen dissector reads it; needs tshark.
tshark: accept
	$(BIN)/python scripts/tshark_logs.py out/accept

# Twenty times in lockstep, bit for bit the same, and once in real time.
accept-repeats: .venv/.installed
	$(BIN)/python scripts/accept_repeats.py --out out/accept_repeats

# Broken controllers through the same suite, and who catches them: out/mutants/table.md; resumes where it was.
mutants: .venv/.installed
	$(BIN)/python -m drivetwin.mutants.table --jobs 2 --out out/mutants

.venv/.installed: requirements.lock pyproject.toml
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@

# The documentation as a site, every link checked: out/site/index.html.
docs: .venv/.installed
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict

# Renew the lock file (needs uv); hashes only, no index host.
lock:
	uv pip compile pyproject.toml --extra dev --universal --python-version 3.11 --generate-hashes \
		--no-emit-index-url --no-header --no-annotate --output-file requirements.lock

clean:
	rm -rf .venv out
