"""A machine at one end of a wire and its controllers at the other: who sends each frame, and who receives it complete."""

from __future__ import annotations

from collections.abc import Callable

import can

from drivetwin.bus.timing.frame_bits import Frame
from drivetwin.bus.timing.wire import Transmission, Wire
from drivetwin.emulator.virtual_machine import VirtualMachine

CONTROLLER = -1
"""The sender of all frames from outside."""

NODE_ID = 0x7F
"""Bits of an identifier that tell which drive sends it (predefined connection set, CiA 301, 7.3.3)."""

INSTANT = 1e-9
"""The wire counts time in whole nanoseconds [s]."""


class Line:
    """Hands the machine's frames and the controller's to one wire, and gives the other side each when it is whole.

    A drive answers a frame when it has it whole. What a SYNC's cycle of the plant brings about is handed in when that cycle is
    over, counted from when SYNC was handed in: a drive locks to SYNC's beat, not to its delay.
    `watch` is told each frame before it is given.
    """

    def __init__(
        self,
        bit_rate: int,
        connect: Callable[[Callable[[can.Message], None]], VirtualMachine],
        transmit: Callable[[can.Message], None],
        watch: Callable[[Transmission], None],
    ) -> None:
        """`connect` gets the function that a machine transmits by, and returns the machine; `transmit` is to the controller."""
        self.bit_rate = bit_rate
        self._wire = Wire(bit_rate)
        self._transmit = transmit
        self._watch = watch
        self._on_the_wire: Transmission | None = None
        self._sent: list[can.Message] = []
        self.virtual = connect(self._sent.append)
        self._looked = self.virtual.now()
        self.time = 0.0
        """When the last frame that was given was whole [s]."""

    def send(self, message: can.Message, at: float) -> None:
        """The controller hands in a frame at the time `at` [s], or now if that is over."""
        self._hand_in(CONTROLLER, message, at)

    def moved(self) -> float:
        """How far the machine's clock has moved by itself since the machine was last looked at [s]."""
        return self.virtual.now() - self._looked

    def send_unasked(self, at: float) -> None:
        """Hand in from `at` [s] on what the machine has sent by itself: it ran on without SYNC, or a fault has struck."""
        self._hand_in_sent(begin=at, earliest=at)

    @property
    def unasked(self) -> bool:
        """Whether the machine has sent anything by itself."""
        return bool(self._sent)

    def run(self, until: float) -> None:
        """Give every frame that is whole before `until` [s]."""
        while (begun := self._begun(until)) is not None and begun.received < until:
            self._give(begun)

    def run_until_idle(self, after: float) -> None:
        """Give frame after frame until nobody wants the wire any more, at `after` [s] or later."""
        while (begun := self._begun(max(after, self._wire.free) + INSTANT)) is not None:
            self._give(begun)

    def next_event(self) -> float | None:
        """When the frame on the wire is whole, or the next one starts [s]; None where nobody sends."""
        return self._wire.next_start if self._on_the_wire is None else self._on_the_wire.received

    def _begun(self, until: float) -> Transmission | None:
        """What is on the wire: if nothing, the next frame that starts before `until` [s]."""
        if self._on_the_wire is None:
            self._on_the_wire = self._wire.step(until)
        return self._on_the_wire

    def _give(self, whole: Transmission) -> None:
        self._on_the_wire = None
        self.time = whole.received
        self._watch(whole)
        message = _message(whole)
        if whole.sender != CONTROLLER:
            self._transmit(message)
            return
        self.virtual.receive(message)
        self._hand_in_sent(begin=whole.handed_in, earliest=whole.received)

    def _hand_in_sent(self, begin: float, earliest: float) -> None:
        """The machine's frames, each as long after `begin` [s] as the machine's clock has come, but not before `earliest`."""
        before, self._looked = self._looked, self.virtual.now()
        for message in self._sent:
            at = max(earliest, begin + message.timestamp - before)
            self._hand_in(message.arbitration_id & NODE_ID, message, at)
        self._sent.clear()

    def _hand_in(self, sender: int, message: can.Message, at: float) -> None:
        requested = message.dlc if message.is_remote_frame else None
        data = b"" if message.is_remote_frame else bytes(message.data)
        self._wire.hand_in(sender, Frame(message.arbitration_id, data, requested), max(at, self._wire.settled))


def _message(whole: Transmission) -> can.Message:
    frame = whole.frame
    return can.Message(
        timestamp=whole.received,
        arbitration_id=frame.identifier,
        is_extended_id=False,
        is_remote_frame=frame.requested is not None,
        dlc=frame.length_code,
        data=frame.data,
    )
