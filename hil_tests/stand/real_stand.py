"""A case on real drives: the stand listens on their bus, sends nothing, and lets the controller do its task."""

from __future__ import annotations

import time
from pathlib import Path

import can
import numpy as np

from drivetwin.bus.channel import open_bus
from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.evidence import BusFrame, BusLost, Ending, Evidence, Run, Truth
from drivetwin.hil_tests.scenario import Scenario
from drivetwin.hil_tests.stand.bus_reading import read_bus, sent_by_drive, strangers_distinguished
from drivetwin.hil_tests.stand.controller_process import ControllerProcess
from drivetwin.hil_tests.stand.controller_start import EXIT_STATUS, ControllerStart
from drivetwin.hil_tests.stand.watchdog import Watchdog

LISTEN = 0.02
"""How long the stand waits for a frame before it looks whether the controller still lives [s]."""


class RealStand:
    """Real drives on a bus that is there, and the controller's starts on it. Time is the wall clock's since the case began."""

    def __init__(self, bench: Bench, scenario: Scenario, folder: Path, bus: can.BusABC, began: float) -> None:
        """`folder` gets controller.log and what the controller writes; `began` [s] is before `bus` was joined."""
        self._bench, self._scenario, self._folder, self._bus = bench, scenario, folder, bus
        self._nodes = tuple(axis.node_id for axis in bench.virtual.axes.values())
        self._began = began
        self._frames: list[BusFrame] = []
        self._left_behind: list[str] = []
        self._lost: BusLost | None = None

    def run(self) -> Evidence:
        """Everything from the controller's start to the aftermath. Raises UserError where its command cannot be started."""
        runs = []
        for number in range(self._scenario.starts):
            start = ControllerStart(self._bench, self._scenario, self._folder, number)
            run, left = start.run(self._bench.bus, self._now, self._serve, self._listen)
            runs.append(run)
            self._left_behind += left
            if self._lost is not None:
                break
            self._listen(self._scenario.aftermath)
        return self._evidence(tuple(runs))

    def _serve(self, process: ControllerProcess, watchdog: Watchdog) -> Ending:
        """Listen until the controller has exited, or has to be ended. The drives' own frames do not say that it lives."""
        while True:
            frame = self._take(LISTEN)
            status = process.status()
            if status is not None:
                self._listen(LISTEN)
                return EXIT_STATUS.get(status, Ending.CRASHED)
            if self._lost is not None:
                return Ending.BUS_LOST
            own = frame is not None and frame.by_controller
            concern = watchdog.frame(self._now()) if own else watchdog.silence(self._now())
            if concern is not None:
                return concern

    def _listen(self, seconds: float) -> None:
        until = self._now() + seconds
        while (left := until - self._now()) > 0.0:
            self._take(left)

    def _take(self, pause: float) -> BusFrame | None:
        """The next frame, noted; one that tells of an error on the wire is none. A bus that is lost stays so."""
        if self._lost is not None:
            time.sleep(pause)
            return None
        try:
            message = self._bus.recv(pause)
        except can.CanError as error:
            self._lost = BusLost(self._now(), str(error))
            return None
        if message is None or message.is_error_frame:
            return None
        heard = message.timestamp - self._began  # by the kernel where it stamps frames, else when they were taken
        identifier, requested = message.arbitration_id, message.dlc if message.is_remote_frame else None
        own = not sent_by_drive(identifier, self._nodes)
        self._frames.append(BusFrame(heard, identifier, bytes(message.data), own, requested, heard))
        return self._frames[-1]

    def _now(self) -> float:
        return time.time() - self._began

    def _evidence(self, runs: tuple[Run, ...]) -> Evidence:
        axes = self._bench.virtual.axes
        reading = read_bus(self._frames, self._bench, runs[-1].ended)
        return Evidence(
            bench=self._bench,
            task=self._scenario.task,
            axes=tuple(axes),
            nodes=self._nodes,
            units=tuple(self._bench.units.values()),
            gears=tuple(axis.gear_ratio for axis in axes.values()),
            frames=strangers_distinguished(self._frames, self._nodes),
            truth=_no_truth(len(axes)),
            states=reading.states,
            struck=(),
            runs=runs,
            configured=reading.configured,
            operational=reading.operational,
            friction={},
            left_behind=tuple(self._left_behind),
            timed=True,
            torque_limits=reading.torque_limits,
            told=reading.told,
            homed=reading.homed,
            bus_lost=self._lost,
        )


def _no_truth(axes: int) -> Truth:
    """A real machine does not tell what is true of it."""
    none = np.empty((0, axes))
    false = np.empty((0, axes), dtype=np.bool_)
    return Truth(np.empty(0), none, none, none, none, none, none, false, false, np.empty((0, axes), dtype=np.int64))


def run_real_case(bench: Bench, scenario: Scenario, folder: Path) -> Evidence:
    """Run one case on the bench's real drives; `folder`, which exists and is empty, gets what the controller writes and says.

    Raises UserError where the bus is not there or the controller cannot be started.
    """
    began = time.time()
    bus = open_bus(bench.bus)
    try:
        return RealStand(bench, scenario, folder, bus, began).run()
    finally:
        bus.shutdown()
