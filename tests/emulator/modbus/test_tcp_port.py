"""The TCP port: frames, order, several clients, and what a client does wrong (MODBUS Messaging on TCP/IP V1.0b)."""

import logging
import socket
import struct
from contextlib import suppress

import pytest
from modbus_bench import CONTROLWORD, PATIENCE, POSITION, SHUTDOWN, STATUSWORD, Bench, client, in_thread

from drivetwin.emulator.modbus import serve_modbus
from drivetwin.emulator.modbus.ports import host_and_port
from drivetwin.emulator.modbus.tcp import HEADER, MOST_CONNECTIONS
from drivetwin.foundation.errors import UserError

READ_STATUSWORD = struct.pack(">BHH", 3, STATUSWORD, 1)
READ_POSITION = struct.pack(">BHH", 4, POSITION, 2)
READ_TORQUE_BY_GATEWAY = bytes.fromhex("2B 0D 00 00 00 6077 00 0000 0002")


def test_transaction_and_unit_come_back() -> None:
    def talk(port: int) -> None:
        with client(port) as master:
            master.send(HEADER.pack(0xBEEF, 0, 6, 1) + READ_STATUSWORD)
            assert master.receive() == (0xBEEF, 1, bytes.fromhex("03 02 0250"))
            master.send(HEADER.pack(1, 0, 6, 77) + READ_STATUSWORD)
            assert master.receive() == (1, 77, b"\x83\x0b")

    Bench().while_served(talk)


def test_requests_that_come_together_and_in_pieces_are_all_answered_in_order() -> None:
    def talk(port: int) -> None:
        with client(port) as master:
            frames = b"".join(HEADER.pack(number, 0, 6, 1) + READ_STATUSWORD for number in range(50))
            for start in range(0, len(frames), 17):
                master.send(frames[start : start + 17])
            assert [master.receive()[0] for _ in range(50)] == list(range(50))

    Bench().while_served(talk)


def test_a_frame_of_another_protocol_is_skipped() -> None:
    def talk(port: int) -> None:
        with client(port) as master:
            master.send(HEADER.pack(1, 9, 6, 1) + READ_STATUSWORD + HEADER.pack(2, 0, 6, 1) + READ_STATUSWORD)
            assert master.receive()[0] == 2

    Bench().while_served(talk)


@pytest.mark.parametrize("length", [0, 1, 255, 0xFFFF])
def test_a_length_that_cannot_be_ends_the_connection_and_no_other(length: int) -> None:
    def talk(port: int) -> None:
        with client(port) as good, client(port) as bad:
            bad.send(HEADER.pack(1, 0, length, 1) + READ_STATUSWORD)
            with pytest.raises(ConnectionError):
                bad.receive()
            assert good.ask(READ_STATUSWORD) == bytes.fromhex("03 02 0250")

    Bench().while_served(talk)


def test_a_client_that_leaves_within_a_frame_or_never_reads_hinders_nobody() -> None:
    def talk(port: int) -> None:
        with client(port) as half:
            half.send(HEADER.pack(1, 0, 6, 1) + READ_STATUSWORD[:2])
        with client(port) as deaf, client(port) as good:
            for number in range(2000):
                deaf.send(HEADER.pack(number, 0, 6, 1) + READ_STATUSWORD)
            assert good.ask(READ_STATUSWORD) == bytes.fromhex("03 02 0250")

    Bench().while_served(talk)


def test_more_clients_than_places(caplog: pytest.LogCaptureFixture) -> None:
    def talk(port: int) -> None:
        connections = [socket.create_connection(("127.0.0.1", port), timeout=30) for _ in range(MOST_CONNECTIONS)]
        for connection in connections:  # each has a place once it is answered
            connection.sendall(HEADER.pack(1, 0, 6, 1) + READ_STATUSWORD)
            assert connection.recv(100)
        with client(port) as late, pytest.raises(ConnectionError):
            late.ask(READ_STATUSWORD)
        for connection in connections:
            connection.close()

    with caplog.at_level(logging.WARNING):
        Bench().while_served(talk)
    assert {record.levelname for record in caplog.records} == {"WARNING"}
    assert "more than 32 connections" in caplog.text


