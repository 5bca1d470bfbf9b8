"""The loops against control theory done elsewhere: an ODE solver, a PID, and the numbers of the sensors."""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from drivetwin.emulator.drive.servo import (
    POSITION,
    SERVO_PERIOD,
    TORQUE_OFFSET,
    VELOCITY,
    VELOCITY_OFFSET,
    Loop,
    Servo,
    ServoBank,
    encoder_quantum,
    filter_share,
)
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.plant import Plant

Array = NDArray[np.float64]

KP, KV, TN = 40.0, 0.02, 0.02
"""Position gain [1/s], velocity gain [N·m·s/rad], integral time [s], on the motor."""
INERTIA = 5e-5
"""On the motor [kg·m²]."""
FILTER, LAG = 1.0 / (2.0 * pi * 300.0), 0.0005


def bank(seed: int = 0, **changed: float) -> ServoBank:
    """The loops of one axis with an ideal encoder, no filter, no lag, no noise, but for what is given."""
    servos = ServoBank(1, seed)
    values = {
        "position_gain": KP,
        "velocity_gain": KV,
        "integral_rate": 1.0 / TN,
        "velocity_feedforward": 1.0,
        "velocity_filter": 1.0,
        "current_filter": 1.0,
        "torque_limit": 1e9,
        "encoder_quantum": 1e-12,
        "torque_noise": 0.0,
        "torque_quantum": 1e-12,
    }
    for name, value in (values | changed).items():
        servos.parameters[0][name] = value
    return servos


def follow(servos: ServoBank, loop: Loop, demand: Array, position: Callable[[int, float], float]) -> tuple[Array, Array]:
    """Run the loops along `demand` (periods, 4); `position(step, torque)` moves the motor. Motor and measured torque."""
    servos.loops[0] = loop
    servos.start_cycle(1)
    angle, torque = np.zeros(1), np.zeros(1)
    given, measured = [], []
    for step, row in enumerate(demand):
        angle[0] = position(step, float(torque[0]))
        servos.demand[0, 0] = row
        servos.run(0, angle, torque)
        given.append(float(torque[0]))
        measured.append(float(servos.state[0]["torque_actual"]))
    return np.array(given), np.array(measured)


def smooth_move(seconds: float, amplitude: float) -> tuple[Array, Array]:
    """(periods, 4) demand of a raised cosine [rad], and its time."""
    time = SERVO_PERIOD * np.arange(1, round(seconds / SERVO_PERIOD) + 1, dtype=np.float64)
    rate = 2.0 * pi / seconds
    demand = np.zeros((len(time), 4))
    demand[:, POSITION] = amplitude * 0.5 * (1.0 - np.cos(rate * time))
    demand[:, VELOCITY] = amplitude * 0.5 * rate * np.sin(rate * time)
    return demand, time


