"""The claims of an effect, each checked against a plant, a search, a file or another claim."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.conformance import chain
from drivetwin.emulator.conformance.bench import SAMPLE, Kind, Recorded, ground, record, site
from drivetwin.emulator.conformance.search import searched
from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw, Motion
from drivetwin.emulator.effects import (
    AxisEffect,
    DriveEffect,
    Effect,
    ModelEffect,
    Need,
    PlacedEffect,
    UnnamedEffect,
    read_effects,
)
from drivetwin.emulator.effects.base import CUBIC, DAMPING, INERTIA, MASS, QUADRATIC, STIFFNESS, TORQUE
from drivetwin.emulator.effects.file import effects_payload

Array = NDArray[np.float64]

UNEXPLAINED = 0.02
"""Of the energy of what an effect costs a plant: what its prediction may leave."""
OFF = 0.1
"""Of the torque that an effect costs, as rms: what a parameter that a search found may change of it."""
LEFT_OF_DRIVE = 0.05
"""Of the energy of what a drive gives less than asked: what the nearest candidate may leave."""
EXACT = 1e-6
"""Of a torque, as rms: what may differ where it has to be the same."""
LOUDER = 3.0
"""Factor of all torques, forces, masses and stiffnesses, as of another unit of force."""

_OF_FORCE = frozenset({TORQUE, DAMPING, STIFFNESS, QUADRATIC, CUBIC, INERTIA, MASS})
_LAW_OF_FORCE = ("coulomb", "viscous")
"""Parts of the bench's friction in units of these."""


@dataclass(frozen=True)
class Finding:
    """One statement: an error that is at most `most` where it holds."""

    what: str
    error: float
    most: float

    @property
    def holds(self) -> bool:
        """Whether it does."""
        return self.error <= self.most

    def __str__(self) -> str:
        return f"{self.what}: {self.error:.3g}, at most {self.most:.3g}"


def findings(kind: type[Effect], seed: int = 1) -> list[Finding]:
    """Every statement of an effect of the library, which has to have it already (`add_effects`).

    Sizes are those that the effect draws for the bench, by `seed`. What no diagnosis asks for is only written and read.
    """
    if issubclass(kind, AxisEffect):
        return [each for bench in ("hinge", "slide") if kind.suits(site(bench)) for each in _of_axis(kind, bench, seed)]
    if issubclass(kind, ModelEffect):
        return list(_of_bodies(kind, seed))
    if issubclass(kind, DriveEffect):
        return list(_of_drive(kind, seed))
    if issubclass(kind, UnnamedEffect):
        return [each for bench in ("hinge", "slide") for each in _of_unnamed(kind, bench, seed)]
    return [_file(kind(**{one.name: float(np.clip(1.0, one.low, one.high)) for one in kind.parameters}))]


def _of_axis(kind: type[AxisEffect], bench: Kind, seed: int) -> Iterator[Finding]:
    true = kind.drawn(ground(bench, seed))
    recorded = record(bench, PlacedEffect("axis", true, {}))
    yield from (_bounds(true), _file(true))
    yield Finding(f"{bench}: what the prediction leaves of the plant", 1.0 - recorded.explained_by(true), UNEXPLAINED)
    found = searched(kind, recorded)
    left = 1.0 if found is None else 1.0 - recorded.explained_by(found)
    yield Finding(f"{bench}: what the search leaves of the plant", left, UNEXPLAINED)
    if found is not None:
        yield from _recovered(bench, recorded, true, found)
    yield from _same_elsewhere(bench, recorded, true)
    yield _still(bench, kind, recorded)


def _of_unnamed(kind: type[UnnamedEffect], bench: Kind, seed: int) -> Iterator[Finding]:
    true = kind.example(ground(bench, seed))
    recorded = record(bench, PlacedEffect("axis", true, {}))
    yield from (_bounds(true), _file(true))
    yield Finding(f"{bench}: what the prediction leaves of the plant", 1.0 - recorded.explained_by(true), UNEXPLAINED)
    yield from _same_elsewhere(bench, recorded, true)


def _recovered(bench: Kind, recorded: Recorded, true: AxisEffect, found: AxisEffect) -> Iterator[Finding]:
    """By how much the torque changes where one parameter found is put to its true value."""
    whole = _rms(recorded.gap)
    for parameter in type(true).parameters:
        put = replace(found, **{parameter.name: getattr(true, parameter.name)})
        change = recorded.judged(put.predict(recorded.motion, recorded.axis) - found.predict(recorded.motion, recorded.axis))
        yield Finding(f"{bench}: {parameter.name} after the search", _rms(change) / whole, OFF)


