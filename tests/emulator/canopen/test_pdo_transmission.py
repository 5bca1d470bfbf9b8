"""When PDOs are sent and take effect: transmission types, SYNC, inhibit and event timers (CiA 301, 7.2.2)."""

import struct

import pytest
from canopen_bench import NODE, STOP, Bench

TPDO = 0x180 + NODE
RPDO = 0x200 + NODE


def tpdo(transmission_type: int, **times: int) -> Bench:
    """TPDO 1 with the position actual value, operational; what is sent for a start is taken."""
    bench = Bench().boot()
    bench.map_pdo(0x1800, (0x6064_0020,), transmission_type, **times)
    bench.nmt(b"\x01")
    bench.take()
    return bench


def move(bench: Bench, position: int) -> bytes:
    bench.od[0x6064].value = position
    return struct.pack("<i", position)


def syncs(bench: Bench, count: int) -> list[int]:
    """Frames sent at each of `count` SYNCs."""
    sent = []
    for _ in range(count):
        bench.device.sync()
        sent.append(len(bench.take()))
    return sent


def test_cyclic_every_sync() -> None:
    bench = tpdo(1)
    for position in (1, 1, -7):
        data = move(bench, position)
        bench.device.sync()
        assert bench.take() == [(TPDO, data)]
    assert bench.run_to(0.01) == []


def test_cyclic_every_third_sync() -> None:
    assert syncs(tpdo(3), 7) == [0, 0, 1, 0, 0, 1, 0]


def test_cyclic_every_240th_sync() -> None:
    assert syncs(tpdo(240), 480) == ([0] * 239 + [1]) * 2


@pytest.mark.parametrize("profile", ["servoone", "cia402-full"])
def test_four_pdos_each_way_at_one_sync(profile: str) -> None:
    """Each on its identifier of the predefined connection set (CiA 301, 7.3.3), each with its own object."""
    bench = Bench(profile).boot()
    received = (0x607A, 0x60FF, 0x60B1, 0x6081)
    for number, index in enumerate(received):
        bench.map_pdo(0x1400 + number, (index << 16 | 0x20,), 1)
    for number, mapped in enumerate((0x6064_0020, 0x606C_0020, 0x6041_0010, 0x6077_0010)):
        bench.map_pdo(0x1800 + number, (mapped,), 1)
    bench.nmt(b"\x01")
    bench.take()
    for number in range(4):
        bench.device.receive(0x200 + 0x100 * number + NODE, struct.pack("<i", 1000 + number))
    bench.device.sync()
    assert [cob_id for cob_id, _ in bench.take()] == [0x180 + 0x100 * number + NODE for number in range(4)]
    assert [bench.od[index].value for index in received] == [1000, 1001, 1002, 1003]


def test_acyclic_waits_for_a_change_and_a_sync() -> None:
    bench = tpdo(0)
    assert syncs(bench, 3) == [1, 0, 0]
    data = move(bench, 4)
    assert bench.run_to(0.01) == []
    bench.device.sync()
    assert bench.take() == [(TPDO, data)]
    assert syncs(bench, 2) == [0, 0]


@pytest.mark.parametrize("transmission_type", [254, 255])
def test_event_driven_sends_on_change(transmission_type: int) -> None:
    bench = tpdo(transmission_type)
    assert bench.run_to(0.005) == [(0.001, TPDO, bytes(4))]
    data = move(bench, 9)
    assert bench.run_to(0.010) == [(0.006, TPDO, data)]
    assert syncs(bench, 2) == [0, 0]


def test_event_timer_sends_without_a_change() -> None:
    bench = tpdo(255, event=4)
    assert [frame[0] for frame in bench.run_to(0.014)] == [0.001, 0.005, 0.009, 0.013]
    move(bench, 1)
    assert [frame[0] for frame in bench.run_to(0.020)] == [0.015, 0.019]


def test_inhibit_time_holds_back_and_sends_the_newest() -> None:
    bench = tpdo(255, inhibit=50)
    frames = []
    for position in range(1, 13):
        move(bench, position)
        frames += bench.run_to(bench.time + 1e-3)
    sent = [(time, struct.unpack("<i", data)[0]) for time, _, data in frames]
    assert sent == [(0.001, 1), (0.006, 6), (0.011, 11)]
    assert [frame[0] for frame in bench.run_to(0.030)] == [0.016]


def test_remote_only_samples_when_asked() -> None:
    bench = tpdo(253)
    data = move(bench, 5)
    assert bench.run_to(0.005) == []
    assert syncs(bench, 2) == [0, 0]
    bench.device.receive(TPDO, b"", remote=True)
    assert bench.take() == [(TPDO, data)]


def test_remote_synchronous_sends_what_the_sync_sampled() -> None:
    bench = tpdo(252)
    data = move(bench, 5)
    assert syncs(bench, 1) == [0]
    move(bench, 6)
    bench.device.receive(TPDO, b"", remote=True)
    assert bench.take() == [(TPDO, data)]


def test_a_tpdo_without_remote_permission_does_not_answer() -> None:
    bench = Bench().boot()
    bench.write(0x1800, 1, 0xC000_0000 | TPDO)
    bench.write(0x1800, 1, 0x4000_0000 | TPDO)
    bench.nmt(b"\x01")
    bench.device.receive(TPDO, b"", remote=True)
    assert bench.take() == []


