"""The plant's friction against the law it is configured with: it sticks, breaks away, and slides as the formula says."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from plant_bench import AXES, PlantBench, Torque, placed

SIGNS = [1.0, -1.0]
NO_CREEP = 1e-6
"""rad/s or m/s."""


@pytest.fixture(params=AXES, ids="-".join)
def axis(request: pytest.FixtureRequest) -> PlantBench:
    return PlantBench(*request.param)


@pytest.mark.parametrize("sign", SIGNS)
def test_stiction_holds_still(axis: PlantBench, sign: float) -> None:
    axis.push(sign * 0.8 * axis.breakaway, 0.05)
    start = axis.position
    axis.push(sign * 0.8 * axis.breakaway, 1.0)
    assert abs(axis.position - start) / 1.0 < NO_CREEP
    assert abs(axis.velocity) < NO_CREEP


@pytest.mark.parametrize("sign", SIGNS)
def test_breakaway_at_static_torque(axis: PlantBench, sign: float) -> None:
    start = axis.position
    axis.push(sign * 0.99 * axis.breakaway, 0.3)
    assert abs(axis.position - start) < 1e-6
    axis.push(sign * 0.02 * axis.breakaway + sign * 0.99 * axis.breakaway, 0.3)
    assert sign * (axis.position - start) > 2e-5


RELATIVE_SPEEDS = [0.1, 0.3, 0.7, 1.0, 1.5, 2.5, 5.0, 20.0]
"""In Stribeck velocities: the dip and the viscous branch. An axis without Stribeck takes 10 mm/s as its unit."""


@pytest.mark.parametrize("sign", SIGNS)
def test_sliding_torque_is_the_law(axis: PlantBench, sign: float) -> None:
    stribeck = axis.true.get("stribeck")
    unit = stribeck.stribeck_velocity if stribeck is not None else 0.01  # type: ignore[attr-defined]
    for share in RELATIVE_SPEEDS:
        speed, torque = axis.slide_at(sign * share * unit)
        assert speed == pytest.approx(sign * share * unit, rel=1e-4)
        assert torque == pytest.approx(axis.law(speed), rel=0.005), share


@pytest.mark.parametrize("name", ["coulomb", "stribeck"])
@pytest.mark.parametrize("sign", SIGNS)
def test_asymmetry(name: str, sign: float) -> None:
    effects = [
        placed("rotate", "coulomb", coulomb=1.9),
        placed("rotate", "viscous", viscous=1.15),
        placed("rotate", "coulomb_asymmetry", asymmetry=0.3),
        placed("rotate", "viscous_asymmetry", asymmetry=-0.25),
    ]
    if name == "stribeck":
        effects.append(placed("rotate", "stribeck", static_torque=2.5, stribeck_velocity=0.05, exponent=1.0))
    bench = PlantBench("scara", "rotate", tuple(effects))
    breakaway = bench.breakaway + sign * 0.3
    start = bench.position
    bench.push(sign * 0.99 * breakaway, 0.3)
    assert abs(bench.position - start) < 1e-6
    bench.push(sign * 1.01 * breakaway, 0.3)
    assert sign * (bench.position - start) > 2e-5
    for speed in (0.02, 0.3, 1.5):
        measured, torque = bench.slide_at(sign * speed)
        assert torque == pytest.approx(bench.law(measured), rel=0.005)


def test_asymmetric_stiction_holds_where_there_is_no_torque() -> None:
    bench = PlantBench(
        "scara", "rotate", (placed("rotate", "coulomb", coulomb=1.0), placed("rotate", "coulomb_asymmetry", asymmetry=0.9))
    )
    start = bench.position
    bench.push(0.0, 1.0)
    assert abs(bench.position - start) < NO_CREEP


@pytest.mark.parametrize("sign", SIGNS)
def test_free_run_out(sign: float) -> None:
    """J v' = -c - b v from v0: the way to standstill is J/b (v0 - c/b ln(1 + b v0/c))."""
    coulomb, viscous, speed = 20.4, 203.5, 0.2
    bench = PlantBench(
        "stage", "slide", (placed("slide", "coulomb", coulomb=coulomb), placed("slide", "viscous", viscous=viscous))
    )
    bench.plant.data.qvel[0] = sign * speed
    start = bench.position
    bench.push(0.0, 1.0)
    inertia = 80.0 + 3.8e-5 * 628.3185307179587**2
    way = inertia / viscous * (speed - coulomb / viscous * np.log(1.0 + viscous * speed / coulomb))
    assert sign * (bench.position - start) == pytest.approx(way, rel=1e-3)
    assert abs(bench.velocity) < NO_CREEP


def test_mujoco_as_it_comes_creeps() -> None:
    """Why the machines set solreffriction: with MuJoCo's defaults the same native friction drifts for ever under 0.8 of it."""
    xml = """<mujoco><option timestep="0.000125"/><worldbody><body><joint name="j" frictionloss="2.5" armature="0.05" {solver}/>
    <geom type="box" size=".1 .1 .1" mass="1" contype="0"/></body></worldbody>
    <actuator><motor name="j" joint="j"/></actuator></mujoco>"""
    speeds = {}
    for solver in ("", 'solreffriction="0.00025 1" solimpfriction="0.9999 0.9999 0.001"'):
        model = mujoco.MjModel.from_xml_string(xml.format(solver=solver))
        data = mujoco.MjData(model)
        model.opt.gravity[:] = 0.0
        data.ctrl[0] = 2.0
        for _ in range(8000):
            mujoco.mj_step(model, data)
        speeds[solver] = abs(float(data.qvel[0]))
    default, ours = speeds.values()
    assert default > 1e-3
    assert ours < NO_CREEP


def test_holding_brake_holds_what_friction_does_not() -> None:
    bench = PlantBench("scara", "lift")
    start = bench.position
    run_without_torque(bench, brake=1)
    assert abs(bench.position - start) < NO_CREEP
    run_without_torque(bench, brake=0)
    assert bench.position < start - 0.01


def run_without_torque(bench: PlantBench, brake: int) -> None:
    """Half a second; `brake` 1 is engaged."""
    drives = Torque(bench.gear, lambda _: np.zeros(len(bench.gear)))
    drives.brakes[:] = brake
    for _ in range(4000):
        bench.plant.advance(drives)
