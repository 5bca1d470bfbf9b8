"""Buses by name: order, nothing lost, loopback only, and what happens when the other end dies."""

from __future__ import annotations

import errno
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from http.client import HTTPConnection

import can
import pytest
from can.interfaces import virtual

from drivetwin.bus.channel import HostedBus, InprocBus, PatientBus, host_bus, is_physical, open_bus
from drivetwin.foundation.errors import UserError

FRAMES = 20_000


@pytest.fixture
def hosted() -> Iterator[HostedBus]:
    host = host_bus("ws://127.0.0.1:0")
    yield host
    host.close()


def frame(number: int) -> can.Message:
    return can.Message(arbitration_id=number % 0x800, data=number.to_bytes(4, "big"), is_extended_id=False)


def take(bus: can.BusABC, count: int) -> list[int]:
    """Numbers of the next `count` frames; fails where one does not come."""
    numbers: list[int] = []
    for _ in range(count):
        message = bus.recv(30.0)
        assert message is not None, f"after {len(numbers)} frames"
        assert message.arbitration_id == int.from_bytes(message.data, "big") % 0x800
        numbers.append(int.from_bytes(message.data, "big"))
    return numbers


class Echo:
    """A peer that answers each frame by two, at once."""

    def __init__(self, transmit: Callable[[can.Message], None]) -> None:
        self._transmit = transmit

    def receive(self, message: can.Message) -> None:
        number = int.from_bytes(message.data, "big")
        self._transmit(frame(2 * number))
        self._transmit(frame(2 * number + 1))

    def poll(self) -> None:
        return

    def wait(self) -> float | None:
        return None


def test_inproc_answers_wait_in_order_and_silence_is_told_at_once() -> None:
    bus = InprocBus(Echo)
    for number in range(500):
        bus.send(frame(number))
    assert take(bus, 1000) == list(range(1000))
    assert bus.recv(3600.0) is None
    bus.shutdown()


def test_ws_loses_nothing_and_keeps_the_order_both_ways(hosted: HostedBus) -> None:
    client = open_bus(hosted.name)

    def send_all(bus: can.BusABC) -> None:
        for number in range(FRAMES):
            bus.send(frame(number))

    senders = [threading.Thread(target=send_all, args=(bus,)) for bus in (client, hosted.bus)]
    for sender in senders:
        sender.start()
    assert take(hosted.bus, FRAMES) == list(range(FRAMES))
    assert take(client, FRAMES) == list(range(FRAMES))
    for sender in senders:
        sender.join()
    client.shutdown()


def test_ws_clients_see_each_other_as_nodes_on_a_bus_do(hosted: HostedBus) -> None:
    first, second = open_bus(hosted.name), open_bus(hosted.name)
    first.send(frame(1))
    assert take(second, 1) == take(hosted.bus, 1) == [1]
    second.send(frame(2))
    assert take(first, 1) == take(hosted.bus, 1) == [2]
    hosted.bus.send(frame(3))
    assert take(first, 1) == take(second, 1) == [3]
    assert first.recv(0.0) is None
    first.shutdown()
    second.shutdown()


def test_ws_carries_remote_and_extended_frames_as_they_are(hosted: HostedBus) -> None:
    client = open_bus(hosted.name)
    client.send(can.Message(arbitration_id=0x1ABCDE, is_extended_id=True, data=b"\x01"))
    client.send(can.Message(arbitration_id=0x281, is_extended_id=False, is_remote_frame=True, dlc=8))
    extended, remote = hosted.bus.recv(30.0), hosted.bus.recv(30.0)
    assert extended is not None
    assert (extended.arbitration_id, extended.is_extended_id) == (0x1ABCDE, True)
    assert remote is not None
    assert (remote.is_remote_frame, remote.dlc) == (True, 8)
    client.shutdown()


def test_two_hosts_in_one_process_are_two_buses() -> None:
    for _ in range(4):
        one, other = host_bus("ws://127.0.0.1:0"), host_bus("ws://127.0.0.1:0")
        one.bus.send(frame(1))
        assert other.bus.recv(0.0) is None
        one.close()
        other.close()


