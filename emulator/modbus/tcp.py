"""Modbus TCP: frames on sockets (MODBUS Messaging on TCP/IP Implementation Guide V1.0b, clause 3.1.3).

    transaction (2) | protocol 0000 | length of what follows (2) | unit identifier | PDU

Answers of one connection come in the order of its requests. A frame of another protocol is skipped; one whose length cannot
be a Modbus frame's ends the connection, since nobody knows where the next one begins.
"""

from __future__ import annotations

import asyncio
import logging
import socket
import struct
import threading
from contextlib import suppress

from drivetwin.emulator.modbus.mailbox import Mailbox
from drivetwin.emulator.modbus.service import ModbusService
from drivetwin.foundation.errors import UserError

logger = logging.getLogger(__name__)

HEADER = struct.Struct(">HHHB")
MODBUS_PROTOCOL = 0
LENGTHS = range(2, 255)
"""Of unit identifier and PDU together."""

MOST_CONNECTIONS = 32
"""At once; one more is accepted and closed at once, and the others stay."""

SETTLE = 0.05
"""How long connections have to come to an end by themselves when the port closes [s]."""

PATIENCE = 2.0
"""Longest wait for connections that were cut off [s]."""


class TcpPort:
    """Serves a machine's Modbus on a TCP port, in a thread of its own. Raises UserError where it cannot listen."""

    def __init__(self, host: str, port: int, service: ModbusService, mailbox: Mailbox) -> None:
        try:
            family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
            self._socket = socket.create_server((host, port), family=family)
        except OSError as error:
            raise UserError(f"Modbus cannot listen on {host}:{port}: {error.strerror or error}") from None
        self.address: tuple[str, int] = self._socket.getsockname()[:2]
        self._service = service
        self._mailbox = mailbox
        self._socket.setblocking(False)
        self._connections: set[asyncio.Task[None]] = set()
        self._writers: set[asyncio.StreamWriter] = set()
        self._loop = asyncio.new_event_loop()
        self._ending = asyncio.Event()
        self._thread = threading.Thread(target=self._run, name="modbus-tcp", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Close the port and its connections; the mailbox has to be closed before."""
        self._loop.call_soon_threadsafe(self._ending.set)
        self._thread.join()

    def _run(self) -> None:
        try:
            self._loop.run_until_complete(self._serve())
        finally:
            self._loop.close()

    async def _serve(self) -> None:
        accepting = self._loop.create_task(self._accept())
        await self._ending.wait()
        accepting.cancel()
        self._socket.close()
        await self._all_ended(SETTLE)
        for writer in self._writers:
            writer.transport.abort()
        await self._all_ended(PATIENCE)

    async def _all_ended(self, timeout: float) -> None:
        for writer in self._writers:
            writer.close()
        if self._connections:
            await asyncio.wait(self._connections, timeout=timeout)

    async def _accept(self) -> None:
        while True:
            try:
                connection, _ = await self._loop.sock_accept(self._socket)
            except OSError as error:  # such as no file descriptor left
                logger.error("Modbus: a connection cannot be accepted: %s", error)
                await asyncio.sleep(PATIENCE)
                continue
            if len(self._connections) >= MOST_CONNECTIONS:
                logger.warning("Modbus: more than %d connections, the newest is closed", MOST_CONNECTIONS)
                connection.close()
                continue
            task = self._loop.create_task(self._converse(connection))
            self._connections.add(task)
            task.add_done_callback(self._ended)

    def _ended(self, task: asyncio.Task[None]) -> None:
        self._connections.discard(task)
        if not task.cancelled() and task.exception() is not None:
            logger.error("Modbus: a connection ended", exc_info=task.exception())

    async def _converse(self, connection: socket.socket) -> None:
        reader, writer = await asyncio.open_connection(sock=connection)
        self._writers.add(writer)
        try:
            with suppress(asyncio.IncompleteReadError, ConnectionError):
                await self._answer_all(reader, writer)
        finally:
            writer.close()
            with suppress(ConnectionError):
                await writer.wait_closed()
            self._writers.discard(writer)

    async def _answer_all(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while True:
            transaction, protocol, length, unit_id = HEADER.unpack(await reader.readexactly(HEADER.size))
            if length not in LENGTHS:
                logger.debug("Modbus: a frame of %d bytes; the connection is closed", length)
                return
            pdu = await reader.readexactly(length - 1)
            if protocol == MODBUS_PROTOCOL:
                answer = await self._ask(unit_id, pdu)
                writer.write(HEADER.pack(transaction, MODBUS_PROTOCOL, len(answer) + 1, unit_id) + answer)
                await writer.drain()

    async def _ask(self, unit_id: int, pdu: bytes) -> bytes:
        answer = await asyncio.wrap_future(self._mailbox.ask(lambda: self._service.answer(unit_id, pdu)))
        if answer is None:
            raise ConnectionAbortedError("the emulator is ending")
        return answer
