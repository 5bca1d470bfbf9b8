"""Transmission effects in a plant against the two-mass system by hand, billiards in a gap, and energy on an uneven gear."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import cos, exp, inf, pi, sin, sqrt

import numpy as np
import pytest
from effect_bench import GEAR, HINGE, LINK, MOTOR, PERIOD, Rig, effect, frequency, hinge, slide
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from drivetwin.diagnosis.propose.search import movable_fields, tangents
from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw, Motion
from drivetwin.emulator.dynamics.replay import motor_torque
from drivetwin.emulator.dynamics.transmission import Transmission
from drivetwin.emulator.effects.backlash import Backlash
from drivetwin.emulator.effects.seen_deflection import plays_seen, stiffness_seen
from drivetwin.foundation.errors import UserError

STIFFNESS = 800.0


def elastic(damping: float = 0.0, brake: float = 0.0) -> Rig:
    return hinge(effect("elasticity", stiffness=STIFFNESS, damping=damping), brake=brake)


def motor(rig: Rig) -> int:
    """Address of the motor's joint."""
    return int(rig.model.joint("axis_motor").qposadr[0])


@pytest.mark.parametrize("make", [hinge, slide])
def test_motor_and_link_swing_against_each_other_at_the_resonance(make: object) -> None:
    """f = sqrt(k (1/Jm + 1/Jl)) / 2 pi, amplitudes as 1/J, and the centre of inertia stands."""
    rig = make(effect("elasticity", stiffness=STIFFNESS))  # type: ignore[operator]
    rig.data.qpos[motor(rig)] = 0.01
    trace = rig.run(0.5)
    assert frequency(trace) == pytest.approx(sqrt(STIFFNESS * (1.0 / MOTOR + 1.0 / LINK)) / (2.0 * pi), rel=2e-3)
    assert np.ptp(trace) == pytest.approx(2.0 * 0.01 * MOTOR / (MOTOR + LINK), rel=1e-2)
    centre = MOTOR * rig.data.qpos[motor(rig)] + LINK * rig.position
    assert centre == pytest.approx(MOTOR * 0.01, rel=1e-6)


def test_the_link_swings_on_a_locked_motor_at_the_antiresonance() -> None:
    rig = elastic(brake=100.0)
    rig.mechanism.brakes[0] = True
    rig.start(velocity=0.0)
    rig.data.qpos[rig.model.joint("axis").qposadr[0]] = 0.01
    trace = rig.run(0.5)
    assert frequency(trace) == pytest.approx(sqrt(STIFFNESS / LINK) / (2.0 * pi), rel=2e-3)
    assert abs(rig.data.qpos[motor(rig)]) < 1e-6


def test_damping_lets_the_twist_decay() -> None:
    """exp(-d t (1/Jm + 1/Jl) / 2)."""
    damping = 0.2
    rig = elastic(damping)
    rig.data.qpos[motor(rig)] = 0.01
    twist = np.array([rig.data.qpos[motor(rig)] - rig.run(PERIOD)[0] for _ in range(4000)])
    window = 800
    decay = exp(-0.5 * damping * (1.0 / MOTOR + 1.0 / LINK) * (4000 - window) * PERIOD)
    assert np.abs(twist[-window:]).max() / np.abs(twist[:window]).max() == pytest.approx(decay, rel=0.02)


def test_encoder_and_torque_are_the_motors() -> None:
    """A torque step: the link starts with T t⁴ k / (24 Jm Jl) only, the encoder with G T t² / (2 Jm)."""
    rig = elastic()
    time = 20 * PERIOD
    rig.run(time, 1.0)
    rig.mechanism.read()
    assert rig.mechanism.motor_position[0] == pytest.approx(GEAR * 0.5 * time**2 / MOTOR, rel=0.06)
    assert rig.position < 0.05 * rig.mechanism.motor_position[0] / GEAR


def test_both_sides_together_are_the_rigid_axis() -> None:
    assert elastic().mechanism.inertia == pytest.approx([MOTOR + LINK], rel=1e-6)
    rig = hinge(effect("elasticity", stiffness=1e5, damping=20.0))
    rig.run(0.2, 2.0)
    assert rig.velocity == pytest.approx(2.0 * 0.2 / (MOTOR + LINK), rel=1e-3)


def test_a_load_sags_on_a_braked_motor_by_its_weight() -> None:
    rig = slide(effect("elasticity", stiffness=STIFFNESS, damping=8.0), gravity=-9.81, brake=50.0)
    rig.mechanism.brakes[0] = True
    rig.run(1.5)
    stands = float(rig.data.qpos[motor(rig)])
    assert abs(stands) < 1e-6
    assert rig.position - stands == pytest.approx(-LINK * 9.81 / STIFFNESS, rel=1e-4)


