"""Takes a drive that tells a fault out of the motion, and goes on with the others."""

from __future__ import annotations

from controller import cycle
from controller.supervision import Watch, supervise
from controller.trouble import DriveFaultError
from mutants.base import CaughtBy
from mutants.surgery import replace

CAUGHT_BY = CaughtBy("08_faults.drive_fault", "stopped")


def break_controller() -> None:
    def broken(watch: Watch, elapsed: float) -> None:
        try:
            supervise(watch, elapsed)
        except DriveFaultError:
            watch.drive.operating = watch.drive.streaming = False

    replace(cycle, "supervise", broken)