def test_cascade_is_the_textbooks_differential_equation() -> None:
    """Rigid stage without friction, against an ODE solver: x'' = T/J, LAG T' = PI(v) - T, FILTER vf' = v - vf.

    In each period the loops compare the demand of its end with the angle of its beginning: the equation's demand is a period
    ahead.
    """
    machine = load_machine("stage")
    plant = Plant(machine, ())
    inertia = float(plant.truth()["slide"]["inertia"]) / machine.axes["slide"].gear_ratio ** 2
    gain = 8500.0 / machine.axes["slide"].gear_ratio ** 2
    servos = bank(
        velocity_gain=gain, velocity_filter=filter_share(FILTER), current_filter=filter_share(LAG), integral_rate=1.0 / 0.03
    )
    start = float(plant.motor_position[0])
    servos.state[0]["position"] = start
    demand, time = smooth_move(0.4, 60.0)
    servos.loops[0] = Loop.POSITION
    errors, torques = [], []
    for first in range(0, len(time), 8):
        servos.start_cycle(8)
        servos.demand[:8, 0] = demand[first : first + 8]
        servos.demand[:8, 0, POSITION] += start
        plant.advance(servos)
        errors.append(float(servos.state[0]["following_error"]))
        torques.append(float(servos.state[0]["torque"]))
    sampled = time[7::8] - SERVO_PERIOD  # the loops of a period see what the plant was at its beginning

    def wanted(t: Array | float) -> tuple[Array, Array]:
        rate = 2.0 * pi / 0.4
        return 30.0 * (1.0 - np.cos(rate * t)), 30.0 * rate * np.sin(rate * t)

    def slope(t: float, state: Array) -> list[float]:
        angle, speed, filtered, integral, torque = state
        wanted_angle, wanted_speed = wanted(t + SERVO_PERIOD)
        error = KP * (wanted_angle - angle) + wanted_speed - filtered
        torque_rate = (gain * error + integral - torque) / LAG
        return [speed, torque / inertia, (speed - filtered) / FILTER, gain / 0.03 * error, torque_rate]

    solution = solve_ivp(slope, (0.0, 0.4), np.zeros(5), t_eval=sampled, rtol=1e-9, atol=1e-12, max_step=1e-3)
    true_error = wanted(sampled + SERVO_PERIOD)[0] - solution.y[0]
    assert np.abs(np.array(torques) - solution.y[4]).max() < 0.01 * np.abs(solution.y[4]).max()
    assert np.abs(np.array(errors) - true_error).max() < 0.01 * np.abs(true_error).max()


def test_unsaturated_cascade_is_a_pid() -> None:
    """kp = Kv (Kp + 1/Tn), kv = Kv, ki = Kv Kp / Tn on the position error, along any motion; a sample of delay in 1/Tn."""
    demand, time = smooth_move(0.2, 3.0)
    demand[:, VELOCITY] = np.diff(demand[:, POSITION], prepend=0.0) / SERVO_PERIOD
    motion = 1.4 * np.sin(11.0 * time) * time + 0.3 * time
    torque, _ = follow(bank(encoder_quantum=1e-13), Loop.POSITION, demand, lambda step, _: float(motion[step]))
    error = demand[:, POSITION] - motion
    rate = np.diff(error, prepend=0.0) / SERVO_PERIOD
    integral = SERVO_PERIOD * (np.cumsum(error) - error)
    delayed = np.concatenate([[0.0], error[:-1]])
    pid = KV * KP * error + KV / TN * delayed + KV * rate + KV * KP / TN * integral
    assert np.abs(torque - pid).max() < 1e-8
    kp, kv, ki = KV * (KP + 1.0 / TN), KV, KV * KP / TN
    textbook = kp * error + kv * rate + ki * integral
    assert np.abs(torque - textbook).max() <= KV / TN * np.abs(np.diff(error)).max() + 1e-8


def test_offsets_are_added_where_the_standard_adds_them() -> None:
    """60B1h to the velocity demand, 60B2h to the torque demand."""
    demand = np.zeros((3, 4))
    demand[:, VELOCITY_OFFSET], demand[:, TORQUE_OFFSET] = 2.0, 0.125
    torque, _ = follow(bank(integral_rate=0.0), Loop.POSITION, demand, lambda *_: 0.0)
    assert torque == pytest.approx(KV * 2.0 + 0.125, abs=1e-9)


def test_velocity_loop_ignores_the_position() -> None:
    demand = np.zeros((3, 4))
    demand[:, POSITION], demand[:, VELOCITY] = 77.0, 2.0
    torque, _ = follow(bank(integral_rate=0.0), Loop.VELOCITY, demand, lambda *_: 0.0)
    assert torque == pytest.approx(KV * 2.0, abs=1e-9)


def test_off_asks_no_torque_and_forgets_the_integral() -> None:
    servos = bank()
    demand = np.full((50, 4), 1.0)
    follow(servos, Loop.POSITION, demand, lambda *_: 0.0)
    assert servos.state[0]["integral"] > 0.0
    torque, _ = follow(servos, Loop.OFF, demand, lambda *_: 0.0)
    assert not torque.any()
    assert servos.state[0]["integral"] == 0.0
    assert servos.state[0]["following_error"] == 0.0


