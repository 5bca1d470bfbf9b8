"""The witness by SDO: the right friction, and never outside the travel that the axis may use."""

from __future__ import annotations

from math import exp

import pytest
from virtual_bench import VirtualBench

from drivetwin.controller.motion import enable_streaming, home, positions_now, stream
from drivetwin.controller.sdo_check import FrictionPoint, friction_by_sdo
from drivetwin.controller.trajectory import move


@pytest.mark.parametrize(("machine", "room"), [("arm", 4.0), ("arm", 0.2), ("stage", 0.28), ("stage", 0.02)])
def test_friction_by_sdo_is_the_plants_and_stays_within_the_travel(machine: str, room: float) -> None:
    bench = VirtualBench(machine, seed=1).up()
    home(bench.cycle, bench.drives)
    enable_streaming(bench.cycle, bench.drives)
    drive = bench.drives[0]
    path = move(float(positions_now(bench.drives)[0]), 0.0, drive.axis.max_speed, 4.0, bench.cycle.period)
    stream(bench.cycle, bench.drives, path[:, None])
    bench.cycle.run_for(0.2)
    drive.axis = drive.axis.model_copy(update={"travel": (-room / 2.0, room / 2.0)})
    seen: list[float] = []
    bench.before_sync = lambda: seen.append(float(bench.virtual.plant.joint_positions()[0]))
    points = friction_by_sdo(bench.cycle, bench.drives)
    assert max(abs(position) for position in seen) < room / 2.0
    true = next(iter(bench.virtual.plant.truth().values()))
    for point in points:
        rise = 0.0
        if "stribeck_velocity" in true:
            rise = (true["static_torque"] - true["coulomb"]) * exp(-((point.velocity / true["stribeck_velocity"]) ** 2))
        friction = true["coulomb"] + rise + true["viscous"] * point.velocity
        assert point.torque == pytest.approx(friction, abs=5.0 * point.standard_error + 0.01 * friction)


def test_the_interval_of_a_point_is_students_at_fourteen_degrees_of_freedom() -> None:
    """Eight means in each direction; the quantile of the published tables at 0.95 and 14 degrees of freedom is 1.761."""
    low, high = FrictionPoint("slide", 0.05, 30.0, 0.1).ci90
    assert (low, high) == pytest.approx((30.0 - 0.1761, 30.0 + 0.1761), abs=1e-4)
