"""Friction on both sides of a transmission, in a plant and in the replay of a motion, against mechanics done by hand."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest
from effect_bench import GEAR, LINK, MOTOR, PERIOD, Rig, effect, frequency, hinge
from numpy.typing import NDArray

from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw, Motion
from drivetwin.emulator.dynamics.replay import motor_torque
from drivetwin.emulator.dynamics.transmission import Transmission

STIFFNESS = 800.0
COULOMB, VISCOUS = 0.5, 0.3
RUBS = f'frictionloss="{COULOMB}" damping="{VISCOUS}"'


def motor_speed(rig: Rig) -> float:
    return float(rig.data.qvel[rig.model.joint("axis_motor").dofadr[0]])


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_in_the_gap_each_side_is_slowed_by_its_own_friction(share: float) -> None:
    """J v' = -F - d v: v = (v0 + F/d) exp(-d t / J) - F/d, with the share of F and d that the side bears."""
    rig = hinge(effect("backlash", gap=1.0, stiffness=STIFFNESS, motor_friction_share=share), joint=RUBS)
    rig.start(velocity=1.0)
    time = 0.02
    rig.run(time)
    level = COULOMB / VISCOUS
    for speed, inertia, own in ((motor_speed(rig), MOTOR, share), (rig.velocity, LINK, 1.0 - share)):
        slowed = (1.0 + level) * np.exp(-own * VISCOUS * time / inertia) - level
        assert speed == pytest.approx(slowed, rel=2e-3)


def test_a_link_without_friction_swings_on_a_motor_that_sticks() -> None:
    """At the antiresonance, and undamped; where the friction is on the link, that sticks."""
    springs = [effect("elasticity", stiffness=STIFFNESS, motor_friction_share=share) for share in (1.0, 0.0)]
    alone, held = (hinge(spring, joint='frictionloss="20"') for spring in springs)
    for rig in (alone, held):
        rig.data.qpos[rig.model.joint("axis").qposadr[0]] = 0.01
    trace = alone.run(0.5)
    assert frequency(trace) == pytest.approx(sqrt(STIFFNESS / LINK) / (2.0 * np.pi), rel=2e-3)
    assert np.ptp(trace[-1000:]) == pytest.approx(0.02, rel=1e-2)
    assert np.ptp(held.run(0.5)) < 1e-5


def test_a_plant_tells_its_whole_friction_wherever_it_acts() -> None:
    rig = hinge(effect("elasticity", stiffness=STIFFNESS, motor_friction_share=0.4), joint=RUBS)
    law = rig.mechanism.friction_laws()["axis"]
    assert (law.coulomb, law.viscous) == pytest.approx((COULOMB, VISCOUS))


def test_friction_that_rises_while_a_plant_runs_rises_on_both_sides() -> None:
    """By (F, 2 F) over the same time in the gap: twice the loss of speed."""
    slower = []
    for factor in (1.0, 2.0):
        rig = hinge(
            effect("backlash", gap=1.0, stiffness=STIFFNESS, motor_friction_share=0.3), joint=f'frictionloss="{COULOMB}"'
        )
        rig.mechanism.set_friction(0, FrictionLaw(coulomb=factor * COULOMB, static_torque=factor * COULOMB))
        rig.start(velocity=1.0)
        rig.run(0.02)
        slower.append((1.0 - motor_speed(rig), 1.0 - rig.velocity))
    assert slower[0] == pytest.approx((0.3 * COULOMB * 0.02 / MOTOR, 0.7 * COULOMB * 0.02 / LINK), rel=1e-2)
    assert slower[1] == pytest.approx([2.0 * each for each in slower[0]], rel=1e-3)


@pytest.mark.parametrize(("torque", "holds"), [(1.9, True), (2.1, False)])
def test_a_brake_holds_the_motor_together_with_its_friction(torque: float, holds: bool) -> None:
    """1.5 N·m and 0.5 N·m."""
    rig = hinge(effect("backlash", gap=1.0, stiffness=STIFFNESS, motor_friction_share=1.0), joint=RUBS, brake=1.5)
    rig.mechanism.brakes[0] = True
    rig.run(0.1, torque)
    assert (abs(motor_speed(rig)) < 1e-3) == holds


def test_bristles_of_a_motor_behind_an_uneven_gear_begin_relaxed() -> None:
    error = effect("transmission_error", amplitude=0.004, order=2.0, phase=0.6)
    spring = effect("elasticity", stiffness=STIFFNESS, motor_friction_share=1.0)
    rig = hinge(spring, error, effect("presliding", stiffness=300.0, damping=1.0), joint=f'frictionloss="{COULOMB}"')
    assert np.abs(rig.run(0.2)).max() < 1e-9


def reversal() -> tuple[NDArray[np.bool_], Motion]:
    """A motor that turns round, 1 rad one way and back; which samples are in the middle of a gap of 0.4 rad."""
    time = np.linspace(0.0, 2.0, round(2.0 / PERIOD) + 1)
    angle, speed, acceleration = np.sin(np.pi * time), np.pi * np.cos(np.pi * time), -(np.pi**2) * np.sin(np.pi * time)
    needed = (LINK + MOTOR) * acceleration
    motion = Motion(angle, speed, acceleration, needed, time, needed, np.full_like(time, LINK + MOTOR), MOTOR)
    back = 1.0 - angle
    return (time > 0.5) & (time < 1.0) & (back > 0.1) & (back < 0.3), motion


@pytest.mark.parametrize("share", [0.0, 0.3, 0.8])
def test_a_motor_alone_in_the_gap_costs_its_inertia_and_its_share_of_friction(share: float) -> None:
    """The link's own friction stops it sooner than the motor turns round: nothing touches."""
    inside, motion = reversal()
    law = FrictionLaw(coulomb=20.0, viscous=VISCOUS)
    gear = Transmission(1e5, 50.0, 0.4, motor_friction_share=share)
    torque = motor_torque(motion, AxisDynamics(GEAR, transmission=gear, friction=law))
    wanted = MOTOR * motion.acceleration - share * (20.0 - VISCOUS * motion.velocity)
    np.testing.assert_allclose(torque[inside], wanted[inside], rtol=1e-9)


def test_behind_a_stiff_spring_it_does_not_matter_where_friction_acts() -> None:
    _, motion = reversal()
    law = FrictionLaw(coulomb=2.0, viscous=VISCOUS)
    rigid = motor_torque(motion, AxisDynamics(GEAR, friction=law))
    moves = (np.abs(motion.velocity) > 0.3) & (motion.time > 0.1)
    for share in (0.0, 0.5, 1.0):
        gear = Transmission(5e6, 400.0, motor_friction_share=share)
        torque = motor_torque(motion, AxisDynamics(GEAR, transmission=gear, friction=law))
        np.testing.assert_allclose(torque[moves], rigid[moves], atol=0.02)
