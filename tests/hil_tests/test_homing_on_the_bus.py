"""What frames say of homing, and `homing_attained`: a drive that was merely told to, or was homed before, has not homed."""

from __future__ import annotations

from pathlib import Path

import pytest
from made_evidence import evidence, judged, standing
from stage_bench import REFERENCE, bench_file

from drivetwin.hil_tests.bench import read_bench
from drivetwin.hil_tests.evidence import BusFrame
from drivetwin.hil_tests.scenario import read_scenario
from drivetwin.hil_tests.stand.bus_reading import read_bus
from drivetwin.hil_tests.stand.stand import run_case
from drivetwin.hil_tests.suite import CASES

BENCH = read_bench(Path("hil_tests/benches/scara.yaml"))


def sdo(request: str, answer: str) -> list[BusFrame]:
    """A request to the lift and its answer, in hexadecimal."""
    return [
        BusFrame(0.1, identifier, bytes.fromhex(data), identifier == 0x601, None, 0.1)
        for identifier, data in ((0x601, request), (0x581, answer))
    ]


def shows(statusword: int) -> list[BusFrame]:
    return sdo("4041600000000000", f"4b416000{statusword.to_bytes(2, 'little').hex()}0000")


def told(controlword: int) -> list[BusFrame]:
    return sdo(f"2b406000{controlword.to_bytes(2, 'little').hex()}0000", "6040600000000000")


MODE_6_WRITTEN = sdo("2f60600006000000", "6060600000000000")
MODE_6_SHOWN = sdo("4061600000000000", "4f61600006000000")
MODE_7_WRITTEN = sdo("2f60600007000000", "6060600000000000")
START, ENABLED, ATTAINED, FAILED = told(0x1F), shows(0x0227), shows(0x1627), shows(0x3227)
BOOTS = [BusFrame(0.2, 0x701, b"\x00", False, None, 0.2)]


@pytest.mark.parametrize(
    ("frames", "homed"),
    [
        (MODE_6_WRITTEN + ENABLED + START + ATTAINED, True),
        (MODE_6_SHOWN + ENABLED + START + ATTAINED, True),
        (MODE_6_WRITTEN + ENABLED + START + ATTAINED + MODE_7_WRITTEN + shows(0x0240), True),
        (MODE_6_WRITTEN + ENABLED + START + FAILED, False),
        (MODE_6_WRITTEN + ENABLED + START, False),
        (MODE_6_WRITTEN + ENABLED + ATTAINED, False),
        (MODE_6_WRITTEN + ATTAINED + START + ATTAINED, False),
        (MODE_6_WRITTEN + ATTAINED + START + ENABLED + ATTAINED, True),
        (MODE_7_WRITTEN + ENABLED + START + ATTAINED, False),
        (MODE_6_WRITTEN + ENABLED + START + MODE_7_WRITTEN + ATTAINED, False),
        (MODE_6_WRITTEN + ENABLED + START + ATTAINED + BOOTS, False),
    ],
    ids=[
        *("mode written", "mode shown", "and disabled", "homing error", "never attained", "never started", "attained before"),
        *("homed anew", "bit 12 of another mode", "mode left meanwhile", "reset afterwards"),
    ],
)
def test_homing_is_a_mode_a_start_and_a_bit_that_rises(frames: list[BusFrame], homed: bool) -> None:
    assert read_bus(frames, BENCH, 3.0).homed == ({"lift"} if homed else set())


@pytest.mark.parametrize("task", ["02_enable/enable", "03_homing/home"])
def test_a_controller_that_homes_is_seen_to(tmp_path: Path, task: str) -> None:
    """By PDOs of a virtual drive, whose own mind is known."""
    bench = read_bench(bench_file(tmp_path, REFERENCE))
    (tmp_path / "case").mkdir()
    seen = run_case(bench, read_scenario(CASES / f"{task}.yaml", bench), tmp_path / "case")
    assert read_bus(seen.frames, bench, seen.end).homed == ({"slide"} if "home" in task else set())


def test_who_has_not_homed_is_named() -> None:
    def said(homed: frozenset[str] | None) -> list[tuple[str | None, str]]:
        finding = judged("homing_attained", evidence(standing(2.0), homed=homed))
        return [(failure.axis, failure.message) for failure in finding.failures]

    assert said(frozenset(("lift", "rotate", "stretch"))) == []
    assert said(frozenset(("lift", "stretch"))) == [
        ("rotate", "no frame showed that node 2 has homed: mode 6, start, homing attained")
    ]
    assert said(None) == []