def test_current_loop_is_a_first_order_lag() -> None:
    demand = np.zeros((40, 4))
    demand[:, TORQUE_OFFSET] = 1.0
    servos = bank(current_filter=filter_share(LAG), velocity_gain=0.0)
    torque, _ = follow(servos, Loop.VELOCITY, demand, lambda *_: 0.0)
    elapsed = SERVO_PERIOD * np.arange(1, 41, dtype=np.float64)
    assert torque == pytest.approx(1.0 - np.exp(-elapsed / LAG), abs=1e-12)


@pytest.mark.parametrize("increments", [4096, 1048576])
def test_encoder_counts_whole_increments(increments: int) -> None:
    quantum = encoder_quantum(increments)
    servos = bank(encoder_quantum=quantum)
    angles = np.linspace(-0.01, 0.01, 501)
    counted = []
    for angle in angles:
        follow(servos, Loop.OFF, np.zeros((1, 4)), lambda *_, angle=angle: angle)
        counted.append(float(servos.state[0]["position"]))
    counts = np.array(counted) * increments / (2.0 * pi)
    assert np.abs(counts - np.round(counts)).max() < 1e-9
    behind = angles - np.array(counted)
    assert behind.min() >= -1e-15
    assert behind.max() < quantum


def test_velocity_is_the_filtered_difference_of_counts() -> None:
    """A constant speed is measured without bias, with a ripple of one count through the filter."""
    quantum = encoder_quantum(65536)
    servos = bank(encoder_quantum=quantum, velocity_filter=filter_share(FILTER))
    seen = []
    for step in range(4000):
        follow(servos, Loop.OFF, np.zeros((1, 4)), lambda *_, step=step: 1.2345 * step * SERVO_PERIOD)
        seen.append(float(servos.state[0]["velocity"]))
    steady = np.array(seen[400:])
    assert steady.mean() == pytest.approx(1.2345, rel=1e-3)
    assert np.abs(steady - 1.2345).max() < filter_share(FILTER) * quantum / SERVO_PERIOD


def test_current_sensor_noise_and_resolution() -> None:
    demand = np.zeros((40_000, 4))
    demand[:, TORQUE_OFFSET] = 0.3
    servos = bank(torque_noise=0.004, torque_quantum=0.0005, velocity_gain=0.0)
    given, measured = follow(servos, Loop.VELOCITY, demand, lambda *_: 0.0)
    assert not np.ptp(given)  # the noise is the sensor's, not the motor's
    noise = measured - 0.3
    expected = np.hypot(0.004, 0.0005 / np.sqrt(12.0))
    assert noise.std() == pytest.approx(expected, rel=4.0 / np.sqrt(2.0 * len(noise)))
    assert abs(noise.mean()) < 4.0 * expected / np.sqrt(len(noise))
    assert np.abs(np.corrcoef(noise[:-1], noise[1:])[0, 1]) < 4.0 / np.sqrt(len(noise))
    steps = measured / 0.0005
    assert np.abs(steps - np.round(steps)).max() < 1e-9


def test_noise_is_the_seeds() -> None:
    demand = np.zeros((100, 4))

    def run(seed: int) -> Array:
        servos = bank(seed, torque_noise=1.0)
        return follow(servos, Loop.VELOCITY, demand, lambda *_: 0.0)[1]

    assert np.array_equal(run(3), run(3))
    assert not np.array_equal(run(3), run(4))


def move(servos: ServoBank, demand: Array, loop: Loop = Loop.POSITION) -> tuple[Array, Array]:
    """Position and torque of a free inertia under the loops."""
    state = [0.0, 0.0]
    seen = []

    def inertia(_: int, torque: float) -> float:
        state[1] += torque / INERTIA * SERVO_PERIOD
        state[0] += state[1] * SERVO_PERIOD
        seen.append(state[0])
        return state[0]

    torque, _ = follow(servos, loop, demand, inertia)
    return np.array(seen), torque


