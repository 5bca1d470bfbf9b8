"""What frames reveal about real drives: states, configuration, and whether they are operational."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from drivetwin.drive_profiles import DataType, DriveProfile
from drivetwin.emulator.canopen.data_types import decode, size
from drivetwin.emulator.drive.state_machine import State, Statusword
from drivetwin.emulator.machine import Axis
from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.evidence import BusFrame, Configuration, StateChange, TorqueLimit
from drivetwin.hil_tests.stand.configuration import PDO_INVALID, configuration

NMT, HEARTBEAT = 0x000, 0x700
START, STOP, PRE_OPERATIONAL, RESET_NODE, RESET_COMMUNICATION = 1, 2, 128, 129, 130
"""NMT commands (CiA 301, 7.2.8.3.1)."""
BOOT_UP, OPERATIONAL = 0, 5
"""States of the heartbeat (CiA 301, 7.2.8.3.2.2)."""

SDO_REQUEST, SDO_ANSWER = 0x600, 0x580
CAN_ID = 0x7FF
CONSUMERS = bytes.fromhex("1610")
"""1016h, consumer heartbeat time, as SDO names it."""
STATUSWORD = (0x6041, 0)
STATE_BITS = 0x6F
HOMING_MODE = 6
"""Mode of operation 6060h (CiA 402-2)."""
START_HOMING = 0x1F
"""Controlword: enable operation, and bit 4."""
MAX_TORQUE, RATED_TORQUE = (0x6072, 0), (0x6076, 0)
"""Thousandths of the rated torque; mN·m of the motor (CiA 402-2)."""

OF_DRIVES = (0x080, 0x180, 0x280, 0x380, 0x480, SDO_ANSWER, HEARTBEAT)
"""COB-IDs, less the node-ID, of EMCY, TPDOs, SDO answers and heartbeats (CiA 301, 7.3.3)."""
LSS_ANSWER = 0x7E4


def sent_by_drive(identifier: int, nodes: Iterable[int]) -> bool:
    """Whether a frame comes of one of the drives, by the predefined COB-IDs: on a bus nobody says who sent it."""
    return identifier == LSS_ANSWER or any(identifier - node in OF_DRIVES for node in nodes)


def strangers_distinguished(frames: Sequence[BusFrame], nodes: Sequence[int]) -> tuple[BusFrame, ...]:
    """The frames, of which a node beats that is no drive and that no drive was told to watch (1016h): not the controller's."""
    watched = {_watched(frame.data) for frame in frames if frame.identifier - SDO_REQUEST in nodes}
    return tuple(
        frame._replace(by_controller=False)
        if 0 < frame.identifier - HEARTBEAT < 0x80 and frame.identifier - HEARTBEAT not in watched
        else frame
        for frame in frames
    )


def _watched(request: bytes) -> int | None:
    """The node whose heartbeat an SDO request lets a drive consume (1016h, bits 16 to 22; CiA 301, 7.5.2.19)."""
    asked = _request(request)
    if asked is None or asked.value is None or asked.address[:2] != CONSUMERS:
        return None
    return int.from_bytes(asked.value, "little") >> 16 & 0x7F


@dataclass(frozen=True)
class BusReading:
    """What was read: changes of state, the configuration of each axis's node, axes that were operational at the end, what
    drives may give, and axes whose drives have told their state, and have homed, since they booted."""

    states: tuple[StateChange, ...]
    configured: dict[str, Configuration]
    operational: frozenset[str]
    torque_limits: tuple[TorqueLimit, ...]
    told: frozenset[str]
    homed: frozenset[str]


