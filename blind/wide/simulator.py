"""Moves a machine by its drives, or says what torque a motion of its motors needs: one set of equations for both.

On every axis a motor with its rotor, a transmission, a joint of the rigid bodies, friction on the joint; behind a spring a
share of it is the motor's, with a state of its own. M(q) and the bias are MuJoCo's; all else is integrated here,
semi-implicit in friction, which is stiff before it slides.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, cos, exp, floor, pi, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetwin.blind.wide.friction import ELEMENTS, level, presliding, viscous
from drivetwin.blind.wide.rigid import RigidBodies, mass_and_bias
from drivetwin.blind.wide.truth import (
    CASCADE,
    COUNTERBALANCE,
    EDDY_BRAKE,
    NEVER,
    PI_P,
    SLOSH,
    SOFT_STOP,
    TETHER,
    TORQUE,
    WANDERING_COGGING,
    Axes,
    Record,
)
from drivetwin.foundation.compiled import compiled

Array = NDArray[np.float64]

NEWTON = 6
"""Steps to the torque of a saturated motor: from where they begin, the sixth changes nothing."""

TICK = 0.00025
"""Period of the servo loops [s]."""

LEANS = 20
"""Newton's steps to where a transmission bears a joint at rest: the weight of an arm changes little over what gives way."""
NOTHING = 1e-9
"""Torque that leans a joint on no flank [N·m or N]."""

SUBSTEPS = 2
"""Steps of the integration a servo period."""


@dataclass(frozen=True)
class Demand:
    """What the drives are asked, each (k, n): position, velocity, acceleration, and torque beside what the loops give."""

    position: Array
    velocity: Array
    acceleration: Array
    torque: Array


@dataclass(frozen=True)
class Outside:
    """What acts by time alone, each (k, n): torque on the joint (or a wandering phase), factors of friction and motor.

    What presses friction harder multiplies its whole torque, also that with which it holds at rest: a joint then moves back,
    by a part of the way on which its friction yields.
    """

    pull: Array
    friction: Array
    gain: Array


@dataclass(frozen=True)
class Motion:
    """A motion (k, n) of the motors by the gear ratio with its derivatives, every `tick` seconds."""

    position: Array
    velocity: Array
    acceleration: Array
    tick: float = TICK


@dataclass(frozen=True)
class Run:
    """A motion at every servo period, each (k, n): of the motors by the gear ratio, and the torques asked and given."""

    position: Array
    velocity: Array
    acceleration: Array
    reading: Array
    asked: Array
    given: Array
    joint: Array


def quiet(count: int, axes: int) -> Outside:
    """Nothing from outside for `count` servo periods."""
    return Outside(np.zeros((count, axes)), np.ones((count, axes)), np.ones((count, axes)))


def move(bodies: RigidBodies, axes: Axes, demand: Demand, outside: Outside, start_time: float, settled: Array) -> Run:
    """Let the drives follow `demand` from rest at its first sample, where the loops hold `settled` (n,) [N·m or N]."""
    count, n = demand.position.shape
    out = np.zeros((6, count, n))
    _move(
        *bodies.addresses,
        bodies.data.qpos,
        bodies.data.qvel,
        bodies.mass,
        bodies.bias,
        axes,
        np.stack((demand.position, demand.velocity, demand.acceleration, demand.torque)),
        np.stack((outside.pull, outside.friction, outside.gain)),
        start_time,
        settled,
        out,
    )
    acceleration = np.diff(out[1], axis=0) / TICK
    return Run(out[0], out[1], np.vstack((acceleration, acceleration[-1:])), out[2], out[3], out[4], out[5])


def needed(bodies: RigidBodies, axes: Axes, motion: Motion, outside: Outside, start_time: float) -> Array:
    """Motor torque (k, n), as the drives would report it, that a motion of the motors needs; `outside` at the same moments."""
    torque = np.zeros(motion.position.shape)
    _needed(
        *bodies.addresses,
        bodies.data.qpos,
        bodies.data.qvel,
        bodies.mass,
        bodies.bias,
        axes,
        np.stack((motion.position, motion.velocity, motion.acceleration)),
        np.stack((outside.pull, outside.friction, outside.gain)),
        start_time,
        motion.tick,
        torque,
    )
    return torque


@compiled
def _is_elastic(axis: Record) -> bool:
    return axis.elasticity > 0.0 or axis.flank > 0.0


