"""The beat that all nodes share: the SYNC consumer (CiA 301, 7.2.5, 1005h)."""

from __future__ import annotations

from collections.abc import Callable

from emulator.canopen.abort_codes import AbortCode, SdoAbort
from emulator.canopen.can_identifier import BIT_30, CAN_ID, check_cob_id
from emulator.canopen.data_types import Value
from emulator.canopen.object_dictionary import ObjectDictionary


class Sync:
    """SYNC consumer of one node: `sample`, then `actuate`, is what its PDOs do at a SYNC (CiA 301, 7.2.2.2)."""

    def __init__(self, od: ObjectDictionary) -> None:
        self._parameter = od[0x1005]
        self._parameter.on_write = self._check
        self.sample: tuple[Callable[[], None], ...] = ()
        self.actuate: tuple[Callable[[], None], ...] = ()

    @property
    def cob_id(self) -> int:
        """CAN-ID of the SYNC that this node listens to."""
        return self._parameter.number & CAN_ID

    def run(self) -> None:
        """What the node does at a SYNC: synchronous TPDOs are sampled and sent, then synchronous RPDOs take effect."""
        for send in self.sample:
            send()
        for take_effect in self.actuate:
            take_effect()

    def _check(self, value: Value) -> None:
        # a drive is no SYNC producer; bit 31 has no meaning here and is kept as written
        if int(value) & BIT_30:
            raise SdoAbort(AbortCode.INVALID_VALUE)
        check_cob_id(int(value))