def test_torque_limit() -> None:
    step = np.zeros((4000, 4))
    step[:, POSITION] = 10.0
    _, torque = move(bank(torque_limit=0.05), step)
    assert np.abs(torque).max() == pytest.approx(0.05)
    assert np.ptp(torque) == pytest.approx(0.1)


def test_mujocos_pid_actuator_replays_the_cascade() -> None:
    """The native controller, in closed loop on the same inertia, with velocity demand and torque feed-forward."""
    gains = f'kp="{KV * (KP + 1.0 / TN)}" kv="{KV}" ki="{KV * KP / TN}"'
    model = mujoco.MjModel.from_xml_string(f"""<mujoco>
      <option timestep="{SERVO_PERIOD}" gravity="0 0 0"/>
      <worldbody><body><joint name="motor" axis="0 0 1" armature="{INERTIA}"/>
      <geom type="sphere" size="0.1" mass="1e-9"/></body></worldbody>
      <actuator><pid joint="motor" input="pos vel ff" {gains}/></actuator></mujoco>""")
    data = mujoco.MjData(model)
    demand, time = smooth_move(0.3, 5.0)
    demand[:, TORQUE_OFFSET] = 0.01 * np.sin(40.0 * time)
    theirs, their_torque = [], []
    for row in demand:
        data.ctrl[:] = row[[POSITION, VELOCITY, TORQUE_OFFSET]]
        mujoco.mj_step(model, data)
        theirs.append(float(data.qpos[0]))
        their_torque.append(float(data.actuator_force[0]))
    ours, torque = move(bank(), demand)  # positions at the beginning of a period, theirs are at its end
    half_a_period = 0.5 * SERVO_PERIOD * demand[:, VELOCITY].max()  # how far sampled demands of angle and speed disagree
    assert np.abs(ours[1:] - theirs[:-1]).max() < half_a_period
    assert np.abs(torque - their_torque).max() < 0.01 * np.abs(torque).max()


def test_integrator_does_not_wind_up() -> None:
    """A speed step of a quarter of a second at the limit: the integral waits, and the speed overshoots by that of the end only.

    The linear range begins 1 rad/s (limit by gain) before the target; a wound-up integral would overshoot by tens of rad/s.
    """
    servos = bank(torque_limit=0.02)
    step = np.zeros((6000, 4))
    step[:, VELOCITY] = 100.0
    angles, torque = move(servos, step, Loop.VELOCITY)
    speed = np.diff(angles) / SERVO_PERIOD
    assert np.mean(torque >= 0.02) > 0.3
    assert speed.max() < 100.0 + 0.3
    assert speed[-1] == pytest.approx(100.0, abs=1e-3)


def test_integrator_waits_while_limited() -> None:
    servos = bank(torque_limit=0.01)
    demand = np.zeros((200, 4))
    demand[:, VELOCITY] = 100.0
    follow(servos, Loop.VELOCITY, demand, lambda *_: 0.0)
    assert servos.state[0]["integral"] == 0.0


def test_torque_loop_gives_the_limited_demand() -> None:
    demand = np.zeros((3, 4))
    demand[:, TORQUE_OFFSET] = [0.02, -0.3, 0.3]
    torque, _ = follow(bank(torque_limit=0.1), Loop.TORQUE, demand, lambda *_: 0.0)
    assert torque == pytest.approx([0.02, -0.1, 0.1])


def test_cycles_longer_than_the_first_arrays() -> None:
    servos = ServoBank(2, seed=0)
    servos.start_cycle(2000)
    assert Servo(servos, 1).demand.shape == (2000, 4)
    assert Servo(servos, 0).positions.shape == (2000,)
