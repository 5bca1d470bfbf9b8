"""The wire between one drive and the bus, on which faults can be injected while the bus runs."""

from __future__ import annotations

import logging
from collections.abc import Callable, Hashable, Iterable
from functools import partial
from math import inf

from drivetwin.emulator.canopen.device import Device
from drivetwin.emulator.wire.frames import Carry, Direction, Disturbance, Frame

logger = logging.getLogger(__name__)


class FaultyWire:
    """A drive's wire. `transmit` gets what the drive sends; `receive` gives it what the bus brings.

    While nothing is wrong `receive` is the device's own, so a sound wire costs nothing. Bus off, a change of the bit rate and
    disturbances may be present together. `rewired` is called whenever `taker` may give another answer than before.
    """

    def __init__(self, transmit: Callable[[int, bytes], None], now: Callable[[], float]) -> None:
        self._bus = transmit
        self._now = now
        self._device: Device | None = None
        self._is_off = False
        self._silent_until = -inf
        self._disturbances: dict[Direction, dict[Hashable, Disturbance]] = {direction: {} for direction in Direction}
        self._out = transmit
        self._outward: Carry = self._put_on_bus
        self._inward: Carry = self._hand_over
        self.receive: Callable[[int, bytes, bool], None] = _to_nobody
        self.rewired: Callable[[], None] = _to_nobody

    def join(self, device: Device) -> None:
        """Connect the drive's device, whose CAN controller starts anew; disturbances stay, as they are the wire's."""
        self._device = device
        device.rewired = self._tell_rewired
        self._is_off = False
        self._silent_until = -inf
        if device.lss is not None:
            device.lss.on_bit_timing.append(self.silence)
        self._connect()

    @property
    def device(self) -> Device:
        """What is on this wire."""
        if self._device is None:
            raise RuntimeError("no device has joined this wire")
        return self._device

    def taker(self, cob_id: int) -> Callable[[bytes], None] | None:
        """What takes the data of frames with this identifier, None where nothing does: whoever hears many asks once."""
        if self.receive == self.device.receive:
            return self.device.taker(cob_id)
        return partial(self._give, cob_id)

    def transmit(self, cob_id: int, data: bytes) -> None:
        """A frame of the drive."""
        self._out(cob_id, data)

    # -- faults -------------------------------------------------------------------------------------------------------

    def bus_off(self) -> None:
        """The CAN controller leaves the bus: nothing comes, nothing goes, until `recover`; the drive reacts as by 1029h."""
        self._is_off = True
        self._connect()
        self.device.bus_off()

    def recover(self) -> None:
        """The CAN controller is back on the bus; the drive tells it (EMCY 8140h)."""
        if self._is_off:
            self._is_off = False
            self._connect()
            self.device.bus_recovered()

    def error_passive(self) -> None:
        """The CAN controller counted many errors: frames still go, and the drive tells it (EMCY 8120h)."""
        self.device.error_passive()

    def error_active(self) -> None:
        """The error counters went down again."""
        self.device.error_active()

    def disturb(self, direction: Direction, cause: Hashable, disturbance: Disturbance) -> None:
        """Let frames of one direction, SYNC among those received, meet a disturbance too, until its cause is mended.

        Frames meet the disturbances in the order in which these came.
        """
        self._disturbances[direction][cause] = disturbance
        self._connect()

    def mend(self, cause: Hashable) -> None:
        """Take away what a cause brought; nothing, where it brought nothing."""
        for disturbances in self._disturbances.values():
            disturbances.pop(cause, None)
        self._connect()

    def silence(self, seconds: float) -> None:
        """Be off the bus for a time, without an error: the bit rate is being changed (CiA 305)."""
        logger.warning("node %d: LSS changes the bit rate, no frame goes or comes for %g s", self.device.node_id, seconds)
        self._silent_until = self._now() + seconds
        self._connect()

    # -- wiring -------------------------------------------------------------------------------------------------------

    def _connect(self) -> None:
        """Put what is wrong between the device and the bus, and nothing where nothing is wrong."""
        interrupted = self._is_interrupted()
        sent, received = self._disturbances[Direction.SENT], self._disturbances[Direction.RECEIVED]
        self._outward = _chain(sent.values(), self._put_on_bus)
        self._inward = _chain(received.values(), self._hand_over)
        self._out = self._send if interrupted or sent else self._bus
        self.receive = self._give if interrupted or received else self.device.receive
        self.rewired()

    def _tell_rewired(self) -> None:
        self.rewired()

    def _is_interrupted(self) -> bool:
        return self._is_off or self._now() < self._silent_until

    def _send(self, cob_id: int, data: bytes) -> None:
        self._outward(Frame(cob_id, data))

    def _put_on_bus(self, frame: Frame) -> None:
        if not self._is_interrupted():
            self._bus(frame.cob_id, frame.data)

    def _give(self, cob_id: int, data: bytes, remote: bool = False) -> None:
        if not self._is_interrupted():
            self._inward(Frame(cob_id, data, remote))

    def _hand_over(self, frame: Frame) -> None:
        if frame.cob_id == self.device.sync_cob_id and not frame.remote:
            self.device.sync(frame.data)
        else:
            self.device.receive(frame.cob_id, frame.data, frame.remote)


def _chain(disturbances: Iterable[Disturbance], end: Carry) -> Carry:
    """The way through disturbances, in their order, to its end."""
    carry = end
    for disturbance in reversed(list(disturbances)):
        carry = partial(_meet, disturbance, carry)
    return carry


def _meet(disturbance: Disturbance, carry: Carry, frame: Frame) -> None:
    disturbance.meet(frame, carry)


def _to_nobody(*_frame: object) -> None:
    """No device has joined."""
