"""What hangs on a joint pulls where the joint is, not where its motor's encoder has it: a pendulum that is moved slowly."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.effects.backlash import Backlash
from drivetwin.emulator.effects.base import PartEffect
from drivetwin.emulator.effects.elasticity import Elasticity
from drivetwin.emulator.effects.encoder_eccentricity import EncoderEccentricity
from drivetwin.emulator.effects.transmission_error import TransmissionError

WEIGHT = 3.0  # m g l [N·m]
PERIOD = 0.002
TIME = PERIOD * np.arange(20_000.0)
JOINT = 1.2 * np.sin(0.05 * TIME)  # so slow that nothing but weight counts


def motion_of(read: NDArray[np.float64]) -> Motion:
    still = np.zeros_like(TIME)
    velocity = np.gradient(read, PERIOD)
    inertia = np.full_like(TIME, 0.01)
    return Motion(
        read, velocity, still, still, TIME, WEIGHT * np.sin(read), inertia, 0.005, weight_slope=WEIGHT * np.cos(read)
    )


def motor_of(deflection: float) -> NDArray[np.float64]:
    """Where the motor is, ahead of its joint by what the weight winds the spring up [rad]."""
    return JOINT + deflection * np.sin(JOINT)


@pytest.mark.parametrize(
    ("effect", "read"),
    [
        (EncoderEccentricity(0.05, 0.4), JOINT + 0.05 * np.sin(JOINT + 0.4)),
        (Elasticity(WEIGHT / 0.05, 0.5), motor_of(0.05)),
        (Backlash(0.02, WEIGHT / 0.05, 0.5), motor_of(0.05) + 0.01 * np.sign(JOINT)),
    ],
    ids=["encoder_eccentricity", "elasticity", "backlash"],
)
def test_the_weight_is_that_of_the_joint(effect: PartEffect, read: NDArray[np.float64]) -> None:
    motion = motion_of(read)
    told = motion.rigid_torque + effect.predict(motion, AxisDynamics(gear_ratio=1.0))
    inside = (np.abs(JOINT) > 0.1) & (TIME > 1.0)
    strayed = np.abs(WEIGHT * np.sin(read) - WEIGHT * np.sin(JOINT))[inside].max()
    assert np.abs(told - WEIGHT * np.sin(JOINT))[inside].max() < 0.05 * strayed


def test_an_uneven_gear_lifts_the_weight_of_the_joint() -> None:
    """By virtual work: torque d motor = weight d joint."""
    motion = motion_of(JOINT)
    effect = TransmissionError(0.02, 5.0, 0.3)
    joint = JOINT + 0.02 * np.sin(5.0 * JOINT + 0.3)
    slope = 1.0 + 0.1 * np.cos(5.0 * JOINT + 0.3)
    expected = WEIGHT * np.sin(joint) * slope
    told = motion.rigid_torque + effect.predict(motion, AxisDynamics(gear_ratio=1.0))
    rigid = WEIGHT * np.sin(JOINT) * slope
    assert np.abs(told - expected).max() < 0.02 * np.abs(rigid - expected).max()
