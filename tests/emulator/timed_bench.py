"""A machine with bit timing and a small master of its own, which knows only frames: no code of the reference controller."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import can

from drivetwin.bus.timing.frame_bits import Frame, frame_bits
from drivetwin.bus.timing.wire import Transmission
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import Clock, SyncClock
from drivetwin.emulator.machine import Machine, load_machine
from drivetwin.emulator.timed_bus import LockstepBus
from drivetwin.emulator.virtual_machine import VirtualMachine

MICROSECOND = 1e-6

RPDO, TPDO_1, TPDO_2, SYNC, NMT = 0x200, 0x180, 0x280, 0x080, 0x000
SDO_REQUEST, SDO_ANSWER = 0x600, 0x580

EXPEDITED = {1: 0x2F, 2: 0x2B, 4: 0x23}
"""Download request by length [byte] (CiA 301, 7.2.4.3.3)."""

RPDO_MAPPING = (0x60400010, 0x60C10120, 0x60B20010)
TPDO_MAPPING = (0x60640020, 0x21A30020)


def frame(cob_id: int, data: bytes = b"") -> can.Message:
    return can.Message(arbitration_id=cob_id, data=data, is_extended_id=False)


def bits(message: can.Message) -> int:
    return frame_bits(Frame(message.arbitration_id, bytes(message.data)))


def slides(count: int, folder: Path) -> Machine:
    """A machine of linear axes alike, nodes 1, 2, ..., that do not act on each other."""
    stage = load_machine("stage")
    names = [f"slide{number}" for number in range(1, count + 1)]
    bodies = "".join(
        f'<body><joint name="{name}" type="slide" axis="1 0 0"/><geom type="box" size="0.1 0.1 0.1" mass="80"/></body>'
        for name in names
    )
    motors = "".join(f'<motor name="{name}" joint="{name}"/>' for name in names)
    (folder / "slides.xml").write_text(
        '<mujoco><option timestep="0.000125" gravity="0 0 0"/><default><geom contype="0" conaffinity="0"/></default>'
        f"<worldbody>{bodies}</worldbody><actuator>{motors}</actuator></mujoco>"
    )
    axis = stage.axes["slide"]
    axes = {
        name: axis.model_copy(update={"node_id": number, "joint": name, "actuator": name})
        for number, name in enumerate(names, start=1)
    }
    return Machine(machine="slides", model="slides.xml", axes=axes, directory=folder)


class TimedBench:
    """`seen` has every frame that was whole on the wire, `received` what the master got since it last looked."""

    def __init__(self, machine: Machine, bit_rate: int, clock: Clock | None = None) -> None:
        self.seen: list[Transmission] = []
        self.received: list[can.Message] = []
        self.handed_in: list[can.Message] = []
        self.nodes = [axis.node_id for axis in machine.axes.values()]
        profile, clock = load_profile("servoone"), SyncClock() if clock is None else clock

        def connect(transmit: Callable[[can.Message], None]) -> VirtualMachine:
            return VirtualMachine(machine, profile, (), clock, 0, self._note(transmit))

        self.bus = LockstepBus(bit_rate, connect, self.received.append, self.seen.append)
        self.bus.power_on()

    def send(self, message: can.Message) -> None:
        self.handed_in.append(message)
        self.bus.receive(message)

    def take(self) -> list[int]:
        """Identifiers of what came since the last time."""
        came = [message.arbitration_id for message in self.received]
        self.received.clear()
        return came

    def write(self, node: int, index: int, subindex: int, value: int, size: int) -> None:
        """An expedited SDO download, and its answer."""
        request = bytes((EXPEDITED[size],)) + index.to_bytes(2, "little") + bytes((subindex,))
        self.received.clear()
        self.send(frame(SDO_REQUEST + node, (request + value.to_bytes(size, "little")).ljust(8, b"\0")))
        answers = [bytes(message.data) for message in self.received if message.arbitration_id == SDO_ANSWER + node]
        assert answers == [b"\x60" + request[1:4] + bytes(4)]

    def bring_up(self, period: float = 0.001) -> None:
        """RPDO 1 and TPDO 2 with 8 bytes at each SYNC, TPDO 1 by event, as the reference controller maps them."""
        for node in self.nodes:
            self.write(node, 0x1006, 0, round(period / MICROSECOND), 4)
            for communication, mapping, cob_id, entries in (
                (0x1400, 0x1600, RPDO + node, RPDO_MAPPING),
                (0x1801, 0x1A01, TPDO_2 + node, TPDO_MAPPING),
            ):
                self.write(node, communication, 1, cob_id | 0x80000000, 4)
                self.write(node, mapping, 0, 0, 1)
                for place, entry in enumerate(entries, start=1):
                    self.write(node, mapping, place, entry, 4)
                self.write(node, mapping, 0, len(entries), 1)
                self.write(node, communication, 2, 1, 1)
                self.write(node, communication, 1, cob_id, 4)
            self.send(frame(NMT, bytes((1, node))))
        self.take()

    def outputs(self, controlword: int = 0x0006) -> list[can.Message]:
        """A set-point frame for each drive."""
        data = controlword.to_bytes(2, "little") + (-1000001).to_bytes(4, "little", signed=True) + bytes(2)
        return [frame(RPDO + node, data) for node in self.nodes]

    def cycle(self, controlword: int = 0x0006) -> list[int]:
        """Set-points, then SYNC; identifiers of what the drives' frames were in this cycle."""
        for message in (*self.outputs(controlword), frame(SYNC)):
            self.send(message)
        return self.take()

    def last(self, cob_id: int) -> Transmission:
        return [sent for sent in self.seen if sent.frame.identifier == cob_id][-1]

    def times(self, cob_id: int) -> list[float]:
        """When each frame of that identifier was whole [s]."""
        return [sent.received for sent in self.seen if sent.frame.identifier == cob_id]

    def _note(self, transmit: Callable[[can.Message], None]) -> Callable[[can.Message], None]:
        def send(message: can.Message) -> None:
            self.handed_in.append(message)
            transmit(message)

        return send
