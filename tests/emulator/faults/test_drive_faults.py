"""Faults of drive, supply, encoder and switches, over the bus: EMCY, statusword, reaction, and how the axis comes to rest."""

from __future__ import annotations

from math import exp, pi

import pytest
from fault_bench import (
    EMCY,
    ENABLED,
    FAULT,
    FAULT_RESET,
    RAMP,
    ROTATE,
    SPEED,
    STRETCH,
    SWITCH_ON_DISABLED,
    TURN,
    FaultBench,
    moving,
)

PROFILES = ["servoone", "cia402-full"]
GEAR = 50.0
REACTION_ACTIVE = 0x0F


def cycles_to_rest(bench: FaultBench, node: int) -> int:
    for cycle in range(500):
        if abs(bench.speed(node)) < 1e-3:
            return cycle
        bench.sync()
    raise AssertionError("the axis does not come to rest")


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize(
    ("fault", "code", "register"), [("sto", 0x5441, 0x21), ("undervoltage", 0x3220, 0x05), ("encoder_loss", 0x7305, 0x21)]
)
def test_hardware_takes_the_torque_away(profile: str, fault: str, code: int, register: int) -> None:
    """EMCY of the code once, FAULT at once, no torque although 605Eh asks for a ramp; reset only without the cause."""
    bench = moving(profile)
    struck = bench.strike(fault, node="rotate")
    bench.sync()
    told = bench.take(EMCY + ROTATE)
    assert [(int.from_bytes(data[:2], "little"), data[2]) for data in told] == [(code, register)]
    assert bench.state(ROTATE) == FAULT
    bench.sync(5)  # the current has died away
    assert abs(bench.torque(ROTATE)) < 1e-3
    assert bench.state(STRETCH) == ENABLED
    assert cycles_to_rest(bench, ROTATE) > 0
    for expected in (FAULT, SWITCH_ON_DISABLED):
        bench.write(ROTATE, 0x6040, FAULT_RESET)
        assert bench.state(ROTATE) == expected
        bench.write(ROTATE, 0x6040, 0)
        bench.end(struck)
        bench.sync()
    bench.enable(ROTATE)
    bench.move(ROTATE)
    assert bench.speed(ROTATE) == pytest.approx(0.5, rel=0.02)


def test_undervoltage_shows_in_the_statusword_and_in_6079h() -> None:
    """Bit 4, voltage enabled (CiA 402-2); the SCARA's DC link has 325 V."""
    bench = FaultBench("cia402-full")
    fault = bench.strike("undervoltage", node=ROTATE, level=0.4)
    word = bench.read(ROTATE, 0x6041)
    assert word is not None
    assert not word & 1 << 4
    assert bench.read(ROTATE, 0x6079) == 130_000
    bench.end(fault)
    word = bench.read(ROTATE, 0x6041)
    assert word is not None
    assert word & 1 << 4


def test_sto_shows_as_interlock() -> None:
    """Bit 3 of 60FDh."""
    bench = FaultBench("cia402-full")
    assert bench.read(ROTATE, 0x60FD) == 0
    bench.strike("sto", node=ROTATE)
    assert bench.read(ROTATE, 0x60FD) == 1 << 3


@pytest.mark.parametrize("profile", PROFILES)
def test_a_limit_switch_that_is_not_there(profile: str) -> None:
    """5443h while moving to the positive side, and a ramp down; the other side is open, and the switch can be mended."""
    bench = moving(profile)
    bench.write(ROTATE, 0x605E, 2)
    fault = bench.strike("limit_switch", node=ROTATE, side="positive")
    bench.sync()
    assert bench.emergencies(ROTATE) == [0x5443]
    assert bench.state(ROTATE) == REACTION_ACTIVE
    cycles_to_rest(bench, ROTATE)
    bench.sync(20)
    assert bench.state(ROTATE) == FAULT
    bench.write(ROTATE, 0x6040, FAULT_RESET)
    bench.write(ROTATE, 0x6040, 0)
    bench.enable(ROTATE)
    bench.write(ROTATE, 0x60FF, -SPEED)
    bench.sync(200)
    assert bench.speed(ROTATE) == pytest.approx(-0.5, rel=0.02)
    bench.end(fault)
    bench.move(ROTATE)
    assert bench.speed(ROTATE) == pytest.approx(0.5, rel=0.02)
    assert bench.state(ROTATE) == ENABLED


def test_the_true_switches_remain() -> None:
    """With the negative switch stuck, the positive one is still where the machine has it: 60FDh bits 0 and 1."""
    bench = FaultBench("cia402-full")
    fault = bench.strike("limit_switch", node=STRETCH, side="negative")
    assert bench.read(STRETCH, 0x60FD) == 0b01
    bench.end(fault)
    assert bench.read(STRETCH, 0x60FD) == 0b00


