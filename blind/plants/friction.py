"""Friction as a dynamic model of its own: LuGre, or a Maxwell-slip model with a rational Stribeck curve.

LuGre: Canudas de Wit, Olsson, Åström, Lischinsky, IEEE T-AC 40(3), 1995. Maxwell slip: Al-Bender, Lampaert, Swevers, IEEE
T-AC 50(11), 2005, `ELEMENTS` of growing strength, Stribeck's curve as Hess and Soom, J. Tribology 112,
1990, write it.
"""

from __future__ import annotations

from math import exp, log, pi, sin, sqrt, tanh

from drivetwin.foundation.compiled import compiled

LUGRE, MAXWELL_SLIP = 0, 1
"""Formulations."""

ELEMENTS = 7
"""Of the Maxwell-slip model."""


@compiled
def sliding_level(a, formulation, scale, position, velocity, load, time):  # type: ignore[no-untyped-def]
    """Torque at which the joint slides in the direction of `velocity`, without what is viscous; > 0."""
    speed = abs(velocity)
    level = a.coulomb
    if a.stribeck_velocity > 0.0:
        ratio = speed / a.stribeck_velocity
        fall = exp(-(ratio**a.exponent)) if formulation == 0 else 1.0 / (1.0 + ratio**a.exponent)
        level += (a.static_torque - a.coulomb) * fall
    level += a.load_coefficient * sqrt(load * load + 1e-4 * a.coulomb * a.coulomb)
    wave = 2.0 * pi * position / a.position_period + a.position_phase
    level += a.position_amplitude * (sin(wave) + 0.15 * sin(2.0 * wave))
    level += a.coulomb_asymmetry if velocity > 0.0 else -a.coulomb_asymmetry
    return max(1e-3 * a.coulomb, level * warmth(a, time) * scale)


@compiled
def warmth(a, time):  # type: ignore[no-untyped-def]
    """Factor of all friction: (1 + cold) when switched on, falling to 1 as viscosity does in a body that warms up."""
    return exp(log(1.0 + a.cold) * exp(-time / a.warming_time)) if a.cold != 0.0 else 1.0


@compiled
def viscous_torque(a, scale, velocity, time):  # type: ignore[no-untyped-def]
    """Torque that grows with the speed."""
    slope = a.viscous + a.viscous_asymmetry * tanh(velocity / a.smooth_velocity)
    speed = abs(velocity)
    return warmth(a, time) * scale * (slope + a.quadratic * speed + a.cubic * speed * speed) * velocity


@compiled
def lugre(a, bristles, level, velocity, step):  # type: ignore[no-untyped-def]
    """Torque of one bristle, whose deflection is solved exactly over a step of constant velocity."""
    before = bristles[0]
    if velocity != 0.0:
        steady = level / a.stiffness if velocity > 0.0 else -level / a.stiffness
        bristles[0] = steady + (before - steady) * exp(-abs(velocity) * a.stiffness * step / level)
    rate = (bristles[0] - before) / step
    ratio = velocity / a.smooth_velocity
    return a.stiffness * bristles[0] + a.damping * rate * exp(-ratio * ratio)


@compiled
def maxwell_slip(a, bristles, level, velocity, step):  # type: ignore[no-untyped-def]
    """Torque of springs side by side that slip one after the other; the i-th bears i shares and is as stiff as any."""
    count = bristles.shape[0]
    share = 2.0 * level / (count * (count + 1))
    torque = 0.0
    for i in range(count):
        most = (i + 1) * share
        force = bristles[i] + a.stiffness / count * velocity * step
        if abs(force) < most:
            torque += a.damping / count * velocity
        else:
            force = most if force > 0.0 else -most
        bristles[i] = force
        torque += force
    return torque
