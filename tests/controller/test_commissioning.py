"""Frequency responses over the bus against the plant's own, linearised step by step about the motion of the measurement."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import can
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from drivetwin.bus.channel import InprocBus
from drivetwin.controller.commissioning import TRAVEL_SPEED, Commissioned, commission
from drivetwin.controller.machine import load_machine
from drivetwin.controller.pacing import Lockstep
from drivetwin.controller.progress import Progress
from drivetwin.controller.session import session_on
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.drive.servo import SERVO_PERIOD
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine as load_virtual_machine
from drivetwin.emulator.plant import Plant
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.identification.frequency.bode import Bode, bode, loops_over
from drivetwin.identification.frequency.cascade import Cascade, cascade_of
from drivetwin.identification.frequency.margins import decibel, margins
from drivetwin.identification.frequency.phasors import response
from drivetwin.identification.frequency.tuning import POSITION_GOAL, VELOCITY_GOAL

Complex = NDArray[np.complex128]

SPLINE = BSpline.basis_element([0.0, 1.0, 2.0, 3.0, 4.0])
"""How a servoone goes on the way to set-points: a uniform cubic B-spline, over cycles."""

STIFFNESS, DAMPING = 1.0e6, 400.0
"""Of the spring that the elastic stage has between motor and slide [N/m], [N·s/m]: its resonance is at about 30 Hz."""


@dataclass(frozen=True)
class Case:
    """An axis that was commissioned over the bus, and the effects file of its plant."""

    axis: str
    machine: str
    effects: Path
    measured: Commissioned

    def bode(self) -> Bode:
        """What the controller makes of it."""
        info = self.measured.excited.recording.info
        return bode(response(self.measured.excited), cascade_of(self.axis, info.axes[self.axis].drive), info.sample_period)


def _commissioned(machine: str, axis: str, profile: str, effects: Path) -> Case:
    def connected(transmit: Callable[[can.Message], None]) -> VirtualMachine:
        virtual = load_virtual_machine(machine)
        built = VirtualMachine(virtual, load_profile(profile), read_effects(effects), SyncClock(), 0, transmit)
        built.power_on()
        return built

    bus = InprocBus(connected)
    with session_on(bus, load_machine(machine), load_profile(profile), Lockstep(), None, Progress(), None) as session:
        return Case(axis, machine, effects, commission(session, axis, seed=0))


@pytest.fixture(scope="module")
def rigid() -> Case:
    return _commissioned("stage", "slide", "servoone", load_virtual_machine("stage").effects_path)


@pytest.fixture(scope="module")
def elastic(tmp_path_factory: pytest.TempPathFactory) -> Case:
    own = json.loads(load_virtual_machine("stage").effects_path.read_text())
    spring = {"stiffness": {"value": STIFFNESS, "unit": "N/m"}, "damping": {"value": DAMPING, "unit": "N·s/m"}}
    own["effects"].append({"effect": "elasticity", "axis": "slide", "parameters": spring})
    path = tmp_path_factory.mktemp("elastic") / "effects.json"
    path.write_text(json.dumps(own))
    return _commissioned("stage", "slide", "cia402-full", path)


def _true_mechanics(case: Case, frequency: NDArray[np.float64]) -> Complex:
    """Motor speed over motor torque (m,), joint side: central differences of one step of the plant, at the travel's speed."""
    machine = load_virtual_machine(case.machine)
    plant = Plant(machine, read_effects(case.effects))
    model, data, mechanism = plant.model, plant.data, plant._mechanism
    gear = machine.axes[case.axis].gear_ratio
    speed = TRAVEL_SPEED * load_machine(case.machine).axes[case.axis].max_speed
    rest = data.qpos.copy()

    def after(state: NDArray[np.float64], torque: float) -> NDArray[np.float64]:
        data.qpos[:], data.qvel[:] = rest + state[: model.nq], state[model.nq :]
        mechanism.brakes[:] = False
        mechanism.read()
        mechanism.motor_torque[:] = torque / gear
        mechanism.step()
        return np.concatenate([data.qpos - rest, data.qvel])

    states = model.nq + model.nv
    about = np.concatenate([np.zeros(model.nq), np.full(model.nv, speed)])
    steps = np.concatenate([np.full(model.nq, 1e-7), np.full(model.nv, 1e-5)])
    matrix = np.column_stack(
        [
            (after(about + step, 0.0) - after(about - step, 0.0)) / (2.0 * size)
            for size, step in zip(steps, np.diag(steps), strict=True)
        ]
    )
    push = (after(about, 1.0) - after(about, -1.0)) / 2.0
    motor = np.zeros(states)
    motor[mechanism._motor_index[0]] = 1.0
    turn = np.exp(2j * np.pi * frequency * SERVO_PERIOD)
    sampled = np.array([motor @ np.linalg.solve(z * np.eye(states) - matrix, push) for z in turn])
    held = np.exp(-1j * np.pi * frequency * SERVO_PERIOD) * np.sinc(frequency * SERVO_PERIOD)
    return np.asarray(2j * np.pi * frequency * sampled / held)


