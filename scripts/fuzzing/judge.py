"""What no frame may bring about: the rules that are checked after each of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

import can
import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.canopen.abort_codes import SdoAbort
from drivetwin.emulator.canopen.data_types import Value
from drivetwin.emulator.canopen.object_dictionary import Variable
from drivetwin.emulator.drive.drive import Drive
from drivetwin.emulator.virtual_machine import VirtualMachine
from fuzzing import fsa
from fuzzing.target import Event

Array = NDArray[np.float64]

INITIALISING, STOPPED, OPERATIONAL, PRE_OPERATIONAL = 0x00, 0x04, 0x05, 0x7F
NMT_NAMES = {
    INITIALISING: "initialising",
    STOPPED: "stopped",
    OPERATIONAL: "operational",
    PRE_OPERATIONAL: "pre-operational",
}
STOP, RESET_NODE, RESET_COMMUNICATION = 0x02, 0x81, 0x82
_NMT_TARGETS = {0x01: OPERATIONAL, STOP: STOPPED, 0x80: PRE_OPERATIONAL}
_RESETS = (RESET_NODE, RESET_COMMUNICATION)
NO_NODE_ID = 0xFF
COMMUNICATING = (PRE_OPERATIONAL, OPERATIONAL)
LSS_REQUEST, LSS_ANSWER = 0x7E5, 0x7E4

ANSWERS_OF_A_DRIVE = 127 + 16
"""Frames that a drive may send because of one: a block of 127 segments, its PDOs, its error control, its emergencies."""


class Violation(Exception):  # noqa: N818  # what a judge finds
    """A rule was broken."""


class Judge:
    """Watches a machine; `before` and `after` stand around each event. `seen` counts the states that events met."""

    def __init__(self, virtual: VirtualMachine) -> None:
        self._virtual = virtual
        self._watches = [_DriveWatch(drive, virtual.now) for drive in virtual.drives]
        self._low, self._high, self._give = _reach(virtual)
        self._time = virtual.now()
        self.seen: Counter[str] = Counter()
        self.deepest = 0.0

    def before(self) -> None:
        """Note how things stand."""
        self._time = self._virtual.now()
        for watch in self._watches:
            watch.note()
            self.seen[watch.standing] += 1

    def after(self, event: Event, answers: list[can.Message]) -> None:
        """Raise Violation where something happened that the event does not allow."""
        moved = self._virtual.now() != self._time
        if moved:
            self._check_plant()
        elif event is not None and len(answers) > ANSWERS_OF_A_DRIVE * len(self._watches):
            raise Violation(f"{len(answers)} frames in answer to one")
        for watch in self._watches:
            watch.judge(event, moved)
        if answers:
            self._check_answers(answers)

    def check_values(self) -> None:
        """Raise Violation where an object holds a value that it does not allow."""
        for watch in self._watches:
            for variable in watch.drive.dictionary:
                if variable.size is not None and variable.on_read is None:
                    _check_value(variable)

    def _check_plant(self) -> None:
        data = self._virtual.plant.data
        if not (np.isfinite(data.qpos).all() and np.isfinite(data.qvel).all()):
            raise Violation(f"the plant is not finite: {data.qpos} {data.qvel}")
        if data.warning.number.any():  # MuJoCo starts anew where a state is not finite, and takes no torque that is not
            raise Violation(f"MuJoCo warned of the plant, by kind of mjtWarning: {data.warning.number}")
        position = self._virtual.plant.joint_positions()
        depth = float(np.max(np.maximum(self._low - position, position - self._high) / self._give))
        self.deepest = max(self.deepest, depth)
        if depth > 1.0:
            raise Violation(f"the joints are beyond their stops: {position}, {self._low} .. {self._high}")
        torque = [float(drive.axis.servo.state["torque"]) for drive in self._virtual.drives]
        if not np.isfinite(torque).all():
            raise Violation(f"a drive's torque is not finite: {torque}")

    def _check_answers(self, answers: list[can.Message]) -> None:
        allowed: set[int] = set().union(*(watch.may_send() for watch in self._watches))
        for answer in answers:
            if answer.arbitration_id not in allowed or len(answer.data) > 8:
                raise Violation(f"a frame that no drive may send now: {answer.arbitration_id:03X}h {answer.data.hex()}")


class _DriveWatch:
    """One drive: its states before an event, and the controlwords that reach it."""

    def __init__(self, drive: Drive, now: Callable[[], float]) -> None:
        self.drive = drive
        self._now = now
        self._controlwords: list[int] = []
        self._last = 0
        self._deaf_until = 0.0
        self._hook()
        self.note()

    def note(self) -> None:
        """Before an event."""
        self._controlwords.clear()
        self._nmt = int(self.drive.device.nmt.state)
        self._node = self.drive.device.node_id
        self._fsa = self._state()
        self._sendable = self._identifiers()
        option = self.drive.dictionary.get(0x6007)
        self._lost_option = option.number if option is not None else 0
        self.standing = f"{NMT_NAMES[self._nmt]}, {fsa.NAMES[self._fsa]}"

    def judge(self, event: Event, moved: bool) -> None:
        """After an event."""
        command = self._command(event)
        self._judge_nmt(event, command, moved)
        if self._controlwords and not self._may_be_written(event):
            raise Violation(f"node {self._node}: a controlword came by a frame that carries none")
        self._judge_fsa(command, moved)

    def may_send(self) -> set[int]:
        """CAN-IDs that are the drive's to send, in its states before and after the event."""
        return self._sendable | self._identifiers()

    # -- NMT ----------------------------------------------------------------------------------------------------------

    def _judge_nmt(self, event: Event, command: int | None, moved: bool) -> None:
        """Whether the state is one that the event, perhaps with a command to this node, allows (CiA 301, 7.3.2.2)."""
        now = int(self.drive.device.nmt.state)
        if command is not None:
            if command in _RESETS:
                expected = INITIALISING if self.drive.device.node_id == NO_NODE_ID else PRE_OPERATIONAL
            else:
                expected = _NMT_TARGETS[command]
            self._expect(now, {expected}, f"NMT command {command:02X}h")
            return
        allowed = {self._nmt}
        if moved and self._is_guarded():
            allowed |= {STOPPED} | ({PRE_OPERATIONAL} if self._nmt == OPERATIONAL else set())
        if self._nmt == INITIALISING and event is not None and event.arbitration_id == LSS_REQUEST:
            allowed.add(PRE_OPERATIONAL)
        self._expect(now, allowed, "no NMT command")

    def _command(self, event: Event) -> int | None:
        """The NMT command that an event is to this node."""
        if event is None or not _is_data(event) or event.arbitration_id != 0 or len(event.data) != 2:
            return None
        command, node = event.data
        obeys = self._nmt != INITIALISING and node in (0, self._node) and self._now() >= self._deaf_until
        return command if obeys and command in (*_NMT_TARGETS, *_RESETS) else None

    def _is_guarded(self) -> bool:
        """Whether heartbeats or life guarding may change the state by 1029h."""
        dictionary = self.drive.dictionary
        consumed = any(variable.index == 0x1016 and variable.subindex and variable.number for variable in dictionary)
        guarded = 0x100C in dictionary and dictionary[0x100C].number and dictionary[0x100D].number
        return bool(consumed or guarded)

    def _expect(self, state: int, allowed: set[int], why: str) -> None:
        if state not in allowed:
            raise Violation(f"node {self._node}: NMT {NMT_NAMES[self._nmt]} -> {NMT_NAMES[state]} by {why}")

    # -- CiA 402 ------------------------------------------------------------------------------------------------------

    def _judge_fsa(self, command: int | None, moved: bool) -> None:
        now = self._state()
        if command == RESET_NODE:
            self._last = 0
            allowed = frozenset({fsa.OFF})
        elif command == RESET_COMMUNICATION or (command == STOP and self._nmt != STOPPED):
            allowed = fsa.after_lost_connection(self._fsa, self._lost_option)
        elif self._controlwords or moved:
            allowed = self._reachable(moved)
        else:
            allowed = frozenset({self._fsa})
        if now not in allowed:
            words = ", ".join(f"{word:04X}h" for word in self._controlwords) or "no controlword"
            raise Violation(f"node {self._node}: {fsa.NAMES[self._fsa]} -> {fsa.NAMES[now]} by {words}")

    def _reachable(self, moved: bool) -> frozenset[int]:
        states = frozenset({self._fsa})
        for word in self._controlwords:
            states = frozenset().union(*(fsa.after_controlword(state, word, self._last) for state in states))
            self._last = word
        if not moved:
            return states
        if self._is_guarded():
            states |= frozenset().union(*(fsa.after_lost_connection(state, self._lost_option) for state in states))
        return frozenset().union(*(fsa.after_time(state, self._last) for state in states))

    def _state(self) -> int:
        word = int(self.drive.dictionary[0x6041].read()) & 0x6F
        return word if word in fsa.NAMES else word & 0x4F

    # -- who may say what ---------------------------------------------------------------------------------------------

    def _may_be_written(self, event: Event) -> bool:
        """An SDO to this node, an RPDO that it has, or the SYNC that lets one act."""
        if event is None or not _is_data(event):
            return False
        dictionary, cob_id = self.drive.dictionary, event.arbitration_id
        if self._nmt in COMMUNICATING and cob_id == 0x600 + self._node:
            return True
        rpdos = {dictionary[index, 1].number for index in range(0x1400, 0x1404)}
        syncs = {dictionary[0x1005].number & 0x7FF}
        return self._nmt == OPERATIONAL and cob_id in {number & 0x7FF for number in rpdos if not number >> 31} | syncs

    def _identifiers(self) -> set[int]:
        """CAN-IDs that the drive may send as it stands (CiA 301, 7.3.2.2.5 and 7.3.5)."""
        nmt, node, dictionary = int(self.drive.device.nmt.state), self.drive.device.node_id, self.drive.dictionary
        found = {LSS_ANSWER}
        if nmt != INITIALISING:
            found.add(0x700 + node)
        if nmt in COMMUNICATING:
            found |= {0x580 + node, dictionary[0x1014].number & 0x7FF}
        if nmt == OPERATIONAL:
            found |= {dictionary[index, 1].number & 0x7FF for index in range(0x1800, 0x1804)}
        return found

    def _hook(self) -> None:
        controlword = self.drive.dictionary[0x6040]
        obey = controlword.on_write

        def obey_and_note(value: Value) -> None:
            self._controlwords.append(int(value))
            if obey is not None:
                obey(value)

        controlword.on_write = obey_and_note
        if self.drive.device.lss is not None:
            self.drive.device.lss.on_bit_timing.append(self._note_silence)

    def _note_silence(self, seconds: float) -> None:
        """A node that changes its bit rate hears nothing for a while (CiA 305, activate bit timing)."""
        self._deaf_until = self._now() + seconds


