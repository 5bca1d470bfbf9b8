"""A controlword that comes by PDO: what it does to the set-points of its frame, and what the statusword says at once."""

from __future__ import annotations

import struct

import can
import pytest
from drive_bench import ENABLE, HOMING, START, DriveBench

POSITION_MODE = 1
ACKNOWLEDGED, REACHED = 1 << 12, 1 << 10
RPDO_3 = 0x400


@pytest.mark.parametrize("transmission_type", [1, 255])
@pytest.mark.parametrize("profile", ["cia402-full", "servoone"])
def test_a_new_set_point_takes_the_target_of_its_own_frame(profile: str, transmission_type: int) -> None:
    """The controlword stands first in CiA 402-2's mapping of RPDO 3; the target behind it is the one that bit 4 means."""
    bench = DriveBench("scara", "rotate", profile)
    for index, value in ((0x6081, 20.0), (0x6083, 400.0), (0x6084, 400.0)):
        bench.write(index, bench.units(value))
    bench.write(0x1402, transmission_type, 2)
    bench.write(0x1402, RPDO_3 + bench.configuration.node_id, 1)
    bench.virtual.receive(can.Message(arbitration_id=0, data=b"\x01\x00", is_extended_id=False))
    bench.enable(POSITION_MODE)
    target = bench.units(2.0)
    for controlword, set_point in ((ENABLE, 0), (START, target), (ENABLE, target)):
        send(bench, controlword, set_point)
    bench.sync(1000)
    assert int(bench.read(0x6041)) & (ACKNOWLEDGED | REACHED) == REACHED
    assert bench.read(0x6064) == pytest.approx(target, rel=0.01)


def send(bench: DriveBench, controlword: int, set_point: int) -> None:
    """RPDO 3 and a SYNC."""
    data = struct.pack("<Hi", controlword, set_point)
    identifier = RPDO_3 + bench.configuration.node_id
    bench.virtual.receive(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))
    bench.sync()


@pytest.mark.parametrize("profile", ["cia402-full", "servoone"])
def test_homing_is_in_progress_from_its_controlword_on(profile: str) -> None:
    """A master that looks before the next cycle must not read 'interrupted or not started' (bit 10 alone)."""
    bench = DriveBench("stage", "slide", profile)
    bench.write(0x6098, 17)
    for index, subindex, value in ((0x6099, 1, 1.0), (0x6099, 2, 0.1), (0x609A, 0, 10.0)):
        bench.write(index, bench.units(value), subindex)
    bench.enable(HOMING)
    assert int(bench.read(0x6041)) & (REACHED | ACKNOWLEDGED) == REACHED
    bench.write(0x6040, START)
    assert int(bench.read(0x6041)) & (REACHED | ACKNOWLEDGED) == 0
    bench.sync()
    assert int(bench.read(0x6041)) & (REACHED | ACKNOWLEDGED) == 0
    bench.write(0x6040, ENABLE)
    bench.sync()
    assert int(bench.read(0x6041)) & (REACHED | ACKNOWLEDGED) == REACHED
