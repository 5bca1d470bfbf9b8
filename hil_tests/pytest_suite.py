"""The cases as pytest items; fixtures for own tests: bench, run_scenario, bus, drives, plant_truth, bus_log."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import can
import pytest

from drivetwin.bus.channel import InprocBus
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.drive.drive import Drive
from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.bench import Bench, read_bench
from drivetwin.hil_tests.evidence import BusFrame
from drivetwin.hil_tests.folder import VERDICT
from drivetwin.hil_tests.results.wording import failure_words, measured_words
from drivetwin.hil_tests.run import CaseProcesses
from drivetwin.hil_tests.scenario import Scenario, read_scenario
from drivetwin.hil_tests.stand.log import FrameLog
from drivetwin.hil_tests.stand.observer import Observer
from drivetwin.hil_tests.suite import CASES
from drivetwin.hil_tests.verdict import CaseResult, Outcome

BENCH = pytest.StashKey[Bench]()
PROCESSES = pytest.StashKey[CaseProcesses]()


def pytest_configure(config: pytest.Config) -> None:
    """Read the bench; with no files named on the command line the product's cases are collected beside the own tests."""
    try:
        config.stash[BENCH] = read_bench(config.getoption("--bench"))
    except UserError as error:
        raise pytest.UsageError(str(error)) from None
    config.stash[PROCESSES] = CaseProcesses(1)
    config.add_cleanup(config.stash[PROCESSES].end)
    if config.args_source is not pytest.Config.ArgsSource.ARGS:
        config.args = [*config.args, str(CASES)]


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> ScenarioFile | None:
    """A case stands in NN_group/name.yaml."""
    if file_path.suffix != ".yaml" or not file_path.parent.name.partition("_")[0].isdecimal():
        return None
    return ScenarioFile.from_parent(parent, path=file_path)


class ScenarioFile(pytest.File):
    """One file, one case."""

    def collect(self) -> Iterable[ScenarioItem]:
        """Read it. A case that is wrong is an error of collection."""
        try:
            scenario = read_scenario(self.path, self.config.stash[BENCH])
        except UserError as error:
            raise self.CollectError(str(error)) from None
        yield ScenarioItem.from_parent(self, name=scenario.identity, scenario=scenario)


class RejectedError(Exception):
    """The controller does not meet a requirement."""

    def __init__(self, result: CaseResult) -> None:
        super().__init__(result.title)
        self.result = result


class ScenarioItem(pytest.Item):
    """One case."""

    def __init__(self, *, scenario: Scenario, **told: object) -> None:
        super().__init__(**told)  # type: ignore[arg-type]  # what pytest's from_parent hands on
        self.scenario = scenario

    def runtest(self) -> None:
        """Run and judge it."""
        folder = _out(self.config) / self.scenario.identity
        result = self.config.stash[PROCESSES].run(self.config.stash[BENCH], self.scenario, folder)
        self.user_properties.extend((measured.name, measured_words(measured)) for measured in result.measured)
        if result.outcome is Outcome.SKIPPED:
            pytest.skip(result.skipped_because)
        if result.outcome is Outcome.REJECTED:
            raise RejectedError(result)

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: object = None) -> str:
        """The requirements that were not met, a line each."""
        error = excinfo.value
        if isinstance(error, UserError):
            return str(error)
        if not isinstance(error, RejectedError):
            return str(super().repr_failure(excinfo))
        result = error.result
        lines = [f"{result.title}: {result.requirement}", *(failure_words(failure) for failure in result.failures)]
        return "\n".join([*lines, f"in {result.folder}: {VERDICT}, bus.log, truth, controller.log"])

    def reportinfo(self) -> tuple[Path, None, str]:
        """File and title."""
        return self.path, None, f"{self.scenario.identity}: {self.scenario.title}"


def _out(config: pytest.Config) -> Path:
    return Path(config.getoption("--bench-out")).absolute() / "cases"


# -- a team's own tests --------------------------------------------------------------------------------------------------


@pytest.fixture(scope="session")
def bench(pytestconfig: pytest.Config) -> Bench:
    """The bench."""
    return pytestconfig.stash[BENCH]


@pytest.fixture
def run_scenario(bench: Bench, tmp_path: Path, pytestconfig: pytest.Config) -> Callable[[Path], CaseResult]:
    """Runs the bench's controller through a scenario file, and judges it; the case's folder is below `tmp_path`."""

    def run(path: Path) -> CaseResult:
        scenario = read_scenario(path, bench)
        return pytestconfig.stash[PROCESSES].run(bench, scenario, tmp_path / scenario.identity)

    return run


class InprocBench:
    """The bench's virtual machine on an in-process bus, for a controller within the test; SYNC moves time."""

    def __init__(self, bench: Bench) -> None:
        def connect(transmit: Callable[[can.Message], None]) -> InprocBench:
            self._transmit = transmit
            self.virtual = bench.virtual_machine(SyncClock(), self._send)
            self.log = FrameLog(self.virtual.now, lambda: 0.0)
            self.observer = Observer(self.virtual)
            self.virtual.power_on()
            return self

        self.bus = InprocBus(connect)

    def receive(self, message: can.Message) -> None:
        """A frame of the test's."""
        self.log.of_controller(message)
        self.virtual.receive(message)
        self.observer.look()

    def poll(self) -> None:
        """Only SYNC moves time."""
        self.virtual.poll()

    def wait(self) -> float | None:
        """As the virtual machine's."""
        return self.virtual.wait()

    def _send(self, message: can.Message) -> None:
        self.log.of_drive(message)
        self._transmit(message)


@pytest.fixture
def inproc_bench(bench: Bench) -> Iterator[InprocBench]:
    """The bench's machine within this process, fresh for each test."""
    made = InprocBench(bench)
    yield made
    made.bus.shutdown()


@pytest.fixture
def bus(inproc_bench: InprocBench) -> can.BusABC:
    """The bus, for a controller within the test."""
    return inproc_bench.bus


@pytest.fixture
def drives(inproc_bench: InprocBench) -> list[Drive]:
    """The virtual drives, in the machine's order: dictionary, state machine, hardware to disturb."""
    return inproc_bench.virtual.drives


@pytest.fixture
def plant_truth(inproc_bench: InprocBench) -> Observer:
    """What is true: `truth()` has every sample so far, `speed`, `state` and `homed` of an axis what is now."""
    return inproc_bench.observer


@pytest.fixture
def bus_log(inproc_bench: InprocBench) -> list[BusFrame]:
    """Every frame so far."""
    return inproc_bench.log.frames
