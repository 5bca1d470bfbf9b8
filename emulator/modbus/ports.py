"""The ports on which a machine's Modbus is served, opened and closed together."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from drivetwin.emulator.modbus.mailbox import Mailbox
from drivetwin.emulator.modbus.rtu import RtuPort
from drivetwin.emulator.modbus.service import ModbusService
from drivetwin.emulator.modbus.tcp import TcpPort
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.foundation.errors import UserError

LOOPBACK = "127.0.0.1"


@contextmanager
def serve_modbus(machine: VirtualMachine, tcp: str | None, serial: str | None) -> Iterator[tuple[str, ...]]:
    """Serve a machine's drives at `tcp` ([HOST:]PORT) and on the line `serial`; either may be None.

    Yields what is open, in words. While it is, the machine's own loop answers the requests (`VirtualMachine.poll`). Raises
    UserError where a port is not to be had.
    """
    if tcp is None and serial is None:
        yield ()
        return
    mailbox = Mailbox()
    service = ModbusService(machine.drives)
    machine.attach(mailbox.work)
    names = []
    with ExitStack() as ports:
        if tcp is not None:
            port = TcpPort(*host_and_port(tcp), service, mailbox)
            ports.callback(port.close)
            names.append(f"Modbus TCP on {port.address[0]}:{port.address[1]}")
        if serial is not None:
            ports.callback(RtuPort(serial, service, mailbox).close)
            names.append(f"Modbus RTU on {serial}")
        ports.callback(mailbox.close)
        yield tuple(names)


def host_and_port(text: str) -> tuple[str, int]:
    """[HOST:]PORT; the host is loopback unless told. Raises UserError."""
    host, _, port = text.rpartition(":")
    if not port.isdecimal() or int(port) > 0xFFFF:
        raise UserError(f"--modbus {text}: expected HOST:PORT or PORT, such as {LOOPBACK}:1502")
    return host.strip("[]") or LOOPBACK, int(port)
