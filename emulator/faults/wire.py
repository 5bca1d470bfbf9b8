"""The wire between one drive and the bus, on which faults can be injected while the bus runs."""

from __future__ import annotations

from collections.abc import Callable
from math import inf

from emulator.canopen.device import Device
from emulator.faults.loss import Loss


class FaultyWire:
    """A drive's wire. `transmit` gets what the drive sends; `receive` and `sync` give it what the bus brings.

    While nothing is wrong `receive` and `sync` are the device's own, so a sound wire costs nothing. Bus off, a change of the
    bit rate and losses may be present together.
    """

    def __init__(self, transmit: Callable[[int, bytes], None], now: Callable[[], float]) -> None:
        self._bus = transmit
        self._now = now
        self._device: Device | None = None
        self._is_off = False
        self._silent_until = -inf
        self._sending: Loss | None = None
        self._receiving: Loss | None = None
        self._out = transmit
        self.receive: Callable[[int, bytes, bool], None] = _to_nobody
        self.sync: Callable[[int | None], None] = _to_nobody

    def join(self, device: Device) -> None:
        """Connect the drive's device."""
        self._device = device
        if device.lss is not None:
            device.lss.on_bit_timing.append(self.silence)
        self._connect()

    @property
    def device(self) -> Device:
        """What is on this wire."""
        if self._device is None:
            raise RuntimeError("no device has joined this wire")
        return self._device

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

    def lose_sent(self, loss: Loss | None) -> None:
        """Lose frames that the drive sends; None: none any more."""
        self._sending = loss
        self._connect()

    def lose_received(self, loss: Loss | None) -> None:
        """Lose frames that the drive would receive, SYNC among them; None: none any more."""
        self._receiving = loss
        self._connect()

    def silence(self, seconds: float) -> None:
        """Be off the bus for a time, without an error: the bit rate is being changed (CiA 305)."""
        self._silent_until = self._now() + seconds
        self._connect()

    # -- wiring -------------------------------------------------------------------------------------------------------

    def _connect(self) -> None:
        """Put what is wrong between the device and the bus, and nothing where nothing is wrong."""
        interrupted = self._is_interrupted()
        self._out = self._send if interrupted or self._sending is not None else self._bus
        if interrupted or self._receiving is not None:
            self.receive, self.sync = self._give, self._give_sync
        else:
            self.receive, self.sync = self.device.receive, self.device.sync

    def _is_interrupted(self) -> bool:
        return self._is_off or self._now() < self._silent_until

    def _send(self, cob_id: int, data: bytes) -> None:
        if self._is_interrupted() or (self._sending is not None and self._sending.loses()):
            return
        self._bus(cob_id, data)

    def _give(self, cob_id: int, data: bytes, remote: bool) -> None:
        if not self._is_lost():
            self.device.receive(cob_id, data, remote)

    def _give_sync(self, counter: int | None) -> None:
        if not self._is_lost():
            self.device.sync(counter)

    def _is_lost(self) -> bool:
        return self._is_interrupted() or (self._receiving is not None and self._receiving.loses())


def _to_nobody(*_frame: object) -> None:
    """No device has joined."""
