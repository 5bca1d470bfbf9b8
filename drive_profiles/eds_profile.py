"""A user's own EDS or DCF as a drive type: the objects of the file, the behaviour and the roles of a profile."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

from drivetwin.drive_profiles.eds_reader import EdsFile, EdsObject, parse_number, read_eds
from drivetwin.drive_profiles.eds_sections import Complaints
from drivetwin.drive_profiles.eds_values import number_of
from drivetwin.drive_profiles.profile import (
    BITS,
    BYTE_TYPES,
    TEXT_TYPES,
    Access,
    DataType,
    DriveProfile,
    ObjectEntry,
    Role,
    load_profile,
    supported_modes,
)
from drivetwin.drive_profiles.requirements import MANDATORY, Address, mode_objects, required_objects
from drivetwin.foundation.errors import UserError

# AccessType of CiA 306-1: access by SDO, and which PDOs may carry the object where PDOMapping says that one may.
_ACCESS = {
    "ro": (Access.RO, False, True),
    "const": (Access.CONST, False, True),
    "wo": (Access.WO, True, False),
    "rw": (Access.RW, True, True),
    "rww": (Access.RW, True, False),
    "rwr": (Access.RW, False, True),
}

_RPDO_MAPPING, _TPDO_MAPPING = range(0x1600, 0x1800), range(0x1A00, 0x1C00)
_PDO_BITS = 64

STANDARD = "cia402-full"
"""The profile that says what type the objects of CiA 301 and CiA 402-2 have."""

MANUFACTURER = range(0x2000, 0x6000)

_COB_IDS = {0x1014: 0, **{base + pdo: 1 for base in (0x1400, 0x1800) for pdo in range(4)}}
"""Sub-index of the COB-ID of EMCY and of each PDO."""
_INVALID = 1 << 31
"""Bit of a COB-ID that does not exist."""

_ARRAYS = frozenset({0x1003, 0x1010, 0x1011, 0x1016})
"""Lists of CiA 301, as long as a device has them, whose entries from sub-index 1 on are of one type."""

_ERROR_FIELD = 0x1003
"""The error history is a list: it has no gaps (CiA 301, 7.5.2.4)."""

Objects = dict[Address, ObjectEntry]


def profile_from_eds(path: Path, base: DriveProfile) -> DriveProfile:
    """The drive type that has the objects of an EDS or DCF and behaves as `base` does.

    Values that the file leaves open are those of `base`, and so are the defaults by which the drive behaves where the file
    lacks an optional object. Of the modes of `base` it has those whose objects are in the file. Raises UserError naming file
    and section where the file cannot be believed (a data type that there is none, a PDO mapping that does not fit its
    objects), or all the mandatory objects that the file lacks.
    """
    file = read_eds(path)
    complaints = Complaints(path)
    told = _objects(file, _standard_types(base), complaints)
    objects = _with_open_values(told, base, complaints)
    roles = dict(_roles(objects, base, complaints))
    _check_complete(path, objects, base)
    base = _with_modes(objects, base, complaints)
    profile = _with_head(file, objects, roles, base)
    _check_mappings(path, {(entry.index, entry.subindex): entry for entry in profile.objects})
    complaints.tell()
    return profile


# -- one entry ---------------------------------------------------------------------------------------------------------


def _objects(file: EdsFile, standard: Objects, complaints: Complaints) -> Objects:
    found: Objects = {}
    for entry in file.objects:
        data_type = _data_type(file.path, entry)
        _check_type(file.path, entry, standard)
        found[entry.index, entry.subindex] = _object(file, entry, data_type, complaints)
    return found


def _data_type(path: Path, entry: EdsObject) -> DataType:
    code = entry.data_type
    try:
        return DataType(-1 if code is None else code)
    except ValueError:
        came = "missing" if code is None else f"0x{code:04X}"
        raise UserError(
            f"{path}, [{entry.section}]: DataType is {came}; expected a code of CiA 301, table 44, such as 0x0006 for "
            "UNSIGNED16: correct the file"
        ) from None


def _standard_types(base: DriveProfile) -> Objects:
    """The objects of CiA 301 and CiA 402-2 that a drive which behaves as `base` knows."""
    entries = (*base.objects, *load_profile(STANDARD).objects)
    return {(entry.index, entry.subindex): entry for entry in entries if entry.index not in MANUFACTURER}


def _check_type(path: Path, entry: EdsObject, standard: Objects) -> None:
    """An object of the standard has the standard's type, width and sign; for a text any text type will do."""
    subindex = min(entry.subindex, 1) if entry.index in _ARRAYS else entry.subindex
    known = standard.get((entry.index, subindex))
    if known is None or entry.data_type == known.data_type or {entry.data_type, known.data_type} <= TEXT_TYPES:
        return
    raise UserError(
        f"{path}, [{entry.section}]: DataType is 0x{entry.data_type:04X}; expected 0x{known.data_type:04X} for "
        f"{known.name}: correct the file"
    )


