"""A drive type as data: drive_profiles/<name>/ holds profile.yaml (what it is) and objects.csv (its object dictionary).

A record's or array's rows are named `Object.Entry`, a plain variable's row has no dot, so the object's own name (which
an EDS wants) is what stands before the dot.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import IntEnum, StrEnum
from functools import cache
from pathlib import Path

from pydantic import Field

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.plugins import installed
from drivetwin.foundation.typed_yaml import Strict, read_yaml, typed

PROFILES = Path(__file__).parent

GROUP = "drivetwin.profiles"
"""Of entry points: each names a package whose folder is a drive type of the folder's name."""
COLUMNS = ["index", "sub", "name", "type", "access", "pdo", "default", "low", "high"]


class DataType(IntEnum):
    """Data types of CiA 301, 7.4.7.1 (object dictionary data types, table 44), by their index."""

    BOOL = 0x01
    I8 = 0x02
    I16 = 0x03
    I32 = 0x04
    U8 = 0x05
    U16 = 0x06
    U32 = 0x07
    R32 = 0x08
    VSTR = 0x09
    OSTR = 0x0A
    USTR = 0x0B
    TIME_OF_DAY = 0x0C
    TIME_DIFFERENCE = 0x0D
    DOMAIN = 0x0F
    I24 = 0x10
    R64 = 0x11
    I40 = 0x12
    I48 = 0x13
    I56 = 0x14
    I64 = 0x15
    U24 = 0x16
    U40 = 0x18
    U48 = 0x19
    U56 = 0x1A
    U64 = 0x1B


BITS: dict[DataType, int] = {
    DataType.BOOL: 1,
    **{DataType[f"{sign}{bits}"]: bits for sign in "IU" for bits in range(8, 72, 8)},
    DataType.R32: 32,
    DataType.R64: 64,
    DataType.TIME_OF_DAY: 48,
    DataType.TIME_DIFFERENCE: 48,
}
"""Length of a value; the other types have none of their own. A time is a number of 48 bits as it stands on the bus: in the
lower 28 milliseconds, in the upper 16 days (CiA 301, 7.1.6.5 and 7.1.6.6).
"""

SIGNED = frozenset(data_type for data_type in BITS if data_type.name.startswith("I"))
FLOATS = frozenset({DataType.R32, DataType.R64})

TEXT_TYPES = frozenset({DataType.VSTR, DataType.OSTR, DataType.USTR, DataType.DOMAIN})
"""Types of any length; a value is text, one ISO 8859-1 character a byte: UNICODE_STRING is those of its UTF-16, low byte first
(CiA 301, 7.1.6).
"""

BYTE_TYPES = frozenset({DataType.OSTR, DataType.DOMAIN})
"""Those that an EDS writes as hexadecimal bytes (CiA 306, 4.6.3)."""


class Quirk(StrEnum):
    """How drives of one vendor behave where CiA 402 leaves room, or where they leave CiA 402."""

    HOMING_LATCHES_START = "homing_latches_start"
    """Homing starts with the rising edge of bit 4 of the controlword and runs on after the bit is cleared."""


class RoleName(StrEnum):
    """Quantities that drives keep in objects of their own, and that emulator or controller look up."""

    ADDITIVE_TORQUE = "additive_torque"
    BUS_TIMEOUT = "bus_timeout"
    BUS_TIMEOUT_TYPE = "bus_timeout_type"
    CURRENT_LOOP_TIME_CONSTANT = "current_loop_time_constant"
    FOLLOWING_ERROR_LIMIT = "following_error_limit"
    FRICTION_CONSTANT = "friction_constant"
    FRICTION_SPEED = "friction_speed"
    FRICTION_TORQUE = "friction_torque"
    HOMING_STATUS = "homing_status"
    INTEGRAL_TIME = "integral_time"
    INTERPOLATION_TYPE = "interpolation_type"
    JERK_TIME = "jerk_time"
    MOTOR_INERTIA = "motor_inertia"
    POSITION_GAIN = "position_gain"
    POSITION_SETPOINT = "position_setpoint"
    POSITION_WINDOW = "position_window"
    RATED_TORQUE = "rated_torque"
    SERVO_PERIOD = "servo_period"
    TORQUE_ACTUAL = "torque_actual"
    TORQUE_LIMIT = "torque_limit"
    TORQUE_REFERENCE = "torque_reference"
    VELOCITY_FEEDFORWARD = "velocity_feedforward"
    VELOCITY_FILTER_TIME = "velocity_filter_time"
    VELOCITY_GAIN = "velocity_gain"


