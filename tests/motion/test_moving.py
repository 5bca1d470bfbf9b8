"""Which samples count as motion: not those of an axis that its drive holds while others shake it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivetwin.motion.axis_motion import AxisMotion
from drivetwin.motion.moving import AxisSamples, select, standstill, standstill_velocity

PERIOD, CUTOFF = 0.001, 48.0
TIME = np.arange(0.0, 6.0, PERIOD)


def motion(position: NDArray[np.float64]) -> AxisMotion:
    """An axis that moves so (n,) [rad], as a filter would leave it."""
    velocity = np.gradient(position, PERIOD)
    none = np.zeros_like(position)
    return AxisMotion(
        recording="a", axis="turn", period=PERIOD, cutoff_hz=CUTOFF, time=TIME, position=position, velocity=velocity,
        acceleration=np.gradient(velocity, PERIOD), torque=none, model_torque=none, velocity_noise=1e-6,
    )  # fmt: skip


def selected(*positions: NDArray[np.float64]) -> list[AxisSamples]:
    motions = [motion(position) for position in positions]
    threshold = standstill_velocity(motions)
    assert threshold is not None
    return [select(each, standstill(motions, threshold), 0.0) for each in motions]


STROKES = 0.3 * np.sin(2.0 * np.pi * 0.5 * TIME)
SHAKEN = 2e-4 * np.sin(2.0 * np.pi * 4.0 * TIME)
"""Within the presliding of its friction: five times faster than 0.2 % of the highest speed of the strokes."""


def test_an_axis_that_is_held_and_shaken_stands() -> None:
    strokes, shaken = selected(STROKES, SHAKEN)
    assert np.abs(shaken.motion.velocity).max() > 2.0 * 0.002 * np.abs(strokes.motion.velocity).max()
    assert not shaken.moving.any()
    assert strokes.moving.mean() > 0.9


def test_an_axis_that_is_shaken_between_its_strokes_stands_there() -> None:
    held = TIME >= 3.0
    (both,) = selected(np.where(held, SHAKEN, STROKES))
    assert not both.moving[3100:].any()
    assert both.moving[:2900].mean() > 0.9


def test_short_strokes_of_a_spindle_that_also_turns_count() -> None:
    """Three hundred radians one way, and then a swing of a tenth of one: much shorter, and not slow."""
    _, swings = selected(60.0 * TIME, 0.1 * np.sin(2.0 * np.pi * 2.0 * TIME))
    assert swings.moving.mean() > 0.7


def test_slow_strokes_that_are_long_count() -> None:
    _, slow = selected(STROKES, 0.3 / 6.0 * 0.1 * TIME)
    assert slow.moving.mean() > 0.9
