"""A machine with Modbus, pumped by the test: drives, plant and ports in this process, SYNC as the test says."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from typing import TypeVar

from can import Message

from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.modbus import ModbusService, serve_modbus
from drivetwin.emulator.modbus.tcp import HEADER
from drivetwin.emulator.plant import truth_path
from drivetwin.emulator.virtual_machine import VirtualMachine

PATIENCE = 60.0
"""Longest that an answer may take [s]."""

SHUTDOWN, SWITCH_ON, ENABLE, QUICK_STOP, DISABLE_VOLTAGE = 0x06, 0x07, 0x0F, 0x02, 0x00
CONTROLWORD, MODE, TARGET_POSITION, TARGET_VELOCITY, STATUSWORD, POSITION = 0x0000, 0x0001, 0x0002, 0x0004, 0x0100, 0x0102
PROFILE_VELOCITY, HOMING_METHOD = 0x0200, 0x0209

T = TypeVar("T")


class Bench:
    """A virtual machine and every frame it sent. `machine` arm and stage have one drive, scara has three."""

    def __init__(self, profile: str = "cia402-full", machine: str = "arm") -> None:
        described = load_machine(machine)
        effects = read_effects(truth_path(described, None))
        self.sent: list[tuple[int, bytes, float]] = []
        self.virtual = VirtualMachine(described, load_profile(profile), effects, SyncClock(), 0, self._sent)
        self.virtual.power_on()
        self.od = self.virtual.drives[0].dictionary

    def service(self) -> ModbusService:
        """The drives on Modbus, without ports."""
        return ModbusService(self.virtual.drives)

    def can(self, cob_id: int, data: bytes = b"") -> None:
        """A frame of the CANopen master."""
        self.virtual.receive(Message(arbitration_id=cob_id, data=data, is_extended_id=False))

    def sync(self, count: int = 1) -> None:
        """Cycles of the CANopen master."""
        for _ in range(count):
            self.can(0x80)
            self.virtual.poll()

    def sdo_write(self, index: int, subindex: int, value: int, size: int, node: int = 1) -> int:
        """An expedited download by the CANopen master; the abort code, 0 when it was taken."""
        before = len(self.sent)
        head = bytes((0x23 | (4 - size) << 2, index & 0xFF, index >> 8, subindex))
        self.can(0x600 + node, head + value.to_bytes(size, "little", signed=value < 0).ljust(4, b"\0"))
        (data,) = (data for cob_id, data, _ in self.sent[before:] if cob_id == 0x580 + node)
        return int.from_bytes(data[4:], "little") if data[0] == 0x80 else 0

    def state(self) -> int:
        """State bits of the statusword."""
        return int(self.od[0x6041].read()) & 0x6F

    def while_served(self, work: Callable[[int], T], cycles: bool = True) -> T:
        """Run `work` with the Modbus port's number in a thread of its own, and the machine in this one until it ends."""
        with serve_modbus(self.virtual, "127.0.0.1:0", None) as names:
            done = in_thread(work, int(names[0].rpartition(":")[2]))
            while not done.done():
                self.virtual.poll()
                if cycles:
                    self.can(0x80)
            return done.result()

    def _sent(self, message: Message) -> None:
        self.sent.append((message.arbitration_id, bytes(message.data), message.timestamp))


def in_thread(work: Callable[..., T], *arguments: object) -> Future[T]:
    """Run `work` in a thread; its result or its exception is in the future."""
    future: Future[T] = Future()

    def run() -> None:
        try:
            future.set_result(work(*arguments))
        except BaseException as error:  # noqa: BLE001  # handed to who waits
            future.set_exception(error)

    threading.Thread(target=run, daemon=True).start()
    return future


class Client:
    """A bare Modbus TCP client: bytes there, bytes back."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self._transaction = 0

    def send(self, frame: bytes) -> None:
        self._connection.sendall(frame)

    def frame(self, pdu: bytes, unit: int = 1) -> bytes:
        """A frame with a transaction of its own."""
        self._transaction = (self._transaction + 1) & 0xFFFF
        return HEADER.pack(self._transaction, 0, len(pdu) + 1, unit) + pdu

    def receive(self) -> tuple[int, int, bytes]:
        """Transaction, unit and PDU of the next answer. Raises ConnectionError when the server has hung up."""
        transaction, protocol, length, unit = HEADER.unpack(self._exactly(HEADER.size))
        assert protocol == 0
        return transaction, unit, self._exactly(length - 1)

    def ask(self, pdu: bytes, unit: int = 1) -> bytes:
        """The answer's PDU."""
        self.send(self.frame(pdu, unit))
        transaction, answered, answer = self.receive()
        assert (transaction, answered) == (self._transaction, unit)
        return answer

    def _exactly(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            part = self._connection.recv(count - len(data))
            if not part:
                raise ConnectionError("the server has closed the connection")
            data += part
        return data


@contextmanager
def client(port: int) -> Iterator[Client]:
    """A connection to a port of this machine."""
    with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) as connection:
        yield Client(connection)