def test_of_forty_connections_that_come_at_once_thirty_two_are_served(caplog: pytest.LogCaptureFixture) -> None:
    """They are open before the first is looked at; only the newest are closed."""
    caplog.set_level(logging.WARNING)

    def talk(port: int) -> None:
        connections = [socket.create_connection(("127.0.0.1", port), timeout=30) for _ in range(MOST_CONNECTIONS + 8)]
        served = []
        for number, connection in enumerate(connections):
            with suppress(ConnectionError):
                connection.sendall(HEADER.pack(number, 0, 6, 1) + READ_STATUSWORD)
        for connection in connections:
            with suppress(ConnectionError):
                served.append(bool(connection.recv(64)))
                continue
            served.append(False)
        assert served == [True] * MOST_CONNECTIONS + [False] * 8
        for connection in connections:
            connection.close()

    Bench().while_served(talk)
    assert caplog.text.count("more than 32 connections") == 8


def test_closing_ends_the_connections_and_frees_the_port() -> None:
    bench = Bench()
    with serve_modbus(bench.virtual, "127.0.0.1:0", None) as (name,):
        port = int(name.rpartition(":")[2])
        with pytest.raises(UserError, match=f"Modbus cannot listen on 127.0.0.1:{port}: "), serve_modbus(
            bench.virtual, str(port), None
        ):
            pass
        master = socket.create_connection(("127.0.0.1", port), timeout=30)
        master.sendall(HEADER.pack(1, 0, 6, 1) + READ_STATUSWORD)  # nobody polls: it waits
    with master, suppress(ConnectionResetError):
        assert master.recv(1) == b""
    with serve_modbus(bench.virtual, str(port), None):
        pass


def test_without_a_port_nothing_is_attached() -> None:
    bench = Bench()
    with serve_modbus(bench.virtual, None, None) as names:
        assert names == ()
        assert bench.virtual.wait() is None


def test_loopback_unless_told() -> None:
    assert host_and_port("1502") == host_and_port(":1502") == ("127.0.0.1", 1502)
    assert host_and_port("0.0.0.0:502") == ("0.0.0.0", 502)
    assert host_and_port("[::1]:502") == ("::1", 502)
    for wrong in ("", "localhost", "127.0.0.1:", "127.0.0.1:x", "1.2.3.4:99999"):
        with pytest.raises(UserError, match="expected HOST:PORT or PORT"):
            host_and_port(wrong)


def moved(bench: Bench) -> list[tuple[int, bytes, float]]:
    """Every frame of a run: a PDO at each SYNC while the drive is enabled and runs."""
    bench.can(0x000, b"\x01\x01")
    for index, value, size in ((0x6081, 400_000, 4), (0x6083, 2_000_000, 4), (0x6084, 2_000_000, 4), (0x6060, 3, 1)):
        assert bench.sdo_write(index, 0, value, size) == 0
    assert bench.sdo_write(0x1803, 1, 0x481, 4) == 0  # TPDO 4: statusword and velocity at each SYNC
    for command in (0x06, 0x07, 0x0F):
        assert bench.sdo_write(0x6040, 0, command, 2) == 0
        bench.sync(10)
    assert bench.sdo_write(0x60FF, 0, 400_000, 4) == 0
    bench.sync(1500)
    return bench.sent


def test_a_run_is_bit_identical_whether_modbus_reads_or_not() -> None:
    alone = moved(Bench())
    watched, answers = Bench(), Answers()
    with serve_modbus(watched.virtual, "127.0.0.1:0", None) as (name,):
        reading = in_thread(answers.read_until_hung_up, int(name.rpartition(":")[2]))
        while answers.count == 0 and not reading.done():
            watched.virtual.poll()
        before = answers.count
        frames = moved(watched)
        during = answers.count - before
    reading.result(PATIENCE)
    assert during > 10
    assert frames == alone
    assert len([frame for frame in alone if frame[0] == 0x481]) > 1500


class Answers:
    """A client that reads registers and objects as fast as it is answered, and counts."""

    def __init__(self) -> None:
        self.count = 0

    def read_until_hung_up(self, port: int) -> None:
        with client(port) as master, suppress(ConnectionError):
            while True:
                for pdu in (READ_STATUSWORD, READ_POSITION, READ_TORQUE_BY_GATEWAY):
                    assert master.ask(pdu)[0] == pdu[0]
                    self.count += 1


def test_two_clients_count_as_one_master() -> None:
    def talk(port: int) -> None:
        with client(port) as first, client(port) as second:
            for command in (SHUTDOWN, 0x07, 0x0F):
                first.ask(struct.pack(">BHH", 6, CONTROLWORD, command))
            assert second.ask(struct.pack(">BHH", 6, CONTROLWORD, 0x07))[0] == 6

    Bench().while_served(talk)
