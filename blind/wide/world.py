"""A drawn world: machine, drives, sensors, plans; what it records with some effects in it, and what each of them costs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.blind.case import Cause
from drivetwin.blind.wide.channel import RATES, Channel, draw_channel, passed
from drivetwin.blind.wide.drives import LAWS as DRIVE_LAWS
from drivetwin.blind.wide.drives import Drive, commission, draw_drive
from drivetwin.blind.wide.effects import CHANNEL, DRIVE, SENSING, put
from drivetwin.blind.wide.foreign import outside
from drivetwin.blind.wide.friction import yielding_way
from drivetwin.blind.wide.machines import Machine
from drivetwin.blind.wide.motion import ENDLESS, Plan, Way, draw_plans
from drivetwin.blind.wide.rigid import RigidBodies, rigid_bodies
from drivetwin.blind.wide.simulator import TICK, Demand, Motion, Outside, Run, move, needed, quiet
from drivetwin.blind.wide.truth import COULOMB, LAWS, TORQUE, Axes, blank

Array = NDArray[np.float64]
Items = tuple[Cause, ...]

WAYS: dict[Way, float] = {"both": 0.84, "one_direction": 0.08, "one_speed": 0.08}

MEMORY = (0.001, 0.05)
"""Time [s] for which sliding friction remembers a higher level."""

MOVING = 0.002
"""Share of an axis's highest speed above which it moves, as the contract of the gap report has it."""