def read_bus(frames: Sequence[BusFrame], bench: Bench, end: float) -> BusReading:
    """Read all frames of a case whose controller ended at `end` [s].

    A node is operational at the end by its first heartbeat after it, or where there is none by its last.
    """
    nodes = {axis.node_id: _Node(name, axis, bench.drive_type) for name, axis in bench.virtual.axes.items()}
    for frame in frames:
        if frame.identifier == NMT:
            for node in nodes.values():
                node.hear_network(frame)
        elif (node_id := frame.identifier & 0x7F) in nodes:
            nodes[node_id].hear(frame, end)
    return BusReading(
        states=tuple(sorted((change for node in nodes.values() for change in node.changes), key=lambda change: change.time)),
        configured={node.axis: node.configured for node in nodes.values() if node.configured is not None},
        operational=frozenset(node.axis for node in nodes.values() if node.beat == OPERATIONAL),
        torque_limits=tuple(limit for node in nodes.values() for limit in node.torque_limits),
        told=frozenset(node.axis for node in nodes.values() if node.state is not None),
        homed=frozenset(node.axis for node in nodes.values() if node.homing.attained),
    )


class _Write(NamedTuple):
    """An SDO request that waits for its answer; `value` is None where it reads, or writes more than 4 bytes."""

    address: bytes
    value: bytes | None


class _Homing:
    """Homing of one drive, as the bus tells of it (CiA 402-2, clause 'Homing mode')."""

    def __init__(self) -> None:
        self.attained = False
        self._mode: int | None = None
        self._started = False
        self._bit_12 = False

    def mode(self, mode: int) -> None:
        """6060h as it was written, or either as the drive shows it: another mode ends homing."""
        self._started = self._started and mode == HOMING_MODE
        self._mode = mode

    def controlword(self, word: int) -> None:
        """Enabled and bit 4: homing starts."""
        self._started = self._started or (self._mode == HOMING_MODE and word & START_HOMING == START_HOMING)

    def statusword(self, word: int) -> None:
        """Attained where bit 12 rises once homing has started: a drive that was homed before may show it until then."""
        risen = bool(word & Statusword.MODE_BIT_12) and not self._bit_12
        self._bit_12 = bool(word & Statusword.MODE_BIT_12)
        if self._started and risen and not word & Statusword.MODE_BIT_13:
            self.attained = True


