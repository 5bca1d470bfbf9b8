"""Reads the objects of a device from an EDS or DCF (CiA 306-1, 4.6), including common deviations of vendors' files.

A missing ParameterName, wrong counts, trailing lines and the like are warned of and read on. What a value means on a
drive is decided by who asks: `eds_profile` for the emulator, `drivetwin.recording.bus_log` for a recording.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from drivetwin.drive_profiles.eds_sections import Complaints, Section, read_sections, text_of
from drivetwin.foundation.errors import UserError

_VAR, _ARRAY, _RECORD = 0x7, 0x8, 0x9
_UNSIGNED8 = 0x5
_LISTS = ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects")
_SUB = re.compile(r"([0-9a-f]{4})sub([0-9a-f]{1,2})")
# Of at most 64 bits, with some zeros before; what is longer is no number that a device could have.
_NUMBER = re.compile(r"[+-]?(0x[0-9a-f]{1,24}|[0-9]{1,24})", re.IGNORECASE)


@dataclass(frozen=True)
class EdsObject:
    """One entry as the file has it, numbers not yet told from text. `data_type` is the code of CiA 301, table 44.

    `object_name` is the name of the record it belongs to, empty for a plain variable. `value` is what a DCF sets
    (ParameterValue), empty in an EDS.
    """

    section: str
    index: int
    subindex: int
    object_name: str
    name: str
    data_type: int | None
    access: str
    mappable: bool
    default: str
    value: str
    low: str
    high: str


@dataclass(frozen=True)
class EdsNumber:
    """A number of an EDS, and whether the node-ID is to be added to it ($NODEID)."""

    value: int
    node_relative: bool

    def of_node(self, node_id: int) -> int:
        """The number on the node with that ID."""
        return self.value + node_id if self.node_relative else self.value


@dataclass(frozen=True)
class EdsFile:
    """The objects of an EDS or DCF in the order of their addresses, [DeviceInfo], and the node-ID of a DCF."""

    path: Path
    device: Section
    node_id: int | None
    objects: tuple[EdsObject, ...]


def read_eds(path: Path) -> EdsFile:
    """Read an EDS or DCF.

    Raises UserError where there is no such file, where it is no EDS, or where it has no object at all.
    """
    return parse_eds(path, text_of(path))


def parse_eds(path: Path, text: str) -> EdsFile:
    """Read the text of an EDS or DCF; `path` is what messages call it. Raises UserError as `read_eds`."""
    complaints = Complaints(path)
    sections = read_sections(text, complaints)
    objects = tuple(sorted(_objects(sections, complaints), key=lambda entry: (entry.index, entry.subindex)))
    if not objects:
        raise UserError(f"{path} has no object: expected a section [1000] and more, each with a DataType (CiA 306)")
    _check_lists(sections, {entry.index for entry in objects}, complaints)
    complaints.tell()
    empty = Section("")
    commissioning = sections.get("devicecomissioning", sections.get("devicecommissioning", empty))
    node = parse_number(commissioning.get("NodeID"))
    return EdsFile(path, sections.get("deviceinfo", empty), node.value if node is not None else None, objects)


def parse_number(text: str) -> EdsNumber | None:
    """A decimal or hexadecimal number, with $NODEID before or behind it or alone; None where it is none."""
    terms = [term for term in re.sub(r"\s", "", text).upper().replace("$NODEID", "+$NODEID+").split("+") if term]
    numbers = [term for term in terms if term != "$NODEID"]
    if not terms or len(numbers) > 1 or len(terms) - len(numbers) > 1 or not all(map(_NUMBER.fullmatch, numbers)):
        return None
    return EdsNumber(_integer(numbers[0]) if numbers else 0, len(numbers) < len(terms))


def _integer(digits: str) -> int:
    """CiA 306 writes octal as C does; a leading zero in an EDS is nearly always a decimal number padded with zeros."""
    return int(digits, 16) if "X" in digits.upper() else int(digits)


def _objects(sections: dict[str, Section], complaints: Complaints) -> Iterator[EdsObject]:
    members: dict[int, dict[int, Section]] = {}
    for key, section in sections.items():
        found = _SUB.fullmatch(key)
        if found:
            members.setdefault(int(found.group(1), 16), {})[int(found.group(2), 16)] = section
    heads = {int(key, 16): section for key, section in sections.items() if re.fullmatch("[1-9a-f][0-9a-f]{3}", key)}
    for index in sorted(heads.keys() | members.keys()):
        if index not in heads:
            if index < 0x1000:
                continue  # a data type of the manufacturer, asked for by `_data_type`
            complaints.note("{} has sub-indices and no section of its own; read without", f"{index:04X}")
        head = heads.get(index, Section(f"{index:04X}"))
        yield from _entries(index, head, members.get(index, {}), sections, complaints)


def _entries(
    index: int, head: Section, members: dict[int, Section], sections: dict[str, Section], complaints: Complaints
) -> Iterator[EdsObject]:
    """The entries of one object: of a record its members, else the variable itself."""
    count = parse_number(head.get("CompactSubObj"))
    code = parse_number(head.get("ObjectType"))
    if members:
        yield from _record(index, head, members, sections, complaints)
    elif count is not None and count.value:
        yield from _compact(index, head, min(count.value, 254), sections, complaints)
    elif code is not None and code.value in (_ARRAY, _RECORD):
        complaints.note("{} is a record or array without a sub-index; left out", head.name)
    else:
        name = _name(head, f"object {index:04X}", complaints)
        yield _entry(index, 0, "", name, head, sections, complaints)


def _record(
    index: int, head: Section, members: dict[int, Section], sections: dict[str, Section], complaints: Complaints
) -> Iterator[EdsObject]:
    object_name = _name(head, f"object {index:04X}", complaints) if head.values else f"object {index:04X}"
    told = parse_number(head.get("SubNumber"))
    if told is not None and told.value != len(members):
        complaints.note("SubNumber of {} is not the number of its sub-indices; those that are there count", head.name)
    if 0 not in members:
        complaints.note("{} has no sub-index 0; it is taken as the highest one", head.name)
        yield _highest(index, object_name, max(members))
    for subindex, section in sorted(members.items()):
        name = _name(section, f"entry {subindex}", complaints)
        yield _entry(index, subindex, object_name, name, section, sections, complaints)


def _highest(index: int, object_name: str, subindex: int) -> EdsObject:
    name = "Highest sub-index supported"
    text = str(subindex)
    return EdsObject(f"{index:04X}sub0", index, 0, object_name, name, _UNSIGNED8, "const", False, text, "", "", "")


def _compact(
    index: int, head: Section, count: int, sections: dict[str, Section], complaints: Complaints
) -> Iterator[EdsObject]:
    """CompactSubObj: entries that are alike are told once; [xxxxName] and [xxxxValue] hold what differs (4.6.4.2)."""
    object_name = _name(head, f"object {index:04X}", complaints)
    names = sections.get(f"{head.name}Name".lower(), Section(""))
    values = sections.get(f"{head.name}Value".lower(), Section(""))
    yield _highest(index, object_name, count)
    for subindex in range(1, count + 1):
        name = names.get(str(subindex)) or f"{object_name} {subindex}"
        entry = _entry(index, subindex, object_name, name, head, sections, complaints)
        value = values.get(str(subindex)) or entry.value
        yield EdsObject(**{**vars(entry), "section": f"{head.name}sub{subindex:X}", "value": value})


def _name(section: Section, otherwise: str, complaints: Complaints) -> str:
    name = section.get("ParameterName")
    if not name:
        complaints.note("no ParameterName in {}; they are read without", section.name)
    return name or otherwise


def _entry(
    index: int,
    subindex: int,
    object_name: str,
    name: str,
    section: Section,
    sections: dict[str, Section],
    complaints: Complaints,
) -> EdsObject:
    mapped = parse_number(section.get("PDOMapping"))
    access = section.get("AccessType").lower()
    if not access:
        complaints.note("no AccessType in {}; they are taken as read-only", section.name)
    return EdsObject(
        section=section.name,
        index=index,
        subindex=subindex,
        object_name=object_name,
        name=name,
        data_type=_data_type(section, sections),
        access=access or "ro",
        mappable=mapped is not None and mapped.value != 0,
        default=section.get("DefaultValue"),
        value=section.get("ParameterValue"),
        low=section.get("LowLimit"),
        high=section.get("HighLimit"),
    )


def _data_type(section: Section, sections: dict[str, Section]) -> int | None:
    """The type's code; one that CANfestival's editor made up (A0h...) stands for the one in [A0sub1] DefaultValue."""
    told = parse_number(section.get("DataType"))
    if told is None:
        return None
    alias = sections.get(f"{told.value:x}sub1")
    stands_for = parse_number(alias.get("DefaultValue")) if alias is not None and told.value < 0x1000 else None
    return told.value if stands_for is None else stands_for.value


def _check_lists(sections: dict[str, Section], found: set[int], complaints: Complaints) -> None:
    """The three lists of objects say what the sections say already; where they differ, the sections are right."""
    listed: set[int] = set()
    for name in _LISTS:
        section = sections.get(name.lower())
        if section is None:
            complaints.note("the list of objects {} is missing", f"[{name}]")
            continue
        entries = [parse_number(value) for key, value in section.values.items() if key.isdigit()]
        indices = {entry.value for entry in entries if entry is not None}
        told = parse_number(section.get("SupportedObjects"))
        if told is None or told.value != len(entries):
            complaints.note("SupportedObjects of {} is not the number of its entries", f"[{section.name}]")
        listed |= indices
    for index in sorted(listed - found):
        complaints.note("{} is listed and has no section; left out", f"{index:04X}")
    for index in sorted(found - listed) if listed else ():
        complaints.note("{} is in no list of objects and has a section; taken", f"{index:04X}")
