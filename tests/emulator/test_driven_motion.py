"""What is kept of a motion is of that motion alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from emulator.dynamics import AxisDynamics, FrictionLaw, Motion
from emulator.dynamics.replay import motor_torque, needed_torque


@pytest.fixture
def motion() -> Motion:
    """A swing of 1 rad and 1 Hz, of an axis of 0.2 kg·m²."""
    time = np.arange(1000) * 1e-3
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
    needed_torque(motion, axis)
    turned = replace(motion, velocity=-motion.velocity)
    np.testing.assert_array_equal(needed_torque(turned, axis), motor_torque(turned, axis))
    assert not np.array_equal(needed_torque(turned, axis), needed_torque(motion, axis))


def test_each_axis_needs_its_own(motion: Motion) -> None:
    one, other = (AxisDynamics(friction=FrictionLaw(coulomb=coulomb)) for coulomb in (1.0, 2.0))
    difference = needed_torque(motion, other) - needed_torque(motion, one)
    np.testing.assert_allclose(difference, np.sign(motion.velocity))