def _true_loops(mechanics: Complex, frequency: NDArray[np.float64], drive: Cascade) -> tuple[Complex, Complex]:
    """Open velocity and position loop (m,) of the servo's own difference equations about the true mechanics."""
    back = np.exp(-2j * np.pi * frequency * SERVO_PERIOD)
    speed_share, current_share = (-np.expm1(-SERVO_PERIOD / lag) for lag in (drive.velocity_filter, 0.0005))
    speed = speed_share / (1.0 - (1.0 - speed_share) * back) * (1.0 - back) / SERVO_PERIOD
    current = current_share / (1.0 - (1.0 - current_share) * back)
    held = np.exp(-1j * np.pi * frequency * SERVO_PERIOD) * np.sinc(frequency * SERVO_PERIOD)
    rate = 0.0 if drive.integral_time is None else 1.0 / drive.integral_time
    torque = drive.velocity_gain * (1.0 + rate * SERVO_PERIOD * back / (1.0 - back)) * current * held
    angle = torque * mechanics / (2j * np.pi * frequency)
    return np.asarray(angle * speed), np.asarray(angle * drive.position_gain / (1.0 + angle * speed))


def _apart(measured: Complex, true: Complex) -> tuple[float, float]:
    """Worst gain error [dB] and phase error [degrees]."""
    ratio = measured / true
    return float(np.abs(decibel(ratio)).max()), float(np.degrees(np.abs(np.angle(ratio))).max())


@pytest.mark.parametrize("name", ["rigid", "elastic"])
def test_mechanics_and_loops_are_the_plants_within_half_a_decibel_and_five_degrees(
    name: str, request: pytest.FixtureRequest
) -> None:
    case: Case = request.getfixturevalue(name)
    found = case.bode()
    sure = found.sure
    frequency = found.frequency[sure]
    mechanics = _true_mechanics(case, frequency)
    velocity, position = _true_loops(mechanics, frequency, found.cascade)
    for measured, true in ((found.mechanics, mechanics), (found.velocity, velocity), (found.position, position)):
        gain, phase = _apart(measured[sure], true)
        assert gain < 0.5
        assert phase < 5.0
    assert frequency.min() <= 3.0
    assert frequency.max() == pytest.approx(200.0)


def test_loops_cut_open_by_measurement_are_those_of_the_told_gains_over_the_mechanics(rigid: Case) -> None:
    found = rigid.bode()
    sure = found.sure
    velocity, position = loops_over(found.mechanics[sure], found.frequency[sure], found.cascade)
    for measured, composed in ((found.velocity, velocity), (found.position, position)):
        gain, phase = _apart(measured[sure], composed)
        assert gain < 0.5
        assert phase < 5.0


def test_current_loop_of_a_drive_that_does_not_tell_it_is_found(rigid: Case) -> None:
    told = rigid.measured.excited.recording.info.axes["slide"].drive
    assert told is not None
    assert told.current_loop_time_constant is None
    assert rigid.bode().cascade.current_lag == pytest.approx(0.0005, rel=0.02)