def _object(file: EdsFile, entry: EdsObject, data_type: DataType, complaints: Complaints) -> ObjectEntry:
    if entry.access not in _ACCESS:
        raise UserError(f"{file.path}, [{entry.section}]: AccessType is {entry.access!r}; expected {', '.join(_ACCESS)}")
    access, to_rpdo, to_tpdo = _ACCESS[entry.access]
    low, high = _limits(entry, data_type, complaints)
    default, relative = _default(file, entry, data_type, complaints)
    if isinstance(default, int | float) and not relative and not _within(default, low, high):
        complaints.note("the value of {} is outside its limits, which are not taken", entry.section)
        low = high = None
    return ObjectEntry(
        index=entry.index,
        subindex=entry.subindex,
        name=_name(entry),
        data_type=data_type,
        access=access,
        rpdo=entry.mappable and to_rpdo,
        tpdo=entry.mappable and to_tpdo,
        default=default,
        default_node_relative=relative,
        low=low,
        high=high,
    )


def _name(entry: EdsObject) -> str:
    """In a profile a dot stands between object and entry, and nowhere else."""
    parts = [entry.object_name, entry.name] if entry.object_name else [entry.name]
    return ".".join(part.replace(".", " ").strip() or "unnamed" for part in parts)


def _limits(entry: EdsObject, data_type: DataType, complaints: Complaints) -> tuple[int | float | None, int | float | None]:
    low, high = (number_of(text, data_type) if text else None for text in (entry.low, entry.high))
    unreadable = (entry.low and low is None) or (entry.high and high is None)
    crossed = low is not None and high is not None and low > high
    if data_type in TEXT_TYPES or unreadable or crossed:
        if entry.low or entry.high:
            complaints.note("the limits of {} make no sense and are not taken", entry.section)
        return None, None
    return low, high


def _default(
    file: EdsFile, entry: EdsObject, data_type: DataType, complaints: Complaints
) -> tuple[int | float | str | None, bool]:
    """What the object holds at power-on: what a DCF sets, else the default; and whether it is relative to the node-ID."""
    text = entry.value or entry.default
    if data_type in TEXT_TYPES:
        return _text(text, data_type, entry, complaints), False
    if not text:
        return None, False
    value = number_of(text, data_type)
    if value is None:
        complaints.note("the value of {} is not a value of its type and is not taken", entry.section)
        return None, False
    written, default = parse_number(text), parse_number(entry.default)
    if written is not None and written.node_relative:
        return value, True
    if default is not None and default.node_relative and file.node_id is not None and isinstance(value, int):
        return max(value - file.node_id, 0), True  # a DCF says the sum for its own node
    return value, False


def _text(text: str, data_type: DataType, entry: EdsObject, complaints: Complaints) -> str:
    plain = text.strip('"')
    if data_type is DataType.USTR:
        return plain.encode("utf-16-le", "replace").decode("latin-1")
    if data_type not in BYTE_TYPES:
        one_byte_each = plain.encode("latin-1", "replace").decode("latin-1")
        if one_byte_each != plain:
            complaints.note("the text of {} has characters beyond ISO 8859-1, for each of which '?' stands", entry.section)
        return one_byte_each
    try:
        return bytes.fromhex(text).decode("latin-1")
    except ValueError:
        complaints.note("the value of {} is not made of hexadecimal bytes and is not taken", entry.section)
        return ""


def _within(value: int | float, low: int | float | None, high: int | float | None) -> bool:
    return (low is None or value >= low) and (high is None or value <= high)


# -- the whole ---------------------------------------------------------------------------------------------------------


