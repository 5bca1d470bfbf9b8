"""Bus names: a SocketCAN interface, `inproc`, or ws://127.0.0.1:PORT; each becomes a python-can bus."""

from __future__ import annotations

import ipaddress
import re
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol
from urllib.parse import urlsplit

import can
from can_remote import RemoteServer

from drivetwin.errors import UserError

SOCKETCAN = re.compile(r"(v?can|vxcan|slcan)\d+")
COPPER = re.compile(r"(can|slcan)\d+")

INPROC = "inproc"


class Peer(Protocol):
    """Who is on the other end of an in-process bus."""

    def receive(self, message: can.Message) -> None:
        """Take one frame; answers are sent before this returns."""
        ...

    def poll(self) -> None:
        """Let time pass."""
        ...

    def wait(self) -> float | None:
        """Seconds until `poll` is worth calling again, None if never."""
        ...


class InprocBus(can.BusABC):
    """A bus within one thread: `send` hands the frame to the peer, whose answers wait in order for `recv`.

    Nothing is lost and nothing is late, so a run with a SYNC-driven peer is bit-identical.
    """

    def __init__(self, connect: Callable[[Callable[[can.Message], None]], Peer]) -> None:
        """`connect` gets the function that a peer transmits by, and returns the peer."""
        super().__init__(channel=INPROC)
        self.channel_info = INPROC
        self._received: deque[can.Message] = deque()
        self._peer = connect(self._received.append)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Hand a frame to the peer."""
        self._peer.receive(msg)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """Next frame of the peer; None after `timeout` seconds of wall-clock, or at once if only a frame could move it."""
        if self._received:
            return self._received.popleft()
        deadline = None if timeout is None else time.monotonic() + timeout
        while not self._received:
            self._peer.poll()
            pause = self._peer.wait()
            if self._received:
                break
            if pause is None or (deadline is not None and time.monotonic() >= deadline):
                return None
            time.sleep(pause)
        return self._received.popleft()


def is_copper(name: str) -> bool:
    """Whether a name may be a real bus with a real machine: `can0`, not `vcan0`."""
    return COPPER.fullmatch(name) is not None


def open_bus(name: str) -> can.BusABC:
    """Join the bus of that name as a client.

    Raises UserError for a name of no known kind, a missing interface, or a server that does not answer.
    """
    if name.startswith("ws://"):
        address = _loopback(name)
        try:
            return can.Bus(interface="remote", channel=f"ws://{address.host}:{address.port}", ignore_config=True)
        except (OSError, can.CanError) as error:
            raise UserError(f"no bus at {name} ({error}); start one with: drivetwin emulate --bus {name}") from None
    if SOCKETCAN.fullmatch(name):
        return _socketcan(name)
    raise _unknown(name)


@dataclass(frozen=True)
class HostedBus:
    """A bus that this process offers: the emulator's own end of it, its name for others, and how to close it."""

    bus: can.BusABC
    name: str
    close: Callable[[], None]


def host_bus(name: str) -> HostedBus:
    """Open the emulator's end of a bus; for ws:// start the server, on loopback only. Port 0 takes a free one.

    Raises UserError for a name that no other process can join, an address that is not loopback, or a port in use.
    """
    if name.startswith("ws://"):
        return _host_remote(_loopback(name))
    if name == INPROC:
        raise UserError("inproc joins nobody outside this process; give --bus vcan0 or --bus ws://127.0.0.1:54701")
    if SOCKETCAN.fullmatch(name):
        bus = _socketcan(name)
        return HostedBus(bus, name, bus.shutdown)
    raise _unknown(name)


@dataclass(frozen=True)
class _Address:
    host: str
    port: int


def _host_remote(address: _Address) -> HostedBus:
    channel = f"drivetwin-{id(address)}"
    try:
        server = RemoteServer(address.host, address.port, interface="virtual", channel=channel, ignore_config=True)
    except OSError as error:
        raise UserError(f"cannot listen on {address.host}:{address.port} ({error.strerror}); choose another port") from None
    bus = can.Bus(interface="virtual", channel=channel, ignore_config=True)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True)
    thread.start()

    def close() -> None:
        server.shutdown()
        server.server_close()
        bus.shutdown()

    return HostedBus(bus, f"ws://{address.host}:{server.server_port}", close)


def _loopback(name: str) -> _Address:
    try:
        parts = urlsplit(name)
        host, port = parts.hostname or "", parts.port
    except ValueError:
        raise _unknown(name) from None
    if port is None:
        raise UserError(f"{name} has no port; write for example ws://127.0.0.1:54701")
    if host != "localhost" and not _is_loopback(host):
        raise UserError(f"{name} is not on this machine; ws buses are loopback only: ws://127.0.0.1:{port}")
    return _Address(host, port)


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _socketcan(name: str) -> can.BusABC:
    try:
        return can.Bus(interface="socketcan", channel=name, ignore_config=True)
    except (OSError, can.CanError, AttributeError, NotImplementedError) as error:
        raise UserError(
            f"cannot open {name} ({error}); see `ip link show {name}`, or where the kernel has no CAN use "
            "--bus ws://127.0.0.1:54701"
        ) from None


def _unknown(name: str) -> UserError:
    return UserError(f"unknown bus {name!r}; expected vcan0 or can0 (SocketCAN), inproc, or ws://127.0.0.1:PORT")