def test_ws_listens_on_loopback_only(hosted: HostedBus) -> None:
    port = int(hosted.name.rpartition(":")[2])
    with socket.create_connection(("127.0.0.1", port), timeout=5.0):
        pass
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(("192.0.2.1", 9))  # sends nothing; tells this machine's own address
        address = probe.getsockname()[0]
    if address.startswith("127."):
        pytest.skip("this machine has no address but loopback")
    with pytest.raises(OSError, match=r"refused|timed out"):
        socket.create_connection((address, port), timeout=5.0)


def test_a_client_that_is_killed_leaves_nothing_behind(hosted: HostedBus, capfd: pytest.CaptureFixture[str]) -> None:
    code = f"""
import time
from drivetwin.bus.channel import open_bus
bus = open_bus({hosted.name!r})
print("joined", flush=True)
time.sleep(60)
"""
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as victim:
        assert victim.stdout is not None
        assert victim.stdout.readline() == b"joined\n"
        os.kill(victim.pid, signal.SIGKILL)
    survivor = open_bus(hosted.name)
    for number in range(200):
        hosted.bus.send(frame(number))
    assert take(survivor, 200) == list(range(200))
    survivor.shutdown()
    assert capfd.readouterr().err == ""


def test_clients_that_leave_cost_the_others_no_frame(hosted: HostedBus) -> None:
    leavers = [open_bus(hosted.name) for _ in range(20)]
    survivor = open_bus(hosted.name)
    leaving = [threading.Thread(target=client.shutdown) for client in leavers]
    for thread in leaving:
        thread.start()
    sent = 0
    while any(thread.is_alive() for thread in leaving):
        hosted.bus.send(frame(sent))
        sent += 1
    assert take(survivor, sent) == list(range(sent))
    survivor.shutdown()


def test_a_periodic_frame_ends_when_it_is_stopped_even_twice_and_when_its_client_leaves(hosted: HostedBus) -> None:
    client = open_bus(hosted.name)
    task = client.send_periodic(frame(0x80), 0.001)
    assert isinstance(task, can.CyclicSendTaskABC)
    take(hosted.bus, 20)
    task.stop()
    task.stop()
    client.send(frame(1))
    numbers: list[int] = []
    while not numbers or numbers[-1] != 1:
        numbers += take(hosted.bus, 1)
    assert hosted.bus.recv(0.05) is None
    client.send_periodic(frame(0x80), 0.001)
    take(hosted.bus, 20)
    client.shutdown()
    while hosted.bus.recv(0.2) is not None:
        pass


def test_a_client_learns_that_the_host_has_gone() -> None:
    host = host_bus("ws://127.0.0.1:0")
    client = open_bus(host.name)
    host.close()

    def talk() -> None:
        for number in range(1000):
            client.send(frame(number))
            client.recv(1.0)

    with pytest.raises(can.CanError, match="has gone"):
        talk()
    client.shutdown()


@pytest.mark.parametrize(
    ("name", "physical"), [("can0", True), ("can12", True), ("slcan0", True), ("vcan0", False), ("ws://127.0.0.1:1", False)]
)
def test_which_names_may_be_a_real_machine(name: str, physical: bool) -> None:
    assert is_physical(name) is physical


@pytest.mark.parametrize("opened", [open_bus, host_bus])
@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("can", "unknown bus 'can'; expected"),
        ("", "unknown bus"),
        ("http://127.0.0.1:80", "unknown bus"),
        ("ws://127.0.0.1:notaport", "unknown bus"),
        ("ws://127.0.0.1:99999", "unknown bus"),
        ("ws://127.0.0.1", "has no port; write for example"),
        ("ws://0.0.0.0:54701", "not loopback"),
        ("ws://192.168.1.5:54701", "not loopback"),
        ("ws://example.com:54701", "not loopback"),
        ("ws://[::1]:54701", "not loopback"),
    ],
)
def test_names_that_are_refused(opened: Callable[[str], object], name: str, expected: str) -> None:
    with pytest.raises(UserError, match=expected):
        opened(name)


