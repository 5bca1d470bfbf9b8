"""Windows and cycles of a log, against sums over every window there is, and against the wire that carries the same frames."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.bus.timing.frame_bits import Frame, frame_bits
from drivetwin.bus.timing.load import Load, LoggedFrame
from drivetwin.bus.timing.wire import Wire

SYNC = Frame(0x080)  # 51 bits
STATUSWORD = Frame(0x181, b"\x50\x02")  # 68 bits
TORQUE = Frame(0x281, bytes.fromhex("ffffffff6de2e43b"))  # 119 bits
REQUEST = Frame(0x601, bytes.fromhex("4000100000000000"))  # 124 bits

MILLISECOND = 1000
"""[us]."""

entries = st.tuples(st.integers(0, 200), st.sampled_from([SYNC, STATUSWORD, TORQUE, REQUEST]))
logs = st.lists(entries, min_size=2, max_size=30).map(
    lambda drawn: [LoggedFrame(stamp, frame) for stamp, frame in sorted(drawn, key=lambda entry: entry[0])]
)


def lasts(log: list[LoggedFrame]) -> bool:
    return log[0].stamp < log[-1].stamp


@given(logs.filter(lasts), st.integers(1, 250))
def test_the_worst_window_is_that_of_all_windows(log: list[LoggedFrame], length: int) -> None:
    """Every microsecond begins one, also before the first frame."""
    bits = [(logged.stamp, frame_bits(logged.frame)) for logged in log]
    sums = [sum(many for stamp, many in bits if start <= stamp < start + length) for start in range(-250, 201)]
    worst = Load(log).worst(length * 1e-6)
    assert worst.bits == max(sums) == sum(worst.by_service.values())
    inside = [logged for logged in log if worst.start <= logged.stamp * 1e-6 + 1e-9 < worst.start + worst.length]
    assert sum(frame_bits(logged.frame) for logged in inside) == worst.bits
    assert len(inside) == worst.frames


def test_a_window_of_100_ms_holds_100_cycles_of_1_ms_wherever_it_begins() -> None:
    """Stamps of the lockstep clock are equal to the microsecond: a 101st cycle on the edge would be one too many."""
    log = [LoggedFrame(1_700_000_000_000_000 + cycle * MILLISECOND, frame) for cycle in range(500) for frame in (SYNC, TORQUE)]
    load = Load(log)
    assert load.worst(0.1).bits == 100 * (51 + 119)
    assert load.worst(0.1).load(1_000_000) == pytest.approx(0.170)
    assert load.worst(0.1).load(125_000) == pytest.approx(1.360)
    assert load.whole().load(1_000_000) == pytest.approx(0.170)
    assert load.whole().by_service == {"SYNC": 500 * 51, "TPDO 2": 500 * 119}


def test_the_worst_window_is_found_where_it_is() -> None:
    calm = [LoggedFrame(cycle * MILLISECOND, SYNC) for cycle in range(300)]
    flood = [LoggedFrame(170 * MILLISECOND, REQUEST) for _ in range(40)]
    load = Load(sorted([*calm, *flood], key=lambda logged: logged.stamp))
    worst = load.worst(0.01)
    assert worst.bits == 10 * 51 + 40 * 124
    assert worst.start == pytest.approx(0.161)
    assert worst.by_service == {"SYNC": 10 * 51, "SDO request": 40 * 124}
    cyclic = load.worst(0.01, without=frozenset({"SDO request"}))
    assert (cyclic.start, cyclic.frames, cyclic.bits, cyclic.by_service) == (0.0, 10, 10 * 51, {"SYNC": 10 * 51})


def test_a_cycle_that_ends_with_the_next_sync_is_in_time_and_one_bit_slower_is_not() -> None:
    """SYNC and TPDO are 170 bits: at 1 Mbit/s 170 us and no more."""
    log = [LoggedFrame(cycle * 170, frame) for cycle in range(10) for frame in (SYNC, TORQUE)]
    in_time, late = Load(log).overruns(1_000_000), Load(log).overruns(999_999)
    assert in_time is not None
    assert in_time.cycles == 9
    assert in_time.overrun == 0
    assert in_time.period == pytest.approx(170e-6)
    assert late is not None
    assert late.overrun == 9
    assert late.latest == pytest.approx(9 * (170 / 999_999 - 170e-6))


def test_what_bears_the_stamp_of_a_sync_is_of_its_cycle_though_logged_before_it() -> None:
    """Set-points go out before the SYNC at which they act, statuswords after the cycle that changed them: at its instant."""
    busy = [LoggedFrame(170, frame) for frame in (TORQUE, TORQUE, TORQUE, SYNC)]
    found = Load([LoggedFrame(0, TORQUE), LoggedFrame(0, SYNC), *busy, LoggedFrame(1170, SYNC)]).overruns(1_000_000)
    assert found is not None
    assert (found.cycles, found.overrun) == (2, 0)


def test_what_waits_for_an_answer_makes_no_cycle_late() -> None:
    log = [LoggedFrame(cycle * 200, frame) for cycle in range(10) for frame in (SYNC, TORQUE, REQUEST)]
    found = Load(log).overruns(1_000_000)
    assert found is not None
    assert found.overrun == 0


def test_a_log_without_sync_has_no_cycles() -> None:
    assert Load([LoggedFrame(0, STATUSWORD), LoggedFrame(5, STATUSWORD)]).overruns(1_000_000) is None


frames_of_a_cycle = st.lists(st.sampled_from([STATUSWORD, TORQUE]), max_size=5)
cycles = st.lists(st.tuples(st.integers(1, 600), frames_of_a_cycle), min_size=2, max_size=20)


@given(cycles, st.sampled_from([500_000, 1_000_000]))
def test_cycles_are_as_late_as_a_wire_makes_them(given_cycles: list[tuple[int, list[Frame]]], bit_rate: int) -> None:
    """One node hands in each cycle at its SYNC; a cycle is late by as much as the wire is still taken when the next is due."""
    log, syncs, now = [], [], 0
    for period, frames in given_cycles:
        syncs.append(now)
        log += [LoggedFrame(now, frame) for frame in (SYNC, *frames)]
        now += period
    wire = Wire(bit_rate)
    for logged in log:
        wire.hand_in(0, logged.frame, logged.stamp * 1e-6)
    free = {round(sent.handed_in * 1e6): sent.received + 3 / bit_rate for sent in wire.run(until=1.0)}
    late = [max(0.0, free[sync] - due * 1e-6) for sync, due in pairwise(syncs)]
    found = Load(log).overruns(bit_rate)
    assert found is not None
    assert found.overrun == sum(lateness > 1e-9 for lateness in late)
    assert found.latest == pytest.approx(max(late), abs=1e-9)
    if found.overrun:
        assert late[syncs.index(round(found.at * 1e6))] == pytest.approx(max(late), abs=1e-9)


@pytest.mark.parametrize(
    ("stamps", "expected"),
    [
        ([], "0 frames with no time between them"),
        ([7, 7, 7], "3 frames with no time between them"),
        ([1, 5, 4], r"stamped 0\.000004 s follows one of 0\.000005 s"),
    ],
)
def test_what_has_no_time_or_goes_back_in_it_is_refused(stamps: list[int], expected: str) -> None:
    with pytest.raises(ValueError, match=expected):
        Load([LoggedFrame(stamp, SYNC) for stamp in stamps])
