"""Faults of frames, seen by a master: against a twin bench on which nothing is wrong."""

from __future__ import annotations

import pytest
from fault_bench import EMCY, HEARTBEAT, LIFT, ROTATE, SDO_ANSWER, SPEED, STRETCH, TPDO_1, FaultBench, moving

from drivetwin.emulator.canopen.nmt import NmtState
from drivetwin.foundation.errors import UserError

TPDO_3 = 0x380


def streaming() -> FaultBench:
    """Rotate moves and tells its position at every SYNC, so that each frame is another one."""
    bench = FaultBench()
    bench.position_at_every_sync()
    bench.start()
    bench.enable(ROTATE)
    bench.move(ROTATE)
    return bench


def positions(bench: FaultBench, cycles: int) -> list[bytes]:
    """TPDO 3 of rotate in each of `cycles`, joined within a cycle."""
    bench.take()
    told = []
    for _ in range(cycles):
        bench.sync()
        told.append(b"|".join(bench.take(TPDO_3 + ROTATE)))
    return told


SOUND = 40


@pytest.fixture(scope="module")
def sound() -> list[bytes]:
    told = positions(streaming(), SOUND)
    assert len(set(told)) == SOUND
    return told


def test_every_third_frame_is_lost(sound: list[bytes]) -> None:
    bench = streaming()
    fault = bench.strike("frames_lost", node=ROTATE, every=3)
    assert positions(bench, 12) == [b"" if number % 3 == 2 else data for number, data in enumerate(sound[:12])]
    bench.end(fault)
    assert positions(bench, 5) == sound[12:17]


def test_frames_are_late_by_their_delay_and_in_order(sound: list[bytes]) -> None:
    bench = streaming()
    fault = bench.strike("frames_late", node="rotate", delay=0.003, cob_id=TPDO_3 + ROTATE)
    told = positions(bench, 20)
    assert told == [b""] * 2 + sound[:18]  # out at the end of the third cycle
    bench.end(fault)
    assert positions(bench, 4) == [b"|".join((sound[20], sound[18])), b"|".join((sound[21], sound[19])), *sound[22:24]]


def test_only_the_frames_of_a_cob_id_are_late(sound: list[bytes]) -> None:
    bench = streaming()
    bench.strike("frames_late", node=ROTATE, delay=0.05, cob_id=TPDO_1 + ROTATE)
    assert positions(bench, SOUND) == sound


def test_doubled_frames(sound: list[bytes]) -> None:
    bench = streaming()
    fault = bench.strike("frames_doubled", node=ROTATE, every=2)
    assert positions(bench, 6) == [data if number % 2 == 0 else data + b"|" + data for number, data in enumerate(sound[:6])]
    bench.end(fault)
    assert positions(bench, 6) == sound[6:12]


def test_a_request_that_comes_twice_is_answered_twice() -> None:
    bench = FaultBench()
    bench.strike("frames_doubled", node=LIFT, direction="received")
    bench.send(0x600 + LIFT, bytes.fromhex("40 00 10 00 00 00 00 00"))
    bench.send(0x600 + ROTATE, bytes.fromhex("40 00 10 00 00 00 00 00"))
    assert [frame.arbitration_id for frame in bench.sent] == [SDO_ANSWER + LIFT, SDO_ANSWER + LIFT, SDO_ANSWER + ROTATE]


@pytest.mark.parametrize("bits", [1, 5, 48])
def test_corrupted_frames_have_so_many_wrong_bits(sound: list[bytes], bits: int) -> None:
    bench = streaming()
    bench.strike("frames_corrupted", node=ROTATE, bits=bits, seed=4)
    told = positions(bench, SOUND)
    wrong = [int.from_bytes(a, "little") ^ int.from_bytes(b, "little") for a, b in zip(told, sound, strict=True)]
    assert [len(data) for data in told] == [6] * SOUND
    assert [number.bit_count() for number in wrong] == [bits] * SOUND
    assert bits == 48 or len(set(wrong)) > SOUND / 2  # not always the same ones


def test_what_is_drawn_is_repeated_by_the_seed(sound: list[bytes]) -> None:
    told = []
    for seed in (7, 7, 8):
        bench = streaming()
        bench.strike("frames_corrupted", node=ROTATE, probability=0.3, seed=seed)
        told.append(positions(bench, SOUND))
    assert told[0] == told[1] != told[2]
    assert 0 < sum(data != right for data, right in zip(told[0], sound, strict=True)) < SOUND


def test_drives_are_not_hit_alike() -> None:
    """One fault of all drives draws for each."""
    bench = FaultBench()
    bench.position_at_every_sync()
    bench.start()
    bench.strike("frames_lost", node="all", probability=0.5, seed=1)
    bench.take()
    bench.sync(50)
    came = [
        tuple(frame.timestamp for frame in bench.sent if frame.arbitration_id == TPDO_3 + node)
        for node in (LIFT, ROTATE, STRETCH)
    ]
    assert all(10 < len(times) < 40 for times in came)
    assert len(set(came)) == 3


