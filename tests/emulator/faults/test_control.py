"""Faults by hand: the socket of a running emulator, its lines, and what it bears."""

from __future__ import annotations

import json
import os
import socket
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from descriptors import no_descriptor_left
from fault_bench import LIFT, ROTATE, FaultBench
from in_process import Command

from drivetwin.emulator.control import LONGEST_LINE, MOST_CONVERSATIONS, Control, serve_control
from drivetwin.emulator.virtual_machine import REQUEST_WAIT
from drivetwin.foundation.errors import UserError

STO = {"fault": "sto", "node": ROTATE}


class Client:
    """One conversation; what is sent is answered when the machine polls."""

    def __init__(self, path: Path, bench: FaultBench) -> None:
        self.connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.connection.settimeout(5.0)
        self.connection.connect(str(path))
        self._bench = bench

    def send(self, data: bytes) -> None:
        self.connection.sendall(data)
        for _ in range(3):  # one to accept, one to read, one to see an end
            self._bench.virtual.poll()

    def ask(self, **request: object) -> dict[str, object]:
        self.send(json.dumps(request).encode() + b"\n")
        answer: dict[str, object] = json.loads(self.connection.recv(65536))
        return answer


@contextmanager
def served(path: Path) -> Iterator[FaultBench]:
    bench = FaultBench()
    with serve_control(bench.virtual, path) as names:
        assert names == (f"control on {path}",)
        yield bench


def interlocked(bench: FaultBench) -> bool:
    return bench.virtual.drives[ROTATE - 1].hardware.sto


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "control"


def test_a_fault_is_struck_and_ended(path: Path) -> None:
    with served(path) as bench:
        client = Client(path, bench)
        bench.sync(7)
        assert client.ask(strike=STO) == {"fault": "sto", "time": pytest.approx(0.007)}
        assert interlocked(bench)
        bench.sync(1000)
        assert interlocked(bench)
        assert client.ask(end=STO) == {"fault": "sto", "time": pytest.approx(1.007)}
        assert not interlocked(bench)


def test_a_fault_ends_by_the_simulated_clock(path: Path) -> None:
    with served(path) as bench:
        Client(path, bench).ask(strike=STO, **{"for": 0.05})
        bench.sync(49)
        assert interlocked(bench)
        bench.sync(1)
        assert not interlocked(bench)


def test_the_last_word_counts(path: Path) -> None:
    """Struck again for longer, it lasts longer; struck again without an end, it stays."""
    with served(path) as bench:
        client = Client(path, bench)
        client.ask(strike=STO, **{"for": 0.02})
        client.ask(strike=STO, **{"for": 0.05})
        bench.sync(49)
        assert interlocked(bench)
        bench.sync(1)
        assert not interlocked(bench)
        client.ask(strike=STO, **{"for": 0.02})
        client.ask(strike=STO)
        bench.sync(100)
        assert interlocked(bench)


def test_values_may_be_text_as_a_command_line_has_them(path: Path) -> None:
    with served(path) as bench:
        assert "time" in Client(path, bench).ask(strike={"fault": "sto", "node": "2"}, **{"for": "0.05"})
        assert interlocked(bench)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        (b"hello", "not JSON: b'hello'"),
        (b"[" * 3000, "not JSON: b'[[["),
        (b"[]", 'expected {"strike": FAULT, "for": SECONDS}, {"end": FAULT}, {"list": {}}, {"truth": {}}'),
        (b"{}", 'expected {"strike": FAULT, "for": SECONDS}, {"end": FAULT}, {"list": {}}, {"truth": {}}'),
        (b'{"strike": 3}', 'expected {"strike": FAULT'),
        (b'{"strike": {"fault": "sto", "node": 2}, "until": 3}', 'expected {"strike": FAULT'),
        (b'{"strike": {"fault": "fire"}}', "unknown fault 'fire'; there are bus_off"),
        (b'{"strike": {"fault": "sto", "node": 9}}', "scara has no node 9"),
        (b'{"strike": {"fault": "sto", "node": 2}, "for": -1}', "for is -1, expected a number from 0"),
        (b'{"strike": {"fault": "node_dies", "node": 2}, "for": 1}', "node_dies strikes once and has no end"),
        (b'{"end": {"fault": "node_dies", "node": 2}}', "node_dies strikes once and has no end"),
    ],
)
def test_a_line_that_cannot_be_obeyed(line: bytes, expected: str) -> None:
    bench = FaultBench()
    answer = Control(bench.virtual).answer(line)
    assert answer.endswith(b"\n")
    assert expected in json.loads(answer)["error"]
    bench.sync(5)
    assert all(bench.read(node, 0x1000) for node in (LIFT, ROTATE))
    assert not interlocked(bench)


