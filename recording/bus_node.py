"""What is known of a node's objects, from its EDS or DCF and from the SDO transfers of a bus log.

PDO parameters (CiA 301, 7.5.2.35 ff.), the factor group (608Fh, 6091h, 6092h) and the rated torque (6076h, CiA 402-2).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from drivetwin.drive_profiles.eds_reader import parse_number, read_eds
from drivetwin.recording.import_map import AxisMap, ObjectKey

# CiA 301 table 44: data type index to the type's name here.
_EDS_TYPES = {2: "int8", 3: "int16", 4: "int32", 5: "uint8", 6: "uint16", 7: "uint32", 8: "float32", 0x11: "float64"}
_INTEGERS = frozenset({1, 2, 3, 4, 5, 6, 7, 0x10, *range(0x12, 0x1C)})
_RATED_TORQUE = (0x6076, 0)
_ENCODER = ((0x608F, 1), (0x608F, 2))
_GEAR = ((0x6091, 1), (0x6091, 2))
_FEED = ((0x6092, 1), (0x6092, 2))
_NOT_VALID = 1 << 31


@dataclass
class Pdo:
    """One PDO as it stands: COB-ID, transmission type, and where it takes its values from."""

    communication: int
    mapping: int
    transmit: bool


@dataclass
class Node:
    """What is known of one node's objects, from its EDS or DCF and from the log so far.

    `defaults`: those whose value only an EDS tells, as the drive was shipped.
    """

    number: int
    types: dict[ObjectKey, str] = field(default_factory=dict)
    values: dict[ObjectKey, int] = field(default_factory=dict)
    defaults: set[ObjectKey] = field(default_factory=set)
    pending: tuple[ObjectKey, int] | None = None

    def value(self, key: ObjectKey, default: int) -> int:
        """The object's value as last written or read on the bus, else from the EDS, else `default`."""
        return self.values.get(key, default)

    def pdos(self) -> Iterator[Pdo]:
        """The PDOs for which anything is known, RPDOs first."""
        for base, transmit in ((0x1400, False), (0x1800, True)):
            known = {
                key[0] & 0x1FF for key in self.values if key[0] & ~0x1FF == base or key[0] & ~0x1FF == base + 0x200
            }
            for number in sorted(known):
                yield Pdo(base + number, base + 0x200 + number, transmit)

    def cob_id(self, pdo: Pdo) -> int | None:
        """The COB-ID, by the predefined connection set where it was never said; None where the PDO is switched off."""
        number = pdo.communication & 0x1FF
        predefined = (0x180 if pdo.transmit else 0x200) + 0x100 * number + self.number if number < 4 else _NOT_VALID
        cob_id = self.value((pdo.communication, 1), predefined)
        return None if cob_id & _NOT_VALID else cob_id & 0x7FF

    def fields(self, pdo: Pdo) -> list[tuple[ObjectKey, int, int]]:
        """(object, first bit, bits) of everything the PDO carries."""
        entries = [self.value((pdo.mapping, sub), 0) for sub in range(1, self.value((pdo.mapping, 0), 0) + 1)]
        starts = itertools.accumulate((entry & 0xFF for entry in entries), initial=0)
        return [
            ((entry >> 16, entry >> 8 & 0xFF), start, entry & 0xFF)
            for entry, start in zip(entries, starts, strict=False)
        ]


def node_from_eds(file: Path | None, node_id: int) -> Node:
    """Types and defaults (a DCF's values before them) of an EDS or DCF."""
    node = Node(node_id)
    if file is None:
        return node
    for entry in read_eds(file).objects:
        key = (entry.index, entry.subindex)
        type_ = _EDS_TYPES.get(entry.data_type or 0)
        if type_ is not None:
            node.types[key] = type_
        set_to = parse_number(entry.value)
        told = set_to or parse_number(entry.default)
        if told is not None and entry.data_type in _INTEGERS:
            node.values[key] = told.of_node(node.number)
            if set_to is None:
                node.defaults.add(key)
    return node


def follow_sdo(node: Node, data: bytes, *, from_server: bool) -> bool:
    """Note an expedited transfer (CiA 301, 7.2.4.3); True where a PDO's parameters changed."""
    if len(data) < 8:
        return False
    command, key = data[0], (data[1] | data[2] << 8, data[3])
    expedited = command & 0x02
    size = 4 - (command >> 2 & 3) if command & 0x01 else 4
    value = int.from_bytes(data[4 : 4 + size], "little")
    if not from_server:
        # A download holds once the drive has confirmed it; one it aborts never does.
        node.pending = (key, value) if command & 0xE0 == 0x20 and expedited else None
        return False
    if command & 0xE0 == 0x60 and node.pending is not None and node.pending[0] == key:
        value = node.pending[1]
    elif not (command & 0xE0 == 0x40 and expedited):
        node.pending = None
        return False
    node.pending = None
    changed = node.values.get(key) != value
    node.values[key] = value
    node.defaults.discard(key)
    return changed and 0x1400 <= key[0] <= 0x1BFF


def with_constants(axis: AxisMap, node: Node) -> AxisMap:
    """The axis with the constants that the map leaves out, as the drive's objects have them (CiA 402-2).

    What a drive was shipped with is no constant of this machine: an EDS default counts only where the log confirms it.
    """
    found: dict[str, float] = {}
    turns = _ratio(node, _GEAR)
    increments = _ratio(node, _ENCODER)
    feed = _ratio(node, _FEED)
    if turns is not None and axis.joint_type == "hinge":
        found["gear_ratio"] = turns
    if increments is not None:
        found["encoder_increments"] = increments
    if feed is not None and not node.defaults & set(_GEAR):
        found["user_units_per_motor_turn"] = feed / (turns or 1.0)
    if axis.rated_torque is None and node.values.get(_RATED_TORQUE) and _RATED_TORQUE not in node.defaults:
        found["motor_rated_torque"] = node.values[_RATED_TORQUE] * 1e-3
    return axis.model_copy(update={name: value for name, value in found.items() if getattr(axis, name) is None})


def unconfirmed(axis: AxisMap, node: Node) -> tuple[str, ...]:
    factors = {
        "encoder_increments": _ENCODER,
        "gear_ratio": _GEAR,
        "user_units_per_motor_turn": (*_GEAR, *_FEED),
        "motor_rated_torque": (_RATED_TORQUE,) if axis.rated_torque is None else (),
    }
    keys = {key for name, keys in factors.items() if getattr(axis, name) is None for key in keys}
    return tuple(sorted({f"{index:04X}h" for index, _ in keys & node.defaults}))


def _ratio(node: Node, keys: tuple[ObjectKey, ObjectKey]) -> float | None:
    """Numerator over denominator of a factor, None where the numerator was never told, or a part is an EDS default."""
    numerator = node.values.get(keys[0])
    return numerator / (node.values.get(keys[1]) or 1) if numerator and not node.defaults & set(keys) else None


def object_name(key: ObjectKey) -> str:
    return f"{key[0]:04X}h" + (f":{key[1]}" if key[1] else "")