class _Node:
    """One drive, as the bus tells of it. What it said before a reset no longer holds."""

    def __init__(self, name: str, axis: Axis, profile: DriveProfile) -> None:
        self.axis = name
        self.changes: list[StateChange] = []
        self.torque_limits: list[TorqueLimit] = []
        self.configured: Configuration | None = None
        self.beat: int | None = None
        self.state: State | None = None
        self.homing = _Homing()
        self._ended = False
        self._node_id, self._profile = axis.node_id, profile
        self._gear, self._commissioned_torque = axis.gear_ratio, axis.motor.rated_torque
        self._types = {(entry.index, entry.subindex): entry.data_type for entry in profile.objects}
        self._known: dict[tuple[int, int], float] = {}
        self._asked: _Write | None = None
        self._started = False

    def hear_network(self, frame: BusFrame) -> None:
        """An NMT command: with a start it is as it was configured until then."""
        if len(frame.data) < 2 or frame.data[1] not in (0, self._node_id):
            return
        if frame.data[0] == START:
            if not self._started:
                self.configured = configuration(self._profile, self._read, frame.time)
                self.torque_limits.append(TorqueLimit(frame.time, self.axis, self._torque_limit()))
            self._started = True
        elif frame.data[0] in (STOP, PRE_OPERATIONAL, RESET_NODE, RESET_COMMUNICATION):
            self._started = False

    def hear(self, frame: BusFrame, end: float) -> None:
        """A frame from or to the node."""
        match frame.identifier - self._node_id:
            case 0x700:
                self._beat(frame, end)
            case 0x600:
                self._asked = _request(frame.data)
            case 0x580:
                self._answer(frame)
            case 0x180 | 0x280 | 0x380 | 0x480 as base:
                self._process_data(frame, 0x1800 + (base - 0x180) // 0x100)
            case 0x200 | 0x300 | 0x400 | 0x500 as base:
                self._process_data(frame, 0x1400 + (base - 0x200) // 0x100)

    def _beat(self, frame: BusFrame, end: float) -> None:
        if len(frame.data) != 1 or self._ended:
            return
        self.beat = frame.data[0] & 0x7F
        self._ended = frame.time > end
        if self.beat == BOOT_UP:
            self._known.clear()
            self._started = False
            self.state = None
            self.homing = _Homing()

    def _answer(self, frame: BusFrame) -> None:
        asked, self._asked = self._asked, None
        if asked is None or len(frame.data) < 8 or frame.data[1:4] != asked.address:
            return
        specifier = frame.data[0] >> 5
        value = asked.value if specifier == 3 else _expedited(frame.data) if specifier == 2 else None
        if value is None:
            return
        address = int.from_bytes(asked.address[:2], "little"), asked.address[2]
        data_type = self._types.get(address, DataType.DOMAIN)
        number = decode(data_type, value) if size(data_type) == len(value) else int.from_bytes(value, "little")
        self._known[address] = float(number)
        self._hear_value(address, int(number), frame.time)

    def _process_data(self, frame: BusFrame, communication: int) -> None:
        """A PDO: the values in it, by the mapping that was written or read back; `communication` is its 1400h or 1800h."""
        mapping = communication + 0x200
        cob_id, count = self._known.get((communication, 1)), self._known.get((mapping, 0))
        if cob_id is None or int(cob_id) & PDO_INVALID or int(cob_id) & CAN_ID != frame.identifier:
            return
        content, bit = int.from_bytes(frame.data, "little"), 0
        for number in range(int(count or 0)):
            entry = int(self._known.get((mapping, number + 1), 0))
            bits = entry & 0xFF
            if len(frame.data) * 8 >= bit + bits:
                self._hear_value((entry >> 16, entry >> 8 & 0xFF), content >> bit & (1 << bits) - 1, frame.time)
            bit += bits

    def _hear_value(self, address: tuple[int, int], value: int, time: float) -> None:
        """An object's value, by SDO or PDO, as unsigned as a PDO has it."""
        match address:
            case (0x6041, 0):
                self._now(_state(value), time)
                self.homing.statusword(value)
            case (0x6040, 0):
                self.homing.controlword(value)
            case (0x6060, 0) | (0x6061, 0):
                self.homing.mode(value)
            case (0x6072, 0) | (0x6076, 0):
                self._known[address] = float(value)
                self._may_give(time)

    def _may_give(self, time: float) -> None:
        """The torque limit of a node that has started has perhaps changed."""
        limit = self._torque_limit()
        if self._started and self.torque_limits[-1].torque != limit:
            self.torque_limits.append(TorqueLimit(time, self.axis, limit))

    def _torque_limit(self) -> float | None:
        """What 6072h lets it give, joint side [N·m or N]; where nobody said its rated torque, of the motor that it has."""
        share, rated = self._known.get(MAX_TORQUE), self._known.get(RATED_TORQUE)
        if share is None:
            return None
        motor = self._commissioned_torque if rated is None else rated * 1e-3
        return share * 1e-3 * motor * self._gear

    def _now(self, state: State | None, time: float) -> None:
        if state is not None and state is not self.state:
            self.changes.append(StateChange(time, self.axis, self.state, state))
            self.state = state

    def _read(self, index: int, subindex: int) -> float | None:
        return self._known.get((index, subindex))


def _request(data: bytes) -> _Write | None:
    """Client command specifiers 1 and 2: initiated download and upload (CiA 301, 7.2.4.3)."""
    if len(data) < 8 or data[0] >> 5 not in (1, 2):
        return None
    return _Write(data[1:4], _expedited(data) if data[0] >> 5 == 1 else None)


def _expedited(data: bytes) -> bytes | None:
    """The value of an expedited transfer (bit 1), of as many bytes as it says (bit 0); None: it is another."""
    if not data[0] & 2:
        return None
    return data[4 : 8 - (data[0] >> 2 & 3)] if data[0] & 1 else data[4:8]


def _state(statusword: int) -> State | None:
    """State of the bits of a statusword (CiA 402-2, table 'State coding'); bit 5 says nothing in some of them."""
    bits = statusword & STATE_BITS
    known = {state.value for state in State}
    for masked in (bits, bits & ~0x20):
        if masked in known:
            return State(masked)
    return None