@pytest.mark.parametrize(("option", "coasts"), [(2, False), (0, True)])
def test_a_drive_fault_stops_by_605eh(option: int, coasts: bool) -> None:
    """605Eh = 2: by 6085h from the speed that the axis has, in v / a; 0: the axis coasts."""
    bench = moving("cia402-full")
    bench.write(ROTATE, 0x605E, option)
    bench.write(ROTATE, 0x6085, RAMP // 2)
    bench.strike("drive_fault", node=ROTATE, code=0x4210)
    assert bench.emergencies(ROTATE) == [0x4210]
    assert bench.state(ROTATE) == REACTION_ACTIVE
    ramp = SPEED / (RAMP / 2)
    bench.sync(round(1000 * ramp / 2))
    half = 0.5 * SPEED / TURN * 2 * pi / GEAR
    if coasts:
        assert bench.torque(ROTATE) == pytest.approx(0.0, abs=1e-6)
    else:
        assert bench.speed(ROTATE) == pytest.approx(half, rel=0.05)
    bench.sync(round(1000 * ramp))
    assert bench.speed(ROTATE) == pytest.approx(0.0, abs=1e-3)
    assert bench.state(ROTATE) == FAULT
    assert bench.read(ROTATE, 0x603F) == 0x4210
    bench.write(ROTATE, 0x6040, FAULT_RESET)
    assert bench.state(ROTATE) == SWITCH_ON_DISABLED


def test_overcurrent_coasts_whatever_605eh_says() -> None:
    bench = moving("cia402-full")
    bench.write(ROTATE, 0x605E, 2)
    bench.strike("drive_fault", node=ROTATE, code="0x2310")
    bench.sync(10)
    assert (bench.emergencies(ROTATE), bench.state(ROTATE)) == ([0x2310], FAULT)
    assert bench.torque(ROTATE) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("increments", [5000, -20000])
def test_an_encoder_glitch_is_one_wrong_sample(increments: int) -> None:
    """A drive that is not enabled, so that nothing moves: 6064h is off once, in increments, by as many as were told."""
    bench = FaultBench()
    bench.sync(5)
    told = []
    for cycle in range(6):
        if cycle == 2:
            bench.strike("encoder_glitch", node=ROTATE, increments=increments)
        bench.sync()
        told.append(bench.read(ROTATE, 0x6064, signed=True))
    assert told == [0, 0, increments, 0, 0, 0]


def test_an_encoder_glitch_kicks_an_axis_whose_loops_are_closed() -> None:
    """One period of 125 us on the wrong sample, against a sound twin: the step of the measured speed, through its filter
    (300 Hz), the velocity loop's gain (32 N·m·s/rad) and the current's lag (0.5 ms).
    """
    bench, twin = moving(), moving()
    bench.strike("encoder_glitch", node=ROTATE, increments=3000)
    bench.sync()
    twin.sync()
    angle, period = 3000 * 2 * pi / TURN, 125e-6
    speed = (1 - exp(-period * 2 * pi * 300)) * angle / period
    kick = (1 - exp(-period / 0.5e-3)) * 32.0 / GEAR**2 * speed
    assert bench.torque(ROTATE) - twin.torque(ROTATE) == pytest.approx(-kick, rel=0.01)
    bench.sync(100)
    assert bench.speed(ROTATE) == pytest.approx(0.5, rel=0.02)
    assert bench.state(ROTATE) == ENABLED


def touched(bench: FaultBench) -> int:
    """Bits 16 and 17 of 60FDh."""
    inputs = bench.read(ROTATE, 0x60FD)
    assert inputs is not None
    return inputs >> 16 & 3


@pytest.mark.parametrize("probe", [1, 2])
def test_a_touch_probe_is_touched(probe: int) -> None:
    """CiA 402-2, 60B8h to 60BDh: both edges are latched where the axis stands, and 60FDh shows the input (bits 16, 17)."""
    bench = FaultBench("cia402-full")
    shift = 8 * (probe - 1)
    bench.virtual.drives[ROTATE - 1].dictionary.find(0x60B8, 0).write(0x31 << shift)
    bench.sync(2)
    fault = bench.strike("probe_input", node=ROTATE, probe=probe)
    bench.sync(2)
    assert touched(bench) == probe
    assert bench.read(ROTATE, 0x60B9) == 0x03 << shift
    fault.end(bench.virtual)
    bench.sync(2)
    assert touched(bench) == 0
    assert bench.read(ROTATE, 0x60B9) == 0x07 << shift
