"""A cycle in one compiled call: the same, bit for bit, as its parts called one by one and MuJoCo's own step from Python."""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray
from plant_bench import placed

from drivetwin.emulator.drive.servo import Loop, ServoBank
from drivetwin.emulator.dynamics import AxisDynamics
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.emulator.effects.coulomb import Coulomb
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.plant import Plant

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Draught:
    """An equation of state in Python."""

    def resistance(self, position: Array, velocity: Array, time: Array) -> Array:
        return np.asarray(0.3 * np.sin(3.0 * position) + 0.1 * velocity * np.exp(-time))


@dataclass(frozen=True)
class Draughty(Coulomb):
    """Friction, and what is written in Python beside it."""

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        return replace(super().add_to(spec, joint, axis), resisting=(Draught(),))


EFFECTS = {
    "none": (),
    "friction": (placed("rotate", "coulomb", coulomb=1.9), placed("rotate", "presliding", stiffness=3000.0, damping=3.0)),
    "warming": (placed("rotate", "coulomb", coulomb=1.9), placed("rotate", "temperature_drift", cold=0.5, time_constant=0.05)),
    "motor": (placed("lift", "torque_constant", error=0.05), placed("rotate", "torque_ripple", amplitude=0.2, order=6.0)),
    "gear": (placed("rotate", "transmission_error", amplitude=1e-3, order=2.0), placed("stretch", "gravity", moment=0.3)),
    "elastic": (placed("rotate", "elasticity", stiffness=3e4, damping=5.0),),
    "encoder": (placed("rotate", "delay", delay=3e-4), placed("rotate", "encoder_eccentricity", amplitude=1e-4)),
    "in Python": (PlacedEffect("rotate", Draughty(1.0), {}), placed("rotate", "elasticity", stiffness=3e4, damping=5.0)),
}


@pytest.mark.parametrize("effects", EFFECTS.values(), ids=EFFECTS)
def test_a_cycle_is_its_parts_one_by_one(effects: tuple[PlacedEffect, ...]) -> None:
    whole, parts = Plant(load_machine("scara"), effects), Plant(load_machine("scara"), effects)
    servos, stepped = drives(), drives()
    for cycle in range(40):
        for bank in (servos, stepped):
            bank.demand[:, :, 3] = np.array([0.6, 0.15, 0.1]) * np.sin(0.1 * cycle)
        whole.advance(servos)
        one_by_one(parts, stepped)
        np.testing.assert_array_equal(whole.data.qpos, parts.data.qpos)
        np.testing.assert_array_equal(whole.data.qvel, parts.data.qvel)
        np.testing.assert_array_equal(servos.state, stepped.state)
        np.testing.assert_array_equal(servos.trace, stepped.trace)


def test_noise_is_one_sequence_whatever_the_cycles() -> None:
    """Cycles of 7 periods do not divide what is drawn at once."""
    long, short = ServoBank(2, seed=4), ServoBank(2, seed=4)
    long.start_cycle(7)
    short.start_cycle(1)
    drawn = np.concatenate([long.take_cycle()[4] for _ in range(1300)])
    np.testing.assert_array_equal(drawn, np.concatenate([short.take_cycle()[4] for _ in range(9100)]))
    np.testing.assert_array_equal(drawn[:4096], np.random.default_rng(4).standard_normal((4096, 2)))


def drives() -> ServoBank:
    """Three drives that control torque, with noise."""
    servos = ServoBank(3, seed=1)
    servos.loops[:] = Loop.TORQUE
    servos.brakes[:] = False
    for name, value in {"torque_limit": 2.0, "current_filter": 0.5, "velocity_filter": 0.3, "torque_noise": 1e-3}.items():
        servos.parameters[name] = value
    servos.parameters["encoder_quantum"] = servos.parameters["torque_quantum"] = 1e-4
    return servos


def one_by_one(plant: Plant, servos: ServoBank) -> None:
    mechanism = plant._mechanism
    mechanism.brakes[:] = servos.brakes
    for period in range(servos.periods):
        mechanism.read()
        servos.run(period, plant.motor_position, plant.motor_torque)
        mechanism.step()
