"""Modbus clients that this project did not write, against `drivetwin emulate`: of Python, C, Rust, Go and JavaScript."""

from __future__ import annotations

import json
import os
import pty
import re
import select
import shutil
import signal
import subprocess
import threading
import time
import venv
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from foreign import FOREIGN, installed, missing
from processes import PATIENCE, start
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.pdu import ModbusPDU

HERE = Path(__file__).parent

CONTROLWORD, MODE, TARGET_VELOCITY, STATUSWORD, POSITION, VELOCITY = 0x0000, 0x0001, 0x0004, 0x0100, 0x0102, 0x0104
PROFILE_VELOCITY, ACCELERATION, DECELERATION = 0x0200, 0x0202, 0x0204
SPEED, RAMP = 400_000, 4_000_000
OPERATION_ENABLED = 0x27

DRYVE_CLIENT = "dryve-d1==0.3.0"


@contextmanager
def emulated(*arguments: object) -> Iterator[int]:
    """An emulator with Modbus TCP on a free port, which is yielded. It has to end well, and say nothing on stderr."""
    process = start("emulate", "--bus", "ws://127.0.0.1:0", "--modbus", "127.0.0.1:0", *arguments)
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        found = re.search(r"Modbus TCP on 127\.0\.0\.1:(\d+)", line)
        assert found is not None, line + (process.communicate(timeout=PATIENCE)[1] if not line else "")
        yield int(found.group(1))
    finally:
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, err) == (0, "")


# -- pymodbus ----------------------------------------------------------------------------------------------------------


class PymodbusMaster:
    """pymodbus as a master of unit 1, in registers and 32-bit values."""

    def __init__(self, client: ModbusTcpClient | ModbusSerialClient) -> None:
        self.client = client

    def write(self, address: int, value: int) -> None:
        """A 16-bit value by function 6."""
        assert not self.client.write_register(address, value, device_id=1).isError()

    def write32(self, address: int, value: int) -> None:
        """A 32-bit value by function 16."""
        words = self.client.convert_to_registers(value, self.client.DATATYPE.INT32)
        assert not self.client.write_registers(address, words, device_id=1).isError()

    def read32(self, address: int) -> int:
        """A 32-bit value by function 4."""
        answer = self.client.read_input_registers(address, count=2, device_id=1)
        value = self.client.convert_from_registers(answer.registers, self.client.DATATYPE.INT32)
        assert isinstance(value, int)
        return value

    def state(self) -> int:
        return self.client.read_holding_registers(STATUSWORD, count=1, device_id=1).registers[0] & 0x6F

    def until(self, state: int) -> None:
        deadline = time.monotonic() + PATIENCE
        while self.state() != state:
            assert time.monotonic() < deadline, hex(self.state())


@contextmanager
def pymodbus(port: int) -> Iterator[PymodbusMaster]:
    client: Any = ModbusTcpClient("127.0.0.1", port=port, timeout=PATIENCE)
    assert client.connect()
    try:
        yield PymodbusMaster(client)
    finally:
        client.close()


@pytest.mark.parametrize("profile", ["servoone", "cia402-full"])
def test_pymodbus_enables_and_moves_an_axis(profile: str) -> None:
    with emulated("--machine", "arm", "--profile", profile) as port, pymodbus(port) as master:
        for address, value in ((PROFILE_VELOCITY, SPEED), (ACCELERATION, RAMP), (DECELERATION, RAMP)):
            master.write32(address, value)
        master.write(MODE, 3)
        for command, state in ((0x06, 0x21), (0x07, 0x23), (0x0F, OPERATION_ENABLED)):
            master.write(CONTROLWORD, command)
            master.until(state)
        begin = master.read32(POSITION)
        master.write32(TARGET_VELOCITY, SPEED)
        deadline = time.monotonic() + PATIENCE
        while abs(master.read32(VELOCITY) - SPEED) > 0.1 * SPEED:
            assert time.monotonic() < deadline
        answer = master.client.readwrite_registers(
            read_address=STATUSWORD, read_count=8, write_address=TARGET_VELOCITY, values=[0, 0], device_id=1
        )
        assert answer.registers[0] & 0x6F == OPERATION_ENABLED
        assert master.read32(POSITION) > begin
        master.write(CONTROLWORD, 0x00)
        master.until(0x40)


def test_pymodbus_over_a_serial_line() -> None:
    """Modbus RTU: a drive is enabled and disabled, values and exceptions come back."""
    with line() as (here, there), emulated("--machine", "scara", "--modbus-serial", here):
        client: Any = ModbusSerialClient(there, baudrate=19200, timeout=PATIENCE, retries=0)  # a pseudo terminal has no parity
        assert client.connect()
        try:
            master = PymodbusMaster(client)
            master.write32(PROFILE_VELOCITY, 123456)
            assert master.read32(PROFILE_VELOCITY) == 123456
            master.write(MODE, 3)
            for command, state in ((0x06, 0x21), (0x07, 0x23), (0x0F, OPERATION_ENABLED), (0x00, 0x40)):
                master.write(CONTROLWORD, command)
                master.until(state)
            assert exception(client.read_holding_registers(0x4000, count=1, device_id=1)) == 2
        finally:
            client.close()


