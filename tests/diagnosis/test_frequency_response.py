"""Frequency responses from recordings against the equations of the machines that made them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from drivetwin.diagnosis.report.frequency_response import frequency_response
from drivetwin.diagnosis.report.result import FrequencyResponse, NoResponse
from drivetwin.recording.recording import Recording, RecordingInfo

Array = NDArray[np.float64]

PERIOD, STEPS, SECONDS = 1e-3, 10, 60.0
MOTOR, LOAD, DAMPING = 2.0, 3.0, 4.0
ANTIRESONANCE = 40.0
STIFFNESS = LOAD * (2.0 * np.pi * ANTIRESONANCE) ** 2
RESONANCE = float(np.sqrt(STIFFNESS * (1.0 / LOAD + 1.0 / MOTOR)) / (2.0 * np.pi))
STANDSTILL = {"slide": 1e-4}


def moved(stiffness: float, *, excited: bool = True, disturbance: float = 1.0, names: tuple[str, ...] = ()) -> Recording:
    """Two masses on a spring (`stiffness` 0: one mass) by Euler's semi-implicit steps, travelling slowly under a PD loop.

    A random torque of `excited` is added, and a random force that nobody records disturbs the motor below 30 Hz.
    """
    count, step = round(SECONDS / PERIOD), PERIOD / STEPS
    rng = np.random.default_rng(4)
    time = np.arange(count, dtype=np.float64) * PERIOD
    demand = 0.2 * np.sin(0.15 * time)
    offset = rng.normal(0.0, 10.0, count) if excited else np.zeros(count)
    pushed = disturbance * np.convolve(rng.normal(size=count + 29), np.ones(30) / np.sqrt(30.0), "valid")
    place, speed, load, load_speed = 0.0, 0.03, 0.0, 0.03
    position, torque = np.empty((2, count))
    motor = MOTOR if stiffness else MOTOR + LOAD
    for k in range(count):
        position[k] = place
        force = 4e4 * (demand[k] - place) + 800.0 * (0.03 * np.cos(0.15 * time[k]) - speed) + offset[k]
        torque[k] = force
        for _ in range(STEPS):
            spring = stiffness * (place - load) + (DAMPING * (speed - load_speed) if stiffness else 0.0)
            speed += step * (force + pushed[k] - spring - 5.0 * speed) / motor
            load_speed += step * spring / LOAD
            place, load = place + step * speed, load + step * load_speed
    position = np.round(position / 1e-8) * 1e-8
    columns: dict[str, Array] = {"position": position, "torque": torque, "position_demand": demand, "torque_offset": offset}
    info = RecordingInfo.model_validate({"machine": "m", "sample_period": PERIOD, "axes": {"slide": {"joint": "slide"}}})
    return Recording("travels", info, time, {"slide": {name: columns[name] for name in names or columns}})


def true_response(frequency: Array, stiffness: float) -> NDArray[np.complex128]:
    """Speed of the motor for a unit of its torque."""
    s = 2j * np.pi * frequency
    spring = (stiffness + DAMPING * s) if stiffness else 0.0
    load = spring * LOAD * s / (LOAD * s * s + spring) if stiffness else LOAD * s
    return np.asarray(1.0 / (MOTOR * s + load + 5.0))


@pytest.fixture(scope="module")
def elastic() -> Recording:
    return moved(STIFFNESS)


@pytest.fixture(scope="module")
def rigid() -> Recording:
    return moved(0.0)


def told(recording: Recording) -> FrequencyResponse:
    found = frequency_response([recording], "slide", STANDSTILL)
    assert isinstance(found, FrequencyResponse), found
    return found


def test_the_response_is_that_of_the_two_masses_though_the_loop_answers_a_disturbance(elastic: Recording) -> None:
    found = told(elastic)
    assert found.instrument == "torque_offset"
    held = np.exp(-1j * np.pi * found.frequency * PERIOD) * np.sinc(found.frequency * PERIOD)
    apart = np.abs(20.0 * np.log10(np.abs(found.mechanics / (true_response(found.frequency, STIFFNESS) * held))))
    sure = found.sure & (found.frequency < 150.0) & (np.abs(found.frequency - ANTIRESONANCE) > 3.0)
    assert sure.sum() > 100
    assert np.sqrt(np.mean(apart[sure] ** 2)) < 0.5


def test_resonance_and_anti_resonance_are_those_of_two_masses_on_the_spring(elastic: Recording, rigid: Recording) -> None:
    shapes = told(elastic).resonances
    assert shapes.antiresonances == pytest.approx((ANTIRESONANCE,), abs=0.5)
    assert shapes.resonances == pytest.approx((RESONANCE,), abs=0.5)
    assert told(rigid).resonances.resonances == ()
    assert told(rigid).resonances.antiresonances == ()


def why(recording: Recording, standstill: dict[str, float] = STANDSTILL) -> str:
    found = frequency_response([recording], "slide", standstill)
    assert isinstance(found, NoResponse)
    return found.reason


def test_what_is_missing_is_said(rigid: Recording) -> None:
    own = rigid.columns["slide"]

    def only(*names: str) -> Recording:
        return Recording("r", rigid.info, rigid.time, {"slide": {name: own[name] for name in names}})

    assert why(only("position", "position_demand")) == "its torque was not recorded"
    assert "no demand was recorded" in why(only("position", "torque"))
    short = Recording("r", rigid.info, rigid.time[:2000], {"slide": {name: own[name][:2000] for name in own}})
    assert why(short) == "it moves in 6 windows of 0.5 s; 10 are needed"
    assert "the motion excites too few" in why(only("position", "torque", "position_demand"))


def test_an_axis_that_moves_with_others_tells_nothing(rigid: Recording) -> None:
    both = Recording("r", rigid.info, rigid.time, {"slide": rigid.columns["slide"], "lift": rigid.columns["slide"]})
    assert why(both, {"slide": 1e-4, "lift": 1e-4}) == "it moves while the others stand in 0 windows of 0.5 s; 10 are needed"
