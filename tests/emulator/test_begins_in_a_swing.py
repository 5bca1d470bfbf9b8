"""A replay that begins in the middle of a swing, of a torque that was recorded in coarse steps: against the closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw, Motion
from drivetwin.emulator.dynamics.replay import followed
from drivetwin.emulator.dynamics.transmission import Transmission

LINK, ROTOR = 1.8, 0.5
"""Inertias behind and before the spring [kg·m²]."""
QUANTUM = 1.0
"""Step of the recorded torque [N·m]."""
SINES = ((0.30, 0.7), (0.08, 1.9))
"""Amplitude [rad] and frequency [Hz] of the motor's motion."""


def _in_a_swing(stiffness: float, damping: float, period: float = 0.02) -> tuple[Motion, NDArray[np.float64]]:
    """A motor that has long moved in sines when the recording begins, and the torque of its shaft (n,), by phasors."""
    time = np.arange(0.0, 12.0, period)
    motor, shaft = np.zeros((3, len(time))), np.zeros(len(time))
    for amplitude, frequency in SINES:
        s = 2.0j * np.pi * frequency
        wave = amplitude * np.exp(s * time)
        link = wave * (stiffness + damping * s) / (LINK * s**2 + damping * s + stiffness)
        motor += np.stack([(s**k * wave).imag for k in range(3)])
        shaft += (ROTOR * s**2 * wave + LINK * s**2 * link).imag
    position, velocity, acceleration = motor
    recorded = QUANTUM * np.round(shaft / QUANTUM)
    inertia = np.full(len(time), LINK + ROTOR)
    return Motion(position, velocity, acceleration, recorded, time, inertia * acceleration, inertia, ROTOR), shaft


@pytest.mark.parametrize(("swing_hz", "damping_ratio"), [(2.4, 0.015), (5.0, 0.02)])
def test_a_replay_goes_on_in_the_swing_that_the_recording_begins_in(swing_hz: float, damping_ratio: float) -> None:
    """To a third of what the torque is rounded by, q / sqrt(12): hardly anything is left of the noise of its first samples."""
    swing = 2.0 * np.pi * swing_hz
    stiffness, damping = LINK * swing**2, 2.0 * damping_ratio * LINK * swing
    motion, shaft = _in_a_swing(stiffness, damping)
    axis = replace(AxisDynamics(), transmission=Transmission().in_series(stiffness, damping, 0.0))
    missed = followed(motion, axis).torque - shaft
    print(f"{swing_hz} Hz: {np.sqrt(np.mean(missed**2)):.3f} N·m of {np.sqrt(np.mean(shaft**2)):.2f}")
    assert np.sqrt(np.mean(missed**2)) < QUANTUM / np.sqrt(12.0) / 3.0


def test_a_replay_that_is_cut_in_motion_begins_on_the_flank_that_its_load_is_on() -> None:
    """As the whole replay goes on, whose torque is recorded in steps, to about one of these on average over the cuts."""
    motion, _ = _in_a_swing(3e3, 3.0)
    play = Transmission(stiffness=3e3, damping=3.0, gap=0.005)
    axis = replace(AxisDynamics(), transmission=play, friction=FrictionLaw(coulomb=1.0))
    whole = followed(motion, axis).torque
    recorded = replace(motion, torque=QUANTUM * np.round(whole / QUANTUM))
    missed = []
    for cut in range(100, 400, 15):
        names = ("position", "velocity", "acceleration", "torque", "time", "rigid_torque", "inertia")
        rest = replace(recorded, **{name: getattr(recorded, name)[cut:] for name in names})
        missed.append(float(np.sqrt(np.mean((followed(rest, axis).torque - whole[cut:]) ** 2))))
    print(f"{np.mean(missed):.2f} N·m, median {np.median(missed):.2f}")
    assert np.mean(missed) < 1.2 * QUANTUM
