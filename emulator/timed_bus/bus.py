"""A bus with bit timing between a controller and a virtual machine: what both clocks have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

import can

from drivetwin.bus.timing.wire import Transmission
from drivetwin.emulator.timed_bus.line import Line
from drivetwin.emulator.virtual_machine import VirtualMachine

Watch = Callable[[Transmission], None]
"""Gets each frame when it is whole, before anybody acts on it, in the order of the wire."""


def nobody(_whole: Transmission) -> None:
    """A watch that looks away."""


class TimedBus(ABC):
    """The machine's `Peer` on a bus whose frames take time on a wire; whoever owns the bus calls it in the machine's place.

    Without errors and retransmission, as `drivetwin.bus.timing.wire.Wire`. All controllers that join are one node of the wire.
    """

    def __init__(
        self,
        bit_rate: int,
        connect: Callable[[Callable[[can.Message], None]], VirtualMachine],
        transmit: Callable[[can.Message], None],
        watch: Watch = nobody,
    ) -> None:
        """`bit_rate` in bit/s. `connect` gets the function that a machine transmits by, and returns the machine, `transmit`
        takes the drives' frames to the controller, stamped with the wire's time [s].
        """
        self._watch = watch
        self._line = Line(bit_rate, connect, transmit, self._whole)
        self.virtual = self._line.virtual

    def power_on(self) -> None:
        """Every drive boots and says so on the bus."""
        self.virtual.power_on()
        self.poll()

    def receive(self, message: can.Message) -> None:
        """Take one frame of the controller. Error frames, extended and FD frames are not CANopen's and take no time."""
        if not (message.is_error_frame or message.is_extended_id or message.is_fd):
            self._take(message)

    @abstractmethod
    def poll(self) -> None:
        """Give what has become whole, and what the machine sends by itself."""

    @abstractmethod
    def wait(self) -> float | None:
        """Seconds until `poll` is worth calling again, None if it need not be."""

    def hurry(self, hurries: bool) -> None:
        """Leave the plant's time out while frames wait too long (`Backlog`)."""
        self.virtual.hurry(hurries)

    @abstractmethod
    def _take(self, message: can.Message) -> None: ...

    def _whole(self, whole: Transmission) -> None:
        """A frame is whole, and about to be given."""
        self._watch(whole)
