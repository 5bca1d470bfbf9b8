"""Ten thousand random and mutated frames at a live port: no error in the log, no hang, the plant finite, still answering."""

import logging
import random
import re
import signal
import subprocess
import sys

import numpy as np
import pytest
from modbus_bench import PATIENCE, STATUSWORD, Bench, Client, client

from drivetwin.emulator.modbus.rtu import RtuFrames, crc
from drivetwin.emulator.modbus.tcp import HEADER

FRAMES = 10_000
SEED = 309

FUNCTIONS = (3, 4, 6, 16, 23, 43)
LEGAL = (
    "03 0100 0010",
    "04 0102 0002",
    "06 0000 000F",
    "06 0001 0003",
    "10 0002 0002 04 00010000",
    "10 0000 0006 0C 000F 0001 00000000 00001000",
    "10 0200 0004 08 00010000 00010000",
    "17 0100 0004 0000 0001 02 0006",
    "2B 0D 00 00 00 6041 00 0000 0002",
    "2B 0D 01 00 00 6040 00 0000 0002 0700",
    "2B 0D 01 00 00 607A 00 0000 0004 00100000",
    "2B 0D 01 00 00 6081 00 0000 0004 00100000",
    "2B 0D 01 00 00 6092 01 0000 0004 00000001",
    "2B 0D 00 00 00 1008 00 0000 0000",
    "2B 0E 01 00",
)
STATES = (0x40, 0x21, 0x23, 0x27, 0x07, 0x0F, 0x08)


def mutated(dice: random.Random) -> bytes:
    """A legal PDU with some bytes changed, lost or added."""
    pdu = bytearray(bytes.fromhex(dice.choice(LEGAL)))
    for _ in range(dice.randint(0, 3)):
        action, at = dice.randrange(4), dice.randrange(len(pdu))
        if action == 0:
            pdu[at] = dice.choice((0x00, 0x01, 0x7F, 0x80, 0xFF, dice.randrange(256)))
        elif action == 1 and len(pdu) > 1:
            del pdu[at]
        elif action == 2:
            pdu.insert(at, dice.randrange(256))
        else:
            pdu[at] ^= 1 << dice.randrange(8)
    return bytes(pdu)


def random_pdu(dice: random.Random) -> bytes:
    """Any bytes, often with a function that there is."""
    function = dice.choice(FUNCTIONS) if dice.random() < 0.7 else dice.randrange(256)
    return bytes((function,)) + dice.randbytes(dice.choice((0, 1, 4, 5, 9, 11, 15, 40, 251)))


def broken_frame(dice: random.Random) -> bytes:
    """What is no frame: noise, another protocol, a length that lies."""
    kind = dice.randrange(3)
    if kind == 0:
        return dice.randbytes(dice.randint(1, 40))
    if kind == 1:
        return HEADER.pack(1, dice.randint(1, 0xFFFF), 6, 1) + dice.randbytes(5)
    return HEADER.pack(1, 0, dice.choice((0, 1, 3, 255, 0xFFFF)), 1) + dice.randbytes(5)


def answered(master: Client, pdu: bytes, unit: int) -> None:
    """A well-framed request has one answer: the function's own, or a refusal of that function."""
    answer = master.ask(pdu, unit)
    assert answer[0] in (pdu[0], pdu[0] | 0x80), (pdu.hex(), answer.hex())
    assert len(answer) <= 253


def fuzz(port: int, dice: random.Random) -> int:
    count = 0
    while count < FRAMES:
        with client(port) as master:
            for _ in range(100):
                answered(master, mutated(dice) if dice.random() < 0.7 else random_pdu(dice), dice.choice((0, 1, 1, 1, 2, 255)))
            master.send(broken_frame(dice))  # and the connection is left as it is
            count += 101
    with client(port) as master:
        assert master.ask(bytes((3, *STATUSWORD.to_bytes(2, "big"), 0, 1)))[:2] == b"\x03\x02"
    return count


def test_ten_thousand_frames(caplog: pytest.LogCaptureFixture) -> None:
    bench = Bench("cia402-full")
    own, loop = "drivetwin.emulator.modbus", "asyncio"
    with caplog.at_level(logging.WARNING, logger=own), caplog.at_level(logging.WARNING, logger=loop):
        assert bench.while_served(lambda port: fuzz(port, random.Random(SEED))) >= FRAMES
    assert caplog.text == ""
    data = bench.virtual.plant.data
    assert np.isfinite(data.qpos).all()
    assert np.isfinite(data.qvel).all()
    assert bench.state() in STATES
    for variable in bench.od:
        if variable.size is not None and variable.on_read is None:
            variable.check(variable.read())
    bench.sync(100)
    assert np.isfinite(data.qpos).all()


def test_ten_thousand_frames_at_a_live_emulator() -> None:
    """A process of its own that follows the wall clock: it ends well and has said nothing on stderr."""
    command = [sys.executable, "-c", "from drivetwin.cli import main; main()", "emulate", "--machine", "arm"]
    process = subprocess.Popen(
        [*command, "--profile", "servoone", "--bus", "ws://127.0.0.1:0", "--modbus", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        found = re.search(r"Modbus TCP on 127\.0\.0\.1:(\d+)", process.stdout.readline())
        assert found is not None, process.communicate(timeout=PATIENCE)
        assert fuzz(int(found.group(1)), random.Random(SEED + 1)) >= FRAMES
    finally:
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, err) == (0, "")


def test_noise_on_a_serial_line() -> None:
    bench = Bench("servoone")
    service, dice = bench.service(), random.Random(SEED)
    frames = RtuFrames(service.answer_on_line)
    for number in range(FRAMES):
        pdu = mutated(dice)
        frame = bytes((dice.choice((0, 1, 2)),)) + pdu
        noise = dice.randbytes(dice.randint(0, 30))
        answer = frames.receive(frame + crc(frame) if number % 2 else noise)
        assert answer == b"" or crc(answer[:-2]) == answer[-2:]
        frames.silence()
        if number % 50 == 0:
            bench.sync()
    assert np.isfinite(bench.virtual.plant.data.qpos).all()
