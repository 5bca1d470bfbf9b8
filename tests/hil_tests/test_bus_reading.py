"""What a bus tells to whoever only listens: configuration, states and torque limits of drives, as they have them inside."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.emulator.drive.state_machine import State
from drivetwin.hil_tests.bench import read_bench
from drivetwin.hil_tests.evidence import BusFrame, Evidence, StateChange
from drivetwin.hil_tests.scenario import read_scenario
from drivetwin.hil_tests.stand.bus_reading import read_bus, sent_by_drive
from drivetwin.hil_tests.stand.stand import run_case
from drivetwin.hil_tests.suite import CASES

SCARA = Path("hil_tests/benches/scara.yaml")


@pytest.fixture(scope="module", params=["servoone", "cia402-full"])
def seen_from_inside(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Evidence:
    """An enabled and disabled virtual machine, whose dictionaries and states the stand has read from within."""
    bench = read_bench(SCARA, changes={"profile": request.param})
    scenario = read_scenario(CASES / "02_enable/enable.yaml", bench)
    return run_case(bench, scenario, tmp_path_factory.mktemp("inside"))


def test_a_bus_tells_the_same_as_the_drives_from_inside(seen_from_inside: Evidence) -> None:
    told = read_bus(seen_from_inside.frames, seen_from_inside.bench, seen_from_inside.end)
    assert told.operational == seen_from_inside.operational == {"lift", "rotate", "stretch"}
    assert set(told.configured) == set(seen_from_inside.configured)
    for axis, inside in seen_from_inside.configured.items():
        outside = told.configured[axis]
        assert outside.unknown_pdos == ()
        assert {name: pdo[0] for name, pdo in outside.pdos.items()} == {name: pdo[0] for name, pdo in inside.pdos.items()}
        for name in seen_from_inside.bench.pdo:
            assert outside.pdos[name] == inside.pdos[name]
        assert (outside.heartbeat, outside.supervises) == (inside.heartbeat, inside.supervises)
        assert outside.limits_following_error == inside.limits_following_error
    for axis in seen_from_inside.axes:
        inside_states = [change.after for change in seen_from_inside.states if change.axis == axis and change.time > 0.0]
        assert [change.after for change in told.states if change.axis == axis and change.before is not None] == inside_states


def test_who_sent_a_frame_is_told_by_its_identifier(seen_from_inside: Evidence) -> None:
    assert {frame.by_controller for frame in seen_from_inside.frames} == {True, False}
    for frame in seen_from_inside.frames:
        assert sent_by_drive(frame.identifier, seen_from_inside.nodes) is not frame.by_controller


def test_what_was_said_before_a_reset_does_not_hold_after_it(seen_from_inside: Evidence) -> None:
    """The configuration, a boot-up message of node 2, and a start: nobody knows how node 2 is."""
    frames = list(seen_from_inside.frames)
    start = next(frame for frame in frames if frame.identifier == 0 and frame.data == b"\x01\x02")
    boot_up = start._replace(identifier=0x702, data=b"\x00", by_controller=False)
    frames.insert(frames.index(start), boot_up)
    told = read_bus(frames, seen_from_inside.bench, seen_from_inside.end)
    assert "rpdo 1" in told.configured["rotate"].unknown_pdos
    assert told.configured["lift"].unknown_pdos == ()


def sdo(node: int, request: str, answer: str, time: float) -> list[BusFrame]:
    """A request and its answer, in hexadecimal."""
    asked = BusFrame(time, 0x600 + node, bytes.fromhex(request), True, None, time)
    return [asked, BusFrame(time, 0x580 + node, bytes.fromhex(answer), False, None, time)]


TELLS_DISABLED = sdo(1, "4041600000000000", "4b41600050020000", 0.1)
BOOTS = BusFrame(0.5, 0x701, b"\x00", False, None, 0.5)
MAPPED = [
    *sdo(1, "2300180181010000", "6000180100000000", 0.1),
    *sdo(1, "2f001a0001000000", "60001a0000000000", 0.1),
    *sdo(1, "23001a0110004160", "60001a0100000000", 0.1),
]
BY_TPDO = BusFrame(0.2, 0x181, b"\x50\x02", False, None, 0.2)


@pytest.mark.parametrize(
    ("frames", "told"),
    [
        ([BOOTS], False),
        (TELLS_DISABLED, True),
        ([*MAPPED, BY_TPDO], True),
        ([BY_TPDO], False),
        ([*TELLS_DISABLED, BOOTS], False),
    ],
    ids=["boots", "SDO", "TPDO", "TPDO whose mapping nobody said", "before a reset"],
)
def test_a_drive_tells_its_state_by_a_statusword(frames: list[BusFrame], told: bool) -> None:
    assert ("lift" in read_bus(frames, read_bench(SCARA), 3.0).told) is told


def tells(statusword: int, time: float) -> list[BusFrame]:
    """Read by SDO."""
    return sdo(1, "4041600000000000", f"4b416000{statusword.to_bytes(2, 'little').hex()}0000", time)


def test_what_a_drive_tells_first_is_where_it_begins_also_when_it_has_booted() -> None:
    """It has kept a fault, which is reset; it boots, and tells next that it is ready to switch on."""
    frames = [*tells(0x0208, 0.1), *tells(0x0250, 0.2), BOOTS, *tells(0x0231, 0.6)]
    fault, off, ready = State.FAULT, State.SWITCH_ON_DISABLED, State.READY_TO_SWITCH_ON
    assert read_bus(frames, read_bench(SCARA), 3.0).states == (
        StateChange(0.1, "lift", None, fault),
        StateChange(0.2, "lift", fault, off),
        StateChange(0.6, "lift", None, ready),
    )


STARTS = BusFrame(1.0, 0x000, b"\x01\x00", True, None, 1.0)
RATED_OF_500_MNM = sdo(1, "4076600000000000", "43766000f4010000", 0.1)
LOWERED_TO_1000 = sdo(1, "2b726000e8030000", "6072600000000000", 0.2)
RAISED_TO_3000 = "2b726000b80b0000"
LIFT_GEAR = 628.3185307179587


@pytest.mark.parametrize(
    ("frames", "told"),
    [
        ([STARTS], [None]),
        ([*LOWERED_TO_1000, STARTS], [1000]),
        ([*sdo(1, "4072600000000000", "4b726000e8030000", 0.2), STARTS], [1000]),
        ([*sdo(1, RAISED_TO_3000, "8072600011000906", 0.2), STARTS], [None]),
        ([*LOWERED_TO_1000, STARTS, *sdo(1, RAISED_TO_3000, "6072600000000000", 2.0)], [1000, 3000]),
        ([*LOWERED_TO_1000, BOOTS, STARTS], [None]),
    ],
    ids=["not said", "written", "read back", "refused", "raised later", "before a reset"],
)
def test_what_the_drives_may_give_is_read_of_6072h(frames: list[BusFrame], told: list[int | None]) -> None:
    """On the lift with a motor of 0.5 N·m: thousandths of it, on the joint's side."""
    bench = read_bench(SCARA)
    assert bench.virtual.axes["lift"].gear_ratio == pytest.approx(LIFT_GEAR)
    seen = [one.torque for one in read_bus([*RATED_OF_500_MNM, *frames], bench, 3.0).torque_limits if one.axis == "lift"]
    assert seen == [None if one is None else pytest.approx(one * 1e-3 * 0.5 * LIFT_GEAR) for one in told]
