"""One start of the controller: writes its task, watches the process until it ends, keeps the outcome."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.evidence import Ending, Run
from drivetwin.hil_tests.scenario import Scenario
from drivetwin.hil_tests.stand.controller_process import GRACE, ORPHANED, ControllerProcess, command_line
from drivetwin.hil_tests.stand.task_file import write_task
from drivetwin.hil_tests.stand.watchdog import Watchdog

EXIT_STATUS = {0: Ending.DONE, 2: Ending.REFUSED, 3: Ending.STOPPED}
"""What a controller's exit status says; any other is a crash."""

Serve = Callable[[ControllerProcess, Watchdog], Ending]
"""Attends to the bus until the controller has ended, or has to be."""


class ControllerStart:
    """The start `number` (from 0 on) of a case; `folder` gets controller.log and what the controller writes."""

    def __init__(self, bench: Bench, scenario: Scenario, folder: Path, number: int) -> None:
        self._bench, self._scenario, self._folder, self._number = bench, scenario, folder, number

    def run(
        self, bus: str, now: Callable[[], float], serve: Serve, meanwhile: Callable[[float], None] = time.sleep
    ) -> tuple[Run, list[str]]:
        """How it ended, by the clock `now` [s], and what it left behind; `meanwhile` for some seconds while it is being ended.

        Raises UserError where it cannot be started.
        """
        out = self._folder / ("controller" if self._number == 0 else f"controller_{self._number + 1}")
        out.mkdir()
        task_file = out / "task.json"
        write_task(self._scenario.task, self._bench, task_file)
        places = {"task_file": str(task_file), "bus": bus, "clock": self._bench.clock, "out": str(out)}
        began = now()
        silence = self._scenario.silence or self._bench.timeouts.silence
        watchdog = Watchdog(self._bench.timeouts, silence, self._bench.bit_rate, began)
        command = command_line(self._bench, places)
        left = []
        log, grace, orphaned = self._folder / "controller.log", GRACE[self._bench.drives], ORPHANED[self._bench.drives]
        with ControllerProcess(command, self._bench.path.parent, log, grace, meanwhile, orphaned) as process:
            ending = serve(process, watchdog)
            ended = now()
            if process.end():
                left.append(f"start {self._number + 1}: processes of its own that still lived")
            status, words = process.status(), process.last_words()
        last_words = "\n".join(filter(None, (watchdog.told(ending), words)))
        return Run(ending, status, began, ended, last_words, out), left
