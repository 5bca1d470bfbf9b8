"""What is seen of one drive: its frames as they pass, and what it tells when it is asked."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import pi

import numpy as np

from drivetwin.drive_profiles import DriveProfile, ObjectEntry
from drivetwin.foundation.errors import UserError
from drivetwin.panel.door import SETTLED, Door
from drivetwin.panel.frames import Frames, Places, Samples
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


Hearer = Callable[[int, Address, Samples, Samples], None]
"""Told node-ID, object, times (n,) [s of the bus] and values (n,)."""


@dataclass(frozen=True)
class Sample:
    """A value, and when it came [s] by time.monotonic()."""

    value: Value
    at: float


class NodeWatch:
    """One node. `take` is called in the thread of the bus with every frame, `refresh` in the one that asks.

    `now` tells the time of the bus [s].
    """

    def __init__(
        self, door: Door, node_id: int, profile: DriveProfile, axis: Axis | None, now: Callable[[], float] = time.monotonic
    ) -> None:
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
        """Why it does not answer; empty where it does."""
        self.hearers: list[Hearer] = []
        self.writers: list[Callable[[Address, bytes], None]] = []
        """Told what the panel has written."""
        self._door = door
        self._now = now
        self._mapping_read = 0.0
        self._rewritten = self._rewritten_read = 0

    @property
    def name(self) -> str:
        """Of the axis, else of the node."""
        return self.axis.name if self.axis is not None else f"node {self.node_id}"

    def read(self, index: int, subindex: int) -> bytes:
        """The bytes of an object. Raises UserError."""
        return self._door.read(self.node_id, index, subindex)

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """Write the bytes of an object. Raises UserError."""
        try:
            self._door.write(self.node_id, index, subindex, data)
        finally:  # it may have been written though no answer came
            if _is_of_mapping_or_gear(index):
                self._rewritten += 1
        for hear in self.writers:
            hear((index, subindex), data)

    def number(self, address: Address) -> int | float | None:
        """The last number of an object that has come, None where none has."""
        sample = self.values.get(address)
        return None if sample is None or isinstance(sample.value, str) else sample.value

    @property
    def settled(self) -> bool:
        """Whether its PDO mapping is known, and it may be asked."""
        return bool(self._mapping_read) and self._door.is_free(self.node_id)

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

    def take(self, frames: Frames) -> None:
        """Frames of the bus, whoever's they are."""
        for cob_id, pdo in list(self.pdos.items()):
            if len(places := frames.of(cob_id)):
                self._take_pdo(pdo, frames, places)
        for place in frames.of(0x700 + self.node_id).tolist():
            if frames.lengths[place]:
                self.nmt = int(frames.data[place, 0]) & 0x7F
        for place in frames.of(0x80 + self.node_id).tolist():
            if len(data := frames.content(place)) >= 3:
                self._alarm(data, float(frames.times[place]))

    def _take_pdo(self, pdo: Pdo, frames: Frames, places: Places) -> None:
        now = time.monotonic()
        times, lengths, data = frames.times[places], frames.lengths[places], frames.data[places]
        for field in pdo.fields:
            there, values = field.column(lengths, data)
            if values.size:
                self.values[field.address] = Sample(values[-1].item(), now)
                self._tell(field.address, times[there], values.astype(np.float64))

    def _alarm(self, data: bytes, at: float) -> None:
        code = int.from_bytes(data[:2], "little")
        self.emergencies.appendleft(Emergency(time.time(), code, data[2], data[3:]))
        self._keep(ERROR_REGISTER, data[2], at)

    def _keep(self, address: Address, value: Value, at: float) -> None:
        self.values[address] = Sample(value, time.monotonic())
        if not isinstance(value, str):
            self._tell(address, np.array([at]), np.array([float(value)]))

    def _tell(self, address: Address, times: Samples, values: Samples) -> None:
        for hear in self.hearers:
            hear(self.node_id, address, times, values)

    def refresh(self) -> None:
        """Ask for what is stale: the PDO mapping after another master has configured the drive, vital objects of no PDO.

        Nothing is asked while another master configures the drive by the one SDO channel that the panel has too.
        """
        if not self._door.is_free(self.node_id):
            return
        try:
            for address in VITAL:
                sample = self.values.get(address)
                if address in self.entries and (sample is None or time.monotonic() - sample.at > FRESH):
                    value = self._read_value(address)
                    self._door.catch_up()  # else a state would be noted before what led to it
                    self._keep_known(address, value)
            self._refresh_mapping()
            self.silent = ""
        except UserError as error:
            self.silent = str(error)

    def ask(self, address: Address) -> Value | None:
        """Read an object and keep its value. Raises UserError."""
        value = self._read_value(address)
        self._keep_known(address, value)
        return value

    def _read_value(self, address: Address) -> Value | None:
        return decode(self.entries[address].data_type, self.read(*address))

    def _keep_known(self, address: Address, value: Value | None) -> None:
        if value is not None:
            self._keep(address, value, self._now())

    def _refresh_mapping(self) -> None:
        quiet = self._door.quiet_for(self.node_id)
        asked_since = time.monotonic() - quiet > self._mapping_read
        began, rewritten = time.monotonic(), self._rewritten
        if self._mapping_read and rewritten == self._rewritten_read and (not asked_since or quiet < SETTLED):
            return
        history = [] if self._mapping_read else list(self._history())
        types = {address: entry.data_type for address, entry in self.entries.items()}
        self.pdos = read_pdos(self.read, types)
        self.unit = None if self.axis is None else self._position_unit(self.axis)
        self.emergencies.extend(history)
        self._mapping_read, self._rewritten_read = began, rewritten

    def _history(self) -> Iterator[Emergency]:
        """1003h: what went wrong before the panel was there (CiA 301, 7.5.2.4)."""
        if (0x1003, 0) not in self.entries:
            return
        for number in range(1, self.read(0x1003, 0)[0] + 1):
            told = self.read(0x1003, number)
            yield Emergency(None, int.from_bytes(told[:2], "little"), None, told[2:])

    def _position_unit(self, axis: Axis) -> float | None:
        """Joint travel a position unit, by the factor group: 6092h units a turn of the driving shaft, 6091h of the gear."""
        if any(address not in self.entries for address in _FACTORS):
            return None
        motor, shaft, feed, turns = (int.from_bytes(self.read(*address), "little") for address in _FACTORS)
        if 0 in (shaft, feed):
            return None
        motor_turns = motor / shaft * turns / feed
        return 2.0 * pi * motor_turns / axis.gear_ratio


def _is_of_mapping_or_gear(index: int) -> bool:
    return 0x1400 <= index < 0x1C00 or index in {index for index, _ in _FACTORS}
