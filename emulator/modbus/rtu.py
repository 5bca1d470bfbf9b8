"""Modbus RTU: frames on a serial line (MODBUS over Serial Line V1.02, clause 2.5.1).

    unit | PDU | CRC, low byte first

The standard parts frames by 3.5 characters of silence, which no host sees through a USB adapter. Here a frame has ended when
its CRC is right; what has no right CRC after `SILENCE` is dropped.
"""

from __future__ import annotations

import logging
import os
import select
import termios
import threading
import tty
from collections.abc import Callable

from drivetwin.emulator.modbus.mailbox import Mailbox
from drivetwin.emulator.modbus.service import ModbusService
from drivetwin.foundation.errors import UserError

logger = logging.getLogger(__name__)

LONGEST_FRAME = 256
SHORTEST_FRAME = 4
SILENCE = 0.05
"""Longest pause within a frame [s]: more than a USB adapter's latency."""

BAUD, PARITY = 19200, "E"
"""What the standard prescribes where nothing is said (2.5.1): even parity, one stop bit."""

POLYNOMIAL = 0xA001

_PARITY_FLAGS = {"N": 0, "E": termios.PARENB, "O": termios.PARENB | termios.PARODD}


def crc(data: bytes) -> bytes:
    """CRC-16 of a frame as it stands on the line (2.5.1.2, appendix B)."""
    register = 0xFFFF
    for byte in data:
        register ^= byte
        for _ in range(8):
            register = register >> 1 ^ (POLYNOMIAL if register & 1 else 0)
    return register.to_bytes(2, "little")


class RtuFrames:
    """Parts the bytes of a line into frames; `answer` gets unit and PDU, and what it returns goes back in a frame."""

    def __init__(self, answer: Callable[[int, bytes], bytes | None]) -> None:
        self._answer = answer
        self._came = b""

    def receive(self, data: bytes) -> bytes:
        """Take bytes of the line; the answering frame, or nothing."""
        self._came += data
        frame = self._came
        if len(frame) > LONGEST_FRAME:
            self._came = b""
            return b""
        if len(frame) < SHORTEST_FRAME or crc(frame[:-2]) != frame[-2:]:
            return b""
        self._came = b""
        answer = self._answer(frame[0], frame[1:-2])
        if answer is None:
            return b""
        reply = frame[:1] + answer
        return reply + crc(reply)

    def silence(self) -> None:
        """Nothing has come for `SILENCE`: what is there will not become a frame."""
        self._came = b""


class RtuPort:
    """Serves a machine's Modbus on a serial line, in a thread of its own.

    `line` is DEVICE[,BAUD[,PARITY]], such as /dev/ttyUSB0,115200,N. Raises UserError where it cannot be opened.
    """

    def __init__(self, line: str, service: ModbusService, mailbox: Mailbox) -> None:
        self._descriptor = open_line(line)
        self._frames = RtuFrames(
            lambda unit_id, pdu: mailbox.ask(lambda: service.answer_on_line(unit_id, pdu)).result()
        )
        self._wake, self._waker = os.pipe()
        self._thread = threading.Thread(target=self._run, name="modbus-rtu", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Close the line; the mailbox has to be closed before."""
        os.write(self._waker, b"\0")
        self._thread.join()
        for descriptor in (self._descriptor, self._wake, self._waker):
            os.close(descriptor)

    def _run(self) -> None:
        while True:
            ready, _, _ = select.select((self._descriptor, self._wake), (), (), SILENCE)
            if self._wake in ready:
                return
            if not ready:
                self._frames.silence()
                continue
            try:
                data = os.read(self._descriptor, LONGEST_FRAME)
                if not data:
                    raise OSError("the line has ended")
                self._write(self._frames.receive(data))
            except OSError as error:
                logger.error("Modbus: the serial line is gone: %s", error)
                return

    def _write(self, reply: bytes) -> None:
        while reply:
            select.select((), (self._descriptor,), ())
            reply = reply[os.write(self._descriptor, reply) :]


def open_line(line: str) -> int:
    """File descriptor of a serial line, raw, with eight data bits. Raises UserError."""
    device, baud, parity = (*line.split(","), "", "")[:3]
    speed = getattr(termios, f"B{baud or BAUD}", None)
    flags = _PARITY_FLAGS.get(parity.upper() or PARITY)
    if speed is None or flags is None or line.count(",") > 2:
        raise UserError(f"--modbus-serial {line}: expected DEVICE[,BAUD[,PARITY]] with a usual baud rate and parity N, E or O")
    try:
        descriptor = os.open(device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(descriptor)
        attributes = termios.tcgetattr(descriptor)
        attributes[2] = attributes[2] & ~(termios.PARENB | termios.PARODD | termios.CSTOPB) | flags | termios.CLOCAL
        attributes[4] = attributes[5] = speed
        termios.tcsetattr(descriptor, termios.TCSANOW, attributes)
    except (OSError, termios.error) as error:
        raise UserError(f"--modbus-serial {line}: {device} cannot be opened as a serial line: {error}") from None
    return descriptor
