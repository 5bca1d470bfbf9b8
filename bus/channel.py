"""Bus names: a SocketCAN interface, `inproc`, ws://127.0.0.1:PORT, or unix:PATH; each becomes a python-can bus."""

from __future__ import annotations

import errno
import ipaddress
import itertools
import logging
import re
import socket
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from http.client import HTTPException
from typing import Any, Protocol
from urllib.parse import urlsplit

import can
from can.interfaces import virtual
from can.interfaces.socketcan import SocketcanBus
from can_remote import RemoteBus, RemoteServer
from can_remote.server import ClientRequestHandler, RemoteServerError, RemoteServerProtocol
from can_remote.websocket import WebSocket, WebsocketClosed, get_accept_key

from drivetwin.bus.unix_bus import PREFIX, UnixBus, UnixHost, socket_path
from drivetwin.foundation.errors import UserError

logger = logging.getLogger(__name__)

SOCKETCAN = re.compile(r"(v?can|vxcan|slcan)\d+")
PHYSICAL = re.compile(r"(can|slcan)\d+")

INPROC = "inproc"

SO_RCVBUFFORCE = 33
"""Of asm-generic/socket.h; the module `socket` has no name for it."""

RECEIVE_BUFFER = 8 * 1024 * 1024
"""Of a SocketCAN socket, some 10,000 frames [bytes]."""

MOST_WAITING = 65_536
"""Frames that a ws server keeps for a client that does not read (some 20 MB); further ones are lost to it, as on SocketCAN."""

GOODBYE = 1.0
"""Longest wait for a ws server to confirm that a client leaves [s]."""


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
        deadline = None if not timeout else time.monotonic() + timeout
        while True:
            self._peer.poll()
            if self._received:
                return self._received.popleft()
            if timeout == 0.0:
                return None
            pause = self._peer.wait()
            if pause is None or (deadline is not None and time.monotonic() >= deadline):
                return None
            time.sleep(pause)


class WebsocketBus(RemoteBus):  # type: ignore[misc]  # can_remote is untyped
    """python-can's `remote` client, whose loss of the server is a CanError like that of any other bus."""

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a frame. Raises CanOperationError where the server has gone."""
        try:
            super().send(msg, timeout)
        except OSError as error:
            raise _gone(self.channel, error) from None

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """Next frame, None after `timeout` seconds. Raises CanOperationError where the server has gone."""
        try:
            message: can.Message | None = super().recv(timeout)
        except (OSError, ValueError, WebsocketClosed) as error:  # ValueError: select on a socket that is closed
            raise _gone(self.channel, error) from None
        return message

    def shutdown(self) -> None:
        """Leave the bus; a server that hangs or has gone does not hold the client."""
        if self._is_shutdown:
            return
        can.BusABC.shutdown(self)
        deadline = time.monotonic() + GOODBYE
        try:
            self.remote_protocol.close()
            while time.monotonic() < deadline:
                self.remote_protocol.recv(deadline - time.monotonic())
        except (OSError, ValueError, WebsocketClosed, can.CanError):
            pass
        self.socket.close()


def _gone(channel: object, error: Exception) -> can.CanOperationError:
    return can.CanOperationError(f"the bus at {channel} has gone ({error or 'connection closed'}): is the emulator running?")


def is_physical(name: str) -> bool:
    """Whether a name may be a real bus with a real machine: `can0`, not `vcan0`."""
    return PHYSICAL.fullmatch(name) is not None


def open_bus(name: str) -> can.BusABC:
    """Join the bus of that name as a client.

    Raises UserError for a name of no known kind, a missing interface, or a server that does not answer.
    """
    if name.startswith("ws://"):
        address = _loopback(name)
        try:
            return WebsocketBus(f"ws://{address.host}:{address.port}")
        except (OSError, can.CanError, HTTPException, AssertionError, WebsocketClosed) as error:
            raise UserError(f"no bus at {name} ({error}); start one with: drivetwin emulate --bus {name}") from None
    if name.startswith(PREFIX):
        try:
            return UnixBus(socket_path(name))
        except OSError as error:
            raise UserError(f"no bus at {name} ({error.strerror}); start one with: drivetwin emulate --bus {name}") from None
    if SOCKETCAN.fullmatch(name):
        return _socketcan(name)
    raise _unknown(name)


class PatientBus(can.BusABC):
    """A SocketCAN bus that outlives its interface being down: some masters take it down for a moment to set a bit rate.

    Meanwhile nothing comes and what is sent is lost, as without a cable. It is told when the interface is down, and when it is
    back.
    """

    def __init__(self, bus: can.BusABC) -> None:
        super().__init__(channel=bus.channel_info)
        self.channel_info = bus.channel_info
        self._bus = bus
        self._is_down = False

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send one frame. Raises CanOperationError for any other trouble than an interface that is down."""
        try:
            self._bus.send(msg, timeout)
        except can.CanOperationError as error:
            self._down(error)
        else:
            self._up()

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """Next frame, None after `timeout` seconds or, where the interface goes down, at once. Raises as `send`."""
        try:
            message = self._bus.recv(timeout)
        except can.CanOperationError as error:
            self._down(error)
            return None
        if message is not None:
            self._up()
        return message

    def shutdown(self) -> None:
        """Leave the bus."""
        if not self._is_shutdown:
            super().shutdown()
            self._bus.shutdown()

    def _down(self, error: can.CanOperationError) -> None:
        if error.error_code != errno.ENETDOWN:
            raise error
        if not self._is_down:
            self._is_down = True
            logger.warning("%s is down: waiting until it is up again (ip link set ... up)", self.channel_info)

    def _up(self) -> None:
        if self._is_down:
            self._is_down = False
            logger.warning("%s is up again", self.channel_info)