@dataclass(frozen=True)
class World:
    """Everything about a case but its effects. `micro` (n,) is the way on which friction yields before it slides [rad or m]."""

    seed: int
    machine: Machine
    laws: tuple[int, ...]
    micro: tuple[float, ...]
    friction_draws: tuple[tuple[float, float, float], ...]
    drives: tuple[Drive, ...]
    channels: tuple[Channel, ...]
    plans: tuple[Plan, ...]
    rates: tuple[float, ...]
    relative: tuple[bool, ...]
    tells_start: bool
    links: tuple[float, ...]
    slower: float = 1.0

    @property
    def names(self) -> tuple[str, ...]:
        """Of the axes."""
        return self.machine.names

    def axes(self, items: Items) -> Axes:
        """The records of the true axes, with `items`."""
        axes = blank(len(self.names))
        for k, (link, limit, known) in enumerate(
            zip(self.machine.links, self.machine.limits, self.machine.nominal, strict=True)
        ):
            axis, (damping, exponent, attraction) = axes[k], self.friction_draws[k]
            axis["law"], axis["slide"] = self.laws[k], int(link.slide)
            axis["coulomb"], axis["viscous"], axis["rotor"] = known.coulomb, known.viscous, known.rotor
            axis["gear_ratio"] = limit.gear_ratio
            axis["stiffness"] = known.coulomb / self.micro[k]
            axis["micro_damping"] = 2.0 * damping * np.sqrt(axis["stiffness"] * (self.links[k] + known.rotor))
            axis["dahl_exponent"], axis["attraction"] = exponent, attraction
            axis["quantum"] = self.channels[k].position_quantum
        for item in sorted(items, key=lambda one: one.effect != "coulomb"):
            axis_index = self.names.index(item.axis)
            put(axes, axis_index, self.machine.links[axis_index].parent, item)
        commission(axes, self.drives, self.machine, np.array(self.links), self.slower)
        return axes

    def nominal_axes(self) -> Axes:
        """The axes of the nominal model: Coulomb friction with next to no presliding, a stiff transmission, no error."""
        axes = blank(len(self.names))
        for axis, known, limit in zip(axes, self.machine.nominal, self.machine.limits, strict=True):
            axis["law"], axis["gear_ratio"] = COULOMB, limit.gear_ratio
            axis["coulomb"], axis["viscous"], axis["rotor"] = known.coulomb, known.viscous, known.rotor
            axis["stiffness"] = 1e9 * max(known.coulomb, 1e-9)
        return axes

    def bodies(self, items: Items) -> RigidBodies:
        """The rigid bodies, with a payload where there is one."""
        for item in items:
            if item.effect == "payload":
                place = [item.parameters[name] for name in "xyz"]
                return rigid_bodies(self.machine.with_payload(self.names.index(item.axis), item.parameters["mass"], place))
        return rigid_bodies(self.machine.xml())

    def outside(self, items: Items, plan: Plan) -> Outside:
        """What acts from outside during a plan."""
        own = [self.seed, 7, sum(plan.name.encode()), int(plan.start_time * 1000)]
        placed = tuple((self.names.index(item.axis), item) for item in items)
        return outside(placed, len(plan.position), len(self.names), np.random.default_rng(own))

    def moved(self, items: Items, plan: Plan) -> Run:
        """The machine with `items` follows a plan."""
        axes, motion = self.axes(items), motion_of(plan.position)
        held = self._held(motion)
        settled = held[0] * (axes["integral_gain"] > 0.0)
        demand = Demand(motion.position, motion.velocity, motion.acceleration, held)
        return move(self.bodies(items), axes, demand, self.outside(items, plan), plan.start_time, settled)

    def _held(self, motion: Motion) -> Array:
        """Torque (k, n) that whoever commands torques takes from the nominal model, no Coulomb friction; else that at first."""
        if all(drive.law != TORQUE for drive in self.drives):
            start = Motion(motion.position[:1], motion.velocity[:1], motion.acceleration[:1])
            return np.broadcast_to(self._nominal_needs(start, frictionless=True), motion.position.shape)
        return self._nominal_needs(motion, frictionless=True)

    def needs(self, items: Items, motion: Motion, plan: Plan) -> Array:
        """Reported torque (k, n) that a motion along a plan needs of the machine with `items`."""
        stride = round(motion.tick / TICK)
        series = self.outside(items, plan)
        thinned = Outside(*(np.ascontiguousarray(one[::stride]) for one in (series.pull, series.friction, series.gain)))
        return needed(self.bodies(items), self.axes(items), motion, thinned, plan.start_time)

    def nominal_needs(self, motion: Motion) -> Array:
        """The same of the nominal model."""
        return self._nominal_needs(motion, frictionless=False)

    def _nominal_needs(self, motion: Motion, *, frictionless: bool) -> Array:
        axes = self.nominal_axes()
        if frictionless:
            axes["coulomb"] = 0.0
        return needed(rigid_bodies(self.machine.xml()), axes, motion, quiet(*motion.position.shape), 0.0)

    def read(self, motion: Motion, items: Items) -> Motion:
        """What encoders say of a motion, without their quanta."""
        axes = self.axes(items)
        if not (axes["eccentricity"].any() or axes["delay"].any()):
            return motion
        position, ticks = motion.position.copy(), np.arange(len(motion.position))
        for k, axis in enumerate(axes):
            position[:, k] = np.interp(ticks - axis["delay"] / motion.tick, ticks, position[:, k])
            position[:, k] += axis["eccentricity"] * np.sin(axis["gear_ratio"] * position[:, k] + axis["eccentricity_phase"])
        return _with_derivatives(position, motion.tick)

    def moving(self, motion: Motion) -> NDArray[np.bool_]:
        """Samples (k, n) in which each axis moves."""
        speeds = np.array([limit.max_speed for limit in self.machine.limits])
        return np.asarray(np.abs(motion.velocity) > MOVING * speeds)

    def cost(self, item: Cause, base: Array, changed: Items, motion: Motion, plan: Plan) -> Array:
        """Torque (k,) that `item` makes a difference of on its axis, along a motion of the motors.

        `base` (k, n) is what the motion needs on one side of that difference, `changed` what acts on the other.
        """
        k = self.names.index(item.axis)
        if item.effect in SENSING:
            return np.asarray((self.nominal_needs(motion) - self.nominal_needs(self.read(motion, (item,))))[:, k])
        torque = base[:, k]
        if item.effect in CHANNEL:
            return passed(torque, (item,), motion.tick) - torque
        if item.effect == "torque_saturation":
            return np.clip(torque, -item.parameters["limit"], item.parameters["limit"]) - torque
        if item.effect in DRIVE:
            return passed(torque, (Cause("torque_lowpass", item.axis, item.parameters),), motion.tick) - torque
        return np.asarray(self.needs(changed, motion, plan)[:, k] - torque)


