"""Node-ID and bit rate set over the bus itself: the LSS slave (CiA 305).

A node-ID that LSS configures becomes the node's at the next reset communication, or, on a node that has none (FFh), when the
master switches it back to waiting.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from enum import IntEnum

from drivetwin.emulator.canopen.nmt import Nmt
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary
from drivetwin.emulator.canopen.parameter_store import ParameterStore

REQUEST_COB_ID = 0x7E5
RESPONSE_COB_ID = 0x7E4

UNCONFIGURED = 0xFF
"""Node-ID of a node that has none: it does nothing but LSS."""

NODE_IDS = frozenset((*range(1, 128), UNCONFIGURED))

STANDARD_TABLE = 0
BIT_RATES = {0: 1000, 1: 800, 2: 500, 3: 250, 4: 125, 6: 50, 7: 20, 8: 10}
"""Bit rates [kbit/s] by their index in the standard table; 5 is reserved (CiA 305, configure bit timing)."""

FASTSCAN_START = 0x80
MILLISECOND = 1e-3

_FRAME_LENGTH = 8
_NUMBER = struct.Struct("<BI3x")
_FASTSCAN = struct.Struct("<xIBBB")


class LssState(IntEnum):
    """Mode that 'switch state global' names."""

    WAITING = 0
    CONFIGURATION = 1


class Command(IntEnum):
    """LSS command specifiers (CiA 305)."""

    SWITCH_GLOBAL = 0x04
    CONFIGURE_NODE_ID = 0x11
    CONFIGURE_BIT_TIMING = 0x13
    ACTIVATE_BIT_TIMING = 0x15
    STORE = 0x17
    SELECT_VENDOR = 0x40
    SELECT_PRODUCT = 0x41
    SELECT_REVISION = 0x42
    SELECT_SERIAL = 0x43
    SELECTED = 0x44
    IDENTIFY_VENDOR = 0x46
    IDENTIFY_PRODUCT = 0x47
    IDENTIFY_REVISION_LOW = 0x48
    IDENTIFY_REVISION_HIGH = 0x49
    IDENTIFY_SERIAL_LOW = 0x4A
    IDENTIFY_SERIAL_HIGH = 0x4B
    IDENTIFY_NON_CONFIGURED = 0x4C
    IDENTIFIED = 0x4F
    NON_CONFIGURED = 0x50
    FASTSCAN = 0x51
    INQUIRE_VENDOR = 0x5A
    INQUIRE_PRODUCT = 0x5B
    INQUIRE_REVISION = 0x5C
    INQUIRE_SERIAL = 0x5D
    INQUIRE_NODE_ID = 0x5E


class Result(IntEnum):
    """Error codes of the configuration services."""

    DONE = 0
    REFUSED = 1
    """Node-ID out of range, bit timing or storing not supported."""
    NOT_STORED = 2


class LssSlave:
    """LSS slave of one node; its LSS address is its identity object (1018h).

    `node_id` and `bit_timing` are what is configured. `boot` is called when a node without node-ID has got one, each of
    `on_bit_timing` gets the time for which a node that changes its bit rate is to be silent [s].
    """

    def __init__(
        self,
        od: ObjectDictionary,
        nmt: Nmt,
        store: ParameterStore | None,
        transmit: Callable[[int, bytes], None],
        boot: Callable[[], None],
    ) -> None:
        self._identity = tuple(od[0x1018, subindex].number for subindex in range(1, 5))
        self._nmt = nmt
        self._store = store
        self._transmit = transmit
        self._boot = boot
        stored = store.lss if store is not None else {}
        self.node_id = stored.get("node_id", nmt.node_id)
        self.bit_timing = stored.get("bit_timing", 0)
        self.on_bit_timing: list[Callable[[float], None]] = []
        self.reset()
        self._always: dict[int, Callable[[bytes], None]] = {
            Command.SWITCH_GLOBAL: self._switch_global,
            Command.IDENTIFY_NON_CONFIGURED: self._identify_non_configured,
            Command.FASTSCAN: self._fastscan,
            **dict.fromkeys(range(Command.SELECT_VENDOR, Command.SELECT_SERIAL + 1), self._select),
            **dict.fromkeys(range(Command.IDENTIFY_VENDOR, Command.IDENTIFY_SERIAL_HIGH + 1), self._identify),
        }
        self._configuring: dict[int, Callable[[bytes], None]] = {
            Command.CONFIGURE_NODE_ID: self._configure_node_id,
            Command.CONFIGURE_BIT_TIMING: self._configure_bit_timing,
            Command.ACTIVATE_BIT_TIMING: self._activate_bit_timing,
            Command.STORE: self._store_configuration,
            Command.INQUIRE_NODE_ID: self._inquire_node_id,
            **dict.fromkeys(range(Command.INQUIRE_VENDOR, Command.INQUIRE_SERIAL + 1), self._inquire),
        }

    def reset(self) -> None:
        """Wait for a master, as after power-on."""
        self.state = LssState.WAITING
        self._selected: list[int] = []
        self._limits: list[int] = []
        self._scanned = 0

    def receive(self, data: bytes) -> None:
        """A frame of the LSS master; one that is not for this node or this state is ignored."""
        if len(data) != _FRAME_LENGTH:
            return
        handle = self._always.get(data[0])
        if handle is None and self.state is LssState.CONFIGURATION:
            handle = self._configuring.get(data[0])
        if handle is not None:
            handle(bytes(data))

    def _answer(self, command: Command, number: int = 0) -> None:
        self._transmit(RESPONSE_COB_ID, _NUMBER.pack(command, number))

    # -- which node is meant ------------------------------------------------------------------------------------------

    def _switch_global(self, frame: bytes) -> None:
        if frame[1] == LssState.CONFIGURATION:
            self.state = LssState.CONFIGURATION
        elif frame[1] == LssState.WAITING:
            self.state = LssState.WAITING
            if self._nmt.node_id == UNCONFIGURED and self.node_id != UNCONFIGURED:
                self._boot()

    def _select(self, frame: bytes) -> None:
        """Four frames name an LSS address; the node that has it changes to configuration."""
        command, number = _NUMBER.unpack(frame)
        if self.state is LssState.CONFIGURATION or not _collect(self._selected, command - Command.SELECT_VENDOR, number):
            return
        if len(self._selected) == 4 and tuple(self._selected) == self._identity:
            self.state = LssState.CONFIGURATION
            self._answer(Command.SELECTED)

    def _identify(self, frame: bytes) -> None:
        """Six frames name a range of LSS addresses; each node in it says so."""
        command, number = _NUMBER.unpack(frame)
        if not _collect(self._limits, command - Command.IDENTIFY_VENDOR, number) or len(self._limits) < 6:
            return
        vendor, product, revision_low, revision_high, serial_low, serial_high = self._limits
        own_vendor, own_product, revision, serial = self._identity
        in_range = revision_low <= revision <= revision_high and serial_low <= serial <= serial_high
        if (vendor, product) == (own_vendor, own_product) and in_range:
            self._answer(Command.IDENTIFIED)

    def _identify_non_configured(self, _frame: bytes) -> None:
        if self._nmt.node_id == UNCONFIGURED:
            self._answer(Command.NON_CONFIGURED)

    def _fastscan(self, frame: bytes) -> None:
        """Find the address of one node without node-ID, bit by bit from the top of each of its four numbers."""
        number, bit, part, following = _FASTSCAN.unpack(frame)
        if self._nmt.node_id != UNCONFIGURED or self.state is LssState.CONFIGURATION:
            return
        if bit == FASTSCAN_START:
            self._scanned = 0
            self._answer(Command.IDENTIFIED)
        elif bit < 32 and part == self._scanned and following < 4 and number >> bit == self._identity[part] >> bit:
            self._scanned = following
            if bit == 0 and following < part:
                self.state = LssState.CONFIGURATION
            self._answer(Command.IDENTIFIED)

    # -- what the node shall be ---------------------------------------------------------------------------------------

    def _configure_node_id(self, frame: bytes) -> None:
        if frame[1] in NODE_IDS:
            self.node_id = frame[1]
            self._answer(Command.CONFIGURE_NODE_ID, Result.DONE)
        else:
            self._answer(Command.CONFIGURE_NODE_ID, Result.REFUSED)

    def _configure_bit_timing(self, frame: bytes) -> None:
        if frame[1] == STANDARD_TABLE and frame[2] in BIT_RATES:
            self.bit_timing = frame[2]
            self._answer(Command.CONFIGURE_BIT_TIMING, Result.DONE)
        else:
            self._answer(Command.CONFIGURE_BIT_TIMING, Result.REFUSED)

    def _activate_bit_timing(self, frame: bytes) -> None:
        """The node is silent for the switch delay before and after the change."""
        delay = int.from_bytes(frame[1:3], "little") * MILLISECOND
        for silence in self.on_bit_timing:
            silence(2.0 * delay)

    def _store_configuration(self, _frame: bytes) -> None:
        if self._store is None:
            self._answer(Command.STORE, Result.REFUSED)
            return
        try:
            self._store.configure(self.node_id, self.bit_timing)
        except OSError:
            self._answer(Command.STORE, Result.NOT_STORED)
        else:
            self._answer(Command.STORE, Result.DONE)

    def _inquire(self, frame: bytes) -> None:
        command = Command(frame[0])
        self._answer(command, self._identity[command - Command.INQUIRE_VENDOR])

    def _inquire_node_id(self, _frame: bytes) -> None:
        self._answer(Command.INQUIRE_NODE_ID, self._nmt.node_id)


def _collect(numbers: list[int], place: int, number: int) -> bool:
    """Keep the number that belongs at `place` of a series; the first begins it anew, one out of turn ends it."""
    if place == 0:
        numbers.clear()
    if place != len(numbers):
        numbers.clear()
        return False
    numbers.append(number)
    return True