@compiled
def _ratio(axis: Record, motor: float) -> tuple[float, float, float]:
    """Where a rigid transmission has the joint, and its first and second derivative over the motor's position."""
    if axis.error_amplitude == 0.0:
        return motor, 1.0, 0.0
    wave = axis.error_order * axis.gear_ratio
    angle = wave * motor + axis.error_phase
    amplitude = axis.error_amplitude
    return motor + amplitude * sin(angle), 1.0 + amplitude * wave * cos(angle), -amplitude * wave**2 * sin(angle)


@compiled
def _transmitted(axis: Record, twist: float, rate: float) -> float:
    """Torque through a spring, a gap with flanks that never pull, or both in series."""
    torsion = axis.elasticity * twist + axis.elasticity_damping * rate
    if axis.flank == 0.0:
        return torsion
    beyond = abs(twist) - axis.gap / 2.0
    if beyond <= 0.0:
        return 0.0
    side = np.sign(twist)
    share = 1.0 if axis.elasticity == 0.0 else axis.elasticity / (axis.elasticity + axis.flank)
    damping = axis.flank_damping if axis.elasticity == 0.0 else axis.elasticity_damping
    return float(side * max(axis.flank * share * beyond + damping * rate * side, 0.0))


@compiled
def _ripple(axis: Record, motor: float) -> float:
    """What the shaft gives beside the reported torque."""
    angle = axis.gear_ratio * motor
    first = axis.ripple * sin(axis.ripple_order * angle + axis.ripple_phase)
    return axis.offset + first + axis.ripple_2 * sin(axis.ripple_2_order * angle + axis.ripple_2_phase)


@compiled
def _unsaturated(axis: Record, given: float) -> float:
    """The torque x of a motor whose current would give x + x³ / saturates_at² if nothing saturated, by Newton's method."""
    if axis.saturates_at >= NEVER:
        return given
    size, bend = abs(given), axis.saturates_at**-2
    field = min(size, (size / bend) ** (1.0 / 3.0))  # above the root, from where every step goes down to it
    for _ in range(NEWTON):
        field -= (field + bend * field**3 - size) / (1.0 + 3.0 * bend * field**2)
    return copysign(field, given)


@compiled
def _held(axis: Record, position: float) -> float:
    """Torque of weight and springs that the rigid bodies lack, against positive motion."""
    weight = axis.moment if axis.slide else axis.moment * sin(position - axis.moment_angle)
    return weight + axis.spring * (position - axis.spring_rest)


@compiled
def _pull(
    axis: Record, position: float, velocity: float, acceleration: float, series: float, step: float, inner: Array
) -> float:
    """Torque on the joint of what the library lacks; `inner` (2,) is its state."""
    if axis.foreign == WANDERING_COGGING:
        return axis.foreign_1 * sin(2.0 * pi * position / axis.foreign_2 + series)
    if axis.foreign == EDDY_BRAKE:
        part = velocity / axis.foreign_2
        return -2.0 * axis.foreign_1 * part / (1.0 + part**2)
    if axis.foreign == SOFT_STOP:
        return -axis.foreign_2 * max(position - axis.foreign_1, 0.0)
    return _dragged(axis, velocity, acceleration, step, inner) + series


@compiled
def _dragged(axis: Record, velocity: float, acceleration: float, step: float, inner: Array) -> float:
    """Torque of what has a motion or a tension of its own."""
    if axis.foreign == COUNTERBALANCE:
        inner[0] += (axis.foreign_1 * velocity - inner[0] / axis.foreign_2) * step
        return float(-inner[0])
    if axis.foreign == SLOSH:
        swing = 2.0 * pi * axis.foreign_2
        restoring = 2.0 * axis.foreign_3 * swing * inner[1] + swing**2 * inner[0]
        inner[1] -= (acceleration + restoring) * step
        inner[0] += inner[1] * step
        return float(axis.foreign_1 * restoring)
    if axis.foreign == TETHER:
        most = axis.foreign_3
        inner[0] = min(max(inner[0] + most / axis.foreign_1 * velocity * step, -most), most)
        inner[1] = min(max(inner[1] + most / axis.foreign_2 * velocity * step, -most), most)
        return float(-inner[0] - inner[1])
    return 0.0


