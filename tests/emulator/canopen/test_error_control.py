"""Heartbeat consumer, node guarding with life guarding, error behaviour (CiA 301, 7.2.8.3.2, 1016h, 100Ch, 100Dh, 1029h)."""

from __future__ import annotations

import pytest
from canopen_bench import NODE, PRE_OPERATIONAL, RESET_COMMUNICATION, START, STOP, Bench, Master, foreign_dictionary

from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.canopen import AbortCode, NmtState, SdoAbort

EMCY, GUARD = 0x80 + NODE, 0x700 + NODE
MASTER = 0x77
LOST_MASTER = bytes.fromhex("30 81 11 77 00 00 00 00")
LOST_GUARD = bytes.fromhex("30 81 11 00 00 00 00 00")


def quiet(profile: str = "cia402-full", command: bytes = START) -> Bench:
    """A device without PDOs of its own."""
    bench = Bench(profile).boot()
    bench.write(0x1800, 1, 0x8000_0000 | 0x180 | NODE)
    bench.nmt(command)
    return bench


def consumer(reaction: int = 1, command: bytes = START) -> Bench:
    bench = quiet(command=command)
    bench.write(0x1029, 1, reaction)
    bench.write(0x1016, 1, MASTER << 16 | 20)
    return bench


def beat(bench: Bench, node: int = MASTER) -> None:
    bench.device.receive(0x700 + node, b"\x05")


def test_a_heartbeat_that_stays_away_is_told_once_and_when_it_is_back() -> None:
    bench = consumer()
    beat(bench)
    assert bench.run_to(0.1) == [(0.02, EMCY, LOST_MASTER)]
    beat(bench)
    assert bench.take() == [(EMCY, bytes(8))]
    assert [frame[0] for frame in bench.run_to(0.2)] == [0.12]


def test_a_node_is_watched_from_its_first_heartbeat_on() -> None:
    assert consumer().run_to(1.0) == []


def test_heartbeats_in_time_are_not_missed() -> None:
    bench = consumer()
    for k in range(20):
        beat(bench)
        assert bench.run_to((k + 1) * 0.019) == []


def test_only_the_watched_node_counts() -> None:
    bench = consumer()
    beat(bench)
    bench.run_to(0.015)
    beat(bench, MASTER + 1)
    assert [frame[0] for frame in bench.run_to(0.1)] == [0.02]


def test_each_missing_node_is_an_error_of_its_own() -> None:
    bench = consumer()
    bench.write(0x1016, 2, 0x10 << 16 | 30)
    beat(bench)
    beat(bench, 0x10)
    assert [(time, data[3]) for time, _, data in bench.run_to(0.1)] == [(0.02, MASTER), (0.03, 0x10)]
    beat(bench)
    assert bench.take() == [(EMCY, bytes.fromhex("00 00 11 00 00 00 00 00"))]


@pytest.mark.parametrize("value", [0, MASTER << 16, 20, 200 << 16 | 20])
def test_an_entry_without_node_or_time_is_unused(value: int) -> None:
    bench = consumer()
    bench.write(0x1016, 1, value)
    beat(bench)
    assert bench.run_to(0.1) == []


def test_a_node_is_not_watched_twice() -> None:
    bench = consumer()
    with pytest.raises(SdoAbort) as refusal:
        bench.write(0x1016, 2, MASTER << 16 | 50)
    assert refusal.value.code is AbortCode.PARAMETER_INCOMPATIBLE
    bench.write(0x1016, 1, MASTER << 16 | 50)


def test_reset_communication_ends_the_watch() -> None:
    bench = consumer()
    beat(bench)
    bench.nmt(RESET_COMMUNICATION)
    bench.take()
    beat(bench)
    assert bench.run_to(0.1) == []


