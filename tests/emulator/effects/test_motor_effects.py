"""Motor and drive effects: what the shaft gives against what the drive reports, in plants and through a drive's loops."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import pytest
from effect_bench import GEAR, PERIOD, WHOLE, Array, Rig, effect, hinge, slide

from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.drive.servo import Loop, Servo, ServoBank
from drivetwin.emulator.dynamics import Motion
from drivetwin.emulator.effects import AxisEffect, PlacedEffect
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.plant import Plant
from drivetwin.emulator.virtual_machine import VirtualMachine

STAGE = load_machine("stage")
RATIO = STAGE.axes["slide"].gear_ratio
STAGE_MASS = 80.0 + 3.8e-5 * RATIO**2


@pytest.mark.parametrize("make", [hinge, slide])
def test_the_shaft_gives_more_than_is_reported_by_the_constants_error(make: object) -> None:
    rig = make(effect("torque_constant", error=0.07))  # type: ignore[operator]
    rig.run(0.2, 1.5)
    assert rig.velocity == pytest.approx(1.07 * 1.5 * 0.2 / WHOLE, rel=1e-9)


@pytest.mark.parametrize("make", [hinge, slide])
@pytest.mark.parametrize("given", [0.4, -1.5, 9.0])
def test_of_a_saturated_motor_the_shaft_gives_the_root_of_a_cubic(make: object, given: float) -> None:
    """x + x³ / knee² = given, the real root by numpy's companion matrix."""
    rig = make(effect("magnetic_saturation", knee=2.0))  # type: ignore[operator]
    rig.run(0.2, given)
    roots = np.roots([1.0 / 2.0**2, 0.0, 1.0, -given])
    shaft = float(roots[np.abs(roots.imag) < 1e-9].real[0])
    assert rig.velocity == pytest.approx(shaft * 0.2 / WHOLE, rel=1e-9)


def test_an_offset_moves_the_axis_without_any_reported_torque() -> None:
    rig = hinge(effect("torque_offset", offset=-0.3))
    rig.run(0.2)
    assert rig.velocity == pytest.approx(-0.3 * 0.2 / WHOLE, rel=1e-9)


def test_ripple_comes_order_times_a_motor_turn() -> None:
    """Spectrum over the motor's angle of the torque that turns a fast axis: one line, of its amplitude and phase."""
    rig = hinge(effect("torque_ripple", amplitude=0.4, order=6.0, phase=0.5))
    rig.start(velocity=3.0)
    angles, torques = [], []
    for _ in range(20000):
        rig.mechanism.read()
        before = rig.velocity
        angles.append(float(rig.mechanism.motor_position[0]))
        rig.step()
        torques.append(WHOLE * (rig.velocity - before) / PERIOD)
    turns = np.array(angles) / (2.0 * pi)
    even = np.arange(0.0, np.floor(turns[-1]), 1.0 / 64.0)
    spectrum = np.fft.rfft(np.interp(even, turns, torques)) * 2.0 / len(even)
    order = np.fft.rfftfreq(len(even), 1.0 / 64.0)
    assert order[np.abs(spectrum).argmax()] == pytest.approx(6.0)
    line = spectrum[np.abs(spectrum).argmax()]
    assert abs(line) == pytest.approx(0.4, rel=1e-2)
    assert np.angle(line) == pytest.approx(0.5 - pi / 2.0, abs=0.02)
    assert np.sort(np.abs(spectrum))[-2] < 0.02


RIPPLES = ((0.4, 6.0, 0.5), (0.25, 1.0, -1.1), (0.1, 0.5, 2.0))
"""Amplitude [N·m], order, phase of three orders of cogging on one axis, one of them once in two motor turns."""


@pytest.mark.parametrize("make", [hinge, slide])
@pytest.mark.parametrize("angle", [0.0, 0.013, -0.2])
def test_several_ripples_of_an_axis_act_as_their_sum(make: object, angle: float) -> None:
    rig = make(*(effect("torque_ripple", amplitude=a, order=n, phase=p) for a, n, p in RIPPLES))  # type: ignore[operator]
    rig.start(position=angle)
    rig.step(0.7)
    cogging = sum(a * np.sin(n * GEAR * angle + p) for a, n, p in RIPPLES)
    assert rig.velocity * WHOLE / PERIOD == pytest.approx(0.7 + cogging, rel=1e-9)


def predicted(placed: PlacedEffect, motion: Motion, rig: Rig) -> Array:
    assert isinstance(placed.effect, AxisEffect)
    return placed.effect.predict(motion, rig.mechanism.dynamics["axis"])


def test_several_ripples_predict_what_they_cost_together_in_any_order() -> None:
    """Each on top of those before it: a ripple does not change what another costs."""
    effects = [effect("torque_ripple", amplitude=a, order=n, phase=p) for a, n, p in RIPPLES]
    position = np.linspace(-0.3, 0.3, 101)
    still = np.zeros_like(position)
    motion = Motion(position, still, still, still, still, still, np.full_like(position, WHOLE), 0.0)
    for order in (effects, effects[::-1]):
        costs = [predicted(one, motion, hinge(*order[:number])) for number, one in enumerate(order)]
        expected = -sum(a * np.sin(n * GEAR * position + p) for a, n, p in RIPPLES)
        np.testing.assert_allclose(np.sum(costs, axis=0), expected, atol=1e-12)