@compiled
def _system(
    axes: Any, mass: Any, bias: Any, q: Any, v: Any, motor: Any, motor_v: Any, shaft: Any, acceleration: Any, series: Any,
    time: float, step: float, bristles: Any, after: Any, inner: Any, matrix: Any, right: Any, slopes: Any, ratios: Any,
) -> None:
    """Equations matrix u' + (all that resists) = right of the speeds u: of the motors, of the joints behind springs.

    `shaft` is what the motors give; behind a spring the joint feels the spring. `slopes` is what friction grows by with u.
    """
    n = len(axes)
    for i in range(n):
        other = axes[i].shared_with
        if other >= 0:
            shared, ratio = axes[i].shared_inertia, axes[i].shared_ratio
            mass[i, i] += shared
            mass[i, other] += shared * ratio
            mass[other, i] += shared * ratio
            mass[other, other] += shared * ratio**2
    for i in range(n):
        _, ratios[i, 0], bend = _ratio(axes[i], motor[i])
        if _is_elastic(axes[i]):
            ratios[i, 0] = 1.0
            bend = 0.0
        ratios[i, 1] = bend * motor_v[i] ** 2
    for i in range(n):
        axis = axes[i]
        stuck, slope = presliding(axis, bristles[i], level(axis, q[i], v[i], shaft[i], time), v[i], step, after[i])
        flowing, more = viscous(axis, v[i], time)
        presses = (1.0 - axis.motor_friction) * series[1, i]
        pull = _pull(axis, q[i], v[i], acceleration[i], series[0, i], step, inner[i])
        resists = bias[i] + presses * (stuck + flowing) + _held(axis, q[i]) - pull
        for j in range(n):
            resists += mass[i, j] * ratios[j, 1]
            matrix[i, j] = ratios[i, 0] * mass[i, j] * ratios[j, 0]
        slopes[i] = ratios[i, 0] ** 2 * presses * (slope + more)
        if _is_elastic(axis):
            place, turn, _ = _ratio(axis, motor[i])
            right[i] = _transmitted(axis, place - q[i], turn * motor_v[i] - v[i]) - resists
        else:
            matrix[i, i] += axis.rotor
            right[i] = shaft[i] - ratios[i, 0] * resists


@compiled
def _before(
    speed: float, axis: Record, motor: float, shaft: float, time: float, factor: float, step: float, state: Array, after: Array
) -> tuple[float, float]:
    """Friction on a motor behind which there is a spring, after a `step` at a `speed`, and its slope over that."""
    stuck, slope = presliding(axis, state, level(axis, motor, speed, shaft, time), speed, step, after)
    flowing, more = viscous(axis, speed, time)
    presses = axis.motor_friction * factor
    return presses * (stuck + flowing), presses * (slope + more)


@compiled
def _driven(
    speed: float, driven: float, axis: Record, motor: float, shaft: float, time: float, factor: float, step: float,
    state: Array, after: Array,
) -> float:
    """Speed of such a motor a step on, by the torque that is left for it; carries its friction on."""
    resists, slope = _before(speed, axis, motor, shaft, time, factor, step, state, after)
    speed += step * (driven - resists) / (axis.rotor + step * slope)
    _before(speed, axis, motor, shaft, time, factor, step, state, after)
    state[:] = after
    return speed


@compiled
def _slid(axes: Any, q: Any, v: Any, shaft: Any, time: float, step: float, bristles: Any, after: Any) -> None:
    """Carry the state of friction on to the end of a step, at the speed with which it ends."""
    for i in range(len(axes)):
        presliding(axes[i], bristles[i], level(axes[i], q[i], v[i], shaft[i], time), v[i], step, after[i])
        bristles[i, :] = after[i, :]


@compiled
def _read(axis: Record, positions: Array, k: int, i: int) -> float:
    """What the encoder says at servo period k."""
    back = axis.delay / TICK
    whole = floor(back)
    late, later = max(k - whole, 0), max(k - whole - 1, 0)
    position = positions[late, i] + (back - whole) * (positions[later, i] - positions[late, i])
    read = position + axis.eccentricity * sin(axis.gear_ratio * position + axis.eccentricity_phase)
    return float(read if axis.quantum == 0.0 else axis.quantum * np.round(read / axis.quantum))