def test_a_corrupted_command_is_obeyed_as_it_comes() -> None:
    """NMT start of all nodes with 16 bits flipped is no such command to the drive that reads it so."""
    bench = FaultBench()
    bench.strike("frames_corrupted", node=LIFT, direction="received", cob_id=0, bits=16)
    bench.start()
    assert [drive.device.nmt.state for drive in bench.virtual.drives] == [
        NmtState.PRE_OPERATIONAL,
        NmtState.OPERATIONAL,
        NmtState.OPERATIONAL,
    ]


def test_late_syncs_are_late_samples_of_one_drive_alone() -> None:
    """At the third SYNC the first one arrives: TPDO at the end of that cycle."""
    bench = FaultBench()
    bench.position_at_every_sync()
    bench.start()
    bench.strike("frames_late", node=LIFT, direction="received", cob_id=0x80, delay=0.002)
    counts = []
    for _ in range(5):
        bench.take()
        bench.sync()
        ids = [frame.arbitration_id for frame in bench.sent]
        counts.append((ids.count(TPDO_3 + LIFT), ids.count(TPDO_3 + ROTATE)))
    assert counts == [(0, 1), (1, 1), (1, 1), (1, 1), (1, 1)]


def test_faults_of_several_causes_are_there_together(sound: list[bytes]) -> None:
    bench = streaming()
    doubled = bench.strike("frames_doubled", node=ROTATE)
    lost = bench.strike("frames_lost", node=ROTATE, every=2)
    # the loss meets the two of each frame one after the other and takes the second
    assert positions(bench, 4) == sound[:4]
    bench.end(lost)
    assert positions(bench, 2) == [data + b"|" + data for data in sound[4:6]]
    bench.end(doubled)
    assert positions(bench, 2) == sound[6:8]


def test_all_drives_at_once() -> None:
    bench = FaultBench()
    bench.strike("frames_lost", node="all")
    assert [bench.read(node, 0x1000) for node in (LIFT, ROTATE, STRETCH)] == [None] * 3


def test_every_and_probability_exclude_each_other() -> None:
    with pytest.raises(UserError, match="frames_lost: give every or probability, not both"):
        FaultBench().strike("frames_lost", node=1, every=2, probability=0.5)


def test_heartbeat_lost_and_nothing_else() -> None:
    bench = moving()
    for node in (ROTATE, STRETCH):
        bench.write(node, 0x1017, 5)
    fault = bench.strike("heartbeat_lost", node=ROTATE)
    bench.take()
    bench.sync(50)
    ids = [frame.arbitration_id for frame in bench.sent]
    assert (ids.count(HEARTBEAT + ROTATE), ids.count(HEARTBEAT + STRETCH)) == (0, 10)
    assert bench.read(ROTATE, 0x1017) == 5
    assert bench.speed(ROTATE) == pytest.approx(0.5, rel=0.02)
    bench.end(fault)
    bench.take()
    bench.sync(50)
    assert len(bench.take(HEARTBEAT + ROTATE)) == 10


def test_sdo_silent_neither_acts_nor_answers() -> None:
    bench = streaming()
    fault = bench.strike("sdo_silent", node=ROTATE)
    bench.send(0x600 + ROTATE, bytes.fromhex("23 FF 60 00 00 00 00 00"))  # target velocity 0
    assert bench.read(ROTATE, 0x60FF) is None
    assert bench.read(STRETCH, 0x60FF) == 0
    assert len(set(positions(bench, 20))) == 20
    assert bench.speed(ROTATE) == pytest.approx(0.5, rel=0.02)
    bench.end(fault)
    assert bench.read(ROTATE, 0x60FF) == SPEED


def test_bus_off_of_a_drive_with_6007h_is_a_fault_and_told_when_it_is_back() -> None:
    """CiA 301, 7.5.2.32 and CiA 402-2, 6007h = 1: fault 8100h by 605Eh; EMCY 8140h after recovery."""
    bench = moving("cia402-full")
    fault = bench.strike("bus_off", node=ROTATE)
    bench.sync(200)
    assert (bench.read(ROTATE, 0x6041), bench.take(EMCY + ROTATE)) == (None, [])
    assert abs(bench.speed(ROTATE)) < 1e-3
    assert bench.speed(STRETCH) == pytest.approx(0.5, rel=0.02)
    bench.end(fault)
    assert bench.emergencies(ROTATE) == [0x8140, 0]
    assert bench.state(ROTATE) == 0x08


def test_bus_off_of_a_drive_without_6007h_goes_on_moving() -> None:
    """What a controller has to know of a servoone without bus supervision: silence is no standstill."""
    bench = moving("servoone")
    bench.strike("bus_off", node=ROTATE)
    bench.sync(200)
    assert bench.speed(ROTATE) == pytest.approx(0.5, rel=0.02)
