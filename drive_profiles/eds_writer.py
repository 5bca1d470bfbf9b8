"""An electronic data sheet from a drive type, or a device configuration file (CiA 306-1), as masters and tools read them.

The text of an EDS depends on the profile and the file's name alone. REAL32 defaults and limits stay empty: tools disagree
whether they are written as numbers or as bit patterns (CiA 306-1 says nothing), and a wrong one is worse than none. A DCF is
worth nothing without its values: there a REAL32 is a decimal number, which python's and npm's `canopen` read.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby

from drivetwin.drive_profiles.profile import BYTE_TYPES, FLOATS, SIGNED, TEXT_TYPES, Access, DataType, DriveProfile, ObjectEntry

BIT_RATES = (10, 20, 50, 125, 250, 500, 800, 1000)
"""[kbit/s] of CiA 306-1, table 'DeviceInfo'."""

SUPPORTED_BIT_RATES = frozenset(BIT_RATES) - {10}

DUMMIES = range(DataType.I8, DataType.U32 + 1)
"""Data types that may stand in an RPDO to skip bytes (CiA 301, 7.4.7.1)."""

MANDATORY = (0x1000, 0x1001, 0x1018)
MANUFACTURER = range(0x2000, 0x6000)

RPDO_COMMUNICATION = range(0x1400, 0x1600)
TPDO_COMMUNICATION = range(0x1800, 0x1A00)

_RECORDS = frozenset({0x1018, 0x60C2, *range(0x1200, 0x1300), *range(0x1400, 0x1C00)})
"""Objects that CiA 301 and CiA 402-2 call RECORD although their entries are alike."""

_DOMAIN, _VAR, _ARRAY, _RECORD = 0x2, 0x7, 0x8, 0x9
"""Object codes of CiA 301, table 42."""

_DATE = "01-01-2026"
_TIME = "12:00AM"
"""The data sheet is not dated by the clock: the same profile gives the same file."""


@dataclass(frozen=True)
class Configured:
    """A node as it stands: its ID and name, and its values by address; those of byte types as hexadecimal bytes."""

    node_id: int
    name: str
    values: Mapping[tuple[int, int], int | float | str]


def eds_text(profile: DriveProfile, file_name: str) -> str:
    """The data sheet of a drive type, to be saved under `file_name`."""
    sections = [*_head(profile, _file_info(profile, file_name))]
    for index, entries in _grouped(profile):
        sections += _object(index, entries, {})
    return "\n".join(sections) + "\n"


def dcf_text(profile: DriveProfile, file_name: str, node: Configured) -> str:
    """The configuration of one drive (CiA 306-1, 4.7): its data sheet with a ParameterValue wherever `node` has one.

    Without a Baudrate: no object of CiA 301 tells it.
    """
    commissioned = {"NodeID": str(node.node_id), "NodeName": _plain(node.name), "CANopenManager": "0"}
    sections = [
        *_head(profile, {**_file_info(profile, file_name), "LastEDS": f"{profile.name}.eds"}),
        *_section("DeviceComissioning", commissioned),  # spelt as the standard spells it
    ]
    for index, entries in _grouped(profile):
        sections += _object(index, entries, node.values)
    return "\n".join(sections) + "\n"


def _head(profile: DriveProfile, file_info: dict[str, str]) -> Iterator[str]:
    indices = [index for index, _ in _grouped(profile)]
    yield from _section("FileInfo", file_info)
    yield from _section("DeviceInfo", _device_info(profile, indices))
    yield from _section("DummyUsage", {f"Dummy{code:04X}": str(int(code in DUMMIES)) for code in range(1, 8)})
    yield from _section("Comments", {"Lines": "1", "Line1": f"Written by drivetwin from the drive type {profile.name}"})
    yield from _list("MandatoryObjects", [index for index in indices if index in MANDATORY])
    yield from _list("OptionalObjects", [index for index in indices if index not in MANDATORY and index not in MANUFACTURER])
    yield from _list("ManufacturerObjects", [index for index in indices if index in MANUFACTURER])


def eds_access(entry: ObjectEntry) -> str:
    """AccessType: rww where only an RPDO may carry it, rwr where only a TPDO may (CiA 306-1, table 'AccessType')."""
    if entry.access is Access.RW and entry.rpdo != entry.tpdo:
        return "rww" if entry.rpdo else "rwr"
    return entry.access.value


def _grouped(profile: DriveProfile) -> list[tuple[int, tuple[ObjectEntry, ...]]]:
    """The entries of each index, in the order of their addresses."""
    entries = sorted(profile.objects, key=lambda entry: (entry.index, entry.subindex))
    return [(index, tuple(each)) for index, each in groupby(entries, key=lambda entry: entry.index)]


def _section(name: str, values: dict[str, str]) -> Iterator[str]:
    yield f"[{name}]"
    for key, value in values.items():
        yield f"{key}={value}"
    yield ""


def _file_info(profile: DriveProfile, file_name: str) -> dict[str, str]:
    return {
        "FileName": _plain(file_name),
        "FileVersion": "1",
        "FileRevision": "0",
        "EDSVersion": "4.0",
        "Description": _plain(profile.description),
        "CreationTime": _TIME,
        "CreationDate": _DATE,
        "CreatedBy": "drivetwin",
        "ModificationTime": _TIME,
        "ModificationDate": _DATE,
        "ModifiedBy": "drivetwin",
    }


def _device_info(profile: DriveProfile, indices: list[int]) -> dict[str, str]:
    return {
        "VendorName": "drivetwin (virtual)",
        "VendorNumber": f"0x{profile.vendor_id:X}",
        "ProductName": _plain(profile.device_name),
        "ProductNumber": f"0x{profile.product_code:X}",
        "RevisionNumber": f"0x{profile.revision_number:X}",
        "OrderCode": profile.name,
        **{f"BaudRate_{rate}": str(int(rate in SUPPORTED_BIT_RATES)) for rate in BIT_RATES},
        "SimpleBootUpMaster": "0",
        "SimpleBootUpSlave": "1",
        "Granularity": "8",
        "DynamicChannelsSupported": "0",
        "CompactPDO": "0",
        "GroupMessaging": "0",
        "NrOfRXPDO": str(sum(1 for index in indices if index in RPDO_COMMUNICATION)),
        "NrOfTXPDO": str(sum(1 for index in indices if index in TPDO_COMMUNICATION)),
        "LSS_Supported": str(int(profile.lss)),
    }


def _list(name: str, indices: list[int]) -> Iterator[str]:
    numbered = {str(number): f"0x{index:04X}" for number, index in enumerate(indices, 1)}
    return _section(name, {"SupportedObjects": str(len(indices)), **numbered})


def _object(
    index: int, entries: tuple[ObjectEntry, ...], values: Mapping[tuple[int, int], int | float | str]
) -> Iterator[str]:
    first = entries[0]
    if len(entries) == 1 and first.subindex == 0:
        yield from _section(f"{index:04X}", {**_variable(first, first.name), **_value(first, values)})
        return
    head = {
        "ParameterName": _plain(first.name.partition(".")[0]),
        "ObjectType": f"0x{_object_code(index, entries):X}",
        "SubNumber": str(len(entries)),
    }
    yield from _section(f"{index:04X}", head)
    for entry in entries:
        told = {**_variable(entry, entry.name.partition(".")[2]), **_value(entry, values)}
        yield from _section(f"{index:04X}sub{entry.subindex:X}", told)


def _value(entry: ObjectEntry, values: Mapping[tuple[int, int], int | float | str]) -> dict[str, str]:
    """ParameterValue, where the node has one."""
    value = values.get((entry.index, entry.subindex))
    if value is None:
        return {}
    if isinstance(value, str):
        return {"ParameterValue": _plain(value)}
    if entry.data_type in FLOATS:
        return {"ParameterValue": f"{value:.9g}" if entry.data_type is DataType.R32 else repr(float(value))}
    return {"ParameterValue": _number(entry, value)}


def _object_code(index: int, entries: tuple[ObjectEntry, ...]) -> int:
    """ARRAY where the entries are alike and without a gap (CiA 301, table 42), RECORD otherwise."""
    members = entries[1:]
    alike = len({(entry.data_type, entry.access) for entry in members}) == 1
    whole = [entry.subindex for entry in members] == list(range(1, len(entries)))
    return _ARRAY if alike and whole and index not in _RECORDS else _RECORD


def _variable(entry: ObjectEntry, name: str) -> dict[str, str]:
    values = {
        "ParameterName": _plain(name),
        "ObjectType": f"0x{_DOMAIN if entry.data_type is DataType.DOMAIN else _VAR:X}",
        "DataType": f"0x{entry.data_type:04X}",
        "AccessType": eds_access(entry),
        "DefaultValue": _default(entry),
    }
    if entry.data_type is not DataType.DOMAIN:  # no PDO carries one, and npm's `canopen` refuses an EDS that says so
        values |= {"PDOMapping": str(int(entry.rpdo or entry.tpdo))}
    if entry.data_type not in TEXT_TYPES:
        values |= {"LowLimit": _number(entry, entry.low), "HighLimit": _number(entry, entry.high)}
    return values


def _default(entry: ObjectEntry) -> str:
    if isinstance(entry.default, str):
        written = entry.default.encode("latin-1")
        if entry.data_type in BYTE_TYPES:
            return written.hex()
        return _plain(written.decode("utf-16-le", "replace") if entry.data_type is DataType.USTR else entry.default)
    number = _number(entry, entry.default)
    return f"$NODEID+{number}" if entry.default_node_relative and number else number


def _number(entry: ObjectEntry, value: int | float | str | None) -> str:
    """Unsigned numbers are hexadecimal, signed ones decimal; a float is left out."""
    if not isinstance(value, int) or entry.data_type in FLOATS:
        return ""
    return str(value) if entry.data_type in SIGNED or entry.data_type is DataType.BOOL else f"0x{value:X}"


def _plain(text: str) -> str:
    """What every INI reader takes as one value: ASCII, without the characters that begin a comment."""
    return text.encode("ascii", "replace").decode("ascii").replace(";", ",").replace("#", "no. ")
