"""The expectation `no_stranger`: a node that the machine has not is named once it is commanded, and only then."""

from __future__ import annotations

import pytest
from made_evidence import evidence, frame, judged, standing

from drivetwin.hil_tests.evidence import BusFrame
from drivetwin.hil_tests.stand.bus_reading import sent_by_drive, strangers_distinguished

BOOTS = frame(0.5, 0x705, b"\x00", by_controller=False)


def said(*frames: BusFrame) -> list[tuple[str, float | None]]:
    """What is found of a bus with these frames, and when."""
    finding = judged("no_stranger", evidence(standing(2.0), frames=frames))
    return [(failure.message, failure.time) for failure in finding.failures]


@pytest.mark.parametrize(
    "command",
    [
        frame(0.8, 0x000, b"\x82\x05"),
        frame(0.8, 0x000, b"\x01\x00"),
        frame(0.8, 0x605, bytes.fromhex("2f60600007000000")),
        frame(0.8, 0x605, bytes.fromhex("c260600040000000")),
        frame(0.8, 0x205, bytes(8)),
        frame(0.8, 0x305, bytes(4)),
    ],
    ids=["NMT", "NMT start of all", "SDO write", "SDO block write", "RPDO 1", "RPDO 2"],
)
def test_a_stranger_that_is_commanded_is_told_once(command: BusFrame) -> None:
    assert said(BOOTS, command, command) == [("node 5 is none of the machine's and is commanded", 0.8)]


@pytest.mark.parametrize(
    "sent",
    [
        frame(0.8, 0x000, b"\x82\x02"),
        frame(0.8, 0x000, b"\x80\x00"),
        frame(0.8, 0x605, bytes.fromhex("4018100100000000")),
        frame(0.8, 0x605, b""),
        frame(0.8, 0x202, bytes(8)),
        frame(0.8, 0x080),
    ],
    ids=["NMT to another", "all pre-operational", "SDO read", "no SDO", "RPDO to another", "SYNC"],
)
def test_what_is_no_command_to_it_is_borne(sent: BusFrame) -> None:
    assert said(BOOTS, sent) == []


def test_a_node_of_the_machine_and_the_controllers_own_heartbeat_are_no_strangers() -> None:
    boots, beats = frame(0.5, 0x702, b"\x00", by_controller=False), frame(0.5, 0x77F, b"\x05")
    assert said(boots, beats, frame(0.8, 0x000, b"\x82\x02"), frame(0.8, 0x000, b"\x82\x7f")) == []


def test_what_was_sent_before_it_was_there_commands_nobody() -> None:
    assert said(frame(0.1, 0x000, b"\x01\x00"), BOOTS) == []


# -- of real drives, where nobody says who sent a frame ----------------------------------------------------------------

NODES = (1, 2)
TO_WATCH_127 = frame(0.2, 0x601, bytes.fromhex("23161001c8007f00"))


def heard(*frames: BusFrame) -> tuple[BusFrame, ...]:
    """As the stand of real drives notes them."""
    noted = [one._replace(by_controller=not sent_by_drive(one.identifier, NODES)) for one in frames]
    return strangers_distinguished(noted, NODES)


@pytest.mark.parametrize("beat", [b"\x00", b"\x7f"], ids=["boots", "beats"])
def test_a_stranger_among_real_drives_is_told(beat: bytes) -> None:
    there = frame(0.5, 0x705, beat, by_controller=False)
    assert said(*heard(there, frame(0.8, 0x205, bytes(8)))) == [("node 5 is none of the machine's and is commanded", 0.8)]


def test_whom_real_drives_were_told_to_watch_is_the_controller() -> None:
    beats, starts = frame(0.1, 0x77F, b"\x05"), frame(0.8, 0x000, b"\x01\x00")
    assert said(*heard(beats, TO_WATCH_127, starts)) == []
    assert [one.by_controller for one in heard(beats, TO_WATCH_127)] == [True, True]
    assert said(*heard(beats, starts)) == [("node 127 is none of the machine's and is commanded", 0.8)]
