"""Machines as they are drawn: a bare MJCF of rigid bodies, and what its axes can do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi
from xml.etree import ElementTree

import mujoco
import numpy as np
from numpy.typing import NDArray

Draw = np.random.Generator

Array = NDArray[np.float64]

GRAVITY = 9.81
_POSES = 40


@dataclass(frozen=True)
class Link:
    """A body and the joint that moves it against `parent` (an index of the links before it; -1 is the world).

    `place` is where the joint stands in the parent's frame [m], `axis` its direction; `com` [m] and `inertia` (about the centre
    of mass, along the frame's axes) [kg·m²] are of the body. `turn` is the frame's quaternion in the parent's.
    """

    name: str
    parent: int
    place: tuple[float, float, float]
    axis: tuple[float, float, float]
    slide: bool
    mass: float
    com: tuple[float, float, float]
    inertia: tuple[float, ...]
    turn: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class AxisLimits:
    """What one axis can do: range [rad or m], speed, acceleration; `endless` may turn on for ever."""

    low: float
    high: float
    max_speed: float
    max_acceleration: float
    gear_ratio: float
    endless: bool = False


@dataclass(frozen=True)
class Nominal:
    """What the model of an axis says: friction, reflected rotor, and what its motor can give [N·m or N]."""

    coulomb: float
    viscous: float
    rotor: float
    rated_torque: float


@dataclass(frozen=True)
class Machine:
    """A drawn machine: links in the order of a depth-first walk, and of each its limits and nominal parameters."""

    family: str
    links: tuple[Link, ...]
    limits: tuple[AxisLimits, ...]
    nominal: tuple[Nominal, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Of its axes."""
        return tuple(link.name for link in self.links)

    def xml(self) -> str:
        """The nominal model: friction and reflected rotors in its joints, one motor an axis."""
        return mjcf(self.links, self.limits, self.nominal)

    def with_payload(self, axis: int, mass: float, place: Sequence[float]) -> str:
        """The model with a point mass at `place` in the frame of the body that `axis` moves."""
        spec = mujoco.MjSpec.from_string(self.xml())
        body = spec.body(self.links[axis].name)
        body.add_body(name="payload", pos=tuple(place), mass=mass, ipos=(0, 0, 0), inertia=(0, 0, 0), explicitinertial=True)
        spec.compile()
        return str(spec.to_xml())


def mjcf(links: Sequence[Link], limits: Sequence[AxisLimits], nominal: Sequence[Nominal]) -> str:
    """MJCF of `links`, whose names its bodies, joints and motors bear."""
    root = ElementTree.Element("mujoco", model="machine")
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true", inertiafromgeom="false")
    ElementTree.SubElement(root, "option", gravity=f"0 0 {-GRAVITY}")
    world = ElementTree.SubElement(root, "worldbody")
    bodies: list[ElementTree.Element] = []
    for link, limit, known in zip(links, limits, nominal, strict=True):
        above = world if link.parent < 0 else bodies[link.parent]
        body = ElementTree.SubElement(above, "body", name=link.name, pos=_text(link.place), quat=_text(link.turn))
        kind, rotor = "slide" if link.slide else "hinge", _text([known.rotor])
        joint = {"name": link.name, "type": kind, "axis": _text(link.axis), "armature": rotor}
        friction = {"frictionloss": _text([known.coulomb]), "damping": _text([known.viscous])}
        reach = {} if limit.endless else {"range": _text([limit.low, limit.high])}
        ElementTree.SubElement(body, "joint", joint | friction | reach)
        shape = "diaginertia" if len(link.inertia) == 3 else "fullinertia"
        weight = {"pos": _text(link.com), "mass": _text([link.mass]), shape: _text(link.inertia)}
        ElementTree.SubElement(body, "inertial", weight)
        bodies.append(body)
    motors = ElementTree.SubElement(root, "actuator")
    for link in links:
        ElementTree.SubElement(motors, "motor", name=link.name, joint=link.name)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _text(numbers: Sequence[float]) -> str:
    return " ".join(f"{number:.9g}" for number in numbers)


def off(machine: Machine, draw: Draw) -> str:
    """The model as somebody fitted it who erred: every mass with its inertia, rotor and friction by a factor of its own.

    Factors have mean 1 and 4 % rms, clipped at 8 %.
    """
    factors = 1.0 + 0.04 * np.clip(draw.standard_normal((len(machine.links), 4)), -2.0, 2.0)
    links = tuple(
        replace(link, mass=link.mass * f[0], inertia=tuple(value * f[0] for value in link.inertia))
        for link, f in zip(machine.links, factors, strict=True)
    )
    nominal = tuple(
        replace(known, coulomb=known.coulomb * f[1], viscous=known.viscous * f[2], rotor=known.rotor * f[3])
        for known, f in zip(machine.nominal, factors, strict=True)
    )
    return mjcf(links, machine.limits, nominal)