def _reach(virtual: VirtualMachine) -> tuple[Array, Array, Array]:
    """Both end stops of each axis, and how far into one its motor could bring it: at peak torque over the whole travel.

    A stop of the model is a critically damped spring of time constant T: hit at speed v it gives way by v T / e, pressed with
    the force that accelerates the axis by a, by a T^2.
    """
    plant = virtual.plant
    axes = virtual.machine.axes
    joints = [plant.model.joint(axis.joint) for axis in axes.values()]
    low, high = np.array([joint.range for joint in joints]).T
    inertia = np.array([plant.truth()[name]["inertia"] for name in axes])
    acceleration = np.array([axis.motor.peak_torque * axis.gear_ratio for axis in axes.values()]) / inertia
    spring = np.array([plant.model.jnt_solref[joint.id, 0] for joint in joints])
    speed = np.sqrt(2.0 * acceleration * (high - low))
    return low, high, speed * spring / np.e + acceleration * spring**2


def _check_value(variable: Variable) -> None:
    try:
        variable.check(variable.read())
    except SdoAbort as refusal:
        raise Violation(f"{variable} holds {variable.read()}, which it does not allow: {refusal}") from None


def _is_data(event: can.Message) -> bool:
    return not (event.is_error_frame or event.is_extended_id or event.is_fd or event.is_remote_frame)
