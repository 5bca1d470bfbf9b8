"""Where searches for waves over the position begin: near every wave that a motion shows, however long."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from drivetwin.emulator.conformance.bench import record
from drivetwin.emulator.dynamics import Motion
from drivetwin.emulator.effects.position_friction import PositionFriction
from drivetwin.emulator.effects.waves import long_waves, orders, shortest, strongest, travel


@pytest.mark.parametrize("waves", [1.2, 1.7, 2.3, 3.3, 4.8, 6.2, 7.7])
def test_a_long_wave_of_friction_is_near_a_start(waves: float) -> None:
    """The start next to it is at most a quarter of a wave off over the whole travel: it has most of the energy."""
    recorded = record("hinge")
    motion = recorded.motion
    true = np.sin(2.0 * np.pi * waves / travel(motion) * motion.position + 0.7) * np.sign(motion.velocity)
    wanted = recorded.judged(true)
    left = []
    for start in PositionFriction.starts(motion, recorded.axis):
        columns = np.column_stack([recorded.judged(one.predict(motion, recorded.axis)) for one in start.members])
        coefficients = np.linalg.lstsq(columns, wanted, rcond=None)[0]
        left.append(float(np.sum((wanted - columns @ coefficients) ** 2) / np.sum(wanted**2)))
    assert min(left) < 0.4


def test_every_whole_order_that_a_motion_shows_is_tried() -> None:
    """In a torque that shows none: beside friction the cogging of a motor is seldom among its strongest waves."""
    recorded = record("hinge")
    motion, turn = recorded.motion, 2.0 * np.pi / recorded.axis.gear_ratio
    shown = {float(order) for order in range(1, 49) if shortest(motion) <= turn / order <= 2.0 * travel(motion)}
    assert len(shown) > 12
    assert shown <= set(orders(motion, recorded.axis, np.zeros_like(motion.position)))


def test_an_axis_that_stands_shows_no_waves() -> None:
    none = np.zeros(4)
    still = Motion(none, none, none, none, np.arange(4.0), none, np.ones(4), 0.1)
    assert long_waves(still) == []


@pytest.mark.parametrize("torque", [0.0, 0.1, 2.7])
def test_a_torque_that_does_not_vary_shows_no_waves(torque: float) -> None:
    """And numpy does not warn of 0 / 0."""
    motion = record("hinge").motion
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert strongest(motion, np.full_like(motion.position, torque), 5) == []