def _with_open_values(objects: Objects, base: DriveProfile, complaints: Complaints) -> Objects:
    """Objects with a value where the file gives none and the base profile, for the same type, does."""
    known = {(entry.index, entry.subindex): entry for entry in base.objects}
    filled = {address: _filled(entry, known.get(address), complaints) for address, entry in objects.items()}
    for index in {index for index, _ in objects if _is_mapping(index)}:
        kept = {address: entry for address, entry in objects.items() if address[0] == index}
        told = any(entry.default for entry in kept.values())
        if told or not _fits(filled, index):
            filled |= kept
    return filled


def _filled(entry: ObjectEntry, other: ObjectEntry | None, complaints: Complaints) -> ObjectEntry:
    """An entry with the value and the limits of the base where the file has none of the kind."""
    if other is None or other.data_type is not entry.data_type:
        return entry
    limits = (other.low, other.high) if entry.low is None and entry.high is None else (entry.low, entry.high)
    if entry.default in (None, "") or _impossible(entry.default, other):
        if entry.default not in (None, ""):
            complaints.note("the value of {} is 0, by which the drive divides; the profile's is taken", _place_of(entry))
        entry = replace(entry, default=other.default, default_node_relative=other.default_node_relative)
    fits = not isinstance(entry.default, int | float) or _within(entry.default, *limits)
    return replace(entry, low=limits[0], high=limits[1]) if fits else replace(entry, low=None, high=None)


def _impossible(value: int | float | str | None, other: ObjectEntry) -> bool:
    return value == 0 and other.low is not None and other.low > 0


def _is_mapping(index: int) -> bool:
    return index in _RPDO_MAPPING or index in _TPDO_MAPPING


def _fits(objects: Objects, index: int) -> bool:
    """Whether a mapping can be used as it stands."""
    try:
        _check_mapping(Path(), objects, index)
    except UserError:
        return False
    return True


def _roles(objects: Objects, base: DriveProfile, complaints: Complaints) -> Iterator[tuple[str, Role]]:
    """The base's roles that an object of the same type plays in this file too."""
    types = {(entry.index, entry.subindex): entry.data_type for entry in base.objects}
    for name, role in base.roles.items():
        entry = objects.get((role.index, role.subindex))
        if entry is not None and entry.data_type is types[role.index, role.subindex]:
            yield name, role
        else:
            complaints.note("no object of the file is the drive's {}", name.replace("_", " "))


def _check_complete(path: Path, objects: Objects, base: DriveProfile) -> None:
    history = range(max((sub for index, sub in objects if index == _ERROR_FIELD), default=0))
    missing = sorted(MANDATORY.union((_ERROR_FIELD, sub) for sub in history) - set(objects))
    if not missing and not _modes(objects, base):
        missing = sorted(mode_objects(base.streaming_mode) - set(objects))
    if missing:
        raise UserError(
            f"{path} lacks objects that a drive which behaves as {base.name} needs: {', '.join(_grouped(missing))}; "
            "add them to the file, or choose another --profile"
        )


def _modes(objects: Objects, base: DriveProfile) -> tuple[int, ...]:
    return tuple(mode for mode in base.modes if mode_objects(mode) <= objects.keys())


def _with_modes(objects: Objects, base: DriveProfile, complaints: Complaints) -> DriveProfile:
    """The base with the modes whose objects are there, and what it goes by where the file has no such object."""
    modes = _modes(objects, base)
    for mode in set(base.modes) - set(modes):
        complaints.note("no objects for mode of operation {}", str(mode))
    known = {(entry.index, entry.subindex): entry for entry in base.objects}
    lacking = sorted(required_objects(modes) - objects.keys())
    return replace(
        base,
        modes=modes,
        streaming_mode=base.streaming_mode if base.streaming_mode in modes else modes[0],
        implicit=tuple(_silent(known[address]) for address in lacking if address in known),
    )


def _silent(entry: ObjectEntry) -> ObjectEntry:
    """An object that the file lacks must say nothing on the bus: no EMCY, no PDO."""
    if entry.index in _COB_IDS and entry.subindex == _COB_IDS[entry.index]:
        return replace(entry, default=_INVALID, default_node_relative=False)
    if _is_mapping(entry.index):
        return replace(entry, default=0)
    return entry