def test_a_value_beyond_its_type_is_told_as_the_nearest() -> None:
    bench = tpdo(1)
    for value, told in ((2**40, 2**31 - 1), (-(2**40), -(2**31)), (1.7, 1), (float("nan"), 0)):
        bench.od[0x6064].on_read = lambda value=value: value
        bench.device.sync()
        assert bench.take() == [(TPDO, struct.pack("<i", told))]


def rpdo(transmission_type: int) -> Bench:
    """RPDO 1 with controlword, target position, torque offset."""
    bench = Bench().boot()
    bench.map_pdo(0x1400, (0x6040_0010, 0x607A_0020, 0x60B2_0010), transmission_type)
    bench.nmt(b"\x01")
    return bench


def demand(bench: Bench) -> tuple[object, ...]:
    return tuple(bench.od[index].value for index in (0x6040, 0x607A, 0x60B2))


def test_event_driven_rpdo_acts_at_once() -> None:
    bench = rpdo(255)
    bench.device.receive(RPDO, struct.pack("<Hih", 15, -1000, -3))
    assert demand(bench) == (15, -1000, -3)


@pytest.mark.parametrize("transmission_type", [0, 1, 240])
def test_synchronous_rpdo_acts_at_the_next_sync_with_the_newest(transmission_type: int) -> None:
    bench = rpdo(transmission_type)
    bench.device.receive(RPDO, struct.pack("<Hih", 15, -1000, -3))
    bench.device.receive(RPDO, struct.pack("<Hih", 31, 7, 8))
    bench.run_to(0.01)
    assert demand(bench) == (0, 0, 0)
    bench.device.sync()
    assert demand(bench) == (31, 7, 8)
    bench.od[0x607A].value = 0
    bench.device.sync()
    assert demand(bench) == (31, 0, 8)


def test_at_a_sync_tpdos_sample_before_rpdos_act() -> None:
    bench = rpdo(1)
    bench.write(0x1800, 1, 0x8000_0000 | TPDO)
    bench.map_pdo(0x1800, (0x607A_0020,), 1)
    bench.device.receive(RPDO, struct.pack("<Hih", 0, 77, 0))
    bench.device.sync()
    bench.device.sync()
    assert bench.take() == [(TPDO, struct.pack("<i", 0)), (TPDO, struct.pack("<i", 77))]


def test_leaving_operational_forgets_what_waits_for_a_sync() -> None:
    bench = rpdo(1)
    bench.device.receive(RPDO, struct.pack("<Hih", 15, 1, 1))
    bench.nmt(STOP)
    bench.nmt(b"\x01")
    bench.device.sync()
    assert demand(bench) == (0, 0, 0)


def test_hooks_get_each_value_once() -> None:
    bench = rpdo(255)
    got: list[object] = []
    bench.od[0x6040].on_write = got.append
    bench.device.receive(RPDO, struct.pack("<Hih", 6, 0, 0))
    assert got == [6]


def test_a_short_rpdo_is_not_processed_and_told_once() -> None:
    bench = rpdo(255)
    bench.take()
    for _ in range(3):
        bench.device.receive(RPDO, struct.pack("<Hi", 15, 1))
    assert demand(bench) == (0, 0, 0)
    assert bench.take() == [(0x80 + NODE, bytes.fromhex("10 82 11 01 00 00 00 00"))]
    bench.device.receive(RPDO, struct.pack("<Hih", 15, 1, 1))
    assert bench.take() == [(0x80 + NODE, bytes(8))]
    assert demand(bench) == (15, 1, 1)


def test_a_long_rpdo_is_processed_and_told() -> None:
    bench = Bench().operational()
    bench.device.receive(RPDO, b"\x0f\x00\xff")
    assert bench.od[0x6040].value == 15
    assert bench.take() == [(0x80 + NODE, bytes.fromhex("20 82 11 01 00 00 00 00"))]


def test_a_value_out_of_range_keeps_the_old_one_and_lets_the_others_through() -> None:
    bench = Bench().boot()
    bench.map_pdo(0x1400, (0x608F_0120, 0x607A_0020), 255)
    bench.nmt(b"\x01")
    bench.device.receive(RPDO, struct.pack("<Ii", 0, 5))
    assert (bench.od[0x608F, 1].value, bench.od[0x607A].value) == (1, 5)


def test_a_dummy_skips_bytes_for_another_node() -> None:
    bench = Bench().boot()
    bench.map_pdo(0x1400, (0x0007_0020, 0x0006_0010, 0x6040_0010), 255)
    bench.nmt(b"\x01")
    bench.device.receive(RPDO, bytes(6) + b"\x0f\x00")
    assert bench.od[0x6040].value == 15


def test_two_rpdos_on_one_identifier_both_get_the_frame() -> None:
    bench = Bench().boot()
    bench.write(0x1401, 1, 0x8000_0000 | RPDO)
    bench.map_pdo(0x1401, (0x6071_0010,), 255)
    bench.nmt(b"\x01")
    bench.device.receive(RPDO, b"\x07\x00")
    assert (bench.od[0x6040].value, bench.od[0x6071].value) == (7, 7)


def test_sync_identifier_follows_1005h() -> None:
    bench = Bench().boot()
    assert bench.device.sync_cob_id == 0x80
    bench.write(0x1005, 0, 0x90)
    assert bench.device.sync_cob_id == 0x90
