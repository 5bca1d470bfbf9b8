"""What a static effect is predicted to cost is what it takes from the acceleration of a plant, on hinges and slides."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from effect_bench import HINGE, MOTOR, SLIDE, WHOLE, Rig, effect

from drivetwin.emulator.dynamics import Motion
from drivetwin.emulator.effects import StaticEffect, library
from drivetwin.emulator.effects.motor_effect import MotorEffect

PARAMETERS = {
    "coulomb": {"coulomb": 0.7},
    "viscous": {"viscous": 0.9},
    "coulomb_asymmetry": {"asymmetry": -0.2},
    "viscous_asymmetry": {"asymmetry": 0.3},
    "stribeck": {"static_torque": 1.1, "stribeck_velocity": 0.4, "exponent": 1.3},
    "viscous_nonlinear": {"quadratic": 0.3, "cubic": 0.2},
    "load_friction": {"coefficient": 0.15},
    "position_friction": {"amplitude": 0.3, "period": 0.07, "phase": 0.4},
    "temperature_drift": {"cold": 0.8, "time_constant": 0.5},
    "inertia": {"difference": 0.02},
    "gravity": {"moment": 1.2, "angle": 0.6},
    "spring": {"stiffness": 3.0, "rest": -0.2},
    "torque_constant": {"error": -0.08},
    "magnetic_saturation": {"knee": 3.0},
    "torque_offset": {"offset": 0.25},
    "torque_ripple": {"amplitude": 0.2, "order": 12.0, "phase": 1.0},
}
BASE = (effect("coulomb", coulomb=0.5), effect("viscous", viscous=0.4))
STATES = [(0.3, 0.5, 2.0), (0.3, -0.5, 2.0), (-0.8, 1.5, -1.0), (0.05, -0.3, -2.5)]
"""Position, velocity, reported torque; at 0.2 s of the plant's time."""


def test_every_static_effect_has_its_plant() -> None:
    assert set(PARAMETERS) == {name for name, kind in library().items() if issubclass(kind, StaticEffect)}


SHORT = 1e-6
"""Time step, for accelerations at an instant [s]."""
MODELS = {
    kind: xml.format(joint="", gravity=0.0).replace("0.000125", f"{SHORT:f}")
    for kind, xml in (("hinge", HINGE), ("slide", SLIDE))
}


def acceleration(rig: Rig, position: float, velocity: float, torque: float) -> float:
    """Over one short step."""
    rig.start(position, velocity)
    rig.data.time = 0.2
    rig.step(torque)
    return (rig.velocity - velocity) / SHORT


@pytest.mark.parametrize("kind", MODELS)
@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("name", PARAMETERS)
def test_prediction_is_the_plants(name: str, state: tuple[float, float, float], kind: str) -> None:
    changed = effect(name, **PARAMETERS[name])
    base = [one for one in BASE if one.effect.name != name]
    without, with_it = Rig(MODELS[kind], *BASE), Rig(MODELS[kind], *base, changed)
    plain, real = acceleration(without, *state), acceleration(with_it, *state)
    position, velocity, torque = (np.array([value]) for value in state)
    inertia = np.array([WHOLE])
    motion = Motion(position, velocity, np.array([real]), torque, np.array([0.2]), inertia * real, inertia, MOTOR)
    assert isinstance(changed.effect, StaticEffect)
    predicted = changed.effect.predict(motion, without.mechanism.dynamics["axis"])
    assert WHOLE * (plain - real) == pytest.approx(float(predicted[0]), rel=1e-4, abs=1e-4)


MOTORS = ("magnetic_saturation", "torque_offset", "torque_ripple", "torque_constant")


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("order", permutations(MOTORS), ids="-".join)
def test_effects_of_a_motor_bend_each_other_in_any_order(order: tuple[str, ...], state: tuple[float, float, float]) -> None:
    """An offset costs the more current the more the motor is saturated: what they cost one after the other is the plant's."""
    effects = [effect(name, **PARAMETERS[name]) for name in order]
    without, with_them = Rig(MODELS["hinge"], *BASE), Rig(MODELS["hinge"], *BASE, *effects)
    plain, real = acceleration(without, *state), acceleration(with_them, *state)
    position, velocity, torque = (np.array([value]) for value in state)
    inertia = np.array([WHOLE])
    motion = Motion(position, velocity, np.array([real]), torque, np.array([0.2]), inertia * real, inertia, MOTOR)
    axis, predicted = without.mechanism.dynamics["axis"], 0.0
    for one in effects:
        assert isinstance(one.effect, MotorEffect)
        predicted += float(one.effect.predict(motion, axis)[0])
        axis = one.effect.on(axis)
    assert WHOLE * (plain - real) == pytest.approx(predicted, rel=1e-4, abs=1e-4)
