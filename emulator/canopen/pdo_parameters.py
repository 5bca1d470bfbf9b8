"""How a PDO is configured while the bus runs: the communication and mapping parameters and the order in which they may
be changed, disable - write - enable (CiA 301, 7.5.2.35 to 7.5.2.38).
"""

from __future__ import annotations

import logging
from collections.abc import Callable

from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.can_identifier import BIT_30, CAN_ID, INVALID, check_change, check_cob_id, exists
from drivetwin.emulator.canopen.data_types import Value
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary, Variable
from drivetwin.emulator.canopen.pdo_mapping import MAX_LENGTH, Mapping, MappingRule, check_entry, parse_mapping

logger = logging.getLogger(__name__)

INHIBIT_UNIT = 100e-6
"""Of sub-index 3 [s]."""

SYNCHRONOUS = range(241)
"""Transmission types that act at a SYNC: 0 acyclic, 1..240 cyclic (CiA 301, table 66 and 72)."""


class PdoParameters:
    """What a PDO is to do, as its parameters stand; `changed` is called after each change of it.

    `types` are the transmission types that the PDO supports, `rule` says which objects it may carry.
    """

    def __init__(
        self,
        od: ObjectDictionary,
        communication_index: int,
        mapping_index: int,
        *,
        types: frozenset[int],
        rule: MappingRule,
        changed: Callable[[], None],
    ) -> None:
        self._od = od
        self._communication_index = communication_index
        self._mapping_index = mapping_index
        self._types = types
        self._rule = rule
        self._changed = changed
        self._cob_id = 0
        self._count = 0
        self.transmission_type = 0
        self.mapping = Mapping((), parse_mapping(od, (), rule).layout)
        self._bind()
        self.load()

    @property
    def cob_id(self) -> int:
        """CAN-ID of the PDO."""
        return self._cob_id & CAN_ID

    @property
    def active(self) -> bool:
        """Whether the PDO exists (bit 31) and carries something."""
        return exists(self._cob_id) and self._count > 0

    @property
    def remote_allowed(self) -> bool:
        """Whether a master may ask for the PDO by a remote frame."""
        return not self._cob_id & BIT_30

    @property
    def synchronous(self) -> bool:
        """Whether the PDO waits for SYNC."""
        return self.transmission_type in SYNCHRONOUS

    def load(self) -> None:
        """Take everything as it stands in the dictionary. A stored mapping that this drive cannot have maps nothing."""
        self._cob_id = self._communication(1).number
        self.transmission_type = self._communication(2).number
        try:
            self._enable_mapping(self._od[self._mapping_index].number)
        except SdoAbort as refusal:
            logger.warning("mapping %04Xh is not possible and is left out: %s", self._mapping_index, refusal)
            self._od[self._mapping_index].value = 0
            self._enable_mapping(0)

    def refuse_while_existing(self, _value: Value) -> None:
        """Raise SdoAbort while the PDO exists; also the rule for the inhibit time."""
        if exists(self._cob_id):
            raise SdoAbort(AbortCode.DEVICE_STATE)

    def _bind(self) -> None:
        self._communication(1).on_write = self._write_cob_id
        self._communication(2).on_write = self._write_type
        self._od[self._mapping_index].on_write = self._write_count
        for subindex in range(1, MAX_LENGTH + 1):
            self._od[self._mapping_index, subindex].on_write = self._write_entry

    def _communication(self, subindex: int) -> Variable:
        return self._od[self._communication_index, subindex]

    def _write_cob_id(self, value: Value) -> None:
        cob_id = int(value)
        if exists(cob_id):
            check_cob_id(cob_id & ~BIT_30)
        elif cob_id & ~(INVALID | BIT_30 | CAN_ID):
            raise SdoAbort(AbortCode.INVALID_VALUE)
        check_change(self._cob_id, cob_id)
        self._cob_id = cob_id
        self._changed()

    def _write_type(self, value: Value) -> None:
        if int(value) not in self._types:
            raise SdoAbort(AbortCode.INVALID_VALUE)
        self.transmission_type = int(value)
        self._changed()

    def _write_count(self, value: Value) -> None:
        self.refuse_while_existing(value)
        self._enable_mapping(int(value))
        self._changed()

    def _write_entry(self, value: Value) -> None:
        self.refuse_while_existing(value)
        if self._count:
            raise SdoAbort(AbortCode.DEVICE_STATE)
        check_entry(self._od, int(value), self._rule)

    def _enable_mapping(self, count: int) -> None:
        if count > MAX_LENGTH:
            raise SdoAbort(AbortCode.PDO_LENGTH)
        entries = [self._od[self._mapping_index, subindex].number for subindex in range(1, count + 1)]
        self.mapping = parse_mapping(self._od, entries, self._rule)
        self._count = count
