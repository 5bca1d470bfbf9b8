"""What the controller checks in every cycle, from SYNC to SYNC. Each check reports one fault of one drive, once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from drivetwin.controller.drive_node import OPERATION_ENABLED, STATE_MASK, DriveNode
from drivetwin.controller.error_control import NODE_IS_LOST_AFTER
from drivetwin.controller.liveness import NMT_STATES, OPERATIONAL
from drivetwin.controller.trouble import DriveFaultError, TroubleError

HINTS = {
    0x8611: ", following error: is the axis blocked, or its torque limit too low for gravity and friction?",
    0x8130: ", heartbeat or guarding lost",
    0x2310: ", overcurrent",
    0x2350: ", I2t: more torque for longer than the motor withstands",
    0x3220: ", undervoltage of the DC link",
}
"""What the commonest error codes say (CiA 402-2, table 'Error codes')."""

ENCODER_ERRORS = range(0x7300, 0x7400)
"""Error codes of sensors (CiA 402-2, table 'Error codes'), after which a position is not to be relied on."""

MISSED = 3
"""Cycles in a row without a PDO of a drive that are one too many; a frame or two may be lost."""

MOST_CHANGE = 1.5
"""Change of speed from cycle to cycle, in full speeds of the axis, that is none of the axis: one that hits an obstacle loses
its speed, and one that comes free lurches, but by less than that."""

AT_LIMIT, AT_LIMIT_FOR = 0.95, 0.3
"""Share of the torque limit, and for how long [s]: an acceleration is over by then, an axis that is blocked is not."""

VOLTAGE_ENABLED = 1 << 4

STATE_AND_VOLTAGE, ENABLED_WITH_VOLTAGE = STATE_MASK | VOLTAGE_ENABLED, OPERATION_ENABLED | VOLTAGE_ENABLED
"""Bits of the statusword, and what they are while all is well."""


@dataclass
class Watch:
    """What is counted of one drive, from cycle to cycle of `period` [s]."""

    drive: DriveNode
    period: float
    missed: int = 0
    owed: int = 0
    surplus: int = 0
    at_limit: float = 0.0
    position: int | None = None
    speed: float = 0.0
    age: float = 0.0

    def begin(self) -> None:
        """Count anew."""
        self.missed = self.owed = self.surplus = 0
        self.at_limit = 0.0
        self.position, self.speed = None, 0.0

    def close(self) -> None:
        """The cycle is over: what came in it beyond the one PDO that SYNC asked for, or that was owed by the last ones."""
        beyond = self.drive.received - 1
        if beyond <= 0:
            return
        late = min(beyond, self.owed)
        self.owed -= late
        self.surplus = beyond - late

    def count(self, elapsed: float) -> None:
        """The inputs of a cycle, whose SYNC came so long after the last one [s], are there, or are not."""
        drive = self.drive
        drive.liveness.silence += self.period
        self.age += max(elapsed, self.period)  # drives go by a full cycle where a SYNC makes up for a late one
        if drive.received == 0:
            self.missed += 1
            self.owed = min(self.owed + 1, MISSED)
        else:
            self.missed = 0
        limited = drive.operating and abs(drive.torque) >= AT_LIMIT * drive.torque_limit
        self.at_limit = self.at_limit + self.period if limited else 0.0

    def keep(self) -> None:
        """The position of this cycle is sound: the next one has to be near it."""
        if not self.drive.received:
            return
        if self.position is not None:
            self.speed = (self.drive.position - self.position) / self.age
        self.position, self.age = self.drive.position, 0.0


Check = Callable[[Watch], TroubleError | None]


def supervise(watch: Watch, elapsed: float) -> None:
    """Raise TroubleError for the first thing that is wrong with a drive, `elapsed` [s] after the SYNC before."""
    watch.count(elapsed)
    if not is_plainly_sound(watch):
        for check in CHECKS:
            trouble = check(watch)
            if trouble is not None:
                raise trouble
    watch.keep()


def is_plainly_sound(watch: Watch) -> bool:
    """Whether it can be seen at one glance, which every cycle takes, that no check finds anything; they are asked where not."""
    drive, liveness = watch.drive, watch.drive.liveness
    if drive.emergencies or watch.surplus or watch.missed >= MISSED or watch.at_limit >= AT_LIMIT_FOR or drive.outside:
        return False
    if liveness.expected and (
        liveness.boots or liveness.silence >= NODE_IS_LOST_AFTER or liveness.state not in (None, OPERATIONAL)
    ):
        return False
    if drive.operating and drive.statusword & STATE_AND_VOLTAGE != ENABLED_WITH_VOLTAGE:
        return False
    if not drive.streaming:
        return True
    if watch.position is None or _has_jumped(watch, watch.position):
        return False
    limit = drive.following_error_limit
    return limit is None or drive.following_error <= limit


def rebooted(watch: Watch) -> TroubleError | None:
    """A boot-up message that nobody asked for: the node has lost its configuration."""
    drive = watch.drive
    if not (drive.liveness.expected and drive.liveness.boots):
        return None
    drive.liveness.expected = drive.answers = drive.homed = drive.operating = False
    return _trouble(drive, "has booted by itself: was it reset, or without power? Its configuration and its zero are gone")


def emergency(watch: Watch) -> TroubleError | None:
    """An EMCY other than 'error reset'."""
    drive = watch.drive
    if not drive.emergencies:
        return None
    told = [each.code for each in drive.emergencies]
    drive.emergencies.clear()
    drive.operating = False
    if any(code in ENCODER_ERRORS for code in told):
        drive.homed = False
    codes = ", ".join(f"{code:04X}h" for code in told)
    hint = next((HINTS[code] for code in told if code in HINTS), "")
    message = f"{drive.where()} reports EMCY {codes}{hint} (statusword {drive.statusword:04X}h)"
    return DriveFaultError(message, drive.node_id, told[0])


def left_operation(watch: Watch) -> TroubleError | None:
    """The statusword says another state than operation enabled, and nobody asked for it."""
    drive = watch.drive
    if not drive.operating or drive.state == OPERATION_ENABLED:
        return None
    drive.operating = False
    return DriveFaultError(f"{drive.where()} has left operation by itself (statusword {drive.statusword:04X}h)", drive.node_id)


def without_voltage(watch: Watch) -> TroubleError | None:
    """Bit 4 of the statusword: the power stage of an enabled drive has no voltage."""
    drive = watch.drive
    if not drive.operating or drive.statusword & VOLTAGE_ENABLED:
        return None
    drive.operating = False
    return DriveFaultError(
        f"{drive.where()} is enabled and has no voltage on its power stage (statusword {drive.statusword:04X}h)", drive.node_id
    )


def nmt_state(watch: Watch) -> TroubleError | None:
    """A heartbeat of another state than operational: set-points do not reach the drive."""
    drive = watch.drive
    state = drive.liveness.state
    if not drive.liveness.expected or state in (None, OPERATIONAL):
        return None
    drive.liveness.expected = drive.answers = False
    told = NMT_STATES.get(int(state), f"state {state:02X}h")
    return _trouble(drive, f"is NMT {told} and was started: who else sends NMT commands on this bus?")


def silent(watch: Watch) -> TroubleError | None:
    """No TPDO for `MISSED` SYNCs in a row."""
    drive = watch.drive
    if not drive.answers or watch.missed < MISSED:
        return None
    drive.answers = False
    return _trouble(
        drive, f"sent no PDO for {MISSED} SYNCs ({MISSED * watch.period * 1e3:g} ms): is it powered, connected, operational?"
    )


def heartbeat_lost(watch: Watch) -> TroubleError | None:
    """A drive that was told to beat does not."""
    liveness = watch.drive.liveness
    if not liveness.expected or liveness.silence < NODE_IS_LOST_AFTER:
        return None
    liveness.expected = False
    return _trouble(watch.drive, f"sent no heartbeat for {liveness.silence:.3g} s, although configured to: is it alive?")


def one_too_many(watch: Watch) -> TroubleError | None:
    """Two different samples for one SYNC."""
    count, watch.surplus = watch.surplus, 0
    if not count:
        return None
    drive = watch.drive
    return _trouble(
        drive,
        f"sent {count + 1} PDOs for one SYNC: is there a second SYNC producer on the bus, or a second device with node-ID "
        f"{drive.node_id}?",
    )


def jump(watch: Watch) -> TroubleError | None:
    """A position that the axis cannot have come to since the last one."""
    drive = watch.drive
    if not drive.streaming or watch.position is None or not drive.received:
        return None
    if not _has_jumped(watch, watch.position):
        return None
    way = abs(drive.position - watch.position) * drive.unit
    drive.streaming = drive.homed = False
    return _trouble(
        drive,
        f"reports a position {way:.4g} from where it was {watch.age * 1e3:.3g} ms before, and cannot have moved that far: "
        "is its encoder sound?",
    )


def _has_jumped(watch: Watch, before: int) -> bool:
    drive = watch.drive
    expected = before + watch.speed * watch.age
    return abs(drive.position - expected) * drive.unit > MOST_CHANGE * drive.axis.max_speed * watch.age + drive.unit


def following_error(watch: Watch) -> TroubleError | None:
    """The axis is further from its set-point than it may be."""
    drive = watch.drive
    limit = drive.following_error_limit
    if not drive.streaming or limit is None or drive.following_error <= limit:
        return None
    error = drive.following_error * drive.unit
    drive.streaming = False
    return _trouble(drive, f"is {error:.4g} off its set-point, and may be {limit * drive.unit:.4g}: is the axis blocked?")


def outside_travel(watch: Watch) -> TroubleError | None:
    """The axis has left the travel that it was told to stay within."""
    drive = watch.drive
    if not drive.outside:
        return None
    low, high = (limit * drive.unit for limit in drive.allowed or (0, 0))
    drive.allowed = None
    return _trouble(drive, f"is at {drive.position * drive.unit:.6g}, outside {low:.6g} .. {high:.6g} that it may use")


def jammed(watch: Watch) -> TroubleError | None:
    """The torque is at its limit for longer than any planned motion asks for."""
    if watch.at_limit < AT_LIMIT_FOR:
        return None
    drive = watch.drive
    watch.at_limit = 0.0
    given, limit = drive.joint_torque(abs(drive.torque)), drive.joint_torque(drive.torque_limit)
    return _trouble(drive, f"gives {given:.4g} of {limit:.4g} for {AT_LIMIT_FOR:g} s: is the axis jammed, or loaded too much?")


CHECKS: tuple[Check, ...] = (
    rebooted,
    emergency,
    left_operation,
    without_voltage,
    nmt_state,
    silent,
    heartbeat_lost,
    one_too_many,
    jump,
    following_error,
    outside_travel,
    jammed,
)
"""In this order: what says most of the cause comes first."""


def _trouble(drive: DriveNode, what: str) -> TroubleError:
    return TroubleError(f"{drive.where()} {what}", drive.node_id)
