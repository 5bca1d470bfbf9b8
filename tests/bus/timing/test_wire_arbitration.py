"""One wire: a schedule by hand, who wins and who waits, and the response times that Davis et al. prove."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetwin.bus.timing.frame_bits import Frame, frame_bits
from drivetwin.bus.timing.wire import Transmission, Wire

SYNC = Frame(0x080)  # 51 bits
HEARTBEAT = Frame(0x701, b"\x05")  # 58 bits
STATUSWORD = Frame(0x181, b"\x50\x02")  # 68 bits


def order(transmissions: list[Transmission]) -> list[int]:
    return [sent.frame.identifier for sent in transmissions]


def test_a_schedule_by_hand_at_125_kbit_s() -> None:
    """8 us a bit. The heartbeat has the wire; SYNC, handed in last, is next by its identifier, and then the statusword."""
    wire = Wire(125_000)
    wire.hand_in(1, HEARTBEAT, 0.0)
    wire.hand_in(2, STATUSWORD, 100e-6)
    wire.hand_in(3, SYNC, 200e-6)
    sent = wire.run(until=1.0)
    assert order(sent) == [0x701, 0x080, 0x181]
    assert [transmission.start for transmission in sent] == pytest.approx([0.0, 58 * 8e-6, (58 + 51) * 8e-6], abs=1e-12)
    ends = [58 * 8e-6, (58 + 51) * 8e-6, (58 + 51 + 68) * 8e-6]
    assert [transmission.received for transmission in sent] == pytest.approx([end - 3 * 8e-6 for end in ends], abs=1e-12)
    assert sent[2].delay == pytest.approx((58 + 51 + 68 - 3) * 8e-6 - 100e-6, abs=1e-12)


def test_a_wire_that_was_idle_sends_at_once() -> None:
    wire = Wire(1_000_000)
    wire.hand_in(0, SYNC, 0.25)
    (sent,) = wire.run(until=1.0)
    assert sent.start == 0.25
    assert sent.received == pytest.approx(0.25 + 48e-6, abs=1e-12)


def test_a_node_sends_in_the_order_in_which_it_was_handed_its_frames() -> None:
    """Set-points, then SYNC: a SYNC that overtook them would make them act a cycle late."""
    wire = Wire(1_000_000)
    for frame in (Frame(0x201, bytes(8)), Frame(0x202, bytes(8)), SYNC):
        wire.hand_in(0, frame, 0.0)
    wire.hand_in(1, STATUSWORD, 0.0)
    assert order(wire.run(until=1.0)) == [0x181, 0x201, 0x202, 0x080]


def test_a_node_may_plan_a_frame_and_send_another_before_it() -> None:
    wire = Wire(1_000_000)
    wire.hand_in(1, STATUSWORD, 2e-3)
    wire.hand_in(1, HEARTBEAT, 1e-3)
    wire.hand_in(1, SYNC, 2e-3)
    assert order(wire.run(until=1.0)) == [0x701, 0x181, 0x080]


def test_a_frame_at_a_time_and_what_answers_it() -> None:
    """The answer is handed in when the request is whole: 3 bits before the next arbitration, in which it takes part."""
    wire = Wire(1_000_000)
    wire.hand_in(0, STATUSWORD, 1e-3)
    wire.hand_in(2, HEARTBEAT, 1e-3)
    assert wire.next_start == 1e-3
    assert wire.step(until=1e-3) is None
    first = wire.step(until=2e-3)
    assert first is not None
    assert wire.next_start == wire.free == pytest.approx(1e-3 + 68e-6, abs=1e-12)
    with pytest.raises(ValueError, match="the wire has come to"):
        wire.hand_in(1, SYNC, first.start)
    wire.hand_in(1, SYNC, first.received)
    assert order([first, *wire.run(until=2e-3)]) == [0x181, 0x080, 0x701]
    assert wire.next_start is None


def test_a_data_frame_wins_against_a_remote_frame_of_its_identifier() -> None:
    wire = Wire(1_000_000)
    wire.hand_in(0, Frame(0x701, requested=1), 0.0)
    wire.hand_in(1, HEARTBEAT, 0.0)
    assert [sent.sender for sent in wire.run(until=1.0)] == [1, 0]


def test_a_frame_handed_in_at_the_instant_of_an_arbitration_takes_part_in_it() -> None:
    wire = Wire(1_000_000)
    wire.hand_in(1, STATUSWORD, 1e-3)
    assert wire.run(until=1e-3) == []
    assert wire.backlog == 1
    wire.hand_in(0, SYNC, 1e-3)
    assert order(wire.run(until=2e-3)) == [0x080, 0x181]
    assert wire.backlog == 0


def test_what_is_handed_in_after_its_time_is_refused() -> None:
    wire = Wire(1_000_000)
    wire.run(until=3e-3)
    with pytest.raises(ValueError, match=r"080h of node 0 .* 0\.002900000 s, but the wire has come to 0\.003000000 s"):
        wire.hand_in(0, SYNC, 2.9e-3)
    assert wire.run(until=1e-3) == []
    with pytest.raises(ValueError, match=r"come to 0\.003000000 s"):
        wire.hand_in(2, SYNC, 2.9e-3)


def test_four_axes_at_1_khz_do_not_fit_and_are_later_each_cycle() -> None:
    """8 PDOs of 8 bytes and SYNC have 939 bits unstuffed; small values, of many equal bits, make 1000 us too short."""
    set_points = [Frame(0x200 + node, bytes.fromhex("1f00180000000000")) for node in (1, 2, 3, 4)]
    pdos = [*set_points, *(Frame(0x280 + node, bytes.fromhex("f8ffffff52491d3a")) for node in (1, 2, 3, 4))]
    cycle = sum(map(frame_bits, [SYNC, *pdos]))
    assert cycle > 1000
    wire, cycles = Wire(1_000_000), 200
    for count in range(cycles):
        for frame in (*pdos[:4], SYNC):
            wire.hand_in(0, frame, count * 1e-3)
        for node, frame in enumerate(pdos[4:], start=1):
            wire.hand_in(node, frame, count * 1e-3)
    sent = wire.run(until=1.0)
    assert len(sent) == 9 * cycles
    assert sent[-1].received == pytest.approx((cycles * cycle - 3) * 1e-6, abs=1e-9)
    assert max(transmission.delay for transmission in sent) > (cycles - 10) * (cycle - 1000) * 1e-6


@dataclass(frozen=True)
class Arrival:
    sender: int
    frame: Frame
    at: int
    """[us]"""


some_frames = st.sampled_from([SYNC, HEARTBEAT, STATUSWORD, Frame(0x201, bytes(8))])
arrivals = st.lists(st.builds(Arrival, st.integers(0, 3), some_frames, st.integers(0, 900)), max_size=25)


@given(arrivals, st.integers(1, 300))
def test_a_wire_run_in_steps_is_the_wire_run_at_once(handed_in: list[Arrival], step: int) -> None:
    """Whoever steps the wire hands in each frame before the step that holds it; the step's length changes nothing."""
    ordered = sorted(handed_in, key=lambda arrival: arrival.at)
    whole, stepped, sent = Wire(500_000), Wire(500_000), []
    for arrival in ordered:
        whole.hand_in(arrival.sender, arrival.frame, arrival.at * 1e-6)
    for until in range(step, 10_000 + step, step):
        for arrival in ordered:
            if until - step <= arrival.at < until:
                stepped.hand_in(arrival.sender, arrival.frame, arrival.at * 1e-6)
        sent += stepped.run(until * 1e-6)
    assert sent == whole.run(1.0)
    assert len(sent) == len(handed_in)
    assert all(one.received + 3 * 2e-6 <= next_.start + 1e-12 for one, next_ in pairwise(sent))