def test_objects_are_read_and_written_beside_the_bus(path: Path) -> None:
    """As the bus reads them; no frame is sent."""
    with served(path) as bench:
        client = Client(path, bench)
        speed = {"node": ROTATE, "index": 0x6081, "subindex": 0}
        bench.sent.clear()
        assert client.ask(write=speed | {"data": "39300000"}) == {"data": "39300000"}
        assert client.ask(read=speed) == {"data": "39300000"}
        assert not bench.sent
        assert bench.read(ROTATE, 0x6081) == 12345


@pytest.mark.parametrize(
    ("request_", "why"),
    [
        ({"read": {"node": ROTATE, "index": 0x5FFF, "subindex": 0}}, "06020000h Object does not exist"),
        ({"write": {"node": ROTATE, "index": 0x6041, "subindex": 0, "data": "0000"}}, "06010002h Attempt to write a read only"),
        ({"write": {"node": ROTATE, "index": 0x6081, "subindex": 0, "data": "00"}}, "06070013h"),
    ],
)
def test_an_object_is_refused_as_on_the_bus(request_: dict[str, object], why: str) -> None:
    answer = json.loads(Control(FaultBench().virtual).answer(json.dumps(request_).encode()))
    assert answer["refused"].startswith(why)


@pytest.mark.parametrize(
    ("request_", "why"),
    [
        ({"read": {"node": 9, "index": 0x6041, "subindex": 0}}, "no drive with power has node-ID 9"),
        ({"read": {"node": ROTATE, "index": 0x6041}}, 'expected {"node": 2, "index": 24641'),
        ({"write": {"node": ROTATE, "index": 0x6081, "subindex": 0, "data": "a rod"}}, "data is 'a rod'; expected"),
    ],
)
def test_what_is_no_object_is_an_error(request_: dict[str, object], why: str) -> None:
    answer = json.loads(Control(FaultBench().virtual).answer(json.dumps(request_).encode()))
    assert why in answer["error"]


def test_a_drive_without_power_has_no_service_port() -> None:
    bench = FaultBench()
    bench.virtual.switch_off(ROTATE - 1)
    told = {"read": {"node": ROTATE, "index": 0x6041, "subindex": 0}}
    assert "no drive with power" in json.loads(Control(bench.virtual).answer(json.dumps(told).encode()))["error"]


def test_the_socket_is_its_owners_alone_and_goes_with_the_emulator(path: Path) -> None:
    mask = os.umask(0)
    try:
        with served(path):
            mode = path.stat().st_mode
            assert stat.S_ISSOCK(mode)
            assert stat.S_IMODE(mode) == 0o600
            assert os.umask(0) == 0
    finally:
        os.umask(mask)
    assert not path.exists()


