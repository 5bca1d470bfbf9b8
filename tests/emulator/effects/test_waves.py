"""Where searches for waves over the position begin: near every wave that a motion shows, however long."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

from drivetwin.emulator.conformance.bench import record
from drivetwin.emulator.dynamics import Motion
from drivetwin.emulator.effects.position_friction import PositionFriction
from drivetwin.emulator.effects.waves import long_waves, orders, passing, shortest, strongest, travel


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


def at_speeds(*speeds: tuple[float, float], band: float = 48.0, period: float = 1e-3) -> Motion:
    """(rad/s, s) one after the other, and the same way back."""
    velocity = np.concatenate([np.full(round(seconds / period), speed) for speed, seconds in speeds])
    velocity = np.concatenate([velocity, -velocity[::-1]])
    position, still = np.cumsum(velocity) * period, np.zeros(len(velocity))
    time = np.arange(len(velocity), dtype=np.float64) * period
    return Motion(position, velocity, still, still, time, still, np.ones(len(velocity)), 0.1, band=band)


@pytest.mark.parametrize(("slow", "tried"), [((0.5, 1.0), True), ((0.5, 0.05), False), ((0.0, 1.0), False)])
def test_an_order_that_passes_in_the_band_for_a_twentieth_of_the_motion_is_tried(
    slow: tuple[float, float], tried: bool
) -> None:
    """18 waves a turn of a motor with a gear of 8 at 0.5 rad/s: 11 Hz, at 10 rad/s 229 Hz."""
    motion = at_speeds((10.0, 9.0), slow, (10.0, 9.0))
    axis = replace(record("hinge").axis, gear_ratio=8.0)
    assert 2.0 * np.pi / (18.0 * axis.gear_ratio) < shortest(motion)
    assert (18.0 in orders(motion, axis, np.zeros_like(motion.position))) is tried


def test_part_of_a_wave_at_each_of_many_reversals_is_not_seen() -> None:
    time = np.arange(60000, dtype=np.float64) * 1e-3
    velocity, still = 10.0 * np.cos(2.0 * np.pi * time), np.zeros(60000)
    position = 10.0 / (2.0 * np.pi) * np.sin(2.0 * np.pi * time)
    motion = Motion(position, velocity, still, still, time, still, np.ones(60000), 0.1, band=48.0)
    assert passing(motion, 0.01) == 0.0


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
