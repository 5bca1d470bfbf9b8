"""The PDOs of every node are mapped as the bench requires, and there are no others."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, Expectation, Finding

INVALID = 1 << 31
CAN_ID = 0x7FF

_PREDEFINED = {"rpdo": 0x200, "tpdo": 0x180}
"""COB-ID of the first PDO, less the node-ID; the next ones are 100h apart (CiA 301, 7.3.3)."""


@dataclass(frozen=True)
class PdoMapping(Expectation):
    """Entries, transmission type and predefined COB-ID, as the node's own dictionary has them when it becomes operational.

    Of real drives: as they were written or read back on the bus.
    """

    name: ClassVar[str] = "pdo_mapping"
    needs_truth: ClassVar[bool] = False

    def judge(self, evidence: Evidence) -> Finding:
        finding = MET
        for axis, node in zip(evidence.axes, evidence.nodes, strict=True):
            configured = evidence.configured.get(axis)
            if configured is None:
                finding += self.fails(f"node {node} never became operational, so that no PDO of it exists", axis)
                continue
            for name in configured.unknown_pdos:
                said = f"node {node}, {name}: the controller neither wrote it nor read it back, so that nobody knows how it is"
                finding += self.fails(said, axis, configured.time)
            for name, (cob_id, kind, entries) in configured.pdos.items():
                said = self._of_pdo(evidence, name, node, cob_id, kind, entries)
                if said:
                    finding += self.fails(f"node {node}, {name}: {said}", axis, configured.time)
        return finding

    @staticmethod
    def _of_pdo(evidence: Evidence, name: str, node: int, cob_id: int, kind: int, entries: tuple[int, ...]) -> str:
        """What is wrong with a PDO; nothing: an empty text."""
        ordered = evidence.bench.pdo.get(name)
        if ordered is None:
            return "" if cob_id & INVALID else f"exists with COB-ID {cob_id & CAN_ID:03X}h, and none was ordered"
        if cob_id & INVALID:
            return "does not exist (bit 31 of its COB-ID), and was ordered"
        direction, number = name.split()
        predefined = _PREDEFINED[direction] + 0x100 * (int(number) - 1) + node
        if cob_id & CAN_ID != predefined:
            return f"has COB-ID {cob_id & CAN_ID:03X}h, ordered was the predefined {predefined:03X}h"
        if entries != ordered.entries:
            return f"maps {_text(entries)}, ordered was {_text(ordered.entries)}"
        if kind != ordered.transmission:
            return f"has transmission type {kind}, ordered was {ordered.transmission}"
        return ""


def _text(entries: tuple[int, ...]) -> str:
    return ", ".join(f"{entry >> 16:04X}:{entry >> 8 & 0xFF:02X}:{entry & 0xFF}" for entry in entries) or "nothing"