@compiled
def _asked(axis: Record, demand: Array, k: int, i: int, read: float, speed: float, integral: Array) -> float:
    """Torque that a drive asks for, by its law, and its integral one period on; no windup at its limit."""
    late = demand[0, k, i] - read
    if axis.drive in (CASCADE, PI_P):
        error = axis.position_gain * late + axis.velocity_feedforward * demand[1, k, i] - speed
    else:
        error = demand[1, k, i] - speed
    driving = error if axis.drive in (CASCADE, PI_P) else late
    proportional = 0.0 if axis.drive in (CASCADE, PI_P) else axis.position_gain * late
    more = axis.inertia_feedforward * demand[2, k, i] + (demand[3, k, i] if axis.drive == TORQUE else 0.0)
    wanted = proportional + axis.velocity_gain * error + integral[i] + more
    if abs(wanted) < axis.drive_limit or wanted * driving < 0.0:
        integral[i] += axis.integral_gain * driving * TICK
    return float(min(max(wanted, -axis.drive_limit), axis.drive_limit))


@compiled
def _gives_way(axis: Record) -> float:
    """How far a spring, a flank, or both in series give way to a torque [rad/(N·m) or m/N]."""
    spring = 1.0 / axis.elasticity if axis.elasticity > 0.0 else 0.0
    return float(spring + (1.0 / axis.flank if axis.flank > 0.0 else 0.0))


@compiled
def _lean(model: int, data: int, qpos: Any, qvel: Any, mass: Any, bias: Any, axes: Any, motor: Any, q: Any) -> None:
    """Put joints where their motors have them at rest, those behind springs and gaps where these bear what weighs on them."""
    for i in range(len(axes)):
        q[i] = _ratio(axes[i], motor[i])[0]
    for _ in range(LEANS):
        qpos[:], qvel[:] = q, 0.0
        mass_and_bias(model, data, mass, bias)
        for i in range(len(axes)):
            axis = axes[i]
            if _is_elastic(axis):
                place = _ratio(axis, motor[i])[0]
                left = _transmitted(axis, place - q[i], 0.0) - bias[i] - _held(axis, q[i])
                if abs(left) > NOTHING and abs(place - q[i]) < axis.gap / 2.0:
                    q[i] = place + copysign(axis.gap / 2.0, left)
                else:
                    q[i] += left * _gives_way(axis)


@compiled
def _move(
    model: int, data: int, qpos: Any, qvel: Any, mass: Any, bias: Any, axes: Any, demand: Any, outside: Any,
    start_time: float, settled: Any, out: Any,
) -> None:
    n, count, step = len(axes), demand.shape[1], TICK / SUBSTEPS
    motor, motor_v, q, v = demand[0, 0].copy(), np.zeros(n), np.zeros(n), np.zeros(n)
    bristles, after, inner = np.zeros((n, ELEMENTS)), np.zeros((n, ELEMENTS)), np.zeros((n, 2))
    rubs, ahead = np.zeros((n, ELEMENTS)), np.zeros((n, ELEMENTS))
    matrix, right, slopes, ratios = np.zeros((n, n)), np.zeros(n), np.zeros(n), np.zeros((n, 2))
    integral, given, asked, shaft, acceleration = settled.copy(), settled.copy(), settled.copy(), settled.copy(), np.zeros(n)
    last, speed = demand[0, 0].copy(), np.zeros(n)
    _lean(model, data, qpos, qvel, mass, bias, axes, motor, q)
    for k in range(count):
        series = outside[:, k]
        out[0, k], out[1, k], out[5, k] = motor, motor_v, q
        for i in range(n):
            axis = axes[i]
            read = _read(axis, out[0], k, i)
            if k == 0:
                last[i] = read
            kept = exp(-TICK / axis.velocity_lag) if axis.velocity_lag > 0.0 else 0.0
            speed[i] = kept * speed[i] + (1.0 - kept) * (read - last[i]) / TICK
            last[i] = read
            asked[i] = _asked(axis, demand, k, i, read, speed[i], integral)
            out[2, k, i], out[3, k, i], out[4, k, i] = read, asked[i], given[i]
        for part in range(SUBSTEPS):
            time = start_time + k * TICK + part * step
            for i in range(n):
                axis = axes[i]
                kept = exp(-step / axis.current_lag) if axis.current_lag > 0.0 else 0.0
                limited = min(max(asked[i], -axis.torque_limit), axis.torque_limit)
                given[i] = kept * given[i] + (1.0 - kept) * limited
                shaft[i] = (1.0 + axis.constant_error) * _unsaturated(axis, given[i]) * series[2, i] + _ripple(axis, motor[i])
                qpos[i], qvel[i] = q[i], v[i]
            mass_and_bias(model, data, mass, bias)
            _system(axes, mass, bias, q, v, motor, motor_v, shaft, acceleration, series, time, step, bristles, after, inner,
                    matrix, right, slopes, ratios)
            for i in range(n):
                matrix[i, i] += step * slopes[i]
            rate = np.linalg.solve(matrix, right)
            for i in range(n):
                axis = axes[i]
                if _is_elastic(axis):
                    place, turn, _ = _ratio(axis, motor[i])
                    driven = shaft[i] - turn * _transmitted(axis, place - q[i], turn * motor_v[i] - v[i])
                    rub = motor[i], shaft[i], time, series[1, i], step, rubs[i], ahead[i]
                    motor_v[i] = _driven(motor_v[i], driven, axis, *rub)
                    motor[i] += step * motor_v[i]
                    v[i] += step * rate[i]
                    q[i] += step * v[i]
                    acceleration[i] = rate[i]
                else:
                    motor_v[i] += step * rate[i]
                    motor[i] += step * motor_v[i]
                    before = v[i]
                    q[i], turn, _ = _ratio(axis, motor[i])
                    v[i] = turn * motor_v[i]
                    acceleration[i] = (v[i] - before) / step
            _slid(axes, q, v, shaft, time, step, bristles, after)