def motion_of(position: Array, stride: int = 1) -> Motion:
    """A motion from its position (k, n) at every servo period, thinned to every `stride`-th."""
    return _with_derivatives(position[::stride], stride * TICK)


def _with_derivatives(position: Array, tick: float) -> Motion:
    velocity = np.gradient(position, tick, axis=0)
    return Motion(position, velocity, np.gradient(velocity, tick, axis=0), tick)


def rms(values: Array) -> float:
    """Root mean square; 0 of nothing."""
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0


def draw_world(seed: int, machine: Machine) -> World:
    """Everything about a case but its effects.

    Presliding 10 um to 1 mm or 0.1 to 10 mrad, but at most a two-hundredth of the travel. Friction of `gms` remembers a higher
    level for 1 to 50 ms (Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994, the integrated model).
    """
    draw = np.random.default_rng([seed, 2])
    n = len(machine.links)
    way: Way = list(WAYS)[int(draw.choice(len(WAYS), p=list(WAYS.values())))]
    links = _inertias(machine)
    micro = []
    for link, limit in zip(machine.links, machine.limits, strict=True):
        low, high = yielding_way(link.slide)
        high = max(2.0 * low, min(high, (limit.high - limit.low) / 200.0))
        micro.append(float(np.exp(draw.uniform(np.log(low), np.log(high)))))
    drive = str(draw.choice(list(DRIVE_LAWS), p=list(DRIVE_LAWS.values())))
    plans = draw_plans(draw, machine, way)
    rate = float(draw.choice(RATES))
    rates = tuple(rate if draw.random() < 0.8 else float(draw.choice(RATES)) for _ in plans)
    return World(
        seed=seed,
        machine=machine,
        laws=tuple(int(draw.integers(len(LAWS))) for _ in range(n)),
        micro=tuple(micro),
        friction_draws=tuple(
            (float(draw.uniform(0.05, 0.5)), float(draw.uniform(0.5, 1.2)), 1.0 / float(np.exp(draw.uniform(*np.log(MEMORY)))))
            for _ in range(n)
        ),
        drives=tuple(draw_drive(draw, drive) for _ in range(n)),
        channels=tuple(
            draw_channel(draw, machine, k, links[k] + machine.nominal[k].rotor) for k in range(n)
        ),
        plans=plans,
        rates=rates,
        relative=tuple(bool(draw.random() < 0.12) for _ in plans),
        tells_start=bool(draw.random() < 0.8),
        links=links,
    )


def slowed(world: World) -> World:
    """The same with drives of two thirds of the bandwidth."""
    return replace(world, slower=1.5 * world.slower)


def _inertias(machine: Machine) -> tuple[float, ...]:
    """Inertia that each motor sees of the links in the middle of the range, the others held."""
    bodies = rigid_bodies(machine.xml())
    bodies.data.qpos[:] = [(limit.low + limit.high) / 2.0 for limit in machine.limits]
    mujoco.mj_forward(bodies.model, bodies.data)
    mujoco.mj_fullM(bodies.model, bodies.data, bodies.mass)
    return tuple(float(value) for value in np.diag(bodies.mass))


def travel(machine: Machine, axis: int) -> float:
    """Of an axis, two turns where it is endless."""
    limit = machine.limits[axis]
    return ENDLESS if limit.endless else limit.high - limit.low
