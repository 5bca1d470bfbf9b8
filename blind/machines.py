"""Machines that nobody has seen: families of one to three axes, drawn in size and commissioned as an engineer would."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from pathlib import Path

import mujoco
import numpy as np

from drivetwin.controller.machine import Axis as ControllerAxis
from drivetwin.controller.machine import Homing
from drivetwin.controller.machine import Machine as ControllerMachine
from drivetwin.emulator.machine import Axis as VirtualAxis
from drivetwin.emulator.machine import CurrentSensor, Encoder, LimitSwitches, Loops, Motor
from drivetwin.emulator.machine import Machine as VirtualMachine

MODEL = "model.xml"

STEP = 0.00025
"""Time step that the nominal model is written with [s]."""

CURRENT_LOOP = 0.0005
"""Time constant of every current loop [s]."""

SWITCH_MARGIN = 0.06
"""How far beyond the travel the limit switches stand, as a share of it."""


@dataclass(frozen=True)
class DrawnAxis:
    """One axis, joint side, SI, unless said otherwise; `bandwidth` [rad/s] of the velocity loop, which has an integral or not.

    `gear` is motor turns a turn of the gear's output, `feed` [m] the way of a slide a turn; rotor inertia: the shaft's [kg·m²].
    `inertia` is d torque / d acceleration at qpos0 with the rotor, `weight` the most that gravity asks at rest, and
    `shaken` the most that full acceleration of the other axes asks.
    """

    gear: int
    feed: float | None
    rotor_inertia: float
    inertia: float
    weight: float
    shaken: float
    coulomb: float
    viscous: float
    travel: tuple[float, float]
    max_speed: float
    max_acceleration: float
    bandwidth: float
    integral: bool
    encoder_increments: int
    sensor_noise: float

    @property
    def slide(self) -> bool:
        """Whether it moves along a line."""
        return self.feed is not None

    @property
    def gear_ratio(self) -> float:
        """Motor turns a joint turn, or rad/m."""
        return float(self.gear) if self.feed is None else self.gear * 2.0 * pi / self.feed

    @property
    def middle(self) -> float:
        """Of its travel."""
        return 0.5 * (self.travel[0] + self.travel[1])

    @property
    def room(self) -> float:
        """Length of its travel."""
        return self.travel[1] - self.travel[0]

    @property
    def power_on_position(self) -> float:
        """Halfway from the travel to the negative switch."""
        return self.travel[0] - 0.5 * SWITCH_MARGIN * self.room

    @property
    def rated_torque(self) -> float:
        """Of its motor, at the joint: what acceleration and friction ask at most, and plenty for weight and other axes."""
        moving = self.inertia * self.max_acceleration + self.coulomb + self.viscous * self.max_speed
        return 0.8 * moving + 1.5 * (self.weight + self.shaken)

    @property
    def limit_switches(self) -> tuple[float, float]:
        """Joint positions of the negative and the positive one."""
        return self.travel[0] - SWITCH_MARGIN * self.room, self.travel[1] + SWITCH_MARGIN * self.room


@dataclass(frozen=True)
class DrawnMachine:
    """`model` is the nominal machine as MJCF: friction and reflected rotors in its joints, one motor an axis, named alike."""

    family: str
    model: str
    axes: dict[str, DrawnAxis]

    def compiled(self) -> mujoco.MjModel:
        """The nominal model."""
        return mujoco.MjModel.from_xml_string(self.model)


@dataclass(frozen=True)
class _Sketch:
    """Rigid bodies as MJCF, and how far [m or rad] and fast each of its axes moves: travel, speed, time to full speed [s]."""

    bodies: str
    axes: dict[str, tuple[tuple[float, float], float, float]]


Draw = np.random.Generator


def _arm(draw: Draw) -> _Sketch:
    """A pendulum under gravity; at 0 it hangs down."""
    length, tool = draw.uniform(0.25, 0.6), draw.uniform(0.5, 2.5)
    body = f"""
      <body name="arm" pos="0 0 1">
        <joint name="shoulder" axis="0 1 0"/>
        <geom type="box" size="0.025 0.03 {length / 2:.4f}" pos="0 0 {-length / 2:.4f}" mass="{draw.uniform(0.8, 2.5):.4f}"/>
        <geom type="cylinder" size="0.04 0.04" pos="0 0 {-length:.4f}" mass="{tool:.4f}"/>
      </body>"""
    return _Sketch(body, {"shoulder": (_travel(draw, 2.6, 4.0, 0.4), draw.uniform(1.2, 2.5), draw.uniform(0.15, 0.35))})


def _turntable(draw: Draw) -> _Sketch:
    """A disc on a vertical axis."""
    body = f"""
      <body name="disc" pos="0 0 0.3">
        <joint name="table" axis="0 0 1"/>
        <geom type="cylinder" size="{draw.uniform(0.12, 0.3):.4f} 0.02" mass="{draw.uniform(4.0, 20.0):.4f}"/>
      </body>"""
    return _Sketch(body, {"table": (_travel(draw, 3.5, 6.0, 0.8), draw.uniform(1.5, 3.5), draw.uniform(0.15, 0.35))})


def _stage(draw: Draw) -> _Sketch:
    """A carriage on a horizontal screw."""
    body = f"""
      <body name="carriage" pos="0 0 0.2">
        <joint name="slide" type="slide" axis="1 0 0"/>
        <geom type="box" size="0.1 0.1 0.04" mass="{draw.uniform(10.0, 80.0):.4f}"/>
      </body>"""
    return _Sketch(body, {"slide": (_travel(draw, 0.3, 0.7, 0.1), draw.uniform(0.2, 0.5), draw.uniform(0.15, 0.35))})


def _lift(draw: Draw) -> _Sketch:
    """A carriage on a vertical screw."""
    body = f"""
      <body name="carriage" pos="0 0 0.6">
        <joint name="lift" type="slide" axis="0 0 1"/>
        <geom type="box" size="0.1 0.1 0.05" mass="{draw.uniform(4.0, 15.0):.4f}"/>
      </body>"""
    return _Sketch(body, {"lift": (_travel(draw, 0.3, 0.6, 0.1), draw.uniform(0.2, 0.45), draw.uniform(0.15, 0.35))})


def _elbow(draw: Draw) -> _Sketch:
    """Two hinges in series, both vertical (a SCARA) or both horizontal (it hangs down at 0)."""
    upper, fore = draw.uniform(0.25, 0.4), draw.uniform(0.2, 0.35)
    flat = bool(draw.random() < 0.6)
    axis, along = ("0 0 1", "{} 0 0") if flat else ("0 1 0", "0 0 -{}")
    box = "{} 0.03 0.02" if flat else "0.02 0.03 {}"
    body = f"""
      <body name="upper" pos="0 0 1">
        <joint name="base" axis="{axis}"/>
        <geom type="box" size="{box.format(upper / 2)}" pos="{along.format(upper / 2)}" mass="{draw.uniform(2.0, 4.0):.4f}"/>
        <body name="fore" pos="{along.format(upper)}">
          <joint name="elbow" axis="{axis}"/>
          <geom type="box" size="{box.format(fore / 2)}" pos="{along.format(fore / 2)}" mass="{draw.uniform(1.0, 2.5):.4f}"/>
        </body>
      </body>"""
    return _Sketch(body, {name: _hinge(draw) for name in ("base", "elbow")})


def _scara3(draw: Draw) -> _Sketch:
    """Lift, rotate and stretch without belts."""
    upper, fore = draw.uniform(0.2, 0.35), draw.uniform(0.2, 0.35)
    body = f"""
      <body name="carriage" pos="0 0 0.5">
        <joint name="lift" type="slide" axis="0 0 1"/>
        <geom type="cylinder" size="0.07 0.12" mass="{draw.uniform(4.0, 8.0):.4f}"/>
        <body name="upper" pos="0 0 0.16">
          <joint name="rotate" axis="0 0 1"/>
          <geom type="box" size="{upper / 2:.4f} 0.04 0.02" pos="{upper / 2:.4f} 0 0" mass="{draw.uniform(2.0, 4.0):.4f}"/>
          <body name="fore" pos="{upper:.4f} 0 0.04">
            <joint name="stretch" axis="0 0 1"/>
            <geom type="box" size="{fore / 2:.4f} 0.03 0.015" pos="{fore / 2:.4f} 0 0" mass="{draw.uniform(1.0, 2.0):.4f}"/>
          </body>
        </body>
      </body>"""
    motion = {"lift": (_travel(draw, 0.25, 0.4, 0.05), draw.uniform(0.2, 0.35), draw.uniform(0.15, 0.35))}
    motion |= {name: _hinge(draw) for name in ("rotate", "stretch")}
    return _Sketch(body, motion)


def _hinge(draw: Draw) -> tuple[tuple[float, float], float, float]:
    """How a hinge of an arm with several moves."""
    return _travel(draw, 2.6, 4.0, 0.3), draw.uniform(1.2, 2.5), draw.uniform(0.2, 0.4)


FAMILIES: dict[str, Callable[[Draw], _Sketch]] = {
    "arm": _arm,
    "turntable": _turntable,
    "stage": _stage,
    "lift": _lift,
    "elbow": _elbow,
    "scara3": _scara3,
}


def draw_machine(family: str, seed: int) -> DrawnMachine:
    """The machine of a family that belongs to a case's seed: always the same one."""
    draw = np.random.default_rng([seed, 1])
    sketch = FAMILIES[family](draw)
    spec = mujoco.MjSpec.from_string(_mjcf(family, sketch))
    bare = spec.compile()
    axes = {name: _commission(draw, bare, name, sketch) for name in sketch.axes}
    for name, axis in axes.items():
        joint = spec.joint(name)
        joint.armature = axis.rotor_inertia * axis.gear_ratio**2
        joint.frictionloss = axis.coulomb
        joint.damping = (axis.viscous, 0.0, 0.0)
        spec.actuator(name).gear[0] = axis.gear_ratio
    spec.compile()
    return DrawnMachine(family, spec.to_xml(), axes)