def test_springs_in_series_add_their_compliances() -> None:
    mesh = effect("backlash", gap=0.0, stiffness=3000.0, damping=8.0)
    rig = hinge(effect("elasticity", stiffness=1000.0, damping=8.0), mesh, brake=50.0)
    rig.mechanism.brakes[0] = True
    link = rig.model.joint("axis").dofadr[0]
    push_link(rig, int(link), 3.0, 1.0)
    assert rig.position == pytest.approx(3.0 * (1.0 / 1000.0 + 1.0 / 3000.0), rel=1e-3)


def push_link(rig: Rig, dof: int, torque: float, seconds: float) -> None:
    """A torque on the link itself, by a hand that is not the motor."""
    body = rig.model.dof_bodyid[dof]
    rig.data.xfrc_applied[body, 3:] = (0.0, torque, 0.0)
    rig.run(seconds)
    rig.data.xfrc_applied[:] = 0.0


def test_lost_motion_is_the_gap_and_the_spring() -> None:
    """On a locked motor the link rests gap/2 + T/k off to either side."""
    rig = hinge(effect("backlash", gap=0.02, stiffness=2000.0, damping=8.0), brake=50.0)
    rig.mechanism.brakes[0] = True
    rest = []
    for torque in (1.0, -1.0):
        push_link(rig, int(rig.model.joint("axis").dofadr[0]), torque, 2.0)
        rest.append(rig.position)
    assert rest[0] - rest[1] == pytest.approx(0.02 + 2.0 / 2000.0, rel=1e-3)
    assert abs(rest[0] + rest[1]) < 1e-5


@pytest.mark.parametrize("make", [hinge, slide])
def test_on_an_axis_that_stands_no_gap_is_looked_for(make: Callable[[], Rig]) -> None:
    """A share of a travel of nothing is no gap, and no flank bends by half of it."""
    none = np.zeros(100)
    still = Motion(none, none, none, none, 0.001 * np.arange(100.0), none, np.full(100, 0.3), 0.1)
    axis = replace(make().mechanism.dynamics["axis"], friction=FrictionLaw(coulomb=0.8))
    with np.errstate(all="raise"):
        assert Backlash.starts(still, axis) == []


def test_two_encoders_that_count_alike_show_no_play_and_no_spring() -> None:
    """Rounding of a filter is 1e-17 of the travel: a play of that size has no slope."""
    time = 0.001 * np.arange(4000.0)
    angle, speed, acceleration = np.sin(5.0 * time), 5.0 * np.cos(5.0 * time), -25.0 * np.sin(5.0 * time)
    torque = 0.3 * acceleration
    gives = -1e-4 * (torque / torque.max() + np.sign(torque))
    motion = Motion(angle, speed, acceleration, torque, time, torque, np.full(4000, 0.3), 0.1, deflection=1e-13 * gives)
    axis = replace(slide().mechanism.dynamics["axis"], friction=FrictionLaw(coulomb=0.8))
    assert plays_seen(motion, axis) == []
    assert stiffness_seen(motion, axis) is None
    plays = plays_seen(replace(motion, deflection=gives), axis)
    assert all(0.0 < gap < np.ptp(gives) and stiffness > 0.0 for gap, stiffness in plays)
    assert len(plays) == 3


def test_flight_through_the_gap_is_free_and_bounces_keep_the_energy() -> None:
    """Between the flanks of a locked motor the speed stays to the rounding; without damping it turns at them."""
    rig = hinge(effect("backlash", gap=0.1, stiffness=20000.0), brake=500.0)
    rig.mechanism.brakes[0] = True
    rig.data.qvel[rig.model.joint("axis").dofadr[0]] = 1.0
    speeds = np.empty((4000, 2))
    for row in speeds:
        rig.step()
        row[:] = rig.position, rig.velocity
    inside = np.abs(speeds[:, 0]) < 0.049
    assert np.abs(np.abs(speeds[inside, 1]) - 1.0).max() < 5e-3
    turns = np.flatnonzero(np.diff(np.sign(speeds[:, 1])))
    assert len(turns) >= 4
    crossing = np.split(speeds[:, 1][inside], np.flatnonzero(np.diff(np.flatnonzero(inside)) > 1) + 1)
    assert max(np.ptp(one) for one in crossing) < 1e-12
    contact = pi * sqrt(LINK / 20000.0)
    assert np.diff(turns).mean() * PERIOD == pytest.approx(0.1 / 1.0 + contact, rel=0.01)