def test_a_socket_that_a_killed_emulator_left_is_taken(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as left:
        left.bind(str(path))
    with served(path) as bench:
        assert Client(path, bench).ask(strike=STO)["fault"] == "sto"


def test_the_socket_of_another_emulator_stays(path: Path) -> None:
    with served(path) as first:
        with pytest.raises(UserError, match=r"control: Address already in use; give a path"), served(path):
            pass
        assert Client(path, first).ask(strike=STO)["fault"] == "sto"


def test_a_file_stays(path: Path) -> None:
    path.write_text("mine")
    with pytest.raises(UserError, match="give a path of at most 107 bytes that is free"), served(path):
        pass
    assert path.read_text() == "mine"


@pytest.mark.parametrize("name", ["missing/control", "x" * 120])
def test_a_path_that_cannot_be(tmp_path: Path, name: str) -> None:
    with pytest.raises(UserError, match="give a path of at most 107 bytes that is free"), served(tmp_path / name):
        pass


def test_clients_that_leave_or_write_without_end_harm_nobody(path: Path) -> None:
    with served(path) as bench:
        gone, endless, sound = (Client(path, bench) for _ in range(3))
        gone.send(b'{"strike": {"fault"')
        gone.connection.close()
        endless.send(b"x" * LONGEST_LINE)
        endless.send(b"x" * LONGEST_LINE)
        assert endless.connection.recv(10) == b""
        assert sound.ask(strike=STO)["fault"] == "sto"


def test_a_crowd_is_served_up_to_a_number_and_no_descriptor_ends_nothing(path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with served(path) as bench:
        sound = Client(path, bench)
        assert sound.ask(strike=STO)["fault"] == "sto"
        waiting = Client(path, bench)
        with no_descriptor_left():
            assert sound.ask(end=STO)["fault"] == "sto"
        assert waiting.ask(strike=STO)["fault"] == "sto"
        crowd = []
        for _ in range(MOST_CONVERSATIONS + 20):
            bench.virtual.poll()
            crowd.append(Client(path, bench))
        for _ in range(3):
            bench.virtual.poll()
        assert sum(each.connection.recv(1, socket.MSG_DONTWAIT | socket.MSG_PEEK) == b"" for each in crowd[-22:]) == 22
        assert sound.ask(end=STO)["fault"] == "sto"
    assert {record.getMessage() for record in caplog.records} == {
        "control: a connection cannot be accepted (Too many open files)",
        f"control: more than {MOST_CONVERSATIONS} conversations, the newest is closed",
    }


def test_a_line_may_come_in_pieces_and_two_at_once(path: Path) -> None:
    line = json.dumps({"strike": STO}).encode() + b"\n"
    with served(path) as bench:
        client = Client(path, bench)
        client.send(line[:10])
        assert not interlocked(bench)
        client.send(line[10:] + line)
        assert client.connection.recv(65536).count(b"\n") == 2


def test_without_a_socket_the_loop_waits_as_before() -> None:
    bench = FaultBench()
    with serve_control(bench.virtual, None) as names:
        assert (names, bench.virtual.wait()) == ((), None)


def test_with_a_socket_the_loop_looks_often(path: Path) -> None:
    with served(path) as bench:
        assert bench.virtual.wait() == REQUEST_WAIT


def test_what_is_not_there_is_not_ended(tmp_path: Path) -> None:
    rise = {"fault": "friction_rise", "node": "rotate", "torque": 20}
    with served(tmp_path / "control") as bench:
        client = Client(tmp_path / "control", bench)
        assert client.ask(end=STO) == {"error": "there is no active sto with these parameters to end; there is none"}
        assert "time" in client.ask(strike=rise)
        refused = client.ask(end=rise | {"torque": 10})["error"]
        assert refused == "there is no active friction_rise with these parameters to end; there is friction_rise on axis rotate"
        assert client.ask(end=rise | {"node": "all"})["fault"] == "friction_rise"
        assert "error" in client.ask(end=rise)


def test_what_has_ended_by_itself_is_not_ended_again(tmp_path: Path) -> None:
    with served(tmp_path / "control") as bench:
        client = Client(tmp_path / "control", bench)
        client.send(json.dumps({"strike": STO, "for": 0.01}).encode() + b"\n")
        client.connection.recv(65536)
        bench.sync(20)
        assert "error" in client.ask(end=STO)


def test_the_owner_is_told_the_truth(path: Path) -> None:
    with served(path) as bench:
        told = Client(path, bench).ask(truth={})
        plant = bench.virtual.plant
        assert told["time"] == bench.virtual.now()
        assert isinstance(told["axes"], dict)
        assert [axis["position"] for axis in told["axes"].values()] == plant.joint_positions().tolist()
        assert [axis["velocity"] for axis in told["axes"].values()] == plant.joint_velocities().tolist()
        assert all(set(axis) == {"position", "velocity", "torque"} for axis in told["axes"].values())


def test_a_client_is_told_which_faults_there_are(path: Path, command: Command) -> None:
    with served(path) as bench:
        client = Client(path, bench)
        client.send(b'{"list": {}}\n')
        with client.connection.makefile("rb") as lines:
            told = json.loads(lines.readline())
    assert told == {"faults": json.loads(command("fault", "--list", "--json").out)}
