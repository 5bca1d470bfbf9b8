"""What sizes of effects are rare among machines: of loads by what steel weighs, of drifts by what recordings show."""

from __future__ import annotations

from math import log

import numpy as np
import pytest

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.effects.payload import Payload
from drivetwin.emulator.effects.temperature_drift import TemperatureDrift

HINGE, SLIDE = AxisDynamics(), AxisDynamics(slide=True)


def motion(inertia: float, seconds: float) -> Motion:
    """An axis that stands, of so much inertia [kg·m² or kg]."""
    time = np.linspace(0.0, seconds, 101)
    none = np.zeros_like(time)
    return Motion(none, none, none, none, time, none, np.full_like(time, inertia), 0.0)


@pytest.mark.parametrize(("mass", "times"), [(5.0, 1.0), (40.0, 1.0), (253.0, 2.0 * 2.82)])
def test_a_load_turns_with_at_least_the_inertia_of_a_ball_of_steel(mass: float, times: float) -> None:
    """2/5 m r² about itself: 253 kg are a ball of 0.2 m, of 3.9 kg·m². An axis of 0.7 kg·m² does not turn it."""
    nats = 0.5 * (log(times) / log(2.0)) ** 2
    assert Payload(mass, 57e-6).unlikely(motion(0.7, 10.0), HINGE) == pytest.approx(nats, abs=0.05)


@pytest.mark.parametrize(("mass", "nats"), [(3.0, 0.0), (16.0, 2.0)])
def test_a_load_of_a_slide_is_hardly_heavier_than_all_that_moves(mass: float, nats: float) -> None:
    assert Payload(mass).unlikely(motion(4.0, 10.0), SLIDE) == pytest.approx(nats)


@pytest.mark.parametrize(("constant", "nats"), [(60.0, 0.0), (700.0, 0.0), (5600.0, 4.5)])
def test_a_drift_that_recordings_hardly_show_is_likelier_a_level(constant: float, nats: float) -> None:
    assert TemperatureDrift(0.1, constant).unlikely(motion(1.0, 700.0), HINGE) == pytest.approx(nats)