class Access(StrEnum):
    """Access of an object by SDO, CiA 301, 7.4.5 (table 42)."""

    RO = "ro"
    RW = "rw"
    WO = "wo"
    CONST = "const"

    @property
    def readable(self) -> bool:
        """Whether an SDO upload may read it."""
        return self is not Access.WO

    @property
    def writable(self) -> bool:
        """Whether an SDO download may write it."""
        return self in (Access.RW, Access.WO)


@dataclass(frozen=True)
class ObjectEntry:
    """One entry of the object dictionary. Limits and defaults are raw values; None where the type gives none."""

    index: int
    subindex: int
    name: str
    data_type: DataType
    access: Access
    rpdo: bool
    tpdo: bool
    default: int | float | str | None
    default_node_relative: bool
    low: int | float | None
    high: int | float | None


@dataclass(frozen=True)
class Role:
    """Where a drive type keeps a quantity: SI value, motor side = raw * si_per_unit; `unit` is that of the raw one."""

    index: int
    subindex: int
    si_per_unit: float
    unit: str


@dataclass(frozen=True)
class DriveProfile:
    """A drive type: identity (1018h), modes of operation (6060h codes), quantities by role, and every object it has.

    `interpolation_codes` are the values of role `interpolation_type` by name: linear, cubic_spline, perhaps none.
    `lss` says whether its node-ID and bit rate are set by LSS (CiA 305), `quirks` in what it differs from others. `implicit`
    are objects that the type does not have on the bus, by whose defaults the virtual drive behaves nevertheless.
    """

    name: str
    description: str
    vendor_id: int
    product_code: int
    revision_number: int
    device_name: str
    modes: tuple[int, ...]
    streaming_mode: int
    roles: dict[str, Role]
    interpolation_codes: dict[str, int]
    objects: tuple[ObjectEntry, ...]
    lss: bool = False
    quirks: frozenset[Quirk] = frozenset()
    implicit: tuple[ObjectEntry, ...] = ()


def available_profiles() -> tuple[str, ...]:
    """Names that `load_profile` knows."""
    return tuple(profile_folders())


@cache
def profile_folders() -> Mapping[str, Path]:
    """The folder of every drive type by its name: the product's own, then those that packages hold, each by an entry point.

    Raises UserError for an entry point that does not import or names no such folder, and for a name twice.
    """
    found = {path.parent.name: path.parent for path in sorted(PROFILES.glob("*/profile.yaml"))}
    for where, package in installed(GROUP):
        folder = Path(getattr(package, "__file__", None) or "nowhere").parent
        if not (folder / "profile.yaml").is_file():
            raise UserError(f"{where}: expected a package whose folder is a drive type, with profile.yaml and objects.csv")
        if folder.name in found:
            raise UserError(f"{where}: drive type {folder.name!r} is there already, in {found[folder.name]}: rename one")
        found[folder.name] = folder
    return found


def load_profile(name: str) -> DriveProfile:
    """The drive type of that name.

    Raises UserError naming the known types, or the file and the key or row that is wrong.
    """
    if name not in available_profiles():
        own = f"; for a drive's own file write --eds {name}" if name.lower().endswith((".eds", ".dcf")) else ""
        raise UserError(f"unknown drive profile {name!r}; known are {', '.join(available_profiles())}{own}")
    return load_profile_from(profile_folders()[name])


@cache
def load_profile_from(folder: Path) -> DriveProfile:
    """The drive type that `folder` describes; its name is the folder's. Raises UserError as `load_profile`."""
    head = _read_head(folder / "profile.yaml")
    objects = _read_objects(folder / "objects.csv", _values_of_the_head(head))
    roles = {str(role): _role(data, role, objects, folder / "profile.yaml") for role, data in head.roles.items()}
    return DriveProfile(
        name=folder.name,
        description=head.description,
        vendor_id=head.vendor_id,
        product_code=head.product_code,
        revision_number=head.revision_number,
        device_name=head.device_name,
        modes=tuple(head.modes),
        streaming_mode=head.streaming_mode,
        roles=roles,
        interpolation_codes=head.interpolation_codes,
        objects=tuple(objects.values()),
        lss=head.lss,
        quirks=frozenset(head.quirks),
    )


class _Role(Strict):
    object: str = Field(pattern=r"^[0-9A-F]{4}(:[0-9A-F]{2})?$")
    si_per_unit: float = Field(gt=0.0)
    unit: str


class _Head(Strict):
    description: str
    vendor_id: int = Field(ge=0, le=0xFFFFFFFF)
    product_code: int = Field(ge=0, le=0xFFFFFFFF)
    revision_number: int = Field(ge=0, le=0xFFFFFFFF)
    device_name: str
    modes: list[int] = Field(min_length=1)
    streaming_mode: int
    roles: dict[RoleName, _Role]
    interpolation_codes: dict[str, int]
    lss: bool = False
    quirks: list[Quirk] = Field(default_factory=list)