def test_inertia_is_that_of_the_model_though_the_load_is_on_a_spring(rigid: Case, elastic: Case) -> None:
    virtual = load_virtual_machine("stage")
    true = Plant(virtual, read_effects(virtual.effects_path)).truth()["slide"]["inertia"]
    assert rigid.measured.evaluate().inertia == pytest.approx(true, rel=0.01)
    assert elastic.measured.evaluate().inertia == pytest.approx(true, rel=0.03)


def test_resonances_are_those_of_two_masses_on_the_spring(rigid: Case, elastic: Case) -> None:
    axis = load_virtual_machine("stage").axes["slide"]
    motor = axis.motor.inertia * axis.gear_ratio**2
    virtual = load_virtual_machine("stage")
    load = Plant(virtual, read_effects(virtual.effects_path)).truth()["slide"]["inertia"] - motor
    antiresonance = np.sqrt(STIFFNESS / load) / (2.0 * np.pi)
    resonance = np.sqrt(STIFFNESS * (1.0 / load + 1.0 / motor)) / (2.0 * np.pi)
    found = elastic.measured.evaluate().resonances
    assert found.antiresonances == pytest.approx((antiresonance,), abs=1.0)
    assert found.resonances == pytest.approx((resonance,), abs=1.5)
    assert rigid.measured.evaluate().resonances.resonances == ()


def test_step_is_that_of_the_linear_loops(rigid: Case) -> None:
    found = rigid.bode().cascade
    mass = rigid.measured.evaluate().inertia
    position = speed = measured = torque = count = 0.0
    simulated = []
    for period in range(8 * 60):
        demand = sum(float(SPLINE(period / 8.0 - late)) for late in range(4) if 0.0 <= period / 8.0 - late <= 4.0)
        demand = demand if period < 8 * 3 else 1.0
        measured += -np.expm1(-SERVO_PERIOD / found.velocity_filter) * ((position - count) / SERVO_PERIOD - measured)
        count = position
        wanted = found.velocity_gain * (found.position_gain * (demand - count) - measured)
        torque += -np.expm1(-SERVO_PERIOD / 0.0005) * (wanted - torque)
        speed += SERVO_PERIOD * torque / mass
        position += SERVO_PERIOD * speed
        simulated.append(position)
    step = rigid.measured.evaluate().step
    assert step.position[1:60] == pytest.approx(np.array(simulated)[7::8][:59], abs=0.03)


def test_torque_over_speed_is_the_plants_friction(rigid: Case) -> None:
    virtual = load_virtual_machine("stage")
    law = Plant(virtual, read_effects(virtual.effects_path))._mechanism.dynamics["slide"].friction
    curve = [point for point in rigid.measured.evaluate().curve if abs(point.speed) > 0.04]
    assert len(curve) == 10
    for point in curve:
        way = np.sign(point.speed)
        true = way * (
            law.coulomb + way * law.coulomb_asymmetry + (law.viscous + way * law.viscous_asymmetry) * abs(point.speed)
        )
        assert point.torque == pytest.approx(true, rel=0.03)


@pytest.mark.parametrize("name", ["rigid", "elastic"])
def test_proposed_gains_keep_their_margins_over_the_true_mechanics(name: str, request: pytest.FixtureRequest) -> None:
    case: Case = request.getfixturevalue(name)
    proposal = case.measured.evaluate().proposal
    assert proposal is not None
    frequency = np.arange(1.0, 1000.0, 0.5)
    velocity, position = _true_loops(_true_mechanics(case, frequency), frequency, proposal.cascade)
    for loop, goal in ((velocity, VELOCITY_GOAL), (position, POSITION_GOAL)):
        true = margins(frequency, loop)
        assert true.phase is not None
        assert true.phase > goal.phase - 3.0
        assert true.gain is None or true.gain > goal.gain - 1.0
        assert true.peak < goal.peak + 0.5
