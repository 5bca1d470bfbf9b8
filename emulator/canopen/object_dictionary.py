"""What a master reads and writes: every object of the drive with its type, range and hooks (CiA 301, 7.4).

Services and the drive meet here: a service or the drive binds `on_read` and `on_write` of the variables it owns.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from drivetwin.drive_profiles import DriveProfile, ObjectEntry
from drivetwin.drive_profiles.profile import FLOATS
from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.data_types import Value, decode, encode_nearest, is_number, size, type_range

COMMUNICATION_AREA = range(0x1000, 0x2000)
"""Communication profile area (CiA 301, 7.4.1): what 'reset communication' takes back to its power-on values."""

IDENTITY = 0x1018

COMMANDS = frozenset(
    (0x1003, 0x1010, 0x1011, 0x6040, 0x6042, 0x6071, 0x607A, 0x60B0, 0x60B1, 0x60B2, 0x60C1, 0x60FE, 0x60FF)
)
"""Writable objects that hold a command or a set-point, not a parameter."""


class Revision:
    """Counts what may have changed a parameter of a dictionary: who computes something from several looks at `number`."""

    __slots__ = ("number",)

    def __init__(self) -> None:
        self.number = 0


class Variable:
    """One entry of the dictionary.

    `value` is the raw value as stored. `on_read` gives the value where it is not a stored one; `on_write` is asked
    before a value is stored and may raise SdoAbort. `default` is the power-on value, `low` and `high` the profile's
    limits; `node_offset` is what the node-ID is added to where the default follows the node-ID. `is_command`: a value
    makes the device act on other objects, so that a PDO writes it after the set-points that came with it. `revision` is that
    of the dictionary, which a change of a parameter counts up.
    """

    __slots__ = (
        "_high",
        "_low",
        "access",
        "data_type",
        "default",
        "high",
        "index",
        "is_command",
        "is_parameter",
        "low",
        "name",
        "node_offset",
        "on_read",
        "on_write",
        "revision",
        "rpdo",
        "size",
        "subindex",
        "tpdo",
        "value",
    )

    def __init__(self, entry: ObjectEntry, default: Value) -> None:
        self.index = entry.index
        self.subindex = entry.subindex
        self.name = entry.name
        self.data_type = entry.data_type
        self.access = entry.access
        self.rpdo = entry.rpdo
        self.tpdo = entry.tpdo
        self.low = entry.low
        self.high = entry.high
        self.node_offset = int(entry.default) if entry.default_node_relative and entry.default is not None else None
        self.default = default
        self.value = default
        self.size = size(entry.data_type)
        self.on_read: Callable[[], Value] | None = None
        self.on_write: Callable[[Value], None] | None = None
        self.is_command = False
        self.is_parameter = entry.index not in COMMANDS
        self.revision = Revision()
        if self.size is not None:
            least, most = type_range(entry.data_type)
            self._low = least if entry.low is None else entry.low
            self._high = most if entry.high is None else entry.high

    def __repr__(self) -> str:
        return f"<{self.index:04X}h:{self.subindex:02X} {self.name}>"

    @property
    def number(self) -> int:
        """The stored value of an integer object."""
        return int(self.value)

    def read(self) -> Value:
        """The raw value now."""
        return self.value if self.on_read is None else self.on_read()

    def write(self, value: Value) -> None:
        """Check the range, ask `on_write`, store. Raises SdoAbort for a wrong value, or what `on_write` refuses."""
        self.check(value)
        if self.on_write is not None:
            self.on_write(value)
        self.store(value)

    def store(self, value: Value) -> None:
        """Take a value that is known to be right."""
        if self.is_parameter and value != self.value:
            self.revision.number += 1
        self.value = value

    def commission(self, value: Value) -> None:
        """Make `value` the stored and the power-on value, as if saved by a commissioning engineer; calls no hook."""
        self.default = value
        self.store(value)

    def encode(self) -> bytes:
        """The bytes of the value now; one beyond its type is told as the nearest that the type has."""
        return encode_nearest(self.data_type, self.read())

    def decode_and_write(self, data: bytes) -> None:
        """Write the value that the bytes say. Raises SdoAbort for a wrong length, and as `write`."""
        if self.size is not None:
            check_length(len(data), self.size)
        self.write(decode(self.data_type, data))

    def check(self, value: Value) -> None:
        """Raise SdoAbort where the value is outside the limits of the object or its type."""
        if self.size is None or isinstance(value, str):
            return
        if not is_number(value):
            raise SdoAbort(AbortCode.INVALID_VALUE)
        if value > self._high:
            raise SdoAbort(AbortCode.VALUE_TOO_HIGH)
        if value < self._low:
            raise SdoAbort(AbortCode.VALUE_TOO_LOW)

    @property
    def takes_all(self) -> bool:
        """Whether no value of the type can fail `check`."""
        return (self._low, self._high) == type_range(self.data_type) and self.data_type not in FLOATS


def check_length(length: int, expected: int) -> None:
    """Raise SdoAbort where a parameter is longer or shorter than its type."""
    if length > expected:
        raise SdoAbort(AbortCode.LENGTH_TOO_HIGH)
    if length < expected:
        raise SdoAbort(AbortCode.LENGTH_TOO_LOW)


Key = int | tuple[int, int]


class ObjectDictionary:
    """All variables by address: `od[0x6041]` is sub-index 0, `od[0x60C1, 1]` any other.

    `implicit` variables are there for who asks by address, and for nobody else: the bus has no such object.
    """

    def __init__(self, variables: list[Variable], node_id: int, implicit: Iterable[Variable] = ()) -> None:
        self._node_id = node_id
        self._variables = {(variable.index, variable.subindex): variable for variable in variables}
        self._by_address = {(variable.index, variable.subindex): variable for variable in implicit} | self._variables
        self._indices = frozenset(variable.index for variable in variables)
        self.revision = Revision()
        for variable in self._by_address.values():
            variable.revision = self.revision

    @classmethod
    def from_profile(cls, profile: DriveProfile, node_id: int) -> ObjectDictionary:
        """The dictionary of a drive of that type with that node-ID."""
        listed, implicit = (
            [Variable(entry, _default(entry, node_id)) for entry in entries] for entries in (profile.objects, profile.implicit)
        )
        return cls(listed, node_id, implicit)

    def __getitem__(self, key: Key) -> Variable:
        return self._by_address[(key, 0) if isinstance(key, int) else key]

    def __contains__(self, key: Key) -> bool:
        return ((key, 0) if isinstance(key, int) else key) in self._variables

    def __iter__(self) -> Iterator[Variable]:
        return iter(self._variables.values())

    def __len__(self) -> int:
        return len(self._variables)

    def get(self, key: Key) -> Variable | None:
        """The variable at an address, None where this drive type has none."""
        return self._variables.get((key, 0) if isinstance(key, int) else key)

    def find(self, index: int, subindex: int) -> Variable:
        """The variable at an address that a master gave. Raises SdoAbort where there is none."""
        variable = self._variables.get((index, subindex))
        if variable is None:
            raise SdoAbort(AbortCode.NO_SUCH_SUBINDEX if index in self._indices else AbortCode.NO_SUCH_OBJECT)
        return variable

    def assign_node_id(self, node_id: int) -> None:
        """Let the defaults that follow the node-ID follow a new one; the identity stays."""
        for variable in self:
            offset = variable.node_offset
            if offset is not None and variable.index != IDENTITY and variable.default == offset + self._node_id:
                variable.default = offset + node_id
        self._node_id = node_id

    def power_on(self) -> None:
        """Power-on values everywhere."""
        self.reset_communication()
        self.reset_application()

    def reset_communication(self) -> None:
        """Power-on values in the communication profile area (CiA 301, 7.3.2.2.1)."""
        for variable in self:
            if variable.index in COMMUNICATION_AREA:
                variable.store(variable.default)

    def reset_application(self) -> None:
        """Power-on values in the manufacturer-specific and the standardised device profile area."""
        for variable in self:
            if variable.index not in COMMUNICATION_AREA:
                variable.store(variable.default)


def _default(entry: ObjectEntry, node_id: int) -> Value:
    if entry.default is None:
        return "" if size(entry.data_type) is None else 0
    if entry.default_node_relative and not isinstance(entry.default, str):
        return entry.default + node_id
    return entry.default
