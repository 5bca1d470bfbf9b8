"""A plant without drives: the test says the joint torque of each servo period, or the joint speed to hold."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.drive.servo import SERVO_PERIOD, TORQUE_OFFSET, Loop, ServoBank
from drivetwin.emulator.effects import PlacedEffect, library, read_effects
from drivetwin.emulator.machine import Machine, load_machine
from drivetwin.emulator.mechanism import followers
from drivetwin.emulator.plant import Plant

Array = NDArray[np.float64]

AXES = [("scara", "lift"), ("scara", "rotate"), ("scara", "stretch"), ("stage", "slide"), ("arm", "shoulder")]
"""Every axis of every machine."""


class Torque(ServoBank):
    """Drives that give the motor torques of joint torques `law(step)` -> (n,) [N·m or N], with cycles of one servo period."""

    def __init__(self, gear: Array, law: Callable[[int], Array]) -> None:
        super().__init__(len(gear), seed=0)
        self.start_cycle(1)
        self.loops[:] = Loop.TORQUE
        self.brakes[:] = False
        self.parameters["torque_limit"] = np.inf
        for one in ("current_filter", "encoder_quantum", "torque_quantum"):
            self.parameters[one] = 1.0
        self._gear = gear
        self._law = law
        self._step = 0

    def take_cycle(self) -> tuple[NDArray[Any], ...]:
        self.demand[0, :, TORQUE_OFFSET] = self._law(self._step) / self._gear
        self._step += 1
        return super().take_cycle()


class PlantBench:
    """One machine's plant, with its own true effects or others, and the joint of interest."""

    def __init__(self, name: str, axis: str, effects: tuple[PlacedEffect, ...] | None = None) -> None:
        self.machine: Machine = load_machine(name)
        self.effects = read_effects(self.machine.effects_path) if effects is None else effects
        self.plant = Plant(self.machine, self.effects)
        self.index = list(self.machine.axes).index(axis)
        self.gear = np.array([one.gear_ratio for one in self.machine.axes.values()])
        self.dofs = np.array([self.plant.model.joint(one.joint).dofadr[0] for one in self.machine.axes.values()])
        self.true = {placed.effect.name: placed.effect for placed in self.effects if placed.axis == axis}

    @property
    def velocity(self) -> float:
        return float(self.plant.joint_velocities()[self.index])

    @property
    def position(self) -> float:
        return float(self.plant.joint_positions()[self.index])

    def push(self, torque: float, seconds: float) -> None:
        """Constant joint torque on the axis on top of what gravity asks at the start, all others free."""
        wanted = self.rigid_body()
        wanted[self.index] += torque
        self.run(lambda _: wanted, seconds)

    def slide_at(self, velocity: float, seconds: float = 0.06) -> tuple[float, float]:
        """Hold the axis at a speed by a stiff PI loop, the others at rest; steady (speed, joint torque less rigid body)."""
        inertia = self.inertia()
        target = np.zeros(len(self.gear))
        target[self.index] = velocity
        integral = self.rigid_body()
        torque = np.zeros_like(integral)
        plant = self.plant

        def law(_: int) -> Array:
            error = target - plant.joint_velocities()
            gain = 0.3 * inertia / SERVO_PERIOD
            integral[:] += gain * error * SERVO_PERIOD / 0.002
            torque[:] = gain * error + integral
            return torque

        self.run(law, seconds)
        tail = []
        for _ in range(40):
            tail.append((self.velocity, float(torque[self.index]) - float(self.rigid_body()[self.index])))
            self.run(law, SERVO_PERIOD)
        speed, friction = np.mean(tail, axis=0)
        return float(speed), float(friction)

    def run(self, law: Callable[[int], Array], seconds: float, each: Callable[[], None] | None = None) -> None:
        drives = Torque(self.gear, law)
        for _ in range(round(seconds / SERVO_PERIOD)):
            self.plant.advance(drives)
            if each is not None:
                each()

    def rigid_body(self) -> Array:
        """Gravity and Coriolis torque of each axis, with what its belts drive."""
        motion = followers(self.plant.model)[:, self.dofs]
        return np.asarray(motion.T @ self.plant.data.qfrc_bias)

    def inertia(self) -> Array:
        return np.array([axis["inertia"] for axis in self.plant.truth().values()])

    def law(self, velocity: float) -> float:
        """Friction against the motion, by the textbook and the numbers of the effects file."""

        def get(effect: str, name: str) -> float:
            return getattr(self.true[effect], name) if effect in self.true else 0.0

        sign, speed = np.sign(velocity), abs(velocity)
        coulomb, viscous = get("coulomb", "coulomb"), get("viscous", "viscous")
        torque = (coulomb + sign * get("coulomb_asymmetry", "asymmetry")) * sign
        torque += (viscous + sign * get("viscous_asymmetry", "asymmetry")) * velocity
        if "stribeck" in self.true:
            shape = np.exp(-((speed / get("stribeck", "stribeck_velocity")) ** get("stribeck", "exponent")))
            torque += (get("stribeck", "static_torque") - coulomb) * shape * sign
        return float(torque)

    @property
    def breakaway(self) -> float:
        """Torque that stiction holds, without asymmetry."""
        stribeck = self.true.get("stribeck")
        return float(stribeck.static_torque if stribeck is not None else self.true["coulomb"].coulomb)  # type: ignore[attr-defined]


def placed(axis: str, name: str, **parameters: float) -> PlacedEffect:
    """An effect of the library on an axis."""
    return PlacedEffect(axis, library()[name](**parameters), {})
