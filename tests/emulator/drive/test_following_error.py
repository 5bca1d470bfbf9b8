"""CiA 402-2: following error window and time-out (6065h, 6066h; 22E7h of a ServoOne), and the stop that follows."""

from __future__ import annotations

from drive_bench import CYCLIC, INTERPOLATED, START, DriveBench

from drivetwin.emulator.drive.state_machine import State


def test_following_error_stops_the_axis() -> None:
    """EMCY 8611h, 603Fh, fault reaction, fault; the axis ends at rest."""
    bench = DriveBench("scara", "rotate")
    bench.write(0x6065, bench.units(0.5))
    bench.write(0x6085, bench.units(4000.0))
    bench.enable(CYCLIC)
    bench.write(0x607A, bench.units(0.4))
    bench.sync(200)
    assert bench.state is State.OPERATION_ENABLED
    bench.write(0x607A, bench.units(40.0))
    bench.sync(2)
    assert bench.emergencies() == [0x8611]
    assert (bench.read(0x603F), bench.read(0x1001)) == (0x8611, 0x21)
    assert bench.state in (State.FAULT_REACTION_ACTIVE, State.FAULT)
    bench.sync(500)
    assert bench.state is State.FAULT
    assert abs(bench.joint_velocity) < 1e-6
    assert bench.read(0x6074) == 0


def test_following_error_time_out() -> None:
    """6066h: an error that lasts 20 ms or less is none."""
    bench = DriveBench("scara", "rotate")
    bench.write(0x6065, bench.units(0.5))
    bench.write(0x6066, 20)
    bench.write(0x6072, 0)
    bench.enable(CYCLIC)
    bench.write(0x607A, bench.units(1.0))
    bench.sync(19)
    assert bench.emergencies() == []
    bench.sync(2)
    assert bench.emergencies() == [0x8611]


def test_following_error_limit_of_a_servoone() -> None:
    bench = DriveBench("scara", "rotate", "servoone")
    bench.write(0x22E7, bench.units(0.5))
    bench.enable(INTERPOLATED)
    bench.write(0x60C1, bench.units(5.0), 1)
    bench.command(START)
    bench.sync(3)
    assert bench.emergencies() == [0x8611]
