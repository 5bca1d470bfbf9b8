"""One case: switches a virtual machine on, starts the controller on its bus, and records everything until after its end."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import can

from drivetwin.bus.channel import HostedBus, host_bus
from drivetwin.bus.timing.wire import Transmission
from drivetwin.bus.unix_bus import PREFIX
from drivetwin.emulator.clock import Clock, RealtimeClock
from drivetwin.emulator.timed_bus import TIMED_BUSES, TimedBus
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.foundation.scratch import scratch
from drivetwin.hil_tests.bench import EMBEDDED, Bench
from drivetwin.hil_tests.evidence import Ending, Evidence, Run
from drivetwin.hil_tests.scenario import Scenario
from drivetwin.hil_tests.stand.clock import StandClock
from drivetwin.hil_tests.stand.controller_process import ControllerProcess
from drivetwin.hil_tests.stand.controller_start import EXIT_STATUS, ControllerStart
from drivetwin.hil_tests.stand.faults import Striker
from drivetwin.hil_tests.stand.log import FrameLog
from drivetwin.hil_tests.stand.observer import Observer
from drivetwin.hil_tests.stand.stalls import Stalls
from drivetwin.hil_tests.stand.watchdog import Watchdog

LISTEN = 0.02
"""How long the stand waits for a frame before it looks whether the controller still lives [s], where only SYNC moves time."""


class Stand:
    """A virtual machine on a hosted bus, and the controller's starts on it."""

    def __init__(self, bench: Bench, scenario: Scenario, folder: Path, hosted: HostedBus) -> None:
        """`folder` gets controller.log and what the controller writes."""
        self._bench, self._scenario, self._folder, self._hosted = bench, scenario, folder, hosted
        self._realtime = bench.clock == "realtime"
        self._clock: Clock = RealtimeClock() if self._realtime else StandClock()
        self._switched_on = time.monotonic()
        self._log = FrameLog(self._now, self._wall)
        self._joined = self._timed_bus() if bench.bit_timing else self._machine(self._transmit)
        self._virtual = self._joined.virtual if isinstance(self._joined, TimedBus) else self._joined
        self._observer = Observer(self._virtual)
        self._striker = Striker(scenario.faults, self._virtual, self._kill)
        self._stalls = Stalls(self._now)
        self._process: ControllerProcess | None = None
        self._killed = False
        self._left_behind: list[str] = []
        self._operational: frozenset[str] = frozenset()

    def run(self) -> Evidence:
        """Everything from power on to the aftermath. Raises UserError where the controller's command cannot be started."""
        self._joined.power_on()
        self._striker.look(self._observer)
        runs = []
        for start in range(self._scenario.starts):
            runs.append(self._run_controller(start))
            self._operational = self._observer.operational()
            self._let_time_pass(self._scenario.aftermath)
        return self._evidence(tuple(runs))

    # -- the controller -----------------------------------------------------------------------------------------------

    def _run_controller(self, number: int) -> Run:
        self._hold_time()
        self._killed = False
        start = ControllerStart(self._bench, self._scenario, self._folder, number)
        run, left = start.run(self._hosted.name, self._virtual.now, self._serve)
        self._process = None
        self._left_behind += left
        self._drop_what_is_left()
        return run

    def _serve(self, process: ControllerProcess, watchdog: Watchdog) -> Ending:
        """Serve the bus until the controller has exited and all that it sent has been handled, or it was or has to be ended."""
        self._process = process
        self._stalls.begin()
        status = None
        while not self._killed:
            pause = self._joined.wait()
            message = self._hosted.bus.recv(LISTEN if pause is None else pause)
            if message is None:
                if status is not None:  # nothing has come since it exited
                    return EXIT_STATUS.get(status, Ending.CRASHED)
                status = process.status()
                concern = watchdog.silence(self._virtual.now()) if status is None else None
            else:
                concern = watchdog.frame(self._virtual.now())
                if not self._bench.bit_timing:
                    self._log.of_controller(message)
                self._joined.receive(message)
            self._joined.poll()
            self._look()
            if concern is not None:
                return concern
        return Ending.KILLED

    def _drop_what_is_left(self) -> None:
        """Frames of a controller that was ended while it sent: the next one finds a silent bus."""
        while self._hosted.bus.recv(0.0) is not None:
            pass

    def _kill(self) -> None:
        if self._process is not None:
            self._killed = True
            self._process.kill()

    # -- time ---------------------------------------------------------------------------------------------------------

    def _hold_time(self) -> None:
        """In lockstep time belongs to the controller's SYNC."""
        if isinstance(self._clock, StandClock):
            self._clock.free = False

    def _let_time_pass(self, seconds: float) -> None:
        """The machine goes on without a controller."""
        if isinstance(self._clock, StandClock):
            self._clock.free = True
        until = self._virtual.now() + seconds
        self._stalls.begin()
        while self._virtual.now() < until:
            self._joined.poll()
            self._look()
            pause = self._joined.wait()
            if pause is not None:
                time.sleep(pause)
        self._hosted.bus.recv(0.0)

    def _look(self) -> None:
        self._observer.look()
        if self._realtime:
            self._stalls.look()
        self._striker.look(self._observer)
        self._stalls.begin()  # what a fault takes, as a controller's death, is no stall
        self._observer.look_at_network()  # a fault may have reset a node that the next frame starts again

    def _now(self) -> float:
        return self._virtual.now()

    def _wall(self) -> float:
        return time.monotonic() - self._switched_on if self._realtime else 0.0

    def _machine(self, transmit: Callable[[can.Message], None]) -> VirtualMachine:
        return self._bench.virtual_machine(self._clock, transmit)

    def _timed_bus(self) -> TimedBus:
        """The machine behind a wire, whose frames are noted when they are whole."""
        wire = TIMED_BUSES[self._bench.clock]
        return wire(self._bench.bit_rate, self._machine, self._hosted.bus.send, self._of_wire)

    def _of_wire(self, whole: Transmission) -> None:
        """A frame is whole: several may be in one turn, and the node that one has started the next may change."""
        self._observer.look_at_network()
        self._log.of_wire(whole)

    def _transmit(self, message: can.Message) -> None:
        self._log.of_drive(message)
        self._hosted.bus.send(message)

    # -- the end ------------------------------------------------------------------------------------------------------

    def _evidence(self, runs: tuple[Run, ...]) -> Evidence:
        axes = self._bench.virtual.axes
        return Evidence(
            bench=self._bench,
            task=self._scenario.task,
            axes=tuple(axes),
            nodes=tuple(axis.node_id for axis in axes.values()),
            units=tuple(self._bench.units.values()),
            gears=tuple(axis.gear_ratio for axis in axes.values()),
            frames=tuple(self._log.frames),
            truth=self._observer.truth(),
            states=tuple(self._observer.changes),
            struck=self._striker.struck(),
            runs=runs,
            configured=self._observer.configured,
            operational=self._operational,
            friction=self._virtual.plant.truth(),
            left_behind=tuple(self._left_behind),
            timed=self._realtime or self._bench.bit_timing,
            stalls=tuple(self._stalls.found),
            late=self._stalls.late,
        )


@contextmanager
def bus_of(bench: Bench) -> Iterator[HostedBus]:
    """The bus of a case, hosted here; an embedded one has a socket of its own, which is gone at the end."""
    with scratch() as folder:
        hosted = host_bus(f"{PREFIX}{folder}/bus" if bench.bus == EMBEDDED else bench.bus)
        try:
            yield hosted
        finally:
            hosted.close()


def run_case(bench: Bench, scenario: Scenario, folder: Path) -> Evidence:
    """Run one case; `folder`, which exists and is empty, gets controller.log and what the controller writes.

    Raises UserError where bus or controller cannot be started.
    """
    with bus_of(bench) as hosted:
        return Stand(bench, scenario, folder, hosted).run()
