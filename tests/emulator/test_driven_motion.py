"""What is kept of a motion is of that motion alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw, Motion
from drivetwin.emulator.dynamics.replay import motor_torque
from drivetwin.emulator.dynamics.transmission import Transmission


@pytest.fixture
def motion() -> Motion:
    """A swing of 1 rad and 1 Hz, of an axis of 0.2 kg·m²."""
    time = np.arange(1000, dtype=np.float64) * 1e-3
    position = np.sin(2.0 * np.pi * time)
    velocity = np.gradient(position, time)
    acceleration = np.gradient(velocity, time)
    inertia = np.full_like(time, 0.2)
    return Motion(position, velocity, acceleration, inertia * acceleration, time, inertia * acceleration, inertia, 0.05)


def test_it_is_made_once(motion: Motion) -> None:
    made: list[Motion] = []

    def speed(of: Motion) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        made.append(of)
        return np.abs(of.velocity)

    first, again = motion.kept("speed", speed), motion.kept("speed", speed)
    assert again is first
    assert len(made) == 1


def test_a_changed_motion_keeps_nothing_of_the_former(motion: Motion) -> None:
    axis = AxisDynamics(friction=FrictionLaw(coulomb=1.0, viscous=0.3))
    motor_torque(motion, axis)
    turned = replace(motion, velocity=-motion.velocity)
    np.testing.assert_array_equal(motor_torque(turned, axis), motor_torque(replace(turned), axis))
    assert not np.array_equal(motor_torque(turned, axis), motor_torque(motion, axis))


def test_each_axis_needs_its_own(motion: Motion) -> None:
    one, other = (AxisDynamics(friction=FrictionLaw(coulomb=coulomb)) for coulomb in (1.0, 2.0))
    difference = motor_torque(motion, other) - motor_torque(motion, one)
    np.testing.assert_allclose(difference, np.sign(motion.velocity))


def test_of_what_a_search_moves_on_from_only_the_last_is_kept(motion: Motion, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivetwin.emulator.dynamics.motion.LATELY", 2)
    made: list[float] = []

    def asked(share: float) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        def scaled(of: Motion) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
            made.append(share)
            return share * of.velocity

        return motion.kept_lately(share, scaled)

    for share in (1.0, 2.0, 1.0, 3.0, 1.0, 2.0):
        np.testing.assert_array_equal(asked(share), share * motion.velocity)
    assert made == [1.0, 2.0, 3.0, 2.0]


def test_a_law_resists_as_its_formula_whatever_was_asked_before(motion: Motion) -> None:
    law = FrictionLaw(
        coulomb=1.0, coulomb_asymmetry=0.1, viscous=0.3, viscous_asymmetry=0.05, quadratic=0.02, cubic=0.01, static_torque=1.7,
        stribeck_velocity=0.4, exponent=1.3, load_coefficient=0.05, position_amplitude=0.2, position_period=0.5, cold=0.6,
        warming_time=0.3,
    )  # fmt: skip
    speed, way = np.abs(motion.velocity), np.sign(motion.velocity)
    level = 1.0 + 0.7 * np.exp(-((speed / 0.4) ** 1.3))
    level += 0.2 * np.sin(4.0 * np.pi * motion.position)
    beside = 0.1 * np.abs(way) + (0.3 + 0.05 * way + 0.02 * speed + 0.01 * speed**2) * motion.velocity
    warmth = 1.0 + 0.6 * np.exp(-motion.time / 0.3)
    for other in (replace(law, stribeck_velocity=0.2), replace(law, exponent=2.0), replace(law, warming_time=1.0), law):
        resistance = other.resistance(motion)
    asked = motion.rigid_torque + resistance
    np.testing.assert_allclose(resistance, warmth * (level * way + beside + 0.05 * np.abs(asked) * way), rtol=1e-9)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_on_a_stiff_spring_friction_of_the_load_is_that_of_a_rigid_axis_wherever_it_acts(motion: Motion, share: float) -> None:
    law = FrictionLaw(coulomb=0.5, load_coefficient=0.2)
    loaded = replace(motion, rigid_torque=motion.rigid_torque + 3.0, torque=motion.rigid_torque + 3.0)
    spring = Transmission(stiffness=1e6, damping=20.0, motor_friction_share=share)
    rigid = motor_torque(loaded, AxisDynamics(friction=law))
    turning = np.abs(motion.velocity) > 0.3 * np.abs(motion.velocity).max()
    sprung = motor_torque(loaded, AxisDynamics(friction=law, transmission=spring))
    assert np.median(np.abs(sprung - rigid)[turning]) < 0.01