def test_pymodbus_reads_the_exceptions() -> None:
    with emulated("--machine", "scara") as port, pymodbus(port) as master:
        client = master.client
        assert exception(client.read_holding_registers(0x4000, count=1, device_id=1)) == 2
        assert exception(client.write_register(STATUSWORD, 0, device_id=1)) == 2
        assert exception(client.write_register(TARGET_VELOCITY, 1, device_id=1)) == 2  # half an object
        assert exception(client.write_register(MODE, 99, device_id=1)) == 3
        assert exception(client.read_holding_registers(STATUSWORD, count=1, device_id=9)) == 0x0B
        assert exception(client.read_coils(0, count=1, device_id=1)) == 1


def exception(answer: ModbusPDU) -> int:
    assert answer.isError()
    return answer.exception_code


# -- Rust, Go, JavaScript ----------------------------------------------------------------------------------------------

CLIENTS = Path(__file__).parents[1] / "interoperability"
SERVICES = ["16, 3: 1 57920", "4: 1 57920", "6: 3", "23: 3", "exception: 2", "enabled", "disabled"]
WITHOUT_23 = [service for service in SERVICES if not service.startswith("23")]


def said(*command: object, **environment: str) -> list[str]:
    """What a client printed, without the brackets and commas in which its language writes a list."""
    environ = {**os.environ, **environment}
    told = [str(part) for part in command]
    done = subprocess.run(told, capture_output=True, text=True, timeout=PATIENCE, check=False, env=environ)
    assert (done.returncode, done.stderr) == (0, "")
    return [re.sub(r"[\[\]]|,(?= \d+\])", "", line) for line in done.stdout.splitlines()]


@pytest.mark.parametrize("program", ["rust/debug/modbus", "bin/go-modbus"])
def test_tokio_modbus_and_goburrow_enable_an_axis(program: str) -> None:
    """Functions 3, 4, 6, 16, 23 and an exception."""
    with emulated("--machine", "arm", "--profile", "cia402-full") as port:
        assert said(installed(program), port) == SERVICES


@pytest.mark.parametrize("program", ["rust/debug/modbus", "bin/go-modbus"])
def test_tokio_modbus_and_goburrow_over_a_serial_line(program: str) -> None:
    """The same services by Modbus RTU."""
    client = installed(program)
    with line() as (here, there), emulated("--machine", "arm", "--profile", "cia402-full", "--modbus-serial", here):
        assert said(client, there) == SERVICES


def test_jsmodbus_enables_an_axis() -> None:
    """Functions 3, 4, 6, 16 and an exception; it has no function 23."""
    installed("node_modules/jsmodbus")
    with emulated("--machine", "arm", "--profile", "cia402-full") as port:
        told = said("node", CLIENTS / "javascript" / "modbus.js", port, NODE_PATH=str(FOREIGN / "node_modules"))
    assert told == WITHOUT_23


def test_jsmodbus_over_a_serial_line() -> None:
    """The same services by Modbus RTU."""
    installed("node_modules/jsmodbus")
    with line() as (here, there), emulated("--machine", "arm", "--profile", "cia402-full", "--modbus-serial", here):
        told = said("node", CLIENTS / "javascript" / "modbus.js", there, NODE_PATH=str(FOREIGN / "node_modules"))
    assert told == WITHOUT_23


# -- mbpoll ------------------------------------------------------------------------------------------------------------


@pytest.fixture
def mbpoll_is_here() -> None:
    if shutil.which("mbpoll") is None:
        missing("mbpoll", "it is a package of Debian's")


