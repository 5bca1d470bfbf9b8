"""What would distinguish effects that these data do not: a motion, or a sensor."""

from __future__ import annotations

from collections.abc import Sequence

TELLS = {
    "coulomb": "strokes at several constant speeds in both directions",
    "viscous": "strokes at several constant speeds up to the highest",
    "coulomb_asymmetry": "the torque that just moves the axis from rest, in both directions; while sliding it is an offset",
    "viscous_asymmetry": "strokes at several high speeds in both directions",
    "stribeck": "slow constant-velocity strokes, below a tenth of the top speed",
    "viscous_nonlinear": "strokes at several speeds up to the highest",
    "presliding": "small slow reversals, smaller than the presliding way",
    "load_friction": "the same strokes with and without a payload",
    "position_friction": "slow strokes over the whole travel, twice from different starts",
    "temperature_drift": "the same strokes from cold until warm",
    "inertia": "accelerations without a change of speed range: short moves of several accelerations",
    "payload": "the same moves in several poses of the machine, and under gravity",
    "gravity": "standstills over the whole travel, approached from both sides",
    "spring": "slow strokes over the whole travel",
    "coupling": "moves of the one axis while the other holds, then both together",
    "backlash": "slow reversals with a light load, at several positions",
    "elasticity": "a sweep of small sines through the resonance",
    "transmission_error": "constant velocities whose waves pass at several frequencies, with and without acceleration",
    "torque_constant": "the same strokes against a known load, such as gravity or a payload",
    "torque_saturation": "accelerations up to the torque limit, in both directions",
    "torque_ripple": "very slow constant velocities over some motor turns",
    "torque_offset": "standstills approached from both sides; while sliding it is an asymmetric Coulomb friction",
    "current_bandwidth": "steps of the torque offset (60B2h)",
    "encoder_eccentricity": "constant velocities at which a motor turn passes at several frequencies",
    "delay": "the same moves with higher accelerations and jerks",
}


def tell_apart(effect: str, others: Sequence[str]) -> str:
    """The motion that would tell an effect from the others, in words."""
    if not others:
        return ""
    return "; ".join(dict.fromkeys(TELLS[name] for name in (effect, *others) if name in TELLS))


SENSORS = {
    "backlash": "an encoder on the joint, behind the transmission",
    "elasticity": "an encoder on the joint, behind the transmission",
    "transmission_error": "an encoder on the joint, behind the transmission",
    "torque_constant": "a torque sensor on the joint",
    "torque_ripple": "a torque sensor on the joint",
    "torque_offset": "a torque sensor on the joint",
    "load_friction": "a torque sensor on the joint",
    "temperature_drift": "a temperature sensor on the motor or the gear",
    "encoder_eccentricity": "a second encoder on the motor shaft",
}


def sensor_that_tells(effects: Sequence[str]) -> str:
    """The sensor that would distinguish effects, in words; empty where none is known."""
    return "; ".join(dict.fromkeys(SENSORS[name] for name in effects if name in SENSORS))