@compiled
def _needed(
    model: int, data: int, qpos: Any, qvel: Any, mass: Any, bias: Any, axes: Any, motion: Any, outside: Any,
    start_time: float, tick: float, out: Any,
) -> None:
    n, count = len(axes), motion.shape[1]
    any_elastic = False
    for i in range(n):
        any_elastic = any_elastic or _is_elastic(axes[i])
    parts = SUBSTEPS * int(np.round(tick / TICK)) if any_elastic else 1
    step = tick / parts
    q, v, motor, motor_v = np.zeros(n), np.zeros(n), motion[0, 0].copy(), np.zeros(n)
    bristles, after, inner = np.zeros((n, ELEMENTS)), np.zeros((n, ELEMENTS)), np.zeros((n, 2))
    rubs, ahead = np.zeros((n, ELEMENTS)), np.zeros((n, ELEMENTS))
    matrix, right, slopes, ratios = np.zeros((n, n)), np.zeros(n), np.zeros(n), np.zeros((n, 2))
    shaft, none, rate, acceleration = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    rows, known = np.zeros((n, n)), np.zeros(n)
    _lean(model, data, qpos, qvel, mass, bias, axes, motor, q)
    for k in range(count):
        series = outside[:, k]
        for part in range(parts):
            time = start_time + k * tick + part * step
            for i in range(n):
                motor_v[i] = motion[1, k, i] + part * step * motion[2, k, i]
                motor[i] = motion[0, k, i] + part * step * motion[1, k, i]
                if not _is_elastic(axes[i]):
                    q[i], turn, _ = _ratio(axes[i], motor[i])
                    v[i] = turn * motor_v[i]
                qpos[i], qvel[i] = q[i], v[i]
            mass_and_bias(model, data, mass, bias)
            _system(axes, mass, bias, q, v, motor, motor_v, shaft, acceleration, series, time, step, bristles, after, inner,
                    matrix, right, slopes, ratios)
            for i in range(n):
                rows[i, :] = matrix[i, :]
                known[i] = right[i]
                rows[i, i] += step * slopes[i]
                if not _is_elastic(axes[i]):
                    rows[i, :] = 0.0
                    rows[i, i] = 1.0
                    known[i] = motion[2, k, i]
            rate[:] = np.linalg.solve(rows, known)
            for i in range(n):
                axis = axes[i]
                if _is_elastic(axis):
                    place, turn, _ = _ratio(axis, motor[i])
                    resists, _ = _before(motor_v[i], axis, motor[i], shaft[i], time, series[1, i], step, rubs[i], ahead[i])
                    rubs[i, :] = ahead[i, :]
                    torque = turn * _transmitted(axis, place - q[i], turn * motor_v[i] - v[i])
                    torque += axis.rotor * motion[2, k, i] + resists
                    v[i] += step * rate[i]
                    q[i] += step * v[i]
                    acceleration[i] = rate[i]
                else:
                    torque = shaft[i] - right[i]
                    for j in range(n):
                        torque += matrix[i, j] * rate[j]
                    acceleration[i] = ratios[i, 0] * rate[i] + ratios[i, 1]
                none[i] = torque
            shaft[:] = none
            _slid(axes, q, v, shaft, time, step, bristles, after)
        for i in range(n):
            linear = (shaft[i] - _ripple(axes[i], motor[i])) / (1.0 + axes[i].constant_error) / series[2, i]
            out[k, i] = linear + linear**3 / axes[i].saturates_at**2