def _mjcf(family: str, sketch: _Sketch) -> str:
    motors = "".join(f'<motor name="{name}" joint="{name}"/>' for name in sketch.axes)
    return f"""
    <mujoco model="{family}">
      <compiler angle="radian"/>
      <option timestep="{STEP}" gravity="0 0 -9.81"/>
      <default><geom contype="0" conaffinity="0"/></default>
      <worldbody>{sketch.bodies}</worldbody>
      <actuator>{motors}</actuator>
    </mujoco>"""


def _commission(draw: Draw, bare: mujoco.MjModel, name: str, sketch: _Sketch) -> DrawnAxis:
    """Motor, gear, friction and gains for an axis whose rigid bodies, travel and speed are given."""
    travel, speed, ramp = sketch.axes[name]
    slide = bare.joint(name).type[0] == mujoco.mjtJoint.mjJNT_SLIDE
    inertias, weight = _inertias(bare, name), _weight(bare, name, travel)
    links = inertias[name]
    shaken = sum(abs(inertias[other]) * top / up for other, (_, top, up) in sketch.axes.items() if other != name)
    gear, feed = (1, float(draw.choice((0.005, 0.01, 0.016, 0.02)))) if slide else (int(draw.integers(30, 121)), None)
    ratio = gear * 2.0 * pi / feed if feed is not None else float(gear)
    rotor = (draw.uniform(0.8, 2.0) if slide and weight > 0.0 else draw.uniform(0.25, 0.9)) * links
    inertia, acceleration = links + rotor, speed / ramp
    coulomb = draw.uniform(0.3, 0.5) * (0.35 * (inertia * acceleration + shaken) + 0.4 * weight)
    return DrawnAxis(
        gear=gear,
        feed=feed,
        rotor_inertia=rotor / ratio**2,
        inertia=inertia,
        weight=weight,
        shaken=shaken,
        coulomb=coulomb,
        viscous=draw.uniform(0.7, 1.5) * coulomb / speed,
        travel=travel,
        max_speed=speed,
        max_acceleration=acceleration,
        bandwidth=draw.uniform(90.0, 180.0),
        integral=bool(not slide or weight > 0.0 or draw.random() < 0.6),
        encoder_increments=int(draw.choice((2**18, 2**20))),
        sensor_noise=draw.uniform(0.002, 0.005),
    )