REACTIONS = [
    (0, START, NmtState.PRE_OPERATIONAL),
    (0, PRE_OPERATIONAL, NmtState.PRE_OPERATIONAL),
    (0, STOP, NmtState.STOPPED),
    (1, START, NmtState.OPERATIONAL),
    (2, START, NmtState.STOPPED),
    (2, PRE_OPERATIONAL, NmtState.STOPPED),
]


@pytest.mark.parametrize(("reaction", "command", "state"), REACTIONS)
def test_error_behaviour(reaction: int, command: bytes, state: NmtState) -> None:
    bench = consumer(reaction, command)
    beat(bench)
    told = bench.run_to(0.1)
    assert bench.device.nmt.state is state
    assert told == ([] if command == STOP else [(0.02, EMCY, LOST_MASTER)])


@pytest.mark.parametrize("value", [3, 255])
def test_an_unknown_error_behaviour_is_refused(value: int) -> None:
    with pytest.raises(SdoAbort):
        quiet().write(0x1029, 1, value)


def guarded(profile: str = "servoone", time: int = 10, factor: int = 3) -> Bench:
    bench = quiet(profile)
    bench.write(0x100C, 0, time)
    bench.write(0x100D, 0, factor)
    return bench


def guard(bench: Bench) -> bytes:
    bench.device.receive(GUARD, b"", remote=True)
    return b"".join(data for cob_id, data in bench.take() if cob_id == GUARD)


def test_the_toggle_bit_alternates_beside_the_state() -> None:
    bench = guarded()
    assert [guard(bench).hex() for _ in range(3)] == ["05", "85", "05"]
    bench.nmt(STOP)
    assert guard(bench).hex() == "84"
    bench.nmt(PRE_OPERATIONAL)
    assert guard(bench).hex() == "7f"
    bench.nmt(RESET_COMMUNICATION)
    bench.take()
    assert guard(bench).hex() == "7f"


@pytest.mark.parametrize("profile", ["servoone", "cia402-full"])
def test_life_guarding(profile: str) -> None:
    bench = guarded(profile)
    assert bench.run_to(0.1) == []  # it begins with the first remote frame
    for _ in range(5):
        guard(bench)
        assert bench.run_to(bench.time + 0.029) == []
    guard(bench)
    lost = bench.time + 0.03
    ((time, *told),) = bench.run_to(1.0)
    assert time == pytest.approx(lost)
    assert told == [EMCY, LOST_GUARD]
    assert bench.device.nmt.state is NmtState.PRE_OPERATIONAL  # by default, also on a drive without 1029h
    bench.device.receive(GUARD, b"", remote=True)
    assert bench.take()[1] == (EMCY, bytes(8))


@pytest.mark.parametrize(("time", "factor"), [(0, 3), (10, 0)])
def test_without_a_life_time_the_node_answers_but_does_not_guard(time: int, factor: int) -> None:
    bench = guarded(time=time, factor=factor)
    assert guard(bench) == b"\x05"
    assert bench.run_to(10.0) == []


def test_a_node_that_beats_does_not_guard() -> None:
    bench = guarded()
    guard(bench)
    bench.write(0x1017, 0, 500)
    assert guard(bench) == b""
    assert [frame[1:] for frame in bench.run_to(0.6)] == [(GUARD, b"\x05")]
    bench.write(0x1017, 0, 0)
    assert guard(bench) == b"\x85"


def test_before_boot_up_there_is_no_answer() -> None:
    bench = Bench("servoone")
    assert guard(bench) == b""


def test_servoone_guards_and_does_not_consume_heartbeats() -> None:
    indices = {entry.index for entry in load_profile("servoone").objects}
    assert {0x100C, 0x100D} <= indices
    assert not {0x1016, 0x1029} & indices


def test_guarding_by_another_implementation() -> None:
    bench = guarded()
    node = Master(bench).add_node(NODE, foreign_dictionary(bench.profile))
    states: list[int] = []
    node.nmt.add_heartbeat_callback(states.append)
    for _ in range(3):
        node.network.send_message(GUARD, b"", remote=True)
    assert states == [5, 5, 5]