_Address = tuple[int, int]
_Objects = dict[_Address, ObjectEntry]


def _read_head(path: Path) -> _Head:
    head = typed(_Head, read_yaml(path), path)
    if head.streaming_mode not in head.modes:
        raise UserError(f"{path}: streaming_mode: {head.streaming_mode} is not one of the modes {head.modes}")
    return head


def _values_of_the_head(head: _Head) -> dict[_Address, int | str]:
    """Objects whose value profile.yaml already says, so that it stands in one place."""
    return {
        (0x1008, 0): head.device_name,
        (0x1018, 1): head.vendor_id,
        (0x1018, 2): head.product_code,
        (0x1018, 3): head.revision_number,
        (0x6502, 0): supported_modes(head.modes),
    }


def supported_modes(modes: Iterable[int]) -> int:
    """6502h: bit n - 1 for each mode n (CiA 402-2, 'Supported drive modes')."""
    return sum(1 << (mode - 1) for mode in modes if mode > 0)


def _read_objects(path: Path, given: dict[_Address, int | str]) -> _Objects:
    objects: _Objects = {}
    with path.open(encoding="utf-8", newline="") as stream:
        reader = csv.DictReader(stream)
        try:
            if reader.fieldnames != COLUMNS:
                raise UserError(f"{path}: the columns are {reader.fieldnames}, expected {COLUMNS}")
            for row in reader:
                entry = _entry(row)
                address = (entry.index, entry.subindex)
                if address in objects:
                    raise ValueError(f"{entry.index:04X}h:{entry.subindex:02X} stands here twice")
                objects[address] = replace(entry, default=given.get(address, entry.default))
        except UnicodeDecodeError as error:
            raise UserError(f"{path} is not UTF-8 text: {error}") from None
        except (ValueError, csv.Error) as error:
            raise UserError(f"{path}, row {reader.line_num}: {error}") from None
    return objects


_INDEX = re.compile(r"[0-9A-F]{4}")
_SUBINDEX = re.compile(r"[0-9A-F]{2}")
_NODE_RELATIVE = re.compile(r"\$NODEID\s*\+\s*(.+)")
_PDO = {"": (False, False), "r": (True, False), "t": (False, True), "rt": (True, True)}


def _entry(row: dict[str, str]) -> ObjectEntry:
    if None in row or None in row.values():
        raise ValueError(f"expected the {len(COLUMNS)} columns {', '.join(COLUMNS)}")
    for column, pattern in (("index", _INDEX), ("sub", _SUBINDEX)):
        if not pattern.fullmatch(row[column]):
            raise ValueError(f"{column} {row[column]!r} is not upper-case hex of fixed width")
    if row["type"] not in DataType.__members__:
        raise ValueError(f"type {row['type']!r} is none of {', '.join(DataType.__members__)}")
    if row["pdo"] not in _PDO:
        raise ValueError(f"pdo {row['pdo']!r} is none of empty, r, t, rt")
    data_type = DataType[row["type"]]
    rpdo, tpdo = _PDO[row["pdo"]]
    relative = _NODE_RELATIVE.fullmatch(row["default"])
    entry = ObjectEntry(
        index=int(row["index"], 16),
        subindex=int(row["sub"], 16),
        name=row["name"],
        data_type=data_type,
        access=Access(row["access"]),
        rpdo=rpdo,
        tpdo=tpdo,
        default=_value(data_type, relative.group(1) if relative else row["default"]),
        default_node_relative=relative is not None,
        low=_limit(data_type, row["low"]),
        high=_limit(data_type, row["high"]),
    )
    _check(entry)
    return entry


def _value(data_type: DataType, text: str) -> int | float | str | None:
    if data_type in TEXT_TYPES:
        return text
    return _limit(data_type, text)


def _limit(data_type: DataType, text: str) -> int | float | None:
    if not text:
        return None
    return float(text) if data_type in FLOATS else int(text, 0)


def _check(entry: ObjectEntry) -> None:
    if not entry.name:
        raise ValueError("the name is empty")
    if entry.low is not None and entry.high is not None and entry.low > entry.high:
        raise ValueError(f"low {entry.low} is above high {entry.high}")
    if isinstance(entry.default, str | None):
        return
    if (entry.low is not None and entry.default < entry.low) or (entry.high is not None and entry.default > entry.high):
        raise ValueError(f"default {entry.default} is outside {entry.low}..{entry.high}")


def _role(data: _Role, name: str, objects: _Objects, path: Path) -> Role:
    index, _, subindex = data.object.partition(":")
    address = (int(index, 16), int(subindex or "0", 16))
    if address not in objects:
        raise UserError(f"{path}: roles.{name}: objects.csv has no {data.object}")
    return Role(*address, si_per_unit=data.si_per_unit, unit=data.unit)