def test_flanks_never_pull_however_damped() -> None:
    """A link that leaves a heavily damped flank is not held back: it parts from it and never goes faster than it came."""
    rig = hinge(effect("backlash", gap=0.02, stiffness=2000.0, damping=40.0), brake=500.0)
    rig.mechanism.brakes[0] = True
    dof = int(rig.model.joint("axis").dofadr[0])
    rig.data.qvel[dof] = 1.0
    torques = []
    for _ in range(2000):
        before = rig.velocity
        rig.step()
        torques.append((rig.position, LINK * (rig.velocity - before) / PERIOD))
    pushed = np.array(torques)
    assert pushed[pushed[:, 0] > 0.0, 1].max() <= 1e-9
    assert pushed[pushed[:, 0] < 0.0, 1].min() >= -1e-9
    assert pushed[:, 1].min() < -10.0


ERROR = {"amplitude": 0.004, "order": 2.0, "phase": 0.6}


def joint(motor: float) -> float:
    """Where a motor's position by the gear ratio has the joint (Tuttle and Seering 1996: the error goes with the motor)."""
    return motor + 0.004 * sin(2.0 * GEAR * motor + 0.6)


def uneven(position: float) -> float:
    """Motor's angle by the gear ratio at a joint position."""
    return float(brentq(lambda motor: joint(motor) - position, position - 0.005, position + 0.005, xtol=1e-14))


def slope(position: float) -> float:
    return 1.0 / (1.0 + 0.004 * 2.0 * GEAR * cos(2.0 * GEAR * uneven(position) + 0.6))


def test_encoder_of_an_uneven_gear_reads_the_motors_angle() -> None:
    rig = hinge(effect("transmission_error", **ERROR))
    for position in (0.0, 0.01, 0.035, -0.4):
        rig.start(position)
        rig.mechanism.read()
        assert rig.mechanism.motor_position[0] == pytest.approx(GEAR * uneven(position), abs=1e-12)


def test_an_uneven_gear_turns_the_rotor_by_its_slope_and_keeps_the_energy() -> None:
    """Free: (Jl + Jm s(q)²) q'² / 2 stays. Pushed: it gains the torque times the motor's way. At a tenth of the time step."""
    rig = Rig(HINGE.format(joint="").replace("0.000125", "0.0000125"), effect("transmission_error", **ERROR))

    def energy() -> float:
        return 0.5 * (LINK + MOTOR * slope(rig.position) ** 2) * rig.velocity**2

    rig.start(velocity=0.5)
    start = energy()
    speeds = []
    for _ in range(20000):
        rig.step()
        speeds.append(rig.velocity)
        assert energy() == pytest.approx(start, rel=5e-4)
    assert np.ptp(speeds) > 0.05
    before, way = energy(), uneven(rig.position)
    for _ in range(20000):
        rig.step(2.0)
    assert energy() - before == pytest.approx(2.0 * (uneven(rig.position) - way), rel=2e-3)


@pytest.mark.parametrize("stiffness", [inf, 5e6])
def test_a_steep_error_costs_the_motor_what_the_power_of_the_joint_tells(stiffness: float) -> None:
    """T m' = (d/dt)(Jl q'²/2 + Jm m'²/2) + weight q' + viscous q'², q by `joint`, whose slope is 0.6 to 1.4."""
    time = np.arange(0.0, 2.0, 1e-4)
    angle = 0.2 - 0.3 * np.cos(2.0 * time)
    speed, acceleration = 0.6 * np.sin(2.0 * time), 1.2 * np.cos(2.0 * time)
    turns = np.array([joint(each) for each in angle])
    moves = CubicSpline(time, turns).derivative()(time)
    energy = 0.5 * LINK * moves**2 + 0.5 * MOTOR * speed**2
    power = CubicSpline(time, energy).derivative()(time) + 1.5 * moves + 0.8 * moves**2
    motion = Motion(
        angle, speed, acceleration, np.zeros_like(time), time,
        (LINK + MOTOR) * acceleration + 1.5, np.full_like(time, LINK + MOTOR), MOTOR,
    )  # fmt: skip
    gear = Transmission(stiffness, 0.0 if stiffness == inf else 400.0, 0.0, 0.004, 2.0, 0.6)
    torque = motor_torque(motion, AxisDynamics(GEAR, transmission=gear, friction=FrictionLaw(viscous=0.8)))
    turning = (np.abs(speed) > 0.1) & (time > 0.05)
    wanted = power[turning] / speed[turning]
    assert np.sqrt(np.mean((torque[turning] - wanted) ** 2)) < 0.01 * np.std(wanted)


def test_an_uneven_gear_behind_a_stiff_spring_is_the_rigid_one() -> None:
    rigid = hinge(effect("transmission_error", **ERROR))
    stiff = hinge(effect("elasticity", stiffness=1e6, damping=20.0), effect("transmission_error", **ERROR))
    stiff.data.qpos[motor(stiff)] = uneven(0.0)
    traces = [rig.run(0.2, 2.0) for rig in (rigid, stiff)]
    even = hinge().run(0.2, 2.0)
    assert np.abs(traces[0] - even).max() > 1e-3
    assert np.abs(traces[0] - traces[1]).max() < 0.05 * np.abs(traces[0] - even).max()
    for rig in (rigid, stiff):
        rig.mechanism.read()
        assert rig.mechanism.motor_position[0] == pytest.approx(GEAR * uneven(rig.position), abs=GEAR * 1e-5)


