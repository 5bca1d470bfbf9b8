"""Elastic belts: the spring by its closed forms, against the rigid belt, and where there is no belt."""

from __future__ import annotations

import numpy as np
import pytest
from plant_bench import PlantBench, placed

from drivetwin.emulator.drive.servo import SERVO_PERIOD
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.plant import Plant
from drivetwin.foundation.errors import UserError

WRIST_INERTIA = 0.45 * 0.12**2 + 0.45 * (0.28**2 + 0.10**2) / 12.0
"""Blade about the wrist [kg·m²]: a box of 0.28 x 0.10 m, 0.45 kg, its middle 0.12 m off (scara.xml; half sizes there)."""


def elastic(stiffness: float, damping: float = 0.0) -> PlantBench:
    return PlantBench("scara", "stretch", (placed("stretch", "belt_elasticity", stiffness=stiffness, damping=damping),))


def test_the_blade_rings_on_its_belt_at_the_closed_forms_frequency() -> None:
    """Leader and elbow held by huge inertia: one mass on one spring, f = sqrt(k / I) / 2 pi."""
    stiffness = 900.0
    bench = elastic(stiffness)
    model, data = bench.plant.model, bench.plant.data
    for joint in ("rotate", "stretch", "elbow"):
        model.dof_armature[model.joint(joint).dofadr[0]] = 1e6
    wrist = model.joint("wrist")
    data.qpos[wrist.qposadr[0]] += 1e-3
    rest = data.qpos[wrist.qposadr[0]] - 1e-3
    trace: list[float] = []
    bench.run(lambda _: np.zeros(3), 0.5, lambda: trace.append(float(data.qpos[wrist.qposadr[0]]) - rest))
    crossings = np.flatnonzero(np.diff(np.sign(trace)))
    period = 2.0 * (crossings[-1] - crossings[0]) / (len(crossings) - 1) * SERVO_PERIOD
    assert 1.0 / period == pytest.approx(np.sqrt(stiffness / WRIST_INERTIA) / (2.0 * np.pi), rel=2e-3)


def test_damping_is_the_closed_forms() -> None:
    """Same mass on spring and damper: amplitude falls as exp(-d t / (2 I))."""
    stiffness, damping = 900.0, 0.05
    bench = elastic(stiffness, damping)
    model, data = bench.plant.model, bench.plant.data
    for joint in ("rotate", "stretch", "elbow"):
        model.dof_armature[model.joint(joint).dofadr[0]] = 1e6
    wrist = model.joint("wrist").qposadr[0]
    rest = float(data.qpos[wrist])
    data.qpos[wrist] += 1e-3
    trace: list[float] = []
    bench.run(lambda _: np.zeros(3), 0.4, lambda: trace.append(abs(float(data.qpos[wrist]) - rest)))
    window = round(0.1 / SERVO_PERIOD)
    early, late = max(trace[:window]), max(trace[2 * window : 3 * window])
    assert late / early == pytest.approx(np.exp(-damping * 0.2 / (2.0 * WRIST_INERTIA)), rel=0.05)


def test_a_very_stiff_belt_moves_as_a_rigid_one() -> None:
    rigid, stiff = PlantBench("scara", "stretch", ()), elastic(3e5, 30.0)
    for bench in (rigid, stiff):
        bench.push(0.5, 0.2)
    assert stiff.velocity == pytest.approx(rigid.velocity, rel=1e-3)


def test_inertia_at_rest_pose_is_the_rigid_ones() -> None:
    assert elastic(900.0).inertia() == pytest.approx(PlantBench("scara", "stretch", ()).inertia(), rel=1e-12)


def test_an_axis_without_belts_is_refused() -> None:
    with pytest.raises(UserError, match="no joint follows 'rotate' by an equality"):
        Plant(load_machine("scara"), (placed("rotate", "belt_elasticity", stiffness=900.0, damping=0.1),))
