"""The embedded bus, `unix:PATH`: a Unix domain socket that carries SocketCAN's struct can_frame, for a program in any language.

The socket is SOCK_SEQPACKET. A packet is one or more frames of 16 bytes as in linux/can.h: identifier with the EFF, RTR and
ERR flags (u32), length (u8), 3 bytes of padding, 8 data bytes; numbers in the machine's byte order. What the host sends while
it handles one frame comes in one packet, so that whoever takes a packet whole sees the same in every run.
"""

from __future__ import annotations

import logging
import os
import select
import socket
import struct
import time
from collections import deque
from pathlib import Path

import can

from drivetwin.bus.candump import MOST_BASE
from drivetwin.bus.frame import DataFrame
from drivetwin.foundation.errors import UserError

logger = logging.getLogger(__name__)

PREFIX = "unix:"

FRAME = struct.Struct("=IB3x8s")
"""struct can_frame (linux/can.h)."""

EXTENDED, REMOTE, ERROR = 0x80000000, 0x40000000, 0x20000000
"""CAN_EFF_FLAG, CAN_RTR_FLAG, CAN_ERR_FLAG."""

MOST_FRAMES = 64
"""In one packet."""

MOST_BYTES = MOST_FRAMES * FRAME.size

LONGEST_PATH = 107
"""Bytes of sun_path without its last zero (unix(7))."""

AGAIN = 0.5
"""After which a host that had no file descriptor left looks again for who wants to join [s]."""

MOST_WAITING = 256
"""Packets that the host keeps for a client that does not read, beside those in its socket; further ones are lost to it, as a
SocketCAN socket loses them."""

MOST_AT_ONCE = 8
"""Of them that go out together once the client reads again: the host has others to serve within the same cycle."""

_SO_TIMESTAMPNS = 35
"""The kernel stamps packets as they are sent (socket(7), asm-generic/socket.h); Python 3.11 has no name for it."""

_TIMESPEC = struct.Struct("@qq")

_STAMP_SPACE = socket.CMSG_SPACE(_TIMESPEC.size)


def _sent_at(told: list[tuple[int, int, bytes]]) -> float:
    """When a packet was sent [s], from what came beside it; now, where nothing did: it was sent before this end joined."""
    for level, kind, data in told:
        if (level, kind) == (socket.SOL_SOCKET, _SO_TIMESTAMPNS) and len(data) == _TIMESPEC.size:
            seconds, nanoseconds = _TIMESPEC.unpack(data)
            return float(seconds + 1e-9 * nanoseconds)
    return time.time()


def pack(message: can.Message) -> bytes:
    """A frame as its 16 bytes. Raises ValueError for more than 8 data bytes."""
    if message.dlc > 8 or message.is_fd:
        raise ValueError(f"{message.arbitration_id:X}h has {message.dlc} bytes; a classic frame has 0 to 8")
    flags = message.is_extended_id * EXTENDED | message.is_remote_frame * REMOTE | message.is_error_frame * ERROR
    return FRAME.pack(message.arbitration_id | flags, message.dlc, bytes(message.data))


def unpack(packet: bytes) -> list[can.Message]:
    """The frames of a packet; what is no whole frame, or longer than 8 bytes, is left out."""
    now = time.time()
    whole = len(packet) - len(packet) % FRAME.size
    fields = FRAME.iter_unpack(packet[:whole])
    return [_message(identifier, length, data, now) for identifier, length, data in fields if length <= 8]


def _message(identifier: int, length: int, data: bytes, now: float) -> can.Message:
    if identifier <= MOST_BASE:
        return DataFrame(identifier, data[:length], now)
    remote = bool(identifier & REMOTE)
    extended = bool(identifier & EXTENDED)
    return can.Message(
        timestamp=now,
        arbitration_id=identifier & (0x1FFFFFFF if extended else 0x7FF),
        is_extended_id=extended,
        is_remote_frame=remote,
        is_error_frame=bool(identifier & ERROR),
        dlc=length,
        data=None if remote else data[:length],
    )


