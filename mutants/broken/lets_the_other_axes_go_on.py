"""Takes a drive that reports a fault out of the motion, and continues with the others."""

from __future__ import annotations

from drivetwin.controller import cycle
from drivetwin.controller.supervision import Watch, supervise
from drivetwin.controller.trouble import DriveFaultError
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("08_faults.drive_fault", "stopped")


@instead_of(cycle, "supervise")
def break_controller(_original: Original, watch: Watch, elapsed: float) -> None:
    try:
        supervise(watch, elapsed)
    except DriveFaultError:
        watch.drive.operating = watch.drive.streaming = False
