"""The virtual wafer handler on an in-process bus, and a witness that sees where its blade truly is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import atan2

import can
import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.bus.channel import InprocBus
from drivetwin.controller.link import SYNC_COB_ID
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.identification.friction_law import FrictionLaw
from wafer_handler.scara.dynamics import BaseParameters, base_parameters
from wafer_handler.scara.geometry import load_geometry
from wafer_handler.scara.link_parameters import from_model

MACHINE = load_machine("scara")
TRUTH = MACHINE.directory / "elastic_belts.json"
"""Stribeck friction with stiction on every axis, and belts that give way: none of it is in the controller's rigid model."""


@dataclass(frozen=True)
class Seen:
    """Where the blade truly was, one row a cycle: the tool point (n, 3) [m] and the blade's direction (n,) [rad]."""

    position: NDArray[np.float64]
    yaw: NDArray[np.float64]


class Witness:
    """At the machine's end of the bus: notes where the blade truly is after each SYNC, which the controller never sees."""

    def __init__(self, machine: VirtualMachine) -> None:
        self._machine = machine
        self._site = machine.plant.model.site("tool").id
        self._data = mujoco.MjData(machine.plant.model)
        self._seen: list[tuple[float, float, float, float]] = []
        self.watching = False

    def receive(self, message: can.Message) -> None:
        """Pass a frame on."""
        self._machine.receive(message)
        if self.watching and message.arbitration_id == SYNC_COB_ID:
            self._seen.append(self._tool())

    def poll(self) -> None:
        """Let time pass."""
        self._machine.poll()

    def wait(self) -> float | None:
        """As the machine says."""
        return self._machine.wait()

    def watch(self) -> None:
        """Begin anew."""
        self._seen.clear()
        self.watching = True

    def seen(self) -> Seen:
        """What there was since `watch`; it looks away afterwards."""
        self.watching = False
        rows = np.array(self._seen)
        return Seen(rows[:, :3], np.unwrap(rows[:, 3]))

    def _tool(self) -> tuple[float, float, float, float]:
        model, data = self._machine.plant.model, self._data
        data.qpos[:] = self._machine.plant.data.qpos
        mujoco.mj_kinematics(model, data)
        x, y, z = data.site_xpos[self._site].tolist()
        along_x, along_y = data.site_xmat[self._site, [0, 3]].tolist()
        return x, y, z, atan2(along_y, along_x)


@dataclass(frozen=True)
class VirtualArm:
    """The bus that a controller joins, and who sees what it cannot."""

    bus: InprocBus
    witness: Witness


def virtual_arm(profile: str, seed: int) -> VirtualArm:
    """Power on the machine with drives of type `profile`, moved by SYNC; `seed` is of the sensors' noise."""
    effects = read_effects(TRUTH)
    built: list[Witness] = []

    def connect(transmit: Callable[[can.Message], None]) -> Witness:
        machine = VirtualMachine(MACHINE, load_profile(profile), effects, SyncClock(), seed, transmit)
        machine.power_on()
        built.append(Witness(machine))
        return built[0]

    return VirtualArm(InprocBus(connect), built[0])


def true_base() -> BaseParameters:
    """The plant's own base parameters: its model's bodies, and its motors at the joints."""
    links = from_model(MACHINE.model_path)
    motors = [axis.motor.inertia * axis.gear_ratio**2 for axis in MACHINE.axes.values()]
    lift, rotate, stretch = (own + motor for own, motor in zip(links.armature, motors, strict=True))
    return base_parameters(replace(links, armature=(lift, rotate, stretch)), load_geometry())


def true_laws() -> dict[str, FrictionLaw]:
    """The plant's friction by axis, in the terms of the identification."""
    told: dict[str, dict[str, float]] = {axis: {} for axis in MACHINE.axes}
    for placed in read_effects(TRUTH):
        told[placed.axis] |= {name.name: float(getattr(placed.effect, name.name)) for name in placed.effect.parameters}
    return {
        axis: FrictionLaw(
            coulomb=values["coulomb"],
            viscous=values["viscous"],
            static_rise=values["static_torque"] - values["coulomb"],
            stribeck_velocity=values["stribeck_velocity"],
            stribeck_exponent=values["exponent"],
        )
        for axis, values in told.items()
    }
