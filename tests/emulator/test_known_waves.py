"""Waves that pass so slowly that a recorded motion shows all of them: nothing of the drive's loops is in their torque."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.emulator.dynamics import Motion
from drivetwin.emulator.dynamics.sampling import KNOWN, Sampling
from drivetwin.motion.filtering import fine_derivative, zero_phase

RINGING = 1.9 + 0.5j
"""Of a torque that disturbs the axis, what these loops would give against it."""


def sampling(period: float, motion_hz: float) -> Sampling:
    return Sampling(period, lambda frequency: np.full(len(frequency), RINGING), motion_hz, 1.0)


def moving(own: Sampling, speed: float) -> Motion:
    time = np.asarray(np.arange(400) * own.period, dtype=np.float64)
    none = np.zeros(400)
    return Motion(speed * time, none + speed, none, none, time, none, none + 1.0, 0.0, sampling=own)


@pytest.mark.parametrize(("period", "motion_hz"), [(1e-3, 100.0), (1e-3, 400.0), (0.02, 20.0), (5e-4, 900.0)])
def test_an_acceleration_is_known_up_to_where_filter_and_slopes_pass_it(period: float, motion_hz: float) -> None:
    """A sine of that frequency, filtered and differentiated twice as a recording is."""
    own = sampling(period, motion_hz)
    frequency = own.known_to
    time = np.arange(round(400.0 / (frequency * period))) * period
    phase = 2.0 * np.pi * frequency * time
    cutoff = min(motion_hz, 0.499 / period)
    passed = zero_phase(np.sin(phase), period, cutoff)
    slope = fine_derivative(fine_derivative(passed, period, cutoff), period, cutoff)
    middle = slice(len(time) // 4, 3 * len(time) // 4)
    sine = np.sin(phase)[middle]
    share = -(slope[middle] @ sine) / (sine @ sine) / (2.0 * np.pi * frequency) ** 2
    assert share == pytest.approx(KNOWN, abs=2e-4)


def test_the_loops_give_nothing_against_a_wave_up_to_there_and_something_above() -> None:
    own = sampling(1e-3, 400.0)
    for above, shown in ((0.99, True), (1.02, False)):
        motion = moving(own, 2.0 * np.pi * own.known_to * above / 7.0)
        angle = 7.0 * motion.position + 0.3
        for wave in (motion.wave(angle, 7.0), motion.known_wave(angle, 7.0)):
            assert np.array_equal(wave, np.sin(angle)) is shown
        assert (motion.unseen_wave(angle, 7.0) is None) is shown
