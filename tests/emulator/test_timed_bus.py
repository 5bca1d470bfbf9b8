"""The bus with bit timing: what fits comes when the bits say, what does not fit comes later, and nothing is lost or made up."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Iterable
from itertools import accumulate, pairwise
from pathlib import Path

import can
import pytest
from timed_bench import (
    MICROSECOND,
    RPDO,
    SDO_ANSWER,
    SDO_REQUEST,
    SYNC,
    TPDO_1,
    TPDO_2,
    TimedBench,
    bits,
    frame,
    slides,
)

from drivetwin.bus.timing.frame_bits import INTERMISSION, frame_bits
from drivetwin.emulator.clock import Cycle, SyncClock
from drivetwin.emulator.machine import load_machine

MBIT = 1_000_000
BIT = 1e-6
"""At 1 Mbit/s [s]."""

READ_DEVICE_TYPE = bytes.fromhex("4000100000000000")

WORST_OF_8_BYTES, WORST_OF_2_BYTES = 135, 75
"""55 + 10 s bits (Davis et al. 2007, equation 2)."""


@pytest.fixture
def bench() -> TimedBench:
    """The SCARA's three drives, streaming at 1 kHz on 1 Mbit/s."""
    bench = TimedBench(load_machine("scara"), MBIT)
    bench.bring_up()
    for _ in range(10):
        bench.cycle()
    bench.seen.clear()
    return bench


def settle(bench: TimedBench, cycles: int, controlword: int = 0x0006) -> list[list[int]]:
    return [bench.cycle(controlword) for _ in range(cycles)]


def whole_after(begin: float, lengths: list[int], bit: float = BIT) -> list[float]:
    """When each of frames that follow each other is whole [s]: its intermission is not waited for."""
    return [begin + (sum_ - INTERMISSION) * bit for sum_ in accumulate(lengths)]


# -- a cycle that fits --------------------------------------------------------------------------------------------------


def test_a_cycle_is_its_frames_bit_after_bit(bench: TimedBench) -> None:
    """Set-points and SYNC in the controller's order when the cycle begins; samples by identifier when SYNC is whole."""
    bench.cycle()
    assert [sent.frame.identifier for sent in bench.seen] == [0x201, 0x202, 0x203, 0x080, 0x281, 0x282, 0x283]
    lengths = [frame_bits(sent.frame) for sent in bench.seen]
    begin = bench.seen[0].handed_in
    assert [sent.received for sent in bench.seen] == pytest.approx(whole_after(begin, lengths), abs=1e-9)
    assert [sent.handed_in for sent in bench.seen[4:]] == [bench.seen[3].received] * 3


def test_a_sync_comes_every_cycle_where_all_fits(bench: TimedBench) -> None:
    settle(bench, 200)
    distances = [later - earlier for earlier, later in pairwise(bench.times(SYNC))]
    assert distances == pytest.approx([1e-3] * 199, abs=1e-9)
    assert bench.bus.late_frames == 0


def test_samples_respond_within_the_analysis_of_davis_et_al(bench: TimedBench) -> None:
    """Queued together at SYNC, equal periods, nothing of a lower identifier on the wire: R_m is the sum of C_k up to m.

    The statuswords that change now and then are queued when a cycle begins, together with set-points and SYNC of other nodes.
    """
    for controlword in (0x06, 0x07, 0x0F, 0x07, 0x06, 0x00):
        settle(bench, 20, controlword)
    assert len(bench.times(TPDO_1 + 3)) >= 4
    for place, node in enumerate(bench.nodes, start=1):
        samples = [sent for sent in bench.seen if sent.frame.identifier == TPDO_2 + node]
        assert len(samples) == 120
        assert max(sent.delay for sent in samples) <= (place * WORST_OF_8_BYTES - INTERMISSION) * BIT + INTERMISSION * BIT
        words = [sent for sent in bench.seen if sent.frame.identifier == TPDO_1 + node]
        assert max(sent.delay for sent in words) <= (WORST_OF_8_BYTES + place * WORST_OF_2_BYTES - INTERMISSION) * BIT