class UnixBus(can.BusABC):
    """A client's end."""

    def __init__(self, path: Path) -> None:
        """Join the bus at `path`. Raises OSError where nobody offers one."""
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            self._socket.connect(str(path))
        except OSError:
            self._socket.close()
            raise
        self._socket.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
        super().__init__(channel=f"{PREFIX}{path}")
        self.channel_info = f"{PREFIX}{path}"
        self._received: deque[can.Message] = deque()
        self._poll = select.poll()
        self._poll.register(self._socket, select.POLLIN)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send one frame. Raises CanOperationError where the host has gone, or takes no frame for `timeout` seconds."""
        try:
            self._socket.settimeout(timeout)
            self._socket.send(pack(msg))
        except OSError as error:
            raise self._gone(error) from None

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """Next frame, None after `timeout` seconds. Raises CanOperationError where the host has gone."""
        if not self._received and not self._take(timeout):
            return None
        return self._received.popleft()

    def recv_packet(self, timeout: float | None = None) -> tuple[float, bytes] | None:
        """Next packet as it came, one or more struct can_frame, and when it was sent [s]; else as `recv`.

        For whoever takes many at once, and late. Raises CanOperationError as `recv`.
        """
        try:
            if timeout != 0.0 and not self._poll.poll(None if timeout is None else timeout * 1e3):
                return None
            packet, told, _, _ = self._socket.recvmsg(MOST_BYTES, _STAMP_SPACE, socket.MSG_DONTWAIT)
        except BlockingIOError:
            return None
        except OSError as error:
            raise self._gone(error) from None
        if not packet:
            raise self._gone("connection closed")
        return _sent_at(told), packet[: len(packet) - len(packet) % FRAME.size]

    def fileno(self) -> int:
        """For whoever waits for several buses."""
        return self._socket.fileno()

    def shutdown(self) -> None:
        """Leave the bus."""
        if not self._is_shutdown:
            super().shutdown()
            self._socket.close()

    def _take(self, timeout: float | None) -> bool:
        """Receive one packet; whether one with a frame came in time."""
        deadline = None if timeout is None else time.monotonic() + timeout
        while not self._received:
            came = self.recv_packet(None if deadline is None else max(0.0, deadline - time.monotonic()))
            if came is None:
                return False
            self._received.extend(unpack(came[1]))
        return True

    def _gone(self, error: object) -> can.CanOperationError:
        return can.CanOperationError(f"the bus at {self.channel_info} has gone ({error}): is its host running?")


class _Client:
    """One client as the host sees it: its socket, the packets that it has not taken yet, whether its host waits for room there.

    One that has gone takes nothing any more; what it sent before is still there to be read.
    """

    def __init__(self, connection: socket.socket) -> None:
        connection.setblocking(False)
        self.connection = connection
        self._waiting: deque[bytes] = deque()
        self._gone = False
        self.is_watched_for_room = False

    def give(self, packet: bytes) -> None:
        """Send a packet, or keep it until the client reads."""
        if len(self._waiting) < MOST_WAITING and not self._gone:
            self._waiting.append(packet)
        self.flush()

    def flush(self) -> None:
        """Send what waits, `MOST_AT_ONCE` at most."""
        for _ in range(min(len(self._waiting), MOST_AT_ONCE)):
            try:
                self.connection.send(self._waiting[0])
            except BlockingIOError:
                return
            except OSError:
                self._gone = True
                self._waiting.clear()
                return
            self._waiting.popleft()

    def take(self) -> bytes | None:
        """Its next packet, empty where it has gone and nothing is left; None: there is none now."""
        try:
            return self.connection.recv(MOST_BYTES)
        except (BlockingIOError, ConnectionResetError):  # reset: it left without reading all, told once before what it sent
            return None

    @property
    def waits(self) -> bool:
        """Whether packets wait for it to read."""
        return bool(self._waiting)


class UnixHost(can.BusABC):
    """The host's end: any number of clients, each of which sees the frames of the host and of all others.

    What is sent goes out together at the next `recv`. A client that dies takes nothing along.
    """

    def __init__(self, path: Path) -> None:
        """Offer a bus at `path`, for this user alone. Raises OSError where that cannot be."""
        self._path = path
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            self._listener.bind(str(path))
            path.chmod(0o600)
            self._listener.listen()
        except OSError:
            self._listener.close()
            raise
        super().__init__(channel=f"{PREFIX}{path}")
        self.channel_info = f"{PREFIX}{path}"
        self._clients: dict[int, _Client] = {}
        self._received: deque[can.Message] = deque()
        self._sent: list[bytes] = []
        self._shut_until: float | None = None
        self._was_full = False
        self._poll = select.poll()
        self._poll.register(self._listener, select.POLLIN)

    @property
    def clients(self) -> int:
        """How many clients there are."""
        return len(self._clients)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send one frame, at the next `recv` at the latest."""
        self._sent.append(pack(msg))
        if len(self._sent) == MOST_FRAMES:
            self._flush()

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """Next frame of a client, None after `timeout` seconds."""
        self._flush()
        self._open_again()
        deadline = None if timeout is None else time.monotonic() + timeout
        while not self._received:
            left = None if deadline is None else max(0.0, deadline - time.monotonic())
            ready = self._poll.poll(None if left is None else left * 1e3)
            for descriptor, _event in ready:
                self._attend(descriptor)
            only_took = all(event == select.POLLOUT for _descriptor, event in ready)
            if only_took and deadline is not None and time.monotonic() >= deadline:
                return None  # else: a client that has just joined may have sent already
        return self._received.popleft()

    def shutdown(self) -> None:
        """Send what is left, close every connection and remove the socket's file."""
        if self._is_shutdown:
            return
        self._flush()
        super().shutdown()
        for client in self._clients.values():
            client.connection.close()
        self._listener.close()
        self._path.unlink(missing_ok=True)

    def _attend(self, descriptor: int) -> None:
        """Let a client join, take its packet, or send what waits for it."""
        if descriptor == self._listener.fileno():
            self._welcome()
            return
        client = self._clients[descriptor]
        client.flush()
        self._watch(client)
        packet = client.take()
        if packet:
            frames = unpack(packet)
            self._received.extend(frames)
            if frames:
                self._give_all_but(client, packet)
        elif packet is not None:
            self._drop(client)

    def _welcome(self) -> None:
        """Let a client join; where no file descriptor is left it waits, and the door is looked at again later."""
        try:
            connection, _address = self._listener.accept()
        except OSError as error:
            if not self._was_full:
                logger.warning("bus %s: nobody else can join now (%s)", self.channel_info, error.strerror)
            self._was_full = True
            self._poll.unregister(self._listener)
            self._shut_until = time.monotonic() + AGAIN
            return
        self._clients[connection.fileno()] = _Client(connection)
        self._poll.register(connection, select.POLLIN)

    def _open_again(self) -> None:
        if self._shut_until is not None and time.monotonic() >= self._shut_until:
            self._poll.register(self._listener, select.POLLIN)
            self._shut_until = None

    def _flush(self) -> None:
        if self._sent:
            packet, self._sent = b"".join(self._sent), []
            self._give_all_but(None, packet)

    def _give_all_but(self, sender: _Client | None, packet: bytes) -> None:
        for client in self._clients.values():
            if client is not sender:
                client.give(packet)
                self._watch(client)

    def _watch(self, client: _Client) -> None:
        """Be woken by a client that sends, and by one that can take what waits for it."""
        if client.waits is not client.is_watched_for_room:
            client.is_watched_for_room = client.waits
            self._poll.modify(client.connection, select.POLLIN | (select.POLLOUT if client.waits else 0))

    def _drop(self, client: _Client) -> None:
        self._poll.unregister(client.connection)
        del self._clients[client.connection.fileno()]
        client.connection.close()


def socket_path(name: str) -> Path:
    """The path of a bus name `unix:PATH`. Raises UserError where it is none that a socket can have."""
    text = name.removeprefix(PREFIX)
    if not text:
        raise UserError(f"{name} has no path; write for example {PREFIX}/tmp/drives.sock")
    if "\0" in text:
        raise UserError(f"{name}: a path has no zero byte; write for example {PREFIX}/tmp/drives.sock")
    if len(os.fsencode(text)) > LONGEST_PATH:
        raise UserError(f"{name}: a socket's path has at most {LONGEST_PATH} bytes; choose a shorter one")
    return Path(text)
