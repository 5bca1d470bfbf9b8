"""Which plant a case's truth is written as."""

from __future__ import annotations

import mujoco
import numpy as np

from drivetwin.blind.case import FOREIGN, Case, Cause
from drivetwin.blind.foreign import FOREIGN_EFFECTS, Foreign
from drivetwin.blind.machines import DrawnMachine
from drivetwin.blind.plants.axis import FORMULATED, withheld_axes
from drivetwin.blind.plants.friction import LUGRE, MAXWELL_SLIP
from drivetwin.blind.plants.rigid import RigidBodies, rigid_bodies
from drivetwin.blind.plants.withheld import WithheldPlant
from drivetwin.emulator.dynamics import AxisDynamics
from drivetwin.emulator.effects import ModelEffect, PlacedEffect, library
from drivetwin.emulator.machine import Machine
from drivetwin.emulator.plant import Plant

LIBRARY = "library"
"""The emulator's own plant with the library's effects: for comparison, and for effects that have no other formulation."""

FORMULATIONS = {"lugre": LUGRE, "maxwell_slip": MAXWELL_SLIP}
"""How a withheld plant's friction is written."""


def has_formulations(cause: Cause) -> bool:
    """Whether withheld plants have a cause: by a formula of their own, or in the model of the rigid bodies."""
    return cause.effect.startswith(FOREIGN) or cause.effect in FORMULATED or _of_bodies(cause)


def plant_of(case: Case, machine: DrawnMachine, virtual: Machine) -> Plant:
    """The plant of a case; `virtual` is its machine as the emulator takes it."""
    if case.formulation == LIBRARY:
        return Plant(virtual, tuple(_placed(cause) for cause in case.causes))
    return withheld_plant(machine, case.causes, FORMULATIONS[case.formulation], case.seed)


def withheld_plant(machine: DrawnMachine, causes: tuple[Cause, ...], formulation: int, seed: int) -> WithheldPlant:
    """A machine with these causes, its friction as LuGre's or the Maxwell-slip model's; `seed` of what is random."""
    links = rigid_bodies(_bodies(machine, causes))
    axes = withheld_axes(machine, causes, formulation, np.diag(links.inertia))
    bodies = RigidBodies(links.inertia.copy(), links.swing, links.weight, links.outer)
    rigid = axes["mesh_stiffness"] == 0.0
    bodies.inertia[np.diag_indices(len(axes))] += np.where(rigid, axes["rotor"], 0.0)
    return WithheldPlant(machine, axes, bodies, formulation, _foreign(machine, causes, seed))


def _foreign(machine: DrawnMachine, causes: tuple[Cause, ...], seed: int) -> tuple[tuple[int, Foreign], ...]:
    """The foreign effects, with the numbers of their axes."""
    names, random = list(machine.axes), np.random.default_rng([seed, 4])
    foreign = [cause for cause in causes if cause.effect.startswith(FOREIGN)]
    kinds = [FOREIGN_EFFECTS[cause.effect.removeprefix(FOREIGN)] for cause in foreign]
    return tuple((names.index(cause.axis), kind(cause.parameters, random)) for cause, kind in zip(foreign, kinds, strict=True))


def _bodies(machine: DrawnMachine, causes: tuple[Cause, ...]) -> mujoco.MjModel:
    """The rigid bodies without rotors, with what causes add to them."""
    spec = mujoco.MjSpec.from_string(machine.model)
    for name in machine.axes:
        spec.joint(name).armature = 0.0
    for cause in causes:
        if _of_bodies(cause):
            library()[cause.effect](**cause.parameters).add_to(spec, spec.joint(cause.axis), AxisDynamics())
    return spec.compile()


def _of_bodies(cause: Cause) -> bool:
    return not cause.effect.startswith(FOREIGN) and issubclass(library()[cause.effect], ModelEffect)


def _placed(cause: Cause) -> PlacedEffect:
    return PlacedEffect(cause.axis, library()[cause.effect](**cause.parameters), {})