def mbpoll(*arguments: str) -> list[str]:
    """Values that mbpoll printed, or those that it wrote; fails where mbpoll does."""
    command = ["mbpoll", "-1", "-0", "-q", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return re.findall(r"^\[\d+\]:\s+(\S+)", done.stdout, re.MULTILINE)


@pytest.mark.usefixtures("mbpoll_is_here")
def test_mbpoll_over_tcp() -> None:
    with emulated("--machine", "scara", "--profile", "cia402-full") as port:
        tcp = ("-m", "tcp", "-p", str(port), "-o", "10")
        assert mbpoll(*tcp, "-a", "2", "-r", "256", "-t", "4:hex", "127.0.0.1") == ["0x0250"]
        mbpoll(*tcp, "-a", "2", "-r", "2", "-t", "4:int", "-B", "127.0.0.1", "--", "-123456789")
        assert mbpoll(*tcp, "-a", "2", "-r", "2", "-t", "4:int", "-B", "127.0.0.1") == ["-123456789"]
        assert mbpoll(*tcp, "-a", "2", "-r", "2", "-t", "3:int", "-B", "127.0.0.1") == ["-123456789"]
        (torque,) = mbpoll(*tcp, "-a", "2", "-r", "264", "-t", "3:float", "-B", "127.0.0.1")
        assert abs(float(torque)) < 0.1
        mbpoll(*tcp, "-a", "2", "-r", "0", "127.0.0.1", "6")
        assert mbpoll(*tcp, "-a", "2", "-r", "256", "-t", "4:hex", "127.0.0.1") == ["0x0231"]


@pytest.mark.usefixtures("mbpoll_is_here")
def test_mbpoll_reads_the_exceptions() -> None:
    """02h, 03h, 01h and 0Bh, by unit, kind of register, register, and what is written to it."""
    asked = {
        ("2", "4", "16384"): "Illegal data address",
        ("2", "4", "1", "99"): "Illegal data value",
        ("2", "0", "0"): "Illegal function",
        ("9", "4", "256"): "Target device failed to respond",
    }
    with emulated("--machine", "scara", "--profile", "cia402-full") as port:
        for (unit, kind, register, *values), told in asked.items():
            options = ("-m", "tcp", "-p", str(port), "-o", "10", "-a", unit, "-t", kind, "-r", register)
            command = ["mbpoll", "-1", "-0", "-q", *options, "127.0.0.1", *values]
            done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
            assert told in done.stderr, done.stdout + done.stderr


@pytest.mark.usefixtures("mbpoll_is_here")
def test_mbpoll_over_a_serial_line() -> None:
    with line() as (here, there), emulated("--machine", "scara", "--modbus-serial", here):
        rtu = ("-m", "rtu", "-b", "19200", "-P", "even", "-o", "10", there)
        assert mbpoll("-a", "3", "-r", "256", "-t", "4:hex", *rtu) == ["0x0250"]
        others = mbpoll("-a", "1", "-r", "512", "-t", "4:int", "-B", *rtu)
        mbpoll("-a", "3", "-r", "512", "-t", "4:int", "-B", *rtu, "70000")
        assert mbpoll("-a", "3", "-r", "512", "-t", "4:int", "-B", *rtu) == ["70000"]
        assert mbpoll("-a", "1", "-r", "512", "-t", "4:int", "-B", *rtu) == others != ["70000"], "one unit ID is one drive"


@contextmanager
def line() -> Iterator[tuple[str, str]]:
    """The names of the two ends of a serial line: two pseudo terminals, joined."""
    ends = [pty.openpty() for _ in range(2)]
    stop, stopper = os.pipe()
    (here, _), (there, _) = ends
    other = {here: there, there: here}

    def carry() -> None:
        while True:
            ready, _, _ = select.select((here, there, stop), (), ())
            if stop in ready:
                return
            for descriptor in ready:
                os.write(other[descriptor], os.read(descriptor, 256))

    thread = threading.Thread(target=carry, daemon=True)
    thread.start()
    try:
        yield os.ttyname(ends[0][1]), os.ttyname(ends[1][1])
    finally:
        os.write(stopper, b"\0")
        thread.join()
        for descriptor in (*ends[0], *ends[1], stop, stopper):
            os.close(descriptor)


# -- dryve-d1 ----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="session")
def dryve_python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An interpreter with `dryve-d1`, in an environment of its own. It declares Python 3.12 and runs with 3.11."""
    folder = tmp_path_factory.mktemp("dryve")
    venv.create(folder, with_pip=True)
    python = folder / "bin" / "python"
    command: list[str | Path] = [python, "-m", "pip", "install", "--quiet", "--ignore-requires-python", DRYVE_CLIENT]
    done = subprocess.run(command, capture_output=True, text=True, timeout=5 * PATIENCE, check=False)
    if done.returncode != 0:
        missing(DRYVE_CLIENT, f"pip says {done.stderr.strip().splitlines()[-1]}")
    return python


def test_dryve_d1_homes_and_moves_an_axis(dryve_python: Path) -> None:
    with emulated("--machine", "scara", "--profile", "dryve_d1") as port:
        done = subprocess.run(
            [dryve_python, HERE / "dryve_client.py", str(port), "1"],
            capture_output=True,
            text=True,
            timeout=4 * PATIENCE,
            check=False,
            env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
        )
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout)
    assert (seen["homed before"], seen["attained"], seen["error"], seen["homed"]) == (False, True, False, True)
    assert seen["limits"] == [0, 5_000_000]
    assert seen["positions"] == pytest.approx([3_000_000, 1_000_000], abs=seen["window"])  # 6067h, the position window
    assert seen["refused"] == ["AB FF", "AB FF"]
    assert seen["statusword"] & 0x6F == 0x40
