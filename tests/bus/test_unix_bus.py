"""The embedded bus: struct can_frame as C has it, order, atomic answers, clients that die or do not read; lockstep over it."""

from __future__ import annotations

import ctypes
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import can
import pytest
from descriptors import no_descriptor_left
from processes import drivetwin, emulator

from drivetwin.bus import unix_bus
from drivetwin.bus.channel import host_bus, open_bus
from drivetwin.bus.unix_bus import LONGEST_PATH, MOST_AT_ONCE, MOST_FRAMES, UnixBus, UnixHost, pack, unpack
from drivetwin.foundation.errors import UserError

PATIENCE = 30.0


class CanFrame(ctypes.Structure):
    """struct can_frame of linux/can.h, laid out by the C compiler's rules."""

    _fields_ = (
        ("can_id", ctypes.c_uint32),
        ("len", ctypes.c_uint8),
        ("pad", ctypes.c_uint8),
        ("res0", ctypes.c_uint8),
        ("len8_dlc", ctypes.c_uint8),
        ("data", ctypes.c_uint8 * 8),
    )


def frame(number: int) -> can.Message:
    return can.Message(arbitration_id=number % 0x800, data=number.to_bytes(4, "big"), is_extended_id=False)


def number_of(message: can.Message | None) -> int:
    assert message is not None
    return int.from_bytes(message.data, "big")


@pytest.fixture
def host(tmp_path: Path) -> Iterator[UnixHost]:
    bus = UnixHost(tmp_path / "bus")
    yield bus
    bus.shutdown()


@pytest.fixture
def client(host: UnixHost) -> Iterator[UnixBus]:
    bus = UnixBus(Path(str(host.channel_info).removeprefix("unix:")))
    assert host.recv(0.0) is None
    assert host.clients == 1
    yield bus
    bus.shutdown()


def join(host: UnixHost) -> UnixBus:
    return UnixBus(Path(str(host.channel_info).removeprefix("unix:")))


@pytest.mark.parametrize(
    ("message", "identifier"),
    [
        (can.Message(arbitration_id=0x181, data=b"\x01\x02\x03", is_extended_id=False), 0x181),
        (can.Message(arbitration_id=0x1ABCDEF, data=bytes(8), is_extended_id=True), 0x81ABCDEF),
        (can.Message(arbitration_id=0x281, is_extended_id=False, is_remote_frame=True, dlc=8), 0x40000281),
        (can.Message(arbitration_id=0x4, is_extended_id=False, is_error_frame=True, dlc=8, data=bytes(8)), 0x20000004),
    ],
)
def test_a_frame_is_what_c_sees(message: can.Message, identifier: int) -> None:
    packed = pack(message)
    seen = CanFrame.from_buffer_copy(packed)
    assert len(packed) == ctypes.sizeof(CanFrame) == 16
    assert (seen.can_id, seen.len, bytes(seen.data)[: len(message.data)]) == (identifier, message.dlc, bytes(message.data))
    (back,) = unpack(packed)
    assert back.equals(message, timestamp_delta=None)


def test_what_is_no_frame_is_left_out() -> None:
    too_long = CanFrame(can_id=0x181, len=9)
    assert unpack(bytes(too_long)) == []
    assert unpack(pack(frame(5))[:15]) == []
    assert [number_of(message) for message in unpack(pack(frame(5)) + b"rest")] == [5]
    with pytest.raises(ValueError, match="classic frame"):
        pack(can.Message(arbitration_id=1, is_fd=True, data=bytes(12)))


def test_frames_go_both_ways_in_order_and_none_is_lost(host: UnixHost, client: UnixBus) -> None:
    for number in range(20_000):
        client.send(frame(number))
        assert number_of(host.recv(PATIENCE)) == number
        host.send(frame(2 * number))
        host.send(frame(2 * number + 1))
        assert host.recv(0.0) is None
        assert [number_of(client.recv(PATIENCE)) for _ in range(2)] == [2 * number, 2 * number + 1]