def _same_elsewhere(bench: Kind, recorded: Recorded, true: AxisEffect | UnnamedEffect) -> Iterator[Finding]:
    """What must not change the torque: when and where it is, unless the effect needs to know; and the unit of force."""
    motion, axis = recorded.motion, recorded.axis
    torque = true.predict(motion, axis)
    if Need.TIME not in true.needs:
        later = true.predict(replace(motion, time=motion.time + 100.0), axis)
        yield Finding(f"{bench}: the same at another time", _rms(later - torque) / _rms(torque), EXACT)
    if not true.needs & {Need.ABSOLUTE_POSITION, Need.MOTOR_ANGLE}:
        elsewhere = true.predict(replace(motion, position=motion.position + 0.37), axis)
        yield Finding(f"{bench}: the same elsewhere", _rms(elsewhere - torque) / _rms(torque), EXACT)
    louder = _louder(true).predict(_louder_motion(motion), _louder_axis(axis))
    yield Finding(f"{bench}: in another unit of force", _rms(louder / LOUDER - torque) / _rms(torque), EXACT)


def _louder(effect: AxisEffect | UnnamedEffect) -> AxisEffect | UnnamedEffect:
    changed = {one.name: LOUDER * getattr(effect, one.name) for one in effect.parameters if one.unit in _OF_FORCE}
    return replace(effect, **changed)


def _louder_motion(motion: Motion) -> Motion:
    names = ("torque", "rigid_torque", "inertia", "rotor_inertia", "from_others", "weight_slope")
    return replace(motion, **{name: LOUDER * getattr(motion, name) for name in names})


def _louder_axis(axis: AxisDynamics) -> AxisDynamics:
    law: FrictionLaw = replace(axis.friction, **{name: LOUDER * getattr(axis.friction, name) for name in _LAW_OF_FORCE})
    return replace(axis, friction=law)


def _still(bench: Kind, kind: type[AxisEffect], recorded: Recorded) -> Finding:
    """A recording of an axis that stands gives no start that predicts what is no number."""
    whole = recorded.motion
    nothing = np.zeros_like(whole.time)
    still = replace(whole, position=nothing, velocity=nothing, acceleration=nothing, torque=nothing, rigid_torque=nothing)
    members = [member for start in kind.starts(still, recorded.axis) for member in start.members]
    wrong = sum(not np.isfinite(member.predict(still, recorded.axis)).all() for member in members)
    return Finding(f"{bench}: starts of an axis that stands, without a torque", float(wrong), 0.0)


def _of_bodies(kind: type[ModelEffect], seed: int) -> Iterator[Finding]:
    """On the second of two hinges: plant against inverse dynamics, and that its cost is what a `ModelEffect` says it is."""
    true = kind.drawn(chain.ground(seed))
    yield from (_bounds(true), _file(true))
    cost = chain.costs(true)
    yield Finding("chain: what the prediction leaves of the plant", _rms(chain.plant_costs(true) - cost) / _rms(cost), EXACT)
    size, *shape = (one.name for one in kind.parameters)
    twice = chain.costs(replace(true, **{size: 2.0 * getattr(true, size)}))
    yield Finding(f"chain: proportional to {size}", _rms(twice - 2.0 * cost) / _rms(cost), EXACT)
    line = [chain.costs(replace(true, **{name: getattr(true, name) + k * kind.probe for name in shape})) for k in range(4)]
    bend = line[0] - 3.0 * line[1] + 3.0 * line[2] - line[3]
    yield Finding(f"chain: of degree two in {', '.join(shape)}", _rms(bend) / _rms(cost), EXACT)


def _of_drive(kind: type[DriveEffect], seed: int) -> Iterator[Finding]:
    base = ground("hinge", seed)
    true, asked = kind.drawn(base), base.motion.torque
    yield from (_bounds(true), _file(true))
    given = true.respond(asked, SAMPLE)
    without = _rms(given - asked)
    nearest = min((_rms(given - one.respond(asked, SAMPLE)) for one in kind.candidates(asked, given, SAMPLE)), default=without)
    yield Finding("what the nearest candidate leaves", (nearest / without) ** 2, LEFT_OF_DRIVE)
    yield Finding("given where nothing is asked", _rms(true.respond(np.zeros(50), SAMPLE)), 0.0)
    ahead = np.full(100, asked[0])
    later = true.respond(np.concatenate([ahead, asked]), SAMPLE)[len(ahead) :]
    yield Finding("the same after a stand", _rms(later - given) / _rms(given), EXACT)


def _bounds(effect: Effect) -> Finding:
    values = [(float(getattr(effect, one.name)), one.low, one.high) for one in effect.parameters]
    return Finding("drawn beyond its bounds", float(sum(not low <= value <= high for value, low, high in values)), 0.0)


def _file(effect: Effect) -> Finding:
    """Written as effects/1 and read again: the largest difference of a parameter, infinite where it is another effect."""
    joint = int(mujoco.mjtJoint.mjJNT_HINGE)
    units = {one.name: one.unit.on(joint) for one in effect.parameters}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "effects.json")
        path.write_text(json.dumps(effects_payload([PlacedEffect("axis", effect, units)])), encoding="utf-8")
        (again,) = read_effects(path)
    same = type(again.effect) is type(effect) and again.units == units
    return Finding("read again from a file", _farthest(again.effect, effect) if same else float("inf"), 0.0)


def _farthest(one: Effect, other: Effect) -> float:
    return max(abs(float(getattr(one, field.name)) - float(getattr(other, field.name))) for field in fields(one))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
