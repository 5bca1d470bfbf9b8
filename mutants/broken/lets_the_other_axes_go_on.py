"""Takes a drive that reports a fault out of the motion, and continues with the others."""

from __future__ import annotations

from drivetwin.controller import cycle
from drivetwin.controller.supervision import Watch, supervise
from drivetwin.controller.trouble import DriveFaultError
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("08_faults.drive_fault", "stopped")


def break_controller() -> None:
    def broken(watch: Watch, elapsed: float) -> None:
        try:
            supervise(watch, elapsed)
        except DriveFaultError:
            watch.drive.operating = watch.drive.streaming = False

    replace(cycle, "supervise", broken)
