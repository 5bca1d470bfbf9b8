"""What a scope's channel shows: an object of a drive, or a quantity of the plant's truth."""

from __future__ import annotations

import re
from dataclasses import dataclass

from drivetwin.drive_profiles.profile import BITS
from drivetwin.foundation.errors import UserError
from drivetwin.panel.dictionary import unit_of
from drivetwin.panel.node_watch import NodeWatch
from drivetwin.panel.pdo_reading import Address

TRUTH = {"position": {"rad": "rad", "m": "m"}, "velocity": {"rad": "rad/s", "m": "m/s"}, "torque": {"rad": "N·m", "m": "N"}}
"""Quantities of a joint that the emulator's owner is told, with their units by that of the position."""

_OBJECT = re.compile(r"(\d{1,3}):([0-9A-Fa-f]{4}):([0-9A-Fa-f]{2})")

_POSITION_UNITS = "position units"


@dataclass(frozen=True)
class Channel:
    """`key` is how a page names it: 1:6064:00, an object of node 1."""

    key: str
    label: str


@dataclass(frozen=True)
class ObjectChannel(Channel):
    """An object of a drive; how it comes is the bus's matter."""

    node: NodeWatch
    address: Address

    @property
    def unit(self) -> str:
        """Of what is shown: rad or m where the axis is known, else the object's own."""
        unit, _ = unit_of(self.node.profile, *self.address)
        if self.node.axis is None or self._joint_unit() is None:
            return unit
        return unit.replace(_POSITION_UNITS, self.node.axis.unit)

    @property
    def scale(self) -> float:
        """Shown value of a raw one."""
        return self._joint_unit() or 1.0

    @property
    def source(self) -> str:
        """What brings it."""
        return "PDO" if self.node.in_pdo(self.address) else "SDO"

    def _joint_unit(self) -> float | None:
        unit, _ = unit_of(self.node.profile, *self.address)
        return self.node.unit if self.node.axis is not None and unit.startswith(_POSITION_UNITS) else None


@dataclass(frozen=True)
class TruthChannel(Channel):
    """What the plant truly does, which no drive tells."""

    axis: str
    quantity: str
    unit: str
    scale: float = 1.0
    source: str = "truth"


AnyChannel = ObjectChannel | TruthChannel


def read_channel(key: str, nodes: dict[int, NodeWatch], *, truth: bool) -> AnyChannel:
    """The channel of a page's name for it: 1:6064:00 or truth:lift:position. Raises UserError."""
    if found := _OBJECT.fullmatch(key):
        return _object(key, int(found[1]), (int(found[2], 16), int(found[3], 16)), nodes)
    head, _, rest = key.partition(":")
    if head != "truth":
        raise UserError(f"{key!r} is no channel; expected NODE:INDEX:SUBINDEX as 1:6064:00, or truth:AXIS:QUANTITY")
    if not truth:
        raise UserError("only the process that started an emulator can read the truth; this panel has joined a bus")
    axis, _, quantity = rest.partition(":")
    axes = {node.axis.name: node.axis for node in nodes.values() if node.axis is not None}
    if axis not in axes or quantity not in TRUTH:
        raise UserError(f"{key}: there is truth of {', '.join(axes)}, and of each {', '.join(TRUTH)}")
    return TruthChannel(key, f"{axis} {quantity} (truth)", axis, quantity, TRUTH[quantity][axes[axis].unit])


def _object(key: str, node_id: int, address: Address, nodes: dict[int, NodeWatch]) -> ObjectChannel:
    if node_id not in nodes:
        raise UserError(f"{key}: there is no node {node_id}; there are {', '.join(map(str, nodes))}")
    node = nodes[node_id]
    entry = node.entry(*address)
    if entry.data_type not in BITS or not (entry.access.readable or node.in_pdo(address)):
        raise UserError(f"{entry.name} ({key}) is no number that can be read")
    return ObjectChannel(key, f"{node.name} {entry.name.replace('.', ' ')}", node, address)