def _grouped(addresses: Iterable[Address]) -> list[str]:
    """An object all of whose entries are named once, sub-indices together."""
    subs: dict[int, list[int]] = {}
    for index, subindex in addresses:
        subs.setdefault(index, []).append(subindex)
    return [f"{index:04X}h" + _subindices(found) for index, found in subs.items()]


def _subindices(found: list[int]) -> str:
    if found == [0]:
        return ""
    span = f"{found[0]:02X}" if len(found) == 1 else f"{found[0]:02X}..{found[-1]:02X}"
    return f":{span}"


def _with_head(file: EdsFile, objects: Objects, roles: dict[str, Role], base: DriveProfile) -> DriveProfile:
    """Identity from [DeviceInfo], else from 1018h; 6502h says the modes that the drive really has."""
    vendor, product, revision = (
        _identity(file, objects, key, subindex, otherwise)
        for key, subindex, otherwise in (
            ("VendorNumber", 1, base.vendor_id),
            ("ProductNumber", 2, base.product_code),
            ("RevisionNumber", 3, base.revision_number),
        )
    )
    name = file.device.get("ProductName") or base.device_name
    given: dict[Address, int | str] = {
        (0x1008, 0): name,
        (0x1018, 1): vendor,
        (0x1018, 2): product,
        (0x1018, 3): revision,
        (0x6502, 0): supported_modes(base.modes),
    }
    entries = (
        replace(entry, default=given[address], low=None, high=None) if address in given else entry
        for address, entry in objects.items()
    )
    return replace(
        base,
        name=file.path.stem,
        description=f"{name} as {file.path.name} tells it, behaving as {base.name}",
        vendor_id=vendor,
        product_code=product,
        revision_number=revision,
        device_name=name,
        roles=roles,
        objects=tuple(entries),
    )


def _identity(file: EdsFile, objects: Objects, key: str, subindex: int, otherwise: int) -> int:
    told = parse_number(file.device.get(key))
    if told is not None and 0 <= told.value <= 0xFFFFFFFF:
        return told.value
    entry = objects.get((0x1018, subindex))
    return entry.default if entry is not None and isinstance(entry.default, int) else otherwise


def _check_mappings(path: Path, objects: Objects) -> None:
    """Every PDO mapping at power-on is made of objects that are there, fit, and may be mapped (CiA 301, 7.5.2.36)."""
    for index, subindex in objects:
        if subindex == 0 and _is_mapping(index):
            _check_mapping(path, objects, index)


def _check_mapping(path: Path, objects: Objects, index: int) -> None:
    bits = sum(_mapped_bits(path, objects, index, sub) for sub in range(1, _count(objects, index) + 1))
    if bits > _PDO_BITS:
        raise UserError(f"{path}, [{index:04X}]: the mapping is {bits} bits long; a PDO carries {_PDO_BITS}: shorten it")


def _count(objects: Objects, index: int) -> int:
    value = objects[index, 0].default if (index, 0) in objects else 0
    return value if isinstance(value, int) else 0


def _mapped_bits(path: Path, objects: Objects, index: int, subindex: int) -> int:
    """Length of what a mapping entry names. Raises UserError where it names nothing that such a PDO may carry."""
    entry = objects.get((index, subindex))
    value = entry.default if entry is not None and isinstance(entry.default, int) else 0
    mapped, bits = (value >> 16, value >> 8 & 0xFF), value & 0xFF
    if index in _RPDO_MAPPING and DataType.I8 <= mapped[0] <= DataType.U32:
        return bits
    target = objects.get(mapped)
    carried = target is not None and (target.rpdo if index in _RPDO_MAPPING else target.tpdo)
    if target is None or not carried or bits != max(8, BITS.get(target.data_type, 0)):
        raise UserError(
            f"{path}, [{index:04X}sub{subindex:X}]: maps {_place(mapped)} with {bits} bits; expected an object of the file "
            f"that may stand in such a PDO, with its own length: correct the mapping, PDOMapping or the object"
        )
    return bits


def _place(address: Address) -> str:
    return f"{address[0]:04X}h" + (f":{address[1]:02X}" if address[1] else "")


def _place_of(entry: ObjectEntry) -> str:
    return _place((entry.index, entry.subindex))
