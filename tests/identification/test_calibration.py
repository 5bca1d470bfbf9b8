"""The 90 % intervals hold what they promise, and the estimates have no bias to speak of."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
import synthetic
from repeats import repeated
from scipy import stats

from drivetwin.identification import Identification, Parameter, Settings, identify
from drivetwin.identification.friction_law import FrictionLaw

REPETITIONS = int(os.environ.get("DRIVETWIN_REPETITIONS", "40"))
"""`DRIVETWIN_REPETITIONS=150` makes the bounds tight; the default keeps the test short. `pytest -rP` shows the counts."""

PLAIN_TRUTH = {"inertia": 1.0, "coulomb": 1.9, "viscous": 1.15, "offset": 0.0}
STRIBECK_TRUTH = PLAIN_TRUTH | {"static_torque": 2.4, "stribeck_velocity": 0.05, "stribeck_exponent": 2.0}


@pytest.mark.parametrize(
    ("law", "truth"),
    [(synthetic.PLAIN, PLAIN_TRUTH), (synthetic.STRIBECK, STRIBECK_TRUTH)],
    ids=["coulomb and viscous", "stribeck"],
)
@pytest.mark.parametrize("settings", [Settings(), Settings(reversal_margin=0.03, estimate_delay=True)], ids=["default", "bus"])
def test_intervals_cover_the_truth(law: FrictionLaw, truth: Mapping[str, float], settings: Settings) -> None:
    motions = synthetic.strokes(), synthetic.sweep()
    found = [_identify(law, motions, seed, settings) for seed in range(REPETITIONS)]
    directions = [result.axes["turn"].direction for result in found]
    assert not any(test is None or test.real for test in directions)
    assert all(result.axes["turn"].stribeck.real == (law is synthetic.STRIBECK) for result in found)
    for name, true in truth.items():
        parameters = [result.axes["turn"].parameters[name] for result in found]
        inside = sum(low <= true <= high for low, high in (parameter.interval for parameter in parameters))
        errors = np.array([parameter.value - true for parameter in parameters])
        print(f"{name}: {inside} of {REPETITIONS}")
        lowest = int(stats.binom.ppf(0.002, REPETITIONS, 0.9))
        assert inside >= lowest, f"{name}: {inside} of {REPETITIONS} intervals hold the truth"
        half = np.mean([(high - low) / 2 for low, high in (parameter.interval for parameter in parameters)])
        assert half < 3.0 * errors.std(), f"{name}: the interval is far wider than the scatter"
        room = 3.5 / np.sqrt(REPETITIONS) + 0.25
        assert abs(errors.mean()) < room * errors.std(), f"{name}: bias {errors.mean():.2g}, scatter {errors.std():.2g}"


@pytest.mark.parametrize("exponent", repeated(1.0, 3.0))
def test_intervals_cover_the_truth_whatever_the_exponent(exponent: float) -> None:
    law = replace(synthetic.STRIBECK, stribeck_exponent=exponent)
    motions = synthetic.strokes(), synthetic.sweep()
    found = [_identify(law, motions, seed, Settings(reversal_margin=0.03)).axes["turn"] for seed in range(REPETITIONS)]
    assert all(result.stribeck.real for result in found)
    lowest = int(stats.binom.ppf(0.002, REPETITIONS, 0.9))
    for name, true in (PLAIN_TRUTH | {"stribeck_exponent": exponent}).items():
        intervals = [result.parameters[name].interval for result in found if name in result.parameters]
        untold = REPETITIONS - len(intervals)
        inside = untold + sum(low <= true <= high for low, high in intervals)
        print(f"{name}: {inside} of {REPETITIONS}, {untold} not told")
        assert inside >= lowest, f"{name}: {inside} of {REPETITIONS} intervals hold the truth"
        assert untold < 0.2 * REPETITIONS


def test_an_exponent_that_the_data_cannot_tell_is_said_and_widens_the_others() -> None:
    motion = synthetic.strokes(speeds=(0.03, 0.05, 0.4, 0.8)), synthetic.sweep()
    rng = np.random.default_rng(8)
    recordings = [synthetic.record(one, synthetic.STRIBECK, rng, name=str(k), noise=0.6) for k, one in enumerate(motion)]
    open_to_all = identify(synthetic.turntable(), recordings, settings=Settings(reversal_margin=0.03)).axes["turn"]
    fixed = Settings(reversal_margin=0.03, stribeck_exponent_bounds=(1.999, 2.001))
    given = identify(synthetic.turntable(), recordings, settings=fixed).axes["turn"]
    assert open_to_all.stribeck.real
    assert "stribeck_exponent" not in open_to_all.parameters
    assert "2 is kept" in open_to_all.unidentifiable["stribeck_exponent"]
    assert open_to_all.law.stribeck_exponent == 2.0
    assert _width(open_to_all.parameters["static_torque"]) > 1.5 * _width(given.parameters["static_torque"])


def test_a_delay_between_torque_and_motion_is_found_and_taken_out() -> None:
    motions = synthetic.strokes(), synthetic.sweep()
    rng = np.random.default_rng(5)
    recordings = [
        synthetic.delayed(synthetic.record(motion, synthetic.PLAIN, rng, name=str(number)), samples=1)
        for number, motion in enumerate(motions)
    ]
    axis = identify(synthetic.turntable(), recordings, settings=Settings(estimate_delay=True)).axes["turn"]
    assert axis.parameters["delay"].value == pytest.approx(1e-3, abs=1e-4)
    assert axis.parameters["viscous"].value == pytest.approx(1.15, rel=0.01)
    uncorrected = identify(synthetic.turntable(), recordings).axes["turn"]
    assert uncorrected.parameters["viscous"].value < 1.12


def _width(parameter: Parameter) -> float:
    return parameter.interval[1] - parameter.interval[0]


def _identify(
    law: FrictionLaw,
    motions: tuple[synthetic.Motion, synthetic.Motion],
    seed: int,
    settings: Settings,
) -> Identification:
    rng = np.random.default_rng(seed)
    recordings = [
        synthetic.record(motion, law, rng, name=name) for motion, name in zip(motions, ("strokes", "sweep"), strict=True)
    ]
    return identify(synthetic.turntable(), recordings, settings=settings)