def test_a_statusword_is_seen_one_sync_after_the_controlword_acts(bench: TimedBench) -> None:
    """As without bit timing: it came of the cycle of the first SYNC, and is there before the samples of the second."""
    first, second = settle(bench, 2, 0x0007)
    assert not {TPDO_1 + node for node in bench.nodes} & set(first)
    assert second == [0x181, 0x182, 0x183, 0x281, 0x282, 0x283]


# -- a cycle that does not fit ------------------------------------------------------------------------------------------


def test_four_axes_do_not_fit_into_1_ms(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """The last sample is whole when all bits are over, that is in the next cycle, and comes after the next SYNC is sent."""
    bench = TimedBench(slides(4, tmp_path), MBIT)
    bench.bring_up()
    bench.seen.clear()
    with caplog.at_level(logging.WARNING):
        first, second = settle(bench, 2)
    assert first == [0x281, 0x282, 0x283]
    assert second[0] == 0x284
    lengths = [frame_bits(sent.frame) for sent in bench.seen[:9]]
    assert sum(lengths) > 1000 + INTERMISSION
    last = bench.seen[8]
    assert last.frame.identifier == 0x284
    assert last.received == pytest.approx(bench.seen[0].start + (sum(lengths) - INTERMISSION) * BIT, abs=1e-9)
    assert bench.bus.late_frames >= 1
    assert "284h came" in caplog.text
    assert "of 1 ms was over: the frames do not fit into it at 1000 kbit/s" in caplog.text


def test_what_does_not_fit_is_later_each_cycle(tmp_path: Path) -> None:
    """The wire has no gap any more. The greatest identifier falls behind; SYNC waits for what is on the wire, and for the
    four statuswords that changed once.
    """
    bench = TimedBench(slides(4, tmp_path), MBIT)
    bench.bring_up()
    bench.seen.clear()
    settle(bench, 200)
    for earlier, later in pairwise(bench.seen):
        assert later.start == pytest.approx(earlier.start + frame_bits(earlier.frame) * BIT, abs=1e-9)
    delays = [sent.delay for sent in bench.seen if sent.frame.identifier == 0x284]
    assert delays[0] < delays[50] < delays[100] < delays[150]
    assert bench.bus.worst_delay == max(delays) > 2e-3
    syncs = bench.times(SYNC)
    jitter = max(abs(time - syncs[0] - count * 1e-3) for count, time in enumerate(syncs))
    assert jitter < (WORST_OF_8_BYTES + 4 * WORST_OF_2_BYTES) * BIT


@pytest.mark.parametrize(("bit_rate", "period"), [(MBIT, 0.002), (500_000, 0.004)])
def test_four_axes_fit_into_a_longer_cycle(tmp_path: Path, bit_rate: int, period: float) -> None:
    bench = TimedBench(slides(4, tmp_path), bit_rate)
    bench.bring_up(period)
    cycles = settle(bench, 100)
    assert all(cycle[-4:] == [0x281, 0x282, 0x283, 0x284] for cycle in cycles)
    assert bench.bus.late_frames == 0
    assert [later - earlier for earlier, later in pairwise(bench.times(SYNC)[3:])] == pytest.approx([period] * 96, abs=1e-9)


@pytest.mark.parametrize("bit_rate", [500_000, 250_000, 125_000])
def test_three_axes_at_1_khz_need_1_mbit_s(bit_rate: int) -> None:
    """At 500 kbit/s set-points and SYNC take 850 us: not even one sample is whole in time."""
    bench = TimedBench(load_machine("scara"), bit_rate)
    bench.bring_up()
    first, *others = settle(bench, 4)
    assert TPDO_2 + 1 not in first
    assert any(TPDO_2 + 1 in cycle for cycle in others) is (bit_rate == 500_000)
    assert bench.bus.late_frames > 0


# -- what comes between SYNCs -------------------------------------------------------------------------------------------


def test_bring_up_takes_time_but_none_of_a_cycle() -> None:
    """Some hundred SDO frames before the first SYNC; it is on the wire at once when it is sent."""
    bench = TimedBench(load_machine("scara"), MBIT)
    bench.bring_up()
    assert len(bench.seen) > 100
    configured = bench.seen[-1].received
    assert configured == pytest.approx(sum(frame_bits(sent.frame) for sent in bench.seen) * BIT, abs=1e-3)
    bench.cycle()
    assert bench.last(RPDO + 1).start == pytest.approx(configured + INTERMISSION * BIT, abs=1e-9)


def test_an_sdo_transfer_takes_what_is_left_of_its_cycle(bench: TimedBench) -> None:
    bench.cycle()
    bench.send(frame(SDO_REQUEST + 1, READ_DEVICE_TYPE))
    assert bench.take() == [SDO_ANSWER + 1]
    request, answer = bench.seen[-2:]
    assert request.start >= bench.last(TPDO_2 + 3).received
    assert answer.handed_in == request.received
    over = answer.received + INTERMISSION * BIT - (bench.seen[0].handed_in + 1e-3)
    bench.cycle()
    first, second = bench.times(SYNC)
    assert second - first == pytest.approx(1e-3 + max(0.0, over), abs=1e-9)


def test_a_sync_is_late_by_what_its_controller_did_before(bench: TimedBench) -> None:
    """Ten transfers have some 2.3 ms: the answers come without a SYNC, and the next cycle begins after the last of them."""
    bench.cycle()
    for _ in range(10):
        bench.send(frame(SDO_REQUEST + 2, READ_DEVICE_TYPE))
    assert bench.take() == [SDO_ANSWER + 2] * 10
    last = bench.seen[-1]
    assert last.received - bench.times(SYNC)[-1] > 2e-3
    assert bench.cycle() == [0x281, 0x282, 0x283]
    assert bench.last(RPDO + 1).start == pytest.approx(last.received + INTERMISSION * BIT, abs=1e-9)
    assert bench.bus.late_frames == 0
    settle(bench, 2)
    assert bench.times(SYNC)[-1] - bench.times(SYNC)[-2] == pytest.approx(1e-3, abs=1e-9)


def test_the_controllers_frames_keep_their_order(bench: TimedBench) -> None:
    """A set-point that waits for its SYNC goes before a request that was sent after it."""
    bench.send(bench.outputs()[0])
    assert bench.seen == []
    bench.send(frame(SDO_REQUEST + 1, READ_DEVICE_TYPE))
    assert [sent.frame.identifier for sent in bench.seen] == [RPDO + 1, SDO_REQUEST + 1, SDO_ANSWER + 1]


def test_a_heartbeat_behind_set_points_waits_with_them(bench: TimedBench) -> None:
    """It is of the burst with which the cycle begins, and makes no cycle begin earlier or later."""
    bench.cycle()
    for message in (*bench.outputs(), frame(0x77F, b"\x05"), frame(SYNC)):
        bench.send(message)
    burst = bench.seen[7:]
    assert [sent.frame.identifier for sent in burst] == [0x201, 0x202, 0x203, 0x77F, 0x080, 0x281, 0x282, 0x283]
    assert burst[0].start - bench.seen[0].start == pytest.approx(1e-3, abs=1e-9)


def test_an_rpdo_that_waits_for_no_sync_goes_at_once(bench: TimedBench) -> None:
    for subindex, value, size in ((1, 0x80000201, 4), (2, 255, 1), (1, 0x201, 4)):
        bench.write(1, 0x1400, subindex, value, size)
    bench.seen.clear()
    bench.send(bench.outputs()[0])
    assert [sent.frame.identifier for sent in bench.seen] == [RPDO + 1]


def test_frames_that_are_not_canopen_take_no_time(bench: TimedBench) -> None:
    bench.send(can.Message(arbitration_id=0x601, is_extended_id=True, data=READ_DEVICE_TYPE))
    bench.send(can.Message(arbitration_id=0x601, is_extended_id=False, is_error_frame=True))
    bench.send(can.Message(arbitration_id=0x601, is_extended_id=False, is_fd=True, data=READ_DEVICE_TYPE))
    assert bench.seen == []


def test_a_remote_frame_is_answered(bench: TimedBench) -> None:
    bench.send(can.Message(arbitration_id=TPDO_2 + 2, is_extended_id=False, is_remote_frame=True, dlc=8))
    assert bench.take() == [TPDO_2 + 2]
    assert bench.seen[0].frame.requested == 8


# -- what the machine does by itself ------------------------------------------------------------------------------------


def test_boot_up_messages_share_the_wire() -> None:
    bench = TimedBench(load_machine("scara"), 125_000)
    assert bench.take() == [0x701, 0x702, 0x703]
    lengths = [frame_bits(sent.frame) for sent in bench.seen]
    assert [sent.received for sent in bench.seen] == pytest.approx(whole_after(0.0, lengths, 8 * MICROSECOND), abs=1e-9)


def test_a_fault_that_strikes_between_syncs_is_told_without_one(bench: TimedBench) -> None:
    bench.bus.virtual.drives[1].fault(0x7500)
    bench.bus.poll()
    assert bench.take() == [0x082]


class Free(SyncClock):
    """As many cycles as it is given, without a SYNC."""

    def __init__(self) -> None:
        self.left = 0

    def due(self, told: int) -> Iterable[Cycle]:
        left, self.left = self.left, 0
        return [cycle for _ in range(left) for cycle in self.at_sync(told)]


def test_drives_that_are_left_alone_go_on_by_their_own_time() -> None:
    """Heartbeats of 10 ms in the 35 ms after the last SYNC come 10 ms after each other."""
    clock = Free()
    bench = TimedBench(load_machine("stage"), MBIT, clock)
    bench.bring_up()
    bench.write(1, 0x1017, 0, 10, 2)
    bench.cycle()
    bench.seen.clear()
    began = bench.bus.virtual.now()
    clock.left = 35
    bench.bus.poll()
    assert bench.bus.virtual.now() - began == pytest.approx(0.035)
    beats = bench.times(0x701)
    assert [later - earlier for earlier, later in pairwise(beats)] == pytest.approx([0.01] * (len(beats) - 1), abs=1e-9)
    assert len(beats) == 3


# -- as a whole ---------------------------------------------------------------------------------------------------------


def work(bench: TimedBench) -> TimedBench:
    bench.bring_up()
    for controlword in (0x06, 0x07, 0x0F, 0x06):
        settle(bench, 30, controlword)
        bench.send(frame(SDO_REQUEST + 3, READ_DEVICE_TYPE))
    return bench


@pytest.mark.parametrize("bit_rate", [MBIT, 500_000, 125_000])
def test_every_bit_that_is_handed_in_is_on_the_wire_once(bit_rate: int) -> None:
    """Until the wire is idle. The bits are those of the frames' contents; what the master got is what the drives sent."""
    bench = work(TimedBench(load_machine("scara"), bit_rate))
    sent = Counter((message.arbitration_id, bytes(message.data)) for message in bench.handed_in)
    seen = Counter((whole.frame.identifier, whole.frame.data) for whole in bench.seen)
    assert seen == sent
    busy = sum(whole.received - whole.start for whole in bench.seen) * bit_rate + INTERMISSION * len(bench.seen)
    assert busy == pytest.approx(sum(map(bits, bench.handed_in)), abs=1e-3)
    ends = [whole.received + INTERMISSION / bit_rate for whole in bench.seen]
    assert all(end <= later.start + 1e-9 for end, later in zip(ends, bench.seen[1:], strict=False))


def test_two_runs_are_identical() -> None:
    first, second = (work(TimedBench(load_machine("scara"), 500_000)) for _ in range(2))
    assert first.seen == second.seen
    assert len(first.seen) > 900


def test_asking_whether_anything_has_come_changes_nothing() -> None:
    """Who hosts the bus polls it whenever it likes: in lockstep only frames move time."""
    calm, restless = (TimedBench(load_machine("scara"), 500_000) for _ in range(2))
    send = restless.send

    def send_and_poll(message: can.Message) -> None:
        restless.bus.poll()
        send(message)
        restless.bus.poll()

    restless.send = send_and_poll  # type: ignore[method-assign]
    assert work(calm).seen == work(restless).seen