def test_answers_to_one_frame_arrive_together(host: UnixHost) -> None:
    """A client that has the first has them all: nothing is left to how the two processes are scheduled."""
    raw = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    raw.connect(str(host.channel_info).removeprefix("unix:"))
    raw.send(pack(frame(1)))
    assert number_of(host.recv(PATIENCE)) == 1
    for number in range(7):
        host.send(frame(number))
    host.recv(0.0)
    assert [number_of(message) for message in unpack(raw.recv(4096))] == list(range(7))
    for number in range(MOST_FRAMES + 1):
        host.send(frame(number))
    host.recv(0.0)
    assert [len(raw.recv(4096)) // 16 for _ in range(2)] == [MOST_FRAMES, 1]
    raw.close()


def test_clients_see_each_other_as_nodes_on_a_bus_do(host: UnixHost, client: UnixBus) -> None:
    other = join(host)
    other.send(frame(1))
    assert number_of(host.recv(PATIENCE)) == 1
    client.send(frame(2))
    assert number_of(host.recv(PATIENCE)) == 2
    host.send(frame(3))
    host.recv(0.0)
    assert [number_of(client.recv(PATIENCE)) for _ in range(2)] == [1, 3]
    assert [number_of(other.recv(PATIENCE)) for _ in range(2)] == [2, 3]
    assert client.recv(0.0) is None
    assert other.recv(0.0) is None
    other.shutdown()


def test_a_client_that_is_killed_takes_nothing_along(host: UnixHost, client: UnixBus) -> None:
    text = f"from drivetwin.bus.channel import open_bus; bus = open_bus({host.channel_info!r}); print(flush=True); bus.recv()"
    with subprocess.Popen([sys.executable, "-c", text], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        assert host.recv(0.0) is None
        assert host.clients == 2
        os.kill(process.pid, signal.SIGKILL)
    host.send(frame(1))
    host.send(frame(2))
    assert host.recv(0.0) is None
    assert host.recv(0.0) is None
    assert host.clients == 1
    assert [number_of(client.recv(PATIENCE)) for _ in range(2)] == [1, 2]


def test_what_a_client_sent_before_it_left_arrives_although_it_read_nothing(host: UnixHost, client: UnixBus) -> None:
    for number in range(100):
        client.send(frame(number))
    assert number_of(host.recv(PATIENCE)) == 0
    host.send(frame(1000))
    assert number_of(host.recv(PATIENCE)) == 1
    client.shutdown()
    for number in range(2, 100):
        host.send(frame(1000 + number))
        assert number_of(host.recv(PATIENCE)) == number
    assert host.recv(0.0) is None
    assert host.clients == 0


def test_a_client_that_does_not_read_holds_nobody_up_and_loses_the_newest(host: UnixHost, client: UnixBus) -> None:
    reader = join(host)
    assert host.recv(0.0) is None
    for number in range(5000):
        host.send(frame(number))
        host.recv(0.0)
        assert number_of(reader.recv(PATIENCE)) == number
    got = []
    while (message := client.recv(0.0)) is not None or host.recv(0.0) is not None:
        if message is not None:
            got.append(number_of(message))
        host.recv(0.0)
    assert 256 <= len(got) < 5000
    assert got == list(range(len(got)))
    host.send(frame(7))
    host.recv(0.0)
    assert number_of(client.recv(PATIENCE)) == 7
    reader.shutdown()


def test_who_reads_again_gets_what_waits_a_little_at_a_time(host: UnixHost, client: UnixBus) -> None:
    """Each time that the host looks, so that a client that has caught up costs nobody a cycle."""
    assert host.recv(0.0) is None
    while not waiting(host):
        host.send(frame(0))
        host.recv(0.0)
    for _ in range(99):
        host.send(frame(0))
        host.recv(0.0)
    left = [waiting(host)]
    while client.recv(0.0) is not None or left[-1]:
        assert host.recv(0.0) is None
        left.append(waiting(host))
    assert left[0] == 100
    assert 0 < max(before - after for before, after in pairwise(left)) <= MOST_AT_ONCE


def waiting(host: UnixHost) -> int:
    """Packets that the only client has not taken yet."""
    (client,) = host._clients.values()
    return len(client._waiting)


def test_a_client_is_told_that_the_host_has_gone(host: UnixHost, client: UnixBus) -> None:
    host.shutdown()
    with pytest.raises(can.CanOperationError, match="has gone"):
        client.recv(PATIENCE)
    with pytest.raises(can.CanOperationError, match="has gone"):
        client.send(frame(1))


def test_the_socket_is_this_users_alone_and_gone_at_the_end(tmp_path: Path) -> None:
    path = tmp_path / "bus"
    hosted = host_bus(f"unix:{path}")
    assert path.stat().st_mode & 0o777 == 0o600
    open_bus(hosted.name).shutdown()
    with pytest.raises(UserError, match=r"cannot offer unix:.*does not exist yet"):
        host_bus(f"unix:{path}")
    hosted.close()
    hosted.close()
    assert not path.exists()


def test_names_that_are_no_bus_say_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"no bus at unix:.*drivetwin emulate --bus unix:"):
        open_bus(f"unix:{tmp_path}/nobody")
    with pytest.raises(UserError, match="has no path"):
        host_bus("unix:")
    with pytest.raises(UserError, match=f"at most {LONGEST_PATH} bytes"):
        open_bus(f"unix:/{'x' * LONGEST_PATH}")


def frames_from_the_reset_on(log: Path) -> list[tuple[str, str]]:
    """(time, frame); the boot-up before it comes before another process can join."""
    frames = [(line.split()[0], line.split()[2]) for line in log.read_text().splitlines()]
    first = next(place for place, (_time, text) in enumerate(frames) if text == "000#8201")
    return frames[first:]


def test_the_reference_controller_as_a_process_sees_what_it_sees_in_process(identified_stage: Path, tmp_path: Path) -> None:
    """Every frame of a cycle and every sample of a whole identification, bit for bit.

    Within a cycle an SDO answer is read before or after the next SYNC, for which nobody waits: the order there is luck.
    """
    common = ("--machine", "stage", "--clock", "sync")
    alone, joined = identified_stage, tmp_path / "joined"
    with emulator(*common, bus=f"unix:{tmp_path}/bus") as bus:
        done = drivetwin("identify", *common, "--bus", bus, "--out", joined)
    assert (done.status, done.err) == (0, "")
    assert sorted(frames_from_the_reset_on(joined / "bus.log")) == sorted(frames_from_the_reset_on(alone / "bus.log"))
    samples = sorted(path.relative_to(alone) for path in alone.glob("recordings/*/signals.parquet"))
    assert samples
    for path in samples:
        assert (alone / path).read_bytes() == (joined / path).read_bytes()


def test_who_joined_sent_and_left_before_anybody_looked_is_heard(host: UnixHost) -> None:
    """A host that is late: nothing is over its time as long as something waits."""
    client = join(host)
    client.send(frame(7))
    client.shutdown()
    assert number_of(host.recv(0.0)) == 7


def test_where_no_more_can_join_those_who_have_go_on_and_others_join_later(
    host: UnixHost, client: UnixBus, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The process has no file descriptor left."""
    monkeypatch.setattr(unix_bus, "AGAIN", 0.0)
    assert host.recv(0.0) is None
    waiting = [socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) for _ in range(3)]
    path = str(host.channel_info).removeprefix("unix:")
    with no_descriptor_left():
        for each in waiting:
            each.connect(path)
        for number in range(5):
            client.send(frame(number))
            assert number_of(host.recv(PATIENCE)) == number
        assert host.clients == 1
    assert host.recv(0.0) is None
    assert host.clients == 4
    assert [record.getMessage() for record in caplog.records] == [
        f"bus unix:{path}: nobody else can join now (Too many open files)"
    ]
    for each in waiting:
        each.close()


def test_a_packet_that_is_taken_late_tells_when_it_was_sent(host: UnixHost, client: UnixBus) -> None:
    apart = 0.05
    for number in (1, 2):
        host.send(frame(number))
        assert host.recv(0.0) is None
        time.sleep(apart * (2 - number))
    first, second = (client.recv_packet(PATIENCE) for _ in range(2))
    assert first is not None
    assert second is not None
    assert second[0] - first[0] >= apart
    assert [number_of(unpack(packet)[0]) for _, packet in (first, second)] == [1, 2]
    assert client.recv_packet(0.0) is None
