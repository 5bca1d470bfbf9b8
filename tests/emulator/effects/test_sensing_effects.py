"""Sensing and timing effects: the reading against the shaft's true angle."""

from __future__ import annotations

from math import pi, sin

import numpy as np
import pytest
from effect_bench import GEAR, PERIOD, Rig, effect, hinge, slide, two_axes


def readings(rig: Rig, count: int, torque: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """True motor angles by the joint, and what the encoder says at the same instants [rad]."""
    true, read = [], []
    for _ in range(count):
        true.append(GEAR * rig.position)
        rig.step(torque)
        read.append(float(rig.mechanism.motor_position[0]))
    return np.array(true), np.array(read)


@pytest.mark.parametrize("make", [hinge, slide])
def test_eccentricity_errs_once_a_motor_turn(make: object) -> None:
    amplitude, phase = 2e-4, 0.8
    rig = make(effect("encoder_eccentricity", amplitude=amplitude, phase=phase))  # type: ignore[operator]
    rig.start(velocity=1.0)
    true, read = readings(rig, 12000)
    turns = true / (2.0 * pi)
    even = np.arange(0.0, np.floor(turns[-1]), 1.0 / 32.0)
    spectrum = np.fft.rfft(np.interp(even, turns, read - true)) * 2.0 / len(even) / GEAR
    order = np.fft.rfftfreq(len(even), 1.0 / 32.0)
    line = np.abs(spectrum).argmax()
    assert order[line] == pytest.approx(1.0)
    assert abs(spectrum[line]) == pytest.approx(amplitude, rel=1e-2)
    assert np.angle(spectrum[line]) == pytest.approx(phase - pi / 2.0, abs=0.02)
    assert np.sort(np.abs(spectrum))[-2] < 0.02 * amplitude


@pytest.mark.parametrize("periods", [0, 1, 8, 37])
def test_delay_of_whole_periods_is_as_many_samples(periods: int) -> None:
    rig = hinge(effect("delay", delay=periods * PERIOD))
    true, read = readings(rig, 300, 2.0)
    assert read[periods:] == pytest.approx(true[: len(true) - periods], abs=1e-12)
    assert (read[:periods] == 0.0).all()


def test_delay_between_periods_lies_on_the_straight_line() -> None:
    rig = hinge(effect("delay", delay=3.25 * PERIOD))
    true, read = readings(rig, 100, 2.0)
    assert read[4:] == pytest.approx(0.75 * true[1:-3] + 0.25 * true[:-4], abs=1e-12)


def test_what_arrives_late_is_the_eccentric_reading() -> None:
    rig = hinge(effect("delay", delay=8 * PERIOD), effect("encoder_eccentricity", amplitude=2e-4))
    rig.start(velocity=1.0)
    true, read = readings(rig, 100)
    then = true[20 - 8]
    assert read[20] == pytest.approx(then + GEAR * 2e-4 * sin(then), abs=1e-12)


def test_a_standing_axis_is_read_where_it_stands_from_the_first_period_on() -> None:
    rig = hinge(effect("delay", delay=0.01), effect("encoder_eccentricity", amplitude=2e-4, phase=0.5))
    _, read = readings(rig, 200)
    assert read == pytest.approx(np.full(200, GEAR * 2e-4 * sin(0.5)), abs=1e-12)


def test_the_motion_itself_is_untouched() -> None:
    plain, late = hinge(), hinge(effect("delay", delay=0.01), effect("encoder_eccentricity", amplitude=1e-3))
    assert (plain.run(0.05, 1.0) == late.run(0.05, 1.0)).all()


def test_the_other_axes_are_read_as_they_are() -> None:
    rig = Rig(two_axes(), effect("delay", "second", delay=0.001), axes=("axis", "second"))
    rig.start(velocity=1.0)
    true, read = readings(rig, 50)
    assert read == pytest.approx(true, abs=1e-12)
    assert rig.mechanism.motor_position[1] == pytest.approx(true[-1 - 8], abs=1e-12)