def test_a_server_that_is_no_bus_is_told_from_one() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]

        def answer() -> None:
            connection, _ = server.accept()
            with connection:
                connection.recv(4096)
                connection.sendall(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n")

        thread = threading.Thread(target=answer)
        thread.start()
        with pytest.raises(UserError, match=r"no bus at ws://127\.0\.0\.1"):
            open_bus(f"ws://127.0.0.1:{port}")
        thread.join()


def test_a_ws_client_that_never_reads_costs_bounded_memory(hosted: HostedBus, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its socket fills, then the frames that are kept for it; who reads gets all of them, and the host is not held up."""
    monkeypatch.setattr("drivetwin.bus.channel.MOST_WAITING", 500)
    deaf, good = open_bus(hosted.name), open_bus(hosted.name)
    numbers: list[int] = []
    for burst in range(200):
        for number in range(100 * burst, 100 * burst + 100):
            hosted.bus.send(frame(number))
        numbers += take(good, 100)
    assert numbers == list(range(20_000))
    queues = virtual.channels[hosted.bus.channel_id]  # type: ignore[attr-defined]
    assert max(queue.qsize() for queue in list(queues)) <= 500
    deaf.shutdown()
    good.shutdown()


@pytest.mark.parametrize(
    ("origin", "status"),
    [
        (None, 101),
        ("http://127.0.0.1:{port}", 101),
        ("http://localhost:{port}", 101),
        ("http://localhost:3000", 403),
        ("https://example.org", 403),
        ("http://example.org:{port}", 403),
        ("http://127.0.0.1.example.org:{port}", 403),
        ("null", 403),
        ("file://", 403),
    ],
)
def test_a_web_page_of_another_origin_may_not_join(hosted: HostedBus, origin: str | None, status: int) -> None:
    """RFC 6455, clause 10.2: a server that is not meant for any web page checks the Origin, and answers 403."""
    port = int(hosted.name.rpartition(":")[2])
    headers = {
        "Upgrade": "websocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
        "Sec-WebSocket-Version": "13",
    }
    if origin is not None:
        headers["Origin"] = origin.format(port=port)
    connection = HTTPConnection("127.0.0.1", port, timeout=10)
    connection.request("GET", "/", headers=headers)
    assert connection.getresponse().status == status
    connection.close()


class Interface(can.BusABC):
    """A SocketCAN socket as the kernel has it: ENETDOWN once to who receives, and to each frame sent until it is up."""

    def __init__(self) -> None:
        super().__init__(channel="vcan0")
        self.channel_info = "vcan0"
        self.error: int | None = None
        self.told = False
        self.sent: list[int] = []

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        if self.error is not None:
            raise can.CanOperationError("Failed to transmit", self.error)
        self.sent.append(msg.arbitration_id)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        if self.error is None:
            return frame(7)
        if not self.told:
            self.told = True
            raise can.CanOperationError("Error receiving", self.error)
        return None


def test_an_interface_that_is_down_for_a_moment_is_waited_for(caplog: pytest.LogCaptureFixture) -> None:
    interface = Interface()
    bus = PatientBus(interface)
    bus.send(frame(1))
    interface.error = errno.ENETDOWN
    assert bus.recv(0.0) is None
    bus.send(frame(2))
    assert bus.recv(0.0) is None
    interface.error = None
    bus.send(frame(3))
    message = bus.recv(0.0)
    assert message is not None
    assert message.arbitration_id == 7
    assert interface.sent == [1, 3]
    assert [record.getMessage().partition(":")[0] for record in caplog.records] == ["vcan0 is down", "vcan0 is up again"]
    bus.shutdown()


@pytest.mark.parametrize("code", [errno.ENODEV, errno.EBADF])
def test_an_interface_that_is_gone_is_an_error(code: int) -> None:
    interface = Interface()
    bus = PatientBus(interface)
    interface.error = code
    with pytest.raises(can.CanOperationError):
        bus.recv(0.0)
    with pytest.raises(can.CanOperationError):
        bus.send(frame(1))
    bus.shutdown()
