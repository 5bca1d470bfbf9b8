"""What is seen of one drive: its frames as they pass, and by SDO what they do not tell."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import pi

import can

from drivetwin.drive_profiles import DriveProfile, ObjectEntry
from drivetwin.foundation.errors import UserError
from drivetwin.panel.link import Link
from drivetwin.panel.pdo_reading import Address, Pdo, read_pdos
from drivetwin.panel.values import Value, decode

STATUSWORD, MODE, POSITION, ERROR_REGISTER = (0x6041, 0), (0x6061, 0), (0x6064, 0), (0x1001, 0)
DIGITAL_INPUTS = (0x60FD, 0)
VITAL = (STATUSWORD, MODE, POSITION, ERROR_REGISTER, DIGITAL_INPUTS)
"""Objects that are asked for where no PDO brings them."""

SWITCHES = ("negative limit", "positive limit", "home")
"""By their bits in 60FDh (CiA 402-2, 'Digital inputs')."""

FRESH = 1.0
"""Age from which a vital object is asked for [s]."""

MAPPING_SETTLED = 0.5
"""So long no other master has asked the drive before its PDO mapping is read anew [s]."""

MOST_EMERGENCIES = 100

_FACTORS = ((0x6091, 1), (0x6091, 2), (0x6092, 1), (0x6092, 2))


@dataclass(frozen=True)
class Axis:
    """What is known of an axis beside its drive: motor turns [rad] a joint's rad or m, and which of the two."""

    name: str
    joint: str
    gear_ratio: float
    unit: str


@dataclass(frozen=True)
class Emergency:
    """An EMCY as it came; `since` [s] of the wall clock, None: of before, read from 1003h."""

    since: float | None
    code: int
    register: int | None
    manufacturer: bytes


@dataclass(frozen=True)
class Sample:
    """A value, and when it came [s] by time.monotonic()."""

    value: Value
    at: float