def alike(count: int, size: int) -> list[Frame]:
    """Frames of rising identifiers that all take the same bits."""
    bits = frame_bits(Frame(0x181, bytes(size)))
    found = [Frame(identifier, bytes(size)) for identifier in range(0x181, 0x800)]
    return [frame for frame in found if frame_bits(frame) == bits][:count]


def test_the_example_by_which_davis_et_al_refuted_the_first_analysis() -> None:
    """A every 2.5 ms, B and C every 3.5 ms, 1 ms each: C is latest the second time, with 3.5 ms, not the first, with 3.0 ms."""
    a, b, c = alike(3, 7)
    bits = frame_bits(a)
    wire = Wire(1000 * bits)  # so that each takes 1 ms, its intermission included
    for sender, frame, period in ((0, a, 2.5e-3), (1, b, 3.5e-3), (2, c, 3.5e-3)):
        for count in range(2):
            wire.hand_in(sender, frame, count * period)
    wire.hand_in(0, a, 5.0e-3)
    responses = [sent.delay + 3e-3 / bits for sent in wire.run(until=1.0) if sent.sender == 2]
    assert responses == pytest.approx([3.0e-3, 3.5e-3], abs=2e-9)


@dataclass(frozen=True)
class Message:
    frame: Frame
    period: int
    """[ns]"""