@dataclass(frozen=True)
class HostedBus:
    """A bus that this process offers: the emulator's own end of it, its name for others, and how to close it."""

    bus: can.BusABC
    name: str
    close: Callable[[], None]


def host_bus(name: str) -> HostedBus:
    """Open the emulator's end of a bus; for ws:// start the server, on loopback only. Port 0 takes a free one.

    For unix: make the socket, which is removed when the bus closes.

    Raises UserError for a name that no other process can join, an address that is not loopback, or a port in use.
    """
    if name.startswith("ws://"):
        return _host_remote(_loopback(name))
    if name.startswith(PREFIX):
        return _host_unix(name)
    if name == INPROC:
        raise UserError("no other process can join inproc; give --bus vcan0 or --bus ws://127.0.0.1:54701")
    if SOCKETCAN.fullmatch(name):
        bus = PatientBus(_socketcan(name))
        return HostedBus(bus, name, bus.shutdown)
    raise _unknown(name)


def _host_unix(name: str) -> HostedBus:
    try:
        host = UnixHost(socket_path(name))
    except OSError as error:
        raise UserError(
            f"cannot offer {name} ({error.strerror}); choose a path that does not exist yet, in a folder that you may write to"
        ) from None
    return HostedBus(host, name, host.shutdown)


@dataclass(frozen=True)
class _Address:
    host: str
    port: int


class _ClientOfServer(RemoteServerProtocol):  # type: ignore[misc]  # can_remote is untyped
    """One client on the server's side. One that is killed leaves no queue that fills up, no periodic frame, no traceback."""

    def run(self) -> None:
        try:
            super().run()
        except OSError:
            self.running = False

    def recv(self, timeout: float | None = None) -> object:
        event: object = super().recv(timeout)
        match event:
            case {"type": "periodic_stop", "payload": cob_id} if cob_id not in self._send_tasks:
                return None  # stopped twice; the base class would throw the client out
        return event

    def _send_to_client(self) -> None:
        try:
            super()._send_to_client()
        except OSError:
            self.running = False
        finally:
            self.bus.shutdown()