@dataclass(frozen=True)
class Known:
    """What is known of an axis already: Coulomb friction [N·m or N] and reflected rotor [kg·m² or kg], 0 where it is not."""

    coulomb: float = 0.0
    rotor: float = 0.0


def equipped(
    draw: Draw, family: str, links: Sequence[Link], limits: Sequence[AxisLimits], known: Sequence[Known] = ()
) -> Machine:
    """A machine whose motors, gears and friction, but for what is `known`, are drawn for what its bodies ask in its range.

    Rotor 0.2 to 2 times the load's inertia as reflected, Coulomb friction 5 to 50 % of what motion asks without it (industrial
    joints: Bittencourt and Gunnarsson 2012), viscous friction at full speed 0.1 to 1 times that.
    """
    inertia, weight, others = _demands(draw, links, limits)
    nominal = []
    for k, limit in enumerate(limits):
        told = known[k] if known else Known()
        rotor = told.rotor or float(inertia[k] * np.exp(draw.uniform(np.log(0.2), np.log(2.0))))
        asked = float((inertia[k] + rotor) * 0.5 * limit.max_acceleration + 0.5 * weight[k])
        coulomb = told.coulomb or asked * float(np.exp(draw.uniform(np.log(0.05), np.log(0.5))))
        viscous = coulomb * float(np.exp(draw.uniform(np.log(0.1), 0.0))) / limit.max_speed
        most = others[k] + rotor * limit.max_acceleration + coulomb + viscous * limit.max_speed
        values = (coulomb, viscous, rotor, most * draw.uniform(0.5, 1.2))
        nominal.append(Nominal(*(float(f"{value:.4g}") for value in values)))
    return Machine(family, tuple(links), tuple(limits), tuple(nominal))


def _demands(draw: Draw, links: Sequence[Link], limits: Sequence[AxisLimits]) -> tuple[Array, Array, Array]:
    """Over random poses in the range: mean inertia (n,) and highest weight (n,) of each axis, and its highest torque (n,).

    The last with all axes at full speed and acceleration, one way or the other, rotors aside.
    """
    idle = [Nominal(0.0, 0.0, 0.0, 1.0)] * len(links)
    model = mujoco.MjModel.from_xml_string(mjcf(links, limits, idle))
    data = mujoco.MjData(model)
    mass, inertia, weight, most = np.zeros((model.nv, model.nv)), np.zeros(model.nv), np.zeros(model.nv), np.zeros(model.nv)
    speeds = np.array([limit.max_speed for limit in limits])
    accelerations = np.array([limit.max_acceleration for limit in limits])
    for _ in range(_POSES):
        data.qpos[:] = [draw.uniform(limit.low, limit.high) for limit in limits]
        data.qvel[:] = 0.0
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, mass)
        inertia += np.diag(mass) / _POSES
        weight = np.maximum(weight, np.abs(data.qfrc_bias))
        data.qvel[:] = speeds * draw.choice((-1.0, 1.0), size=model.nv)
        mujoco.mj_forward(model, data)
        most = np.maximum(most, np.abs(mass @ (accelerations * draw.choice((-1.0, 1.0), size=model.nv)) + data.qfrc_bias))
    return np.maximum(inertia, 1e-5), weight, most


def hinge_limits(draw: Draw, low: float, high: float, *, endless: bool = False) -> AxisLimits:
    """A hinge: 0.5 to 5 rad/s, reached in 0.1 to 0.4 s; gears of 1 (direct), 3 to 20 (planetary) or 50 to 160 (strain wave)."""
    speed = float(np.exp(draw.uniform(np.log(0.5), np.log(5.0))))
    ranges = ((1.0, 1.0), (3.0, 20.0), (50.0, 160.0))
    gear = float(np.round(draw.uniform(*ranges[int(draw.choice(3, p=(0.15, 0.35, 0.5)))]), 1))
    return AxisLimits(low, high, speed, speed / draw.uniform(0.1, 0.4), gear, endless)


def slide_limits(draw: Draw, low: float, high: float) -> AxisLimits:
    """A slide: 0.1 to 2 m/s, reached in 0.05 to 0.3 s, on a screw of 5 to 40 mm or a belt of 60 to 200 mm a motor turn."""
    speed = float(np.exp(draw.uniform(np.log(0.1), np.log(2.0))))
    lead = draw.uniform(0.06, 0.2) if speed > 1.0 or draw.random() < 0.25 else draw.uniform(0.005, 0.04)
    return AxisLimits(low, high, speed, speed / draw.uniform(0.05, 0.3), float(f"{2.0 * pi / lead:.6g}"))
