"""Faults of the machine itself while it runs: a load, a bearing that dies, a jam; by closed form and by the plant's truth."""

from __future__ import annotations

import numpy as np
import pytest
from fault_bench import ENABLED, LIFT, ROTATE, STRETCH, FaultBench, moving

GRAVITY = 9.81


def mean_torque(bench: FaultBench, node: int, cycles: int = 100) -> float:
    """Mean motor torque at the joint [N·m or N]."""
    torques = []
    for _ in range(cycles):
        bench.sync()
        torques.append(bench.torque(node))
    return float(np.mean(torques)) * list(bench.virtual.machine.axes.values())[node - 1].gear_ratio


def test_a_payload_on_the_lift_weighs() -> None:
    """A lift that goes up at constant speed needs m g more, and as much less again when the load is taken off."""
    bench = moving("servoone", LIFT)
    empty = mean_torque(bench, LIFT)
    fault = bench.strike("payload", node=STRETCH, mass=0.5)
    bench.sync(300)
    assert mean_torque(bench, LIFT) - empty == pytest.approx(0.5 * GRAVITY, abs=0.15)
    bench.end(fault)
    bench.sync(300)
    assert mean_torque(bench, LIFT) == pytest.approx(empty, abs=0.15)


def test_friction_rises_in_proportion_to_time_and_stays() -> None:
    """At constant speed the torque rises by what the fault says, half of it after half the time; truth tells it."""
    bench = moving()
    before = mean_torque(bench, ROTATE)
    sound = bench.virtual.plant.truth()["rotate"]
    fault = bench.strike("friction_rise", node="rotate", torque=2.0, over=0.6)
    bench.sync(250)
    assert mean_torque(bench, ROTATE) - before == pytest.approx(1.0, abs=0.15)
    bench.sync(500)
    assert mean_torque(bench, ROTATE) - before == pytest.approx(2.0, abs=0.1)
    worn = bench.virtual.plant.truth()["rotate"]
    assert worn["coulomb"] == pytest.approx(sound["coulomb"] + 2.0, abs=1e-12)
    assert worn["static_torque"] == pytest.approx(sound["static_torque"] + 2.0, abs=1e-12)
    assert worn["viscous"] == sound["viscous"]
    assert bench.speed(ROTATE) == pytest.approx(0.5, rel=0.02)
    bench.end(fault)
    bench.sync(300)
    assert bench.virtual.plant.truth()["rotate"] == sound
    assert mean_torque(bench, ROTATE) == pytest.approx(before, abs=0.1)


def test_other_axes_wear_not() -> None:
    bench = FaultBench()
    sound = bench.virtual.plant.truth()
    bench.strike("friction_rise", node=ROTATE, torque=2.0, over=0)
    bench.sync(2)
    worn = bench.virtual.plant.truth()
    assert worn["rotate"]["coulomb"] == pytest.approx(sound["rotate"]["coulomb"] + 2.0)
    assert (worn["lift"], worn["stretch"]) == (sound["lift"], sound["stretch"])


@pytest.mark.parametrize("profile", ["servoone", "cia402-full"])
def test_a_jam_stops_the_axis_dead(profile: str) -> None:
    """It stands within a few periods, although the drive gives all it has; nothing of the drive tells, as no limit is set."""
    bench = moving(profile)
    fault = bench.strike("jam", node=ROTATE)
    bench.sync(2)
    where = bench.position(ROTATE)
    assert abs(bench.speed(ROTATE)) < 1e-4
    bench.sync(300)
    assert bench.position(ROTATE) == pytest.approx(where, abs=1e-5)
    peak = list(bench.virtual.machine.axes.values())[1].motor.peak_torque
    assert bench.torque(ROTATE) == pytest.approx(peak, rel=0.05)
    assert bench.state(ROTATE) == ENABLED
    bench.end(fault)
    bench.sync(400)
    assert abs(bench.position(ROTATE) - where) > 0.05