class _ClientHandler(ClientRequestHandler):  # type: ignore[misc]  # can_remote is untyped
    """Opens the websocket of a client, as `ClientRequestHandler`, for a `_ClientOfServer`."""

    def start_websocket(self) -> None:
        origin = self.headers.get("Origin")
        if origin is not None and not _is_own(origin, self.server.server_port):
            logger.warning("a web page of %s wanted to join the bus and was refused", _printable(origin))
            self.send_error(403, "pages of other origins may not join this bus")
            return
        offered = {name.strip() for name in self.headers.get("Sec-WebSocket-Protocol", "").split(",")}
        protocol = "can.binary+json.v1" if "can.binary+json.v1" in offered else "can.json.v1"
        self.send_response(101)
        self.send_header("Upgrade", "WebSocket")
        self.send_header("Connection", "Upgrade")
        self.send_header("Sec-WebSocket-Accept", get_accept_key(self.headers["Sec-WebSocket-Key"]))
        self.send_header("Sec-WebSocket-Protocol", protocol)
        self.end_headers()
        try:
            client = _ClientOfServer(self.server.config, WebSocket(None, protocol, sock=self.request))
        except (OSError, WebsocketClosed, RemoteServerError):
            return  # it left before it had joined
        self.server.clients.append(client)
        client.run()
        self.server.clients.remove(client)


def _is_own(origin: str, port: int) -> bool:
    """Whether an Origin is a page of this server itself; only browsers send one."""
    try:
        parts = urlsplit(origin)
        host, own_port = parts.hostname or "", parts.port
    except ValueError:
        return False
    return parts.scheme == "http" and own_port == port and (host == "localhost" or _is_loopback(host))


def _printable(text: str) -> str:
    return "".join(letter if letter.isprintable() else "?" for letter in text[:80])


class _Members(list[Any]):
    """The receivers on a virtual channel, for whom a send goes through as they were when it began.

    python-can's `VirtualBus.send` walks the very list that a leaving client is removed from, and so skips the one behind it.
    Its queues grow without end where nobody reads; these take `MOST_WAITING` frames.
    """

    def append(self, received: Any) -> None:
        """A receiver joins with its queue."""
        take = received.put

        def put(message: can.Message, **_waiting: object) -> None:
            if received.qsize() < MOST_WAITING:
                take(message)

        received.put = put
        super().append(received)

    def __iter__(self) -> Iterator[Any]:
        return iter(self[:])


_channels = itertools.count()


def _host_remote(address: _Address) -> HostedBus:
    channel = f"drivetwin-{next(_channels)}"
    try:
        server = RemoteServer(address.host, address.port, interface="virtual", channel=channel, ignore_config=True)
    except OSError as error:
        raise UserError(
            f"cannot listen on {address.host}:{address.port} ({error.strerror}); choose another port, or 0 for a free one"
        ) from None
    server.RequestHandlerClass = _ClientHandler
    virtual.channels[channel] = _Members()
    bus = can.Bus(interface="virtual", channel=channel, ignore_config=True)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True)
    thread.start()

    def close() -> None:
        server.shutdown()
        server.server_close()
        for client in list(server.clients):
            with suppress(OSError):
                client.close()
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
        raise UserError(f"{name} is not loopback on this machine; write ws://127.0.0.1:{port}")
    return _Address(host, port)


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.IPv4Address(host).is_loopback
    except ValueError:
        return False


def _socketcan(name: str) -> can.BusABC:
    try:
        if sys.platform != "linux":
            raise OSError("SocketCAN is Linux's")
        bus = SocketcanBus(channel=name)
    except (OSError, can.CanError) as error:
        raise UserError(
            f"cannot open {name} ({error}); see `ip link show {name}`, or where the kernel has no CAN use "
            "--bus ws://127.0.0.1:54701"
        ) from None
    _let_wait(bus.socket)
    return bus


def _let_wait(channel: socket.socket) -> None:
    """Make room for what comes while the process does not run: some 300 frames are all that a socket holds by default.

    With the right to (CAP_NET_ADMIN) beyond net.core.rmem_max, else up to it.
    """
    try:
        channel.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, RECEIVE_BUFFER)
    except PermissionError:
        channel.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)


def _unknown(name: str) -> UserError:
    return UserError(f"unknown bus {name!r}; expected vcan0 or can0 (SocketCAN), unix:PATH, inproc, or ws://127.0.0.1:PORT")
