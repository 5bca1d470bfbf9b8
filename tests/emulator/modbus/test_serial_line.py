"""Modbus RTU: CRC, parting of frames, and a line that is a pseudo terminal."""

import os
import pty
import struct
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from modbus_bench import PATIENCE, PROFILE_VELOCITY, STATUSWORD, Bench, in_thread

from drivetwin.emulator.modbus import serve_modbus
from drivetwin.emulator.modbus.rtu import LONGEST_FRAME, RtuFrames, crc, open_line
from drivetwin.foundation.errors import UserError


def framed(unit: int, pdu: bytes) -> bytes:
    return bytes((unit,)) + pdu + crc(bytes((unit,)) + pdu)


READ_STATUSWORD = framed(1, struct.pack(">BHH", 3, STATUSWORD, 1))


def test_crc_of_the_standard() -> None:
    assert crc(bytes.fromhex("02 07")) == bytes.fromhex("41 12")  # MODBUS over Serial Line V1.02, appendix B: 1241h, low first
    assert framed(1, bytes.fromhex("03 00 00 00 0A"))[-2:] == bytes.fromhex("C5 CD")


def test_a_frame_in_pieces() -> None:
    frames = RtuFrames(lambda unit, pdu: bytes((unit,)) + pdu)
    assert [frames.receive(READ_STATUSWORD[at : at + 1]) for at in range(7)] == [b""] * 7
    assert frames.receive(READ_STATUSWORD[7:]) == framed(1, b"\x01" + READ_STATUSWORD[1:-2])


def test_noise_is_dropped_after_a_silence() -> None:
    frames = RtuFrames(lambda _, pdu: pdu)
    assert frames.receive(b"\xff\x00" + READ_STATUSWORD) == b""
    frames.silence()
    assert frames.receive(READ_STATUSWORD) == READ_STATUSWORD
    assert frames.receive(bytes(LONGEST_FRAME + 1)) == b""
    assert frames.receive(READ_STATUSWORD) == READ_STATUSWORD


def test_a_wrong_crc_is_not_answered() -> None:
    frames = RtuFrames(lambda _, pdu: pdu)
    assert frames.receive(READ_STATUSWORD[:-1] + b"\0") == b""


@contextmanager
def line() -> Iterator[tuple[int, str]]:
    """Our end of a pseudo terminal, and the name of the other end."""
    ours, theirs = pty.openpty()
    try:
        yield ours, os.ttyname(theirs)
    finally:
        os.close(ours)
        os.close(theirs)


def test_over_a_line() -> None:
    bench = Bench(machine="scara")
    with line() as (ours, name), serve_modbus(bench.virtual, None, name) as names:
        assert names == (f"Modbus RTU on {name}",)

        def talk() -> list[bytes]:
            os.write(ours, READ_STATUSWORD)
            first = read_frame(ours, 7)
            os.write(ours, framed(9, bytes.fromhex("03 0100 0001")))  # nobody is unit 9
            time.sleep(0.2)
            os.write(ours, framed(0, bytes.fromhex("10 0200 0002 04 00000063")))  # to all, and no answer
            time.sleep(0.2)
            os.write(ours, framed(3, struct.pack(">BHH", 3, PROFILE_VELOCITY, 2)))
            return [first, read_frame(ours, 9)]

        done = in_thread(talk)
        deadline = time.monotonic() + PATIENCE
        while not done.done() and time.monotonic() < deadline:
            bench.virtual.poll()
        assert done.result(1.0) == [framed(1, bytes.fromhex("03 02 0250")), framed(3, bytes.fromhex("03 04 00000063"))]
    assert [drive.dictionary[0x6081].value for drive in bench.virtual.drives] == [99, 99, 99]


def read_frame(descriptor: int, length: int) -> bytes:
    data = b""
    while len(data) < length:
        data += os.read(descriptor, length - len(data))
    return data


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("/nowhere/ttyS9", "cannot be opened as a serial line"),
        ("/dev/null", "cannot be opened as a serial line"),
        ("/dev/ttyS0,12345", "expected DEVICE"),
        ("/dev/ttyS0,9600,X", "expected DEVICE"),
        ("/dev/ttyS0,9600,N,1", "expected DEVICE"),
    ],
)
def test_a_line_that_is_none_is_told(name: str, message: str) -> None:
    with pytest.raises(UserError, match=message):
        open_line(name)
