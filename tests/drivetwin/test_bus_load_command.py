"""`drivetwin bus-load` as a user runs it: figures of logs whose bits are known, and one line for what cannot be counted."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
from in_process import Command
from processes import Ended

from drivetwin.bus.timing.frame_bits import Frame
from drivetwin.bus.timing.log import read_log

BusLoad = Callable[..., Ended]

SYNC = "080#"  # 51 bits
TORQUE = "281#FFFFFFFF6DE2E43B"  # 119 bits
REQUEST = "601#4000100000000000"  # 124 bits


@pytest.fixture
def bus_load(command: Command) -> BusLoad:
    """The command, without its name."""
    return partial(command, "bus-load")


def lines(frames: list[str], cycles: int = 200, period: float = 0.001) -> str:
    return "".join(f"({cycle * period:.6f}) can0 {frame}\n" for cycle in range(cycles) for frame in frames)


@pytest.fixture
def log(tmp_path: Path) -> Callable[[str], Path]:
    def write(text: str) -> Path:
        file = tmp_path / "bus.log"
        file.write_text(text, encoding="ascii")
        return file

    return write


def row(outcome: Ended, service: str) -> list[str]:
    found = [line.split() for line in outcome.out.splitlines() if line.strip().startswith(service)]
    assert len(found) == 1, outcome.out
    return [cell for cell in found[0][len(service.split()) :] if cell != "%"]


def test_a_log_that_fits(bus_load: BusLoad, log: Callable[[str], Path]) -> None:
    outcome = bus_load(log(lines([SYNC, TORQUE])))
    assert outcome.status == 0
    assert "without" not in outcome.out
    assert row(outcome, "SYNC") == ["10200", "5.10", "5100", "5.10"]
    assert row(outcome, "TPDO 2") == ["23800", "11.90", "11900", "11.90"]
    assert row(outcome, "all") == ["34000", "17.00", "17000", "17.00"]
    verdict = "would fit: 17.0 % in the 100 ms from 0.000000 s, below 80 %, and all 199 cycles of 1 ms end in time"
    assert outcome.out.rstrip().endswith(verdict)


def test_a_log_that_does_not_fit_at_a_lower_bit_rate(bus_load: BusLoad, log: Callable[[str], Path]) -> None:
    """170 bits take 1.36 ms at 125 kbit/s; the 199th cycle ends 199 times the excess late."""
    outcome = bus_load(log(lines([SYNC, TORQUE])), "--bit-rate", "125k")
    assert outcome.status == 0
    assert row(outcome, "all") == ["34000", "136.00", "17000", "136.00"]
    assert "would not fit: 136.0 % in the 100 ms from 0.000000 s, 80 % or more; 199 of 199 cycles of 1 ms" in outcome.out
    assert outcome.out.rstrip().endswith("end late, that of the SYNC at 0.198000 s by 71.640 ms")


def test_80_percent_is_too_much_however_evenly_it_comes(bus_load: BusLoad, log: Callable[[str], Path]) -> None:
    """815 of 1000 bits in each cycle: every cycle is in time, but nothing unplanned has a place."""
    outcome = bus_load(log(lines([SYNC, *[TORQUE] * 6, "7FF#"])), "--bit-rate", "1M")
    assert row(outcome, "all")[1] == "81.50"  # 51 + 6 x 119 + 50
    assert "would not fit: 81.5 % in the 100 ms from 0.000000 s, 80 % or more" in outcome.out
    assert "late" not in outcome.out


def test_what_comes_before_the_first_sync_is_not_counted(bus_load: BusLoad, log: Callable[[str], Path]) -> None:
    """A lockstep clock stands still while drives are configured: 1000 requests at one instant are no load."""
    boot = f"(0.000000) can0 {REQUEST}\n" * 1000
    outcome = bus_load(log(boot + lines([SYNC, TORQUE])))
    assert row(outcome, "all") == ["34000", "17.00", "17000", "17.00"]
    assert "1000 frames before the first SYNC are not counted" in outcome.out
    assert "SDO" not in outcome.out


def test_a_flood_is_named_by_its_service_and_its_window(bus_load: BusLoad, log: Callable[[str], Path]) -> None:
    calm = lines([SYNC], cycles=300).splitlines(keepends=True)
    flood = [f"(0.150000) can0 {REQUEST}\n"] * 700
    outcome = bus_load(log("".join([*calm[:151], *flood, *calm[151:]])), "--window", "50ms")
    assert row(outcome, "SDO request")[2:] == ["86800", "173.60"]
    assert "without SDO, NMT and LSS, which wait for their turn: 5.1 % in the 50 ms from 0.000000 s" in outcome.out
    assert "would not fit: 178.7 % in the 50 ms from 0.101000 s" in outcome.out


def test_error_frames_are_told(bus_load: BusLoad, log: Callable[[str], Path]) -> None:
    outcome = bus_load(log(lines([SYNC]) + "(0.200000) can0 20000080#0000000000000000\n"))
    assert row(outcome, "all")[0] == "10200"
    assert "1 error frames are not counted" in outcome.out


def test_a_candump_log_is_read_to_the_bit(log: Callable[[str], Path]) -> None:
    """What `candump -L` writes of a data frame, an empty one and a remote frame that asks for one byte."""
    text = "(1700000000.000001) can0 181#5002\n(1700000000.000500) can0 080#\n(1700000000.001000) can0 701#R1\n"
    read = read_log(log(text))
    assert [logged.frame for logged in read.frames] == [Frame(0x181, b"\x50\x02"), Frame(0x080), Frame(0x701, requested=1)]
    assert [logged.stamp - 1_700_000_000_000_000 for logged in read.frames] == [1, 500, 1000]


def test_of_several_interfaces_one_is_counted(bus_load: BusLoad, log: Callable[[str], Path]) -> None:
    both = lines([SYNC, TORQUE]) + lines([REQUEST]).replace("can0", "can1")
    assert row(bus_load(log(both), "--channel", "can0"), "all")[0] == "34000"
    refused = bus_load(log(both))
    assert refused.status == 2
    assert "has frames of can0, can1; each is a wire of its own: name one with --channel" in refused.err


@pytest.mark.parametrize(
    ("text", "arguments", "expected"),
    [
        (lines([SYNC]), ["--bit-rate", "2M"], "--bit-rate 2M is not a bit rate of a classic CAN bus; write 1M, 500k"),
        (lines([SYNC]), ["--bit-rate", "fast"], "--bit-rate fast is not a bit rate"),
        (lines([SYNC]), ["--window", "100"], "--window 100 is not a time of 1ms or more; write for example 100ms or 1s"),
        (lines([SYNC]), ["--window", "1s"], "is longer than"),
        (lines([SYNC]), ["--channel", "can7"], "has no frames of can7, only of can0"),
        ("", [], "has no frames"),
        ("no log\n", [], "cannot be read as a bus log"),
        (lines([SYNC], cycles=1), [], "1 frames with no time between them"),
        ("(2.0) can0 080#\n(1.0) can0 080#\n(3.0) can0 080#\n", [], "stamped 1.000000 s follows one of 2.000000 s"),
        (lines(["00000181#5002"]), [], "181h at 0.000000 s is a 29-bit identifier"),
        (lines(["181##15002"]), [], "181h at 0.000000 s is an FD frame"),
        (lines(["FFF#00"]), [], "no classic CAN frame at 0.000000 s"),
        (lines(["181#000102030405060708"]), [], "no classic CAN frame at 0.000000 s: 181h has more than 8 bytes"),
    ],
)
def test_what_cannot_be_counted_is_one_line(
    bus_load: BusLoad, log: Callable[[str], Path], text: str, arguments: list[str], expected: str
) -> None:
    outcome = bus_load(log(text), *arguments)
    assert outcome.status == 2
    assert expected in outcome.err
    assert outcome.err.count("\n") == 1
    assert outcome.out == ""


def test_a_log_that_is_not_there_is_one_line(bus_load: BusLoad, tmp_path: Path) -> None:
    outcome = bus_load(tmp_path / "none.log")
    assert outcome.status == 2
    assert "none.log does not exist; give a bus log" in outcome.err


def test_help_has_an_example(bus_load: BusLoad) -> None:
    assert "drivetwin bus-load out/identify/bus.log --bit-rate 1M" in bus_load("--help").out
