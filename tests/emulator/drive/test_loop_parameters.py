"""The loops' parameters: as commissioned, as a master writes them, and as a reset brings them back."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from drive_bench import DriveBench

from drivetwin.emulator.drive.servo import SERVO_PERIOD


@pytest.mark.parametrize("profile", ["cia402-full", "servoone"])
def test_loops_are_as_commissioned_and_as_written(profile: str) -> None:
    bench = DriveBench("scara", "rotate", profile)
    bench.sync()
    parameters, roles = bench.drive.axis.servo.parameters, bench.drive.profile.roles
    expected = {
        "position_gain": 40.0,
        "velocity_gain": 32.0 / 50.0**2,
        "integral_rate": 1.0 / 0.02,
        "velocity_feedforward": 1.0,
        "velocity_filter": 1.0 - np.exp(-SERVO_PERIOD * 2.0 * pi * 300.0),
        "current_filter": 1.0 - np.exp(-SERVO_PERIOD / 0.0005),
        "torque_limit": 1.2,
        "encoder_quantum": 2.0 * pi / 1048576,
        "torque_noise": 0.0016,
        "torque_quantum": 0.0002,
    }
    assert {name: float(parameters[name]) for name in expected} == pytest.approx(expected, rel=1e-6)
    for role, field, value, becomes in (
        ("position_gain", "position_gain", 25.0, 25.0),
        ("integral_time", "integral_rate", 0.04, 25.0),
        ("integral_time", "integral_rate", 0.0, 0.0),
        ("velocity_feedforward", "velocity_feedforward", 0.5, 0.5),
        ("torque_limit", "torque_limit", 0.7, 0.7),
    ):
        place = roles[role]
        bench.write(place.index, value / place.si_per_unit, place.subindex)
        bench.sync()
        assert float(parameters[field]) == pytest.approx(becomes)
    bench.drive.device.receive(0, bytes((0x81, 2)))
    bench.sync()
    assert {name: float(parameters[name]) for name in expected} == pytest.approx(expected, rel=1e-6)