def test_ripple_offset_and_constant_stand_beside_each_other() -> None:
    rig = hinge(
        effect("torque_ripple", amplitude=0.4, order=6.0, phase=pi / 2.0),
        effect("torque_offset", offset=0.1),
        effect("torque_constant", error=-0.5),
    )
    rig.step(2.0)
    assert rig.velocity * WHOLE / PERIOD == pytest.approx(0.4 + 0.1 + 0.5 * 2.0, rel=1e-9)


def test_a_load_by_friction_is_the_shafts() -> None:
    """A motor that is half as strong presses half as much: it slides steadily where T/2 = 0.5 + 0.2 T/2."""
    weak = (effect("torque_constant", error=-0.5), effect("coulomb", coulomb=0.5), effect("load_friction", coefficient=0.2))
    rig: Rig = hinge(*weak)
    rig.start(velocity=1.0)
    rig.run(0.2, 2.0 * 0.5 / 0.8)
    assert rig.velocity == pytest.approx(1.0, rel=1e-6)


def stage(*effects: PlacedEffect) -> tuple[Plant, ServoBank]:
    """The screw stage with its motor under torque control, a faultless current sensor, and its effects."""
    plant, servos = Plant(STAGE, effects), ServoBank(1, 0)
    own = servos.parameters[0]
    for name in ("encoder_quantum", "torque_quantum"):
        own[name] = 1e-12
    own["torque_limit"], own["velocity_filter"], own["current_filter"] = 10.0, 1.0, 1.0
    plant.equip(servos)
    servos.loops[0], servos.brakes[0] = Loop.TORQUE, False
    servos.start_cycle(1)
    return plant, servos


def reported(plant: Plant, servos: ServoBank, demand: float) -> float:
    """One period under a torque demand on the joint side; the force that the drive measures [N]."""
    servos.demand[0, 0] = (0.0, 0.0, 0.0, demand / RATIO)
    plant.advance(servos)
    return float(servos.state[0]["torque_actual"]) * RATIO


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_saturation_clips_motor_and_measurement(sign: float) -> None:
    plant, servos = stage(effect("torque_saturation", "slide", limit=150.0))
    assert reported(plant, servos, sign * 149.0) == pytest.approx(sign * 149.0)
    before = float(plant.joint_velocities()[0])
    measured = [reported(plant, servos, sign * 400.0) for _ in range(200)]
    assert measured == pytest.approx([sign * 150.0] * 200)
    gained = float(plant.joint_velocities()[0]) - before
    assert gained == pytest.approx(sign * 150.0 * 200 * PERIOD / STAGE_MASS, rel=1e-9)


def test_the_drives_own_loops_do_not_know_the_saturation() -> None:
    plant, servos = stage(effect("torque_saturation", "slide", limit=150.0))
    reported(plant, servos, 400.0)
    assert servos.state[0]["torque_demand"] * RATIO == pytest.approx(400.0)
    assert servos.state[0]["limited"] == 0


@pytest.mark.parametrize("bandwidth", [20.0, 60.0])
def test_current_loop_is_three_decibels_down_at_its_bandwidth(bandwidth: float) -> None:
    plant, servos = stage(effect("current_bandwidth", "slide", bandwidth=bandwidth))
    count = round(20 / bandwidth / PERIOD)
    angle = 2.0 * pi * bandwidth * PERIOD * np.arange(count)
    measured = np.array([reported(plant, servos, 100.0 * float(np.sin(one))) for one in angle])
    tail = slice(count // 2, None)
    response = 2.0 * np.mean(measured[tail] * np.exp(-1j * angle[tail])) / 100.0
    assert abs(response) == pytest.approx(1.0 / sqrt(2.0), rel=0.02)
    assert np.angle(response) == pytest.approx(-pi / 2.0 - pi / 4.0, abs=0.05)


def test_a_drive_without_such_effects_keeps_its_commissioned_lag() -> None:
    plant, servos = stage()
    servos.parameters[0]["current_filter"] = 0.25
    plant.equip(servos)
    assert servos.parameters[0]["current_filter"] == 0.25
    assert servos.parameters[0]["current_limit"] == np.inf


def test_a_virtual_machines_drives_have_the_power_stages_of_the_effects() -> None:
    effects = (effect("torque_saturation", "slide", limit=150.0), effect("current_bandwidth", "slide", bandwidth=60.0))
    virtual = VirtualMachine(STAGE, load_profile("servoone"), effects, SyncClock(), 0, lambda _: None)
    virtual.power_on()
    loops = virtual.drives[0].axis.servo.parameters
    assert loops["current_limit"] == pytest.approx(150.0 / RATIO)
    assert loops["current_filter"] == pytest.approx(1.0 - np.exp(-2.0 * pi * 60.0 * PERIOD))


def test_brakes_are_engaged_where_the_loops_are_off_until_told_otherwise() -> None:
    servos = ServoBank(2, 0)
    servo = Servo(servos, 1)
    assert servos.brakes.all()
    servo.loop = Loop.POSITION
    assert list(servos.brakes) == [True, False]
    servo.brake = True
    assert (servo.brake, servo.loop) == (True, Loop.POSITION)
    servo.loop = Loop.OFF
    assert servo.brake
