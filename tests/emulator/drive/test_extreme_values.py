"""What a fuzz of the whole drive found: values at the edge of a type that a drive took badly."""

from __future__ import annotations

from drive_bench import DriveBench


def test_a_rated_torque_beyond_what_6076h_can_say() -> None:
    """A ServoOne's own rated torque is REAL32 in N·m, 6076h is UNSIGNED32 in mN·m: it tells the nearest."""
    bench = DriveBench(profile="servoone")
    own = bench.drive.profile.roles["rated_torque"]
    bench.write(own.index, 3e38, own.subindex)
    assert bench.read(0x6076) == 0xFFFF_FFFF
    bench.drive.dictionary[0x6076].check(bench.read(0x6076))
    bench.write(own.index, 0.5, own.subindex)
    assert bench.read(0x6076) == 500