def test_refusals() -> None:
    with pytest.raises(UserError, match=r"transmission: stiffness 4e\+06 is more than a time step of 0\.000125 s follows"):
        hinge(effect("elasticity", stiffness=4e6))
    with pytest.raises(UserError, match=r"transmission: damping 300 is more than .* follows, 160 at most"):
        hinge(effect("elasticity", stiffness=1000.0, damping=300.0))
    with pytest.raises(UserError, match=r"a transmission error of 0\.02 would turn the joint back"):
        hinge(effect("transmission_error", amplitude=0.02, order=1.0))
    with pytest.raises(UserError, match="needs a motor's inertia; give joint 'axis' an armature"):
        hinge(effect("elasticity", stiffness=1000.0), effect("inertia", difference=-MOTOR))


def test_the_told_inertia_does_not_move_with_an_uneven_gear() -> None:
    rig = hinge(effect("transmission_error", **ERROR))
    rig.start(0.02)
    rig.step()
    assert rig.mechanism.inertia == pytest.approx([MOTOR + LINK], rel=1e-12)


def test_a_released_brake_lets_the_motor_go() -> None:
    rig = elastic(damping=4.0, brake=20.0)
    rig.mechanism.brakes[0] = True
    rig.run(0.1, 2.0)
    assert abs(rig.data.qpos[motor(rig)]) < 1e-6
    rig.mechanism.brakes[0] = False
    rig.run(0.1, 2.0)
    both = (MOTOR * rig.data.qvel[rig.model.joint("axis_motor").dofadr[0]] + LINK * rig.velocity) / (MOTOR + LINK)
    assert both == pytest.approx(2.0 * 0.1 / (MOTOR + LINK), rel=1e-3)


def test_a_rotor_on_its_spring_has_no_weight() -> None:
    """Let go on a vertical slide: only the link falls, and takes the rotor's inertia along."""
    rig = slide(effect("elasticity", stiffness=STIFFNESS, damping=4.0), gravity=-9.81)
    rig.run(0.2)
    fallen = MOTOR * rig.data.qvel[rig.model.joint("axis_motor").dofadr[0]] + LINK * rig.velocity
    assert fallen == pytest.approx(-LINK * 9.81 * 0.2, rel=1e-6)


def test_an_uneven_elastic_gear_starts_without_twist() -> None:
    rig = hinge(effect("elasticity", stiffness=STIFFNESS), effect("transmission_error", **ERROR))
    assert np.abs(rig.run(0.1)).max() < 1e-12


def test_a_motor_on_a_spring_has_no_friction_of_the_model_s_default_class() -> None:
    """Default classes are of the joints that the model has; the motor's own is the emulator's."""
    defaults = '<default><joint damping="3" frictionloss="2" stiffness="5" armature="7"/></default>'
    plain = '<joint name="axis" damping="0" frictionloss="0" stiffness="0" armature="0"'
    xml = HINGE.format(joint="").replace('<joint name="axis"', plain)
    spring = effect("elasticity", "axis", stiffness=2000.0, damping=1.0)
    one, other = (Rig(text, spring).model for text in (xml, xml.replace("<worldbody>", f"{defaults}<worldbody>", 1)))
    for name in ("dof_damping", "dof_frictionloss", "dof_armature", "jnt_stiffness", "dof_M0"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_a_closed_gap_on_stiff_flanks_moves_by_what_these_give() -> None:
    """A slope at 0: a step of a gap that no drive train has throws the link about, and no torque follows it."""
    time = 0.001 * np.arange(4000.0)
    angle, speed, acceleration = np.sin(5.0 * time), 5.0 * np.cos(5.0 * time), -25.0 * np.sin(5.0 * time)
    torque = (LINK + MOTOR) * acceleration
    motion = Motion(angle, speed, acceleration, torque, time, torque, np.full_like(time, LINK + MOTOR), MOTOR)
    axis = replace(slide().mechanism.dynamics["axis"], friction=FrictionLaw(coulomb=0.8))
    closed = Backlash(0.0, 4e9, 0.0)
    fields = movable_fields(closed, motion, axis, 0.05)
    slopes = tangents(closed, fields, lambda effect: {"axis": effect.predict(motion, axis)})  # type: ignore[attr-defined]
    assert all(np.isfinite(each["axis"]).all() for each in slopes)
    gap = next(field for field in fields if field.name == "gap")
    assert gap.size == pytest.approx(np.sqrt(np.mean(torque**2)) / 4e9)
