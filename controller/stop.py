"""Emergency stop: quick-stops and disables every drive that answers, whatever else has failed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress

from drivetwin.controller.cycle import Cycle
from drivetwin.controller.drive_node import FAULT, SWITCH_ON_DISABLED, DriveNode
from drivetwin.controller.motion import DISABLE_VOLTAGE, QUICK_STOP, STATE_TIMEOUT, disable
from drivetwin.foundation.errors import InterruptedByUserError, UserError

WITHOUT_VOLTAGE = (SWITCH_ON_DISABLED, FAULT)


@contextmanager
def stopped_at_the_end(cycle: Cycle, drives: Sequence[DriveNode]) -> Iterator[None]:
    """Every axis quick-stopped and without voltage afterwards, however the block ends.

    Raises what the block raised with what became of the axes; for Ctrl-C InterruptedByUserError.
    """
    try:
        yield
        disable(cycle, drives)
    except KeyboardInterrupt:
        raise InterruptedByUserError(f"interrupted; {stop(cycle, drives)}") from None
    except UserError as error:
        stopped = type(error)(f"{error}; {stop(cycle, drives)}")
        stopped.__dict__ |= error.__dict__  # which node it was
        raise stopped from None
    except BaseException:
        stop(cycle, drives)
        raise


def stop(cycle: Cycle, drives: Sequence[DriveNode]) -> str:
    """Quick-stop, then take the voltage off; a drive that is silent or in fault does not keep the others from it.

    Returns what became of the axes, for the person at the bench.
    """
    for drive in drives:
        drive.operating = drive.streaming = False
        drive.clear_offsets()
        drive.controlword = QUICK_STOP
    for _ in range(round(STATE_TIMEOUT / cycle.period)):
        _run(cycle)
        if all(drive.state in WITHOUT_VOLTAGE for drive in drives if drive.answers):
            break
    for drive in drives:
        drive.controlword = DISABLE_VOLTAGE
    for _ in range(SYNCS_TO_TELL):
        _run(cycle)
    doubtful = [drive for drive in drives if not drive.answers or drive.state not in WITHOUT_VOLTAGE]
    doubtful = [drive for drive in doubtful if not _stopped_by_sdo(cycle, drive)]
    doubtful += [drive for drive in _still_moving(cycle, drives) if drive not in doubtful]
    if not doubtful:
        return "every axis was stopped and is without voltage"
    names = ", ".join(drive.where() for drive in doubtful)
    return f"NOT KNOWN TO BE STOPPED: {names}; every other axis was stopped and is without voltage"


def _stopped_by_sdo(cycle: Cycle, drive: DriveNode) -> bool:
    """Whether a drive that takes no PDOs any more, as one that is not operational, could be stopped by SDO."""
    with suppress(UserError, KeyboardInterrupt):
        drive.leave_operational()
        for word in (QUICK_STOP, DISABLE_VOLTAGE):
            for _ in range(TRIES):
                drive.command(word)
                if drive.state in WITHOUT_VOLTAGE:
                    return True
                for _ in range(round(STATE_TIMEOUT / TRIES / cycle.period)):
                    _run(cycle)
    return False


def _still_moving(cycle: Cycle, drives: Sequence[DriveNode]) -> list[DriveNode]:
    """Wait until every axis that can be seen stands, and return those that do not get there.

    An axis that has no voltage any more is taken along by one that still brakes.
    """
    seen = [drive for drive in drives if drive.answers]
    moving = seen
    cycles = max(1, round(REST_FOR / cycle.period))
    seconds = cycles * cycle.period
    for _ in range(round(STATE_TIMEOUT / seconds)):
        before = [drive.position for drive in seen]
        for _ in range(cycles):
            _run(cycle)
        moving = [drive for drive, was in zip(seen, before, strict=True) if not _stands(drive, was, seconds)]
        if not moving:
            break
    return moving


def _stands(drive: DriveNode, was: int, seconds: float) -> bool:
    """Whether the axis is where it was so many seconds ago, or within what its encoder resolves."""
    way = abs(drive.position - was) * drive.unit
    return way <= max(drive.unit, REST_SPEED * drive.axis.max_speed * seconds)


REST_FOR, REST_SPEED = 0.02, 0.002
"""An axis stands that was slower for so long [s], and for a cycle at least, than this share of its full speed."""

TRIES = 10
"""How often a drive's state is asked for within `STATE_TIMEOUT`."""

SYNCS_TO_TELL = 2
"""One at which the controlword takes effect, and one more for the statusword to come back."""


def _run(cycle: Cycle) -> None:
    """A cycle, whatever it reports; it goes to all drives, and says each trouble once."""
    with suppress(UserError, KeyboardInterrupt):
        cycle.run()