class NodeWatch:
    """One node. `take` is called in the thread of the bus with every frame, `refresh` in the one that asks."""

    def __init__(self, link: Link, node_id: int, profile: DriveProfile, axis: Axis | None) -> None:
        self.node_id = node_id
        self.axis = axis
        self.profile = profile
        self.entries: dict[Address, ObjectEntry] = {(entry.index, entry.subindex): entry for entry in profile.objects}
        self.nmt: int | None = None
        self.emergencies: deque[Emergency] = deque(maxlen=MOST_EMERGENCIES)
        self.values: dict[Address, Sample] = {}
        self.pdos: dict[int, Pdo] = {}
        self.unit: float | None = None
        """rad or m a position unit, None where the axis is not known."""
        self.silent = ""
        """Why it does not answer by SDO; empty where it does."""
        self.hearers: list[Callable[[int, Address, Value], None]] = []
        """Told node-ID, object and value of whatever comes."""
        self._link = link
        self._remote = link.add(node_id)
        self._mapping_read = 0.0

    @property
    def name(self) -> str:
        """Of the axis, else of the node."""
        return self.axis.name if self.axis is not None else f"node {self.node_id}"

    def read(self, index: int, subindex: int) -> bytes:
        """By SDO. Raises UserError."""
        return self._link.read(self._remote, index, subindex)

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """By SDO. Raises UserError."""
        self._link.write(self._remote, index, subindex, data)

    def number(self, address: Address) -> int | float | None:
        """The last number of an object that has come, None where none has."""
        sample = self.values.get(address)
        return None if sample is None or isinstance(sample.value, str) else sample.value

    @property
    def settled(self) -> bool:
        """Whether its PDO mapping is known and no other master has asked it by SDO for a while: one that configures it does."""
        return bool(self._mapping_read) and self._link.quiet_for(self.node_id) >= MAPPING_SETTLED

    def in_pdo(self, address: Address) -> bool:
        """Whether a PDO that exists carries an object."""
        return any(field.address == address for pdo in self.pdos.values() for field in pdo.fields)

    @property
    def joint(self) -> float | None:
        """Where the joint is, by the drive's own word [rad or m]; None where that is not known."""
        position = self.number(POSITION)
        return None if position is None or self.unit is None else position * self.unit

    @property
    def joint_torque(self) -> float | None:
        """Torque or force on the joint, no gear losses, by the drive's own word [N·m or N]; None where it is not known."""
        role = self.profile.roles.get("torque_actual")
        raw = None if role is None else self.number((role.index, role.subindex))
        return None if raw is None or role is None or self.axis is None else raw * role.si_per_unit * self.axis.gear_ratio

    @property
    def switches(self) -> list[str] | None:
        """Limit and home switches that are active (60FDh, CiA 402-2), None where the drive does not tell."""
        inputs = self.number(DIGITAL_INPUTS)
        return None if inputs is None else [name for bit, name in enumerate(SWITCHES) if int(inputs) >> bit & 1]

    def entry(self, index: int, subindex: int) -> ObjectEntry:
        """Raises UserError for an object that the drive type does not have."""
        if (found := self.entries.get((index, subindex))) is None:
            raise UserError(f"drives of type {self.profile.name} have no {index:04X}h:{subindex:02X}")
        return found

    def take(self, message: can.Message) -> None:
        """A frame of the bus, whoever's it is."""
        cob_id = message.arbitration_id
        if message.is_remote_frame or message.is_extended_id:
            return
        if (pdo := self.pdos.get(cob_id)) is not None:
            self._keep(pdo.values(bytes(message.data)))
        elif cob_id == 0x700 + self.node_id and message.data:
            self.nmt = message.data[0] & 0x7F
        elif cob_id == 0x80 + self.node_id and len(message.data) >= 3:
            self._alarm(bytes(message.data))

    def _alarm(self, data: bytes) -> None:
        code = int.from_bytes(data[:2], "little")
        self.emergencies.appendleft(Emergency(time.time(), code, data[2], data[3:]))
        self._keep([(ERROR_REGISTER, data[2])])

    def _keep(self, told: Iterable[tuple[Address, Value]]) -> None:
        now = time.monotonic()
        for address, value in told:
            self.values[address] = Sample(value, now)
            for hear in self.hearers:
                hear(self.node_id, address, value)

    def refresh(self) -> None:
        """Ask for what is stale: the PDO mapping after another master has configured the drive, vital objects of no PDO.

        Nothing is asked while another master configures the drive: two on its one SDO channel take each other's answers.
        """
        if self._link.quiet_for(self.node_id) < MAPPING_SETTLED:
            return
        try:
            for address in VITAL:
                sample = self.values.get(address)
                if address in self.entries and (sample is None or time.monotonic() - sample.at > FRESH):
                    self.ask(address)
            self._refresh_mapping()
            self.silent = ""
        except UserError as error:
            self.silent = str(error)

    def ask(self, address: Address) -> Value | None:
        """Read an object by SDO and keep its value. Raises UserError."""
        value = decode(self.entries[address].data_type, self.read(*address))
        if value is not None:
            self._keep([(address, value)])
        return value

    def _refresh_mapping(self) -> None:
        quiet = self._link.quiet_for(self.node_id)
        asked_since = time.monotonic() - quiet > self._mapping_read
        if self._mapping_read and (not asked_since or quiet < MAPPING_SETTLED):
            return
        began = time.monotonic()
        if not self._mapping_read:
            self._read_history()
        types = {address: entry.data_type for address, entry in self.entries.items()}
        self.pdos = read_pdos(self.read, types)
        self.unit = None if self.axis is None else self._position_unit(self.axis)
        self._mapping_read = began

    def _read_history(self) -> None:
        """1003h: what went wrong before the panel was there (CiA 301, 7.5.2.4)."""
        if (0x1003, 0) not in self.entries:
            return
        for number in range(1, self.read(0x1003, 0)[0] + 1):
            told = self.read(0x1003, number)
            self.emergencies.append(Emergency(None, int.from_bytes(told[:2], "little"), None, told[2:]))

    def _position_unit(self, axis: Axis) -> float | None:
        """Joint travel a position unit, by the factor group: 6092h units a turn of the driving shaft, 6091h of the gear."""
        if any(address not in self.entries for address in _FACTORS):
            return None
        motor, shaft, feed, turns = (int.from_bytes(self.read(*address), "little") for address in _FACTORS)
        motor_turns = motor / shaft * turns / feed
        return 2.0 * pi * motor_turns / axis.gear_ratio
