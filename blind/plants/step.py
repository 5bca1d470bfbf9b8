"""One servo period of a withheld machine, in small steps: motor, transmission, friction and rigid bodies of every axis."""

from __future__ import annotations

from math import atan2, cos, sin, sqrt

import numpy as np

from drivetwin.blind.plants.friction import lugre, maxwell_slip, sliding_level, viscous_torque
from drivetwin.blind.plants.rigid import accelerations
from drivetwin.foundation.compiled import compiled

STATE = np.dtype(
    [
        (name, "f8")
        for name in (
            *("motor_position", "motor_velocity"),  # at the joint's side of the gear
            *("position", "velocity"),  # of the joint
            *("held", "load"),  # torque of the holding brake; motor torque as the gear feels it
        )
    ]
)
"""One axis; joint side, SI."""

LOAD_LAG = 0.004
"""With which the contact that bears the load follows the motor's torque [s]."""


@compiled
def advance(  # type: ignore[no-untyped-def]  # record arrays have no static type
    axes, state, bristles, bodies, motor_torque, brakes, gains, frictions, pulls, formulation, time, steps, step
) -> None:
    """`steps` steps of `step` seconds.

    Motor torques (n,) on the shaft; brakes (n,) engaged or not; `gains`, `frictions` and `pulls` (n,) are what disturbs an axis
    from outside: factors of its motor torque and of its friction, and a torque on its joint.
    """
    count = axes.shape[0]
    inertia, swing, weight, outer = bodies
    position, velocity, torque, acceleration = np.empty(count), np.empty(count), np.empty(count), np.empty(count)
    for number in range(steps):
        for i in range(count):
            a, s = axes[i], state[i]
            shaft = _shaft_torque(a, s, gains[i] * a.gear * motor_torque[i], brakes[i], step)
            s.load += (a.gear * motor_torque[i] - s.load) * step / LOAD_LAG
            torque[i] = pulls[i] - _friction(a, s, bristles[i], frictions[i], formulation, time + number * step, step)
            torque[i] -= a.sine * sin(s.position) + a.cosine * cos(s.position) + a.constant
            torque[i] -= a.spring_stiffness * (s.position - a.spring_rest)
            if a.mesh_stiffness > 0.0:
                angle = a.error_order * a.gear * s.motor_position + a.error_phase
                slope = 1.0 + a.error_amplitude * a.error_order * a.gear * cos(angle)
                twist = s.motor_position + a.error_amplitude * sin(angle) - s.position
                through = _mesh_torque(a, twist, slope * s.motor_velocity - s.velocity)
                s.motor_velocity += step * (shaft - slope * through) / a.rotor
                torque[i] += through
            else:
                torque[i] += shaft
            position[i], velocity[i] = s.position, s.velocity
        accelerations(inertia, swing, weight, outer, position, velocity, torque, acceleration)
        for i in range(count):
            a, s = axes[i], state[i]
            s.velocity += step * acceleration[i]
            s.position += step * s.velocity
            if a.mesh_stiffness > 0.0:
                s.motor_position += step * s.motor_velocity
            else:
                s.motor_position, s.motor_velocity = s.position, s.velocity


@compiled
def _shaft_torque(a, s, torque, brake, step):  # type: ignore[no-untyped-def]
    """What the shaft gives for a reported `torque`, less what the brake holds; joint side."""
    angle = a.ripple_order * a.gear * s.motor_position + a.ripple_phase
    given = (1.0 + a.constant_error) * _less_saturation(a, torque) + a.offset
    given += a.ripple_amplitude * (sin(angle) + 0.1 * sin(2.0 * angle))
    if not brake or a.brake == 0.0:
        s.held = 0.0
        return given
    s.held += a.stiffness * s.motor_velocity * step
    s.held = min(max(s.held, -a.brake), a.brake)
    return given - s.held - a.damping * s.motor_velocity


@compiled
def _less_saturation(a, torque):  # type: ignore[no-untyped-def]
    """The torque x of a motor whose current would give x + cubic_loss x³ if nothing saturated: Cardano's formula."""
    if a.cubic_loss == 0.0:
        return torque
    half = 0.5 * torque / a.cubic_loss
    root = sqrt(half * half + (1.0 / (3.0 * a.cubic_loss)) ** 3)
    return np.cbrt(root + half) - np.cbrt(root - half)


@compiled
def _friction(a, s, bristles, scale, formulation, time, step):  # type: ignore[no-untyped-def]
    level = sliding_level(a, formulation, scale, s.position, s.velocity, s.load, time)
    viscous = viscous_torque(a, scale, s.velocity, time)
    if formulation == 0:
        return lugre(a, bristles, level, s.velocity, step) + viscous
    return maxwell_slip(a, bristles, level, s.velocity, step) + viscous


@compiled
def _mesh_torque(a, twist, rate):  # type: ignore[no-untyped-def]
    """Of a spring, or of teeth that never pull and are damped the more the deeper they are pressed (Hunt and Crossley 1975)."""
    if a.gap == 0.0:
        return a.mesh_stiffness * twist * (1.0 + a.hardening * twist * twist) + a.mesh_damping * rate
    depth = abs(twist) - 0.5 * a.gap
    if depth <= 0.0:
        return 0.0
    side = 1.0 if twist > 0.0 else -1.0
    pressed = min(1.0, depth * a.mesh_stiffness / a.coulomb)
    return side * max(0.0, a.mesh_stiffness * depth + side * a.mesh_damping * pressed * rate)


@compiled
def read_encoders(axes, state, motor_angle) -> None:  # type: ignore[no-untyped-def]
    """What discs say (n,) [rad, motor]; one whose centre is off the shaft's sees the angle from there."""
    for i in range(axes.shape[0]):
        a = axes[i]
        angle = a.gear * state[i].motor_position
        motor_angle[i] = angle
        if a.eccentricity != 0.0:
            seen = angle + a.eccentricity_phase
            motor_angle[i] += atan2(a.eccentricity * sin(seen), 1.0 - a.eccentricity * cos(seen))