def _travel(draw: Draw, least: float, most: float, shift: float) -> tuple[float, float]:
    """A range of between `least` and `most`, whose middle is at most `shift` off 0."""
    half, middle = 0.5 * draw.uniform(least, most), draw.uniform(-shift, shift)
    return middle - half, middle + half


def _inertias(model: mujoco.MjModel, name: str) -> dict[str, float]:
    """Torque on an axis by the acceleration of each axis, itself included, at qpos0."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    row = mass[model.joint(name).dofadr[0]]
    return {model.joint(number).name: float(row[model.jnt_dofadr[number]]) for number in range(model.njnt)}


def _weight(model: mujoco.MjModel, name: str, travel: tuple[float, float]) -> float:
    """The most torque that gravity asks of an axis over its travel, the others at 0 [N·m or N]."""
    data = mujoco.MjData(model)
    joint = model.joint(name)

    def asked(position: float) -> float:
        data.qpos[joint.qposadr[0]] = position
        mujoco.mj_forward(model, data)
        return abs(float(data.qfrc_bias[joint.dofadr[0]]))

    return max(map(asked, np.linspace(*travel, 30)), default=0.0)


def virtual_machine(machine: DrawnMachine, directory: Path) -> VirtualMachine:
    """The machine as the emulator takes it; its MJCF, without the rotors, is written into `directory`."""
    spec = mujoco.MjSpec.from_string(machine.model)
    for name in machine.axes:
        spec.joint(name).armature = 0.0
        spec.actuator(name).gear[0] = 1.0
    spec.compile()
    (directory / MODEL).write_text(spec.to_xml(), encoding="utf-8")
    axes = {name: _virtual_axis(number, name, axis) for number, (name, axis) in enumerate(machine.axes.items(), start=1)}
    return VirtualMachine(machine=machine.family, model=MODEL, axes=axes, directory=directory)


def _virtual_axis(node_id: int, name: str, axis: DrawnAxis) -> VirtualAxis:
    ratio = axis.gear_ratio
    negative, positive = axis.limit_switches
    return VirtualAxis(
        node_id=node_id,
        joint=name,
        actuator=name,
        gear_ratio=ratio,
        motor=Motor(
            rated_torque=axis.rated_torque / ratio,
            peak_torque=3.0 * axis.rated_torque / ratio,
            inertia=axis.rotor_inertia,
            holding_brake=2.0 * axis.weight / ratio,
        ),
        encoder=Encoder(increments_per_revolution=axis.encoder_increments),
        current_sensor=CurrentSensor(noise=axis.sensor_noise, resolution=0.001),
        current_loop_time_constant=CURRENT_LOOP,
        loops=Loops(
            position_gain=axis.bandwidth / 4.0,
            velocity_gain=axis.inertia * axis.bandwidth,
            integral_time=4.0 / axis.bandwidth if axis.integral else None,
            velocity_feedforward=1.0,
            velocity_filter_hz=300.0,
        ),
        limit_switches=LimitSwitches(negative=negative, positive=positive),
        power_on_position=axis.power_on_position,
    )


def controller_machine(machine: DrawnMachine, directory: Path) -> ControllerMachine:
    """The machine as the controller knows it; `directory` is where its nominal model stands."""
    axes = {name: _controller_axis(number, name, axis) for number, (name, axis) in enumerate(machine.axes.items(), start=1)}
    return ControllerMachine(machine=machine.family, model=MODEL, axes=axes, groups=(tuple(axes),), directory=directory)


def _controller_axis(node_id: int, name: str, axis: DrawnAxis) -> ControllerAxis:
    return ControllerAxis(
        node_id=node_id,
        joint=name,
        actuator=name,
        gear=(axis.gear, 1),
        feed=axis.feed,
        travel=axis.travel,
        rest=axis.middle,
        max_speed=axis.max_speed,
        max_acceleration=axis.max_acceleration,
        homing=Homing(
            method=17,
            switch_position=axis.limit_switches[0],
            search_speed=0.1 * axis.max_speed,
            edge_speed=0.01 * axis.max_speed,
            acceleration=0.3 * axis.max_acceleration,
        ),
    )


def off(model: str, seed: int) -> str:
    """A nominal model that is some per cent off: every mass, inertia, armature, friction and damping by a factor of its own.

    Factors have mean 1 and 4 % rms, clipped at 8 %. A mass and its inertia share one: the shape is known, the density is not.
    """
    draw = np.random.default_rng([seed, 3])

    def factor() -> float:
        return 1.0 + 0.04 * float(np.clip(draw.standard_normal(), -2.0, 2.0))

    spec = mujoco.MjSpec.from_string(model)
    for geom in spec.geoms:
        geom.mass *= factor()
    for joint in spec.joints:
        joint.armature *= factor()
        joint.frictionloss *= factor()
        joint.damping = np.asarray(joint.damping) * factor()
    spec.compile()
    return str(spec.to_xml())
