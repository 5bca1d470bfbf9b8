"""One axis, or two, of a mechanism written in the test: the effects on any MJCF, against mechanics done by hand."""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np

from drivetwin.emulator.assembly import DrivenJoint
from drivetwin.emulator.conformance.bench import GEAR, LINK, MOTOR, PERIOD, ROTOR, WHOLE, Array
from drivetwin.emulator.effects import PlacedEffect, library
from drivetwin.emulator.mechanism import Mechanism

__all__ = ["GEAR", "LINK", "MOTOR", "PERIOD", "ROTOR", "WHOLE", "Array"]

HINGE = """<mujoco model="rig"><compiler angle="radian"/><option gravity="0 0 0" timestep="0.000125"/><worldbody>
<body><joint name="axis" type="hinge" axis="0 1 0" {joint}/><inertial pos="0 0 0" mass="1" diaginertia="0.2 0.2 0.2"/></body>
</worldbody><actuator><motor name="axis" joint="axis"/></actuator></mujoco>"""

SLIDE = """<mujoco model="rig"><option gravity="0 0 {gravity}" timestep="0.000125"/><worldbody>
<body><joint name="axis" type="slide" axis="0 0 1"/><inertial pos="0 0 0" mass="0.2" diaginertia="1 1 1"/></body>
</worldbody><actuator><motor name="axis" joint="axis"/></actuator></mujoco>"""


def effect(name: str, axis: str = "axis", /, **parameters: float) -> PlacedEffect:
    """An effect of the library on an axis."""
    return PlacedEffect(axis, library()[name](**parameters), {})


class Rig:
    """A mechanism of the test's own; torques at the joint in, true motion out, of its first axis."""

    def __init__(
        self, xml: str, *effects: PlacedEffect, axes: tuple[str, ...] = ("axis",), brake: float = 0.0, position: float = 0.0
    ) -> None:
        drives = {name: DrivenJoint(name, name, GEAR, ROTOR, brake / GEAR, position) for name in axes}
        self.mechanism = Mechanism(mujoco.MjSpec.from_string(xml), drives, effects)
        self.model, self.data = self.mechanism.model, self.mechanism.data

    @property
    def position(self) -> float:
        return float(self.mechanism.joint_positions()[0])

    @property
    def velocity(self) -> float:
        return float(self.mechanism.joint_velocities()[0])

    def start(self, position: float = 0.0, velocity: float = 0.0) -> None:
        """Put every joint, of links and motors, at one position and velocity."""
        self.data.qpos[:], self.data.qvel[:] = position, velocity

    def step(self, torque: float = 0.0) -> None:
        """A period under a joint torque of the first axis's motor, as its drive reports it."""
        self.mechanism.read()
        self.mechanism.motor_torque[0] = torque / GEAR
        self.mechanism.step()

    def run(self, seconds: float, torque: Callable[[], float] | float = 0.0) -> Array:
        """Steps of `seconds`; the joint's position after each, (n,)."""
        seen = np.empty(round(seconds / PERIOD))
        for k in range(len(seen)):
            self.step(torque() if callable(torque) else torque)
            seen[k] = self.position
        return seen


def hinge(*effects: PlacedEffect, joint: str = "", brake: float = 0.0) -> Rig:
    """A link of 0.2 kg·m² on a hinge, without gravity."""
    return Rig(HINGE.format(joint=joint), *effects, brake=brake)


def slide(*effects: PlacedEffect, gravity: float = 0.0, brake: float = 0.0) -> Rig:
    """A mass of 0.2 kg on a vertical slide."""
    return Rig(SLIDE.format(gravity=gravity), *effects, brake=brake)


def two_axes() -> str:
    """A model with a second hinge of its own beside the first."""
    second = HINGE.format(joint="").split("<worldbody>")[1].split("</worldbody>")[0].replace('"axis"', '"second"')
    both = HINGE.format(joint="").replace("</worldbody>", second + "</worldbody>")
    return both.replace("</actuator>", '<motor name="second" joint="second"/></actuator>')


def frequency(trace: Array) -> float:
    """Of a swinging trace about its mean [Hz], by its zero crossings to a fraction of a step."""
    swing = trace - 0.5 * (trace.max() + trace.min())
    at = np.flatnonzero(np.diff(np.signbit(swing)))
    crossings = at + swing[at] / (swing[at] - swing[at + 1])
    return float((len(crossings) - 1) / (2.0 * (crossings[-1] - crossings[0]) * PERIOD))