BIT = 1000
"""At 1 Mbit/s [ns]."""


def took(message: Message) -> int:
    return frame_bits(message.frame) * BIT


def worst_responses(messages: list[Message], place: int) -> list[int]:
    """The revised analysis of Davis et al. 2007: response times of a message in the busy period of its priority [ns].

    A lower message that has just begun blocks it. What arrives at the very instant of an arbitration takes part in it.
    """
    mine, higher, lower = messages[place], messages[:place], messages[place + 1 :]
    blocking = max((took(message) - 1 for message in lower), default=0)
    busy = settled(took(mine), lambda time: blocking + sum(-(-time // m.period) * took(m) for m in (*higher, mine)))
    responses = []
    for instance in range(-(-busy // mine.period)):
        before = blocking + instance * took(mine)

        def queue(time: int, start: int = before) -> int:
            return start + sum((time // m.period + 1) * took(m) for m in higher)

        queued = settled(before, queue)
        responses.append(queued - instance * mine.period + took(mine))
    return responses


def settled(time: int, demand: Callable[[int], int]) -> int:
    """The fixed point that a recurrence comes to from below."""
    while (next_ := demand(time)) != time:
        time = next_
    return time


@st.composite
def message_sets(draw: st.DrawFn) -> list[Message]:
    """By falling priority; at most 90 % of the wire."""
    count = draw(st.integers(2, 5))
    identifiers = sorted(draw(st.sets(st.integers(1, 0x7FF), min_size=count, max_size=count)))
    frames = [Frame(identifier, draw(st.binary(max_size=8))) for identifier in identifiers]
    shares = [draw(st.floats(0.05, 0.9 / count)) for _ in frames]
    return [Message(frame, round(frame_bits(frame) * BIT / share)) for frame, share in zip(frames, shares, strict=True)]


@settings(deadline=None)
@given(message_sets(), st.data())
def test_response_times_are_those_of_the_analysis(messages: list[Message], data: st.DataObject) -> None:
    """All higher messages at once, a nanosecond after the longest lower one began: the analysis' critical instant, exactly."""
    place = data.draw(st.integers(0, len(messages) - 1))
    expected = worst_responses(messages, place)
    wire, zero = Wire(1_000_000_000 // BIT), 1
    lower = messages[place + 1 :]
    if lower:
        wire.hand_in(99, max(lower, key=took).frame, 0.0)
    for sender, message in enumerate(messages[: place + 1]):
        horizon = len(expected) * messages[place].period + expected[-1]
        for at in range(zero, zero + horizon + 1, message.period):
            wire.hand_in(sender, message.frame, at * 1e-9)
    sent = [transmission for transmission in wire.run(until=10.0) if transmission.sender == place]
    found = [round(transmission.delay * 1e9) + 3 * BIT for transmission in sent[: len(expected)]]
    assert found == expected
