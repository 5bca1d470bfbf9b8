"""Draws the cases of the wide generator: worlds, causes of any size from 1 to 30 %, small nuisances beside them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivetwin.blind.case import Cause, Kind
from drivetwin.blind.wide.case import Item, Level, WideCase
from drivetwin.blind.wide.choice import FOUR, Choice, family, plans
from drivetwin.blind.wide.effects import DRIVE, suits
from drivetwin.blind.wide.families import FAMILIES, draw_family
from drivetwin.blind.wide.machines import Draw, Machine
from drivetwin.blind.wide.motion import Plan
from drivetwin.blind.wide.robots import draw_robot
from drivetwin.blind.wide.simulator import Run
from drivetwin.blind.wide.sizing import Along, has_presliding, sized_causes, sized_nuisances, stiffened
from drivetwin.blind.wide.truth import DRIVES, LAWS
from drivetwin.blind.wide.weighing import Recorded, item_of, noise_of, quieted, torque_and_gap, weighed
from drivetwin.blind.wide.world import Items, World, draw_world, rms, slowed, travel
from drivetwin.foundation.children import tied_processes
from drivetwin.foundation.errors import UserError

Array = NDArray[np.float64]

_TRIES, _PATIENCE, _SLOWER = 600, 6, 5
_LOUD = 0.2**0.5


def draw_wide(count: int, seed: int, allowed: Choice, workers: int = 1) -> tuple[WideCase, ...]:
    """`count` cases, the same ones for the same arguments however many `workers` draw them."""
    return tuple(each_wide(count, seed, allowed, workers))


def each_wide(count: int, seed: int, allowed: Choice, workers: int = 1) -> Iterator[WideCase]:
    """The cases of `draw_wide` one after the other, as they are drawn."""
    draw = np.random.default_rng([seed, 11])
    planned = plans(draw, count, allowed)
    draw.shuffle(planned)
    seeds = [int(own) for own in draw.choice(2**31, size=count, replace=False)]
    drawn = partial(drawn_case, allowed=allowed)
    numbers, kinds, effects = range(count), [kind for kind, _ in planned], [effects for _, effects in planned]
    if workers == 1 or count == 1:
        yield from map(drawn, numbers, seeds, kinds, effects)
        return
    with ProcessPoolExecutor(workers, tied_processes()) as pool:
        yield from pool.map(drawn, numbers, seeds, kinds, effects)


def world_of(case: WideCase, robots: Path | None) -> World:
    """The world of a case, as it was drawn."""
    world = replace(_world(case.seed, case.attempt, case.machine, robots), slower=case.slower, micro=case.micro)
    channels = tuple(
        replace(channel, torque_noise=channel.torque_noise + more)
        for channel, more in zip(world.channels, case.noise, strict=True)
    )
    return replace(world, channels=channels)


def _world(seed: int, attempt: int, family: str, robots: Path | None) -> World:
    return draw_world(seed + attempt, _machine(seed + attempt, family, robots))


def _machine(seed: int, family: str, robots: Path | None) -> Machine:
    draw = np.random.default_rng([seed, 1])
    if family in FAMILIES:
        return draw_family(draw, family)
    assert robots is not None
    return draw_robot(draw, family, robots)


def drawn_case(number: int, seed: int, kind: Kind, effects: tuple[str, ...], allowed: Choice) -> WideCase:
    """The first attempt at which machine, effects and drives go together; raises UserError where none does.

    A family that has been drawn is kept for some attempts, so that those that are hard to fit are not drawn less often. What
    only the demanded torque tells is no cause where no demand is recorded.
    """
    for attempt in range(_TRIES):
        draw = np.random.default_rng([seed, 3, attempt])
        name = family(np.random.default_rng([seed, 4, attempt // _PATIENCE]), allowed)
        world = _world(seed, attempt, name, allowed.robots)
        placed = _placed(draw, world.machine, kind, effects)
        if placed is None or any(effect in DRIVE and not world.drives[axis].demand_is_recorded for effect, axis in placed):
            continue
        found = _drawn(draw, world, kind, placed)
        if found is not None:
            return replace(found, number=number, seed=seed, machine=name, attempt=attempt)
    raise UserError(f"no machine of {', '.join(allowed.families)} can have {', '.join(effects)}; allow more families")


def _placed(draw: Draw, machine: Machine, kind: Kind, effects: tuple[str, ...]) -> list[tuple[str, int]] | None:
    """Each effect with its axis: a pair on one, four on four; None where the machine cannot have them."""
    n = len(machine.links)
    fits = [[k for k in range(n) if suits(effect, machine, k)] for effect in effects]
    if kind == "four":
        if n < FOUR:
            return None
        axes = [int(k) for k in draw.permutation(n)[:FOUR]]
        ordered = axes if all(k in fit for k, fit in zip(axes, fits, strict=True)) else None
        return list(zip(effects, ordered, strict=True)) if ordered else None
    common = [k for k in range(n) if all(k in fit for fit in fits)]
    if not common or len(set(effects)) < len(effects):
        return None
    axis = int(draw.choice(common))
    return [(effect, axis) for effect in effects]


def _drawn(draw: Draw, world: World, kind: Kind, placed: list[tuple[str, int]]) -> WideCase | None:
    """A case, but for its names; None where an axis hardly moves, drives swing, a cause stays too small or hidden, what is
    beside it grows as large, or a play is a spring by another name.

    Causes are sized along the validation plans, presliding and nuisances along the motion that is recorded with the causes: a
    channel's low-pass costs more there than along the plan.
    """
    plans = [plan for plan in world.plans if plan.name.startswith("validate")]
    planned = Along.planned(world, plans)
    if planned.torque.min() <= 0.0:
        return None
    causes = sized_causes(draw, world, planned, placed)
    moved = _moved(world, causes, plans) if causes is not None else None
    if causes is None or moved is None:
        return None
    world, recorded = moved
    scales = _scales(world, causes, recorded)
    along = Along.recorded(world, [(one.plan, one.motion, one.window.band) for one in recorded])
    world, plain = stiffened(world, along, causes, scales)
    if not plain and kind != "clean":
        return None
    nuisances = sized_nuisances(draw, world, along, causes, [axis for _, axis in placed], scales)
    moved = _moved(world, (*causes, *nuisances), world.plans)
    if moved is None:
        return None
    case = _weighed(moved[0], kind, causes, nuisances, moved[1])
    loud = any(item.size > _LOUD * scales[world.names.index(item.axis)] for item in case.beside)
    strays = dict(zip(world.names, np.max([one.strays for one in moved[1]], axis=0), strict=True))
    springs = any(is_a_spring(item, case.levels[item.axis], float(strays[item.axis])) for item in case.causes)
    return None if loud or springs else case


def is_a_spring(cause: Cause, level: Level, strays: float) -> bool:
    """Whether it is a play that gives way by less than its flanks do under the torque of its axis, or that a weight holds on
    one of them: joint and motor then differ by less than the gap over the run, `strays` [rad or m] peak to peak.
    """
    gap = cause.parameters.get("gap", 0.0)
    return cause.effect == "backlash" and (gap < level.torque / cause.parameters["stiffness"] or strays < gap)


def _scales(world: World, causes: Items, recorded: list[Recorded]) -> Array:
    """Size (n,) of the largest cause of each axis that is part of a gap; of all causes on other axes.

    Of a clean case, some of the noise.
    """
    torque, gap = torque_and_gap(world, recorded)
    if not causes:
        return np.full(len(torque), np.min(0.6 * noise_of(world, recorded) / torque))
    levels = {name: Level(torque[k], gap[k], 0.0) for k, name in enumerate(world.names)}
    items = [item_of(world, cause, causes, recorded, levels[cause.axis]) for cause in causes]
    telling = [item for item in items if item.effect not in DRIVE] or items
    largest = max(item.size for item in telling)
    return np.array([max((item.size for item in telling if item.axis == name), default=largest) for name in world.names])


def _moved(world: World, items: Items, asked: Sequence[Plan]) -> tuple[World, list[Recorded]] | None:
    """Move the machine through plans, with slower drives where it swings; None where nothing helps.

    Of what it recorded, the validation recordings.
    """
    for _ in range(_SLOWER):
        runs = [(world.moved(items, plan), plan) for plan in asked]
        if all(_sound(run, plan, world) for run, plan in runs):
            return world, [Recorded.of(world, items, run, plan) for run, plan in runs if plan.name.startswith("validate")]
        world = slowed(world)
    return None


def _weighed(world: World, kind: Kind, causes: Items, nuisances: Items, recorded: list[Recorded]) -> WideCase:
    """The case with what everything costs along the motion that was recorded."""
    items, noise = (*causes, *nuisances), noise_of(world, recorded)
    torque, gap = torque_and_gap(world, recorded)
    more = np.maximum(0.0, 2.0 * gap - noise) if kind == "clean" else 0.0 * noise
    levels = {
        name: Level(*(float(f"{value:.4g}") for value in (torque[k], gap[k], noise[k] + more[k])))
        for k, name in enumerate(world.names)
    }
    there = tuple(item_of(world, item, items, recorded, levels[item.axis]) for item in items)
    first = world.names.index(causes[0].axis) if causes else 0
    return WideCase(
        number=0,
        seed=0,
        machine=world.machine.family,
        kind=kind,
        causes=there[: len(causes)],
        formulation=LAWS[world.laws[first]],
        axes=world.names,
        friction=tuple(LAWS[law] for law in world.laws),
        drive=DRIVES[world.drives[0].law] if world.drives[0].told else "untold",
        nuisances=(*there[len(causes) :], *_presliding(world, causes, recorded, levels)),
        levels=levels,
        attempt=0,
        slower=world.slower,
        micro=world.micro,
        noise=tuple(float(f"{value:.6g}") for value in more / quieted(recorded)),
    )


def _presliding(world: World, causes: Items, recorded: list[Recorded], levels: dict[str, Level]) -> tuple[Item, ...]:
    """That of every axis which has none as its cause, as items."""
    cost = Along.recorded(world, [(one.plan, one.motion, one.window.band) for one in recorded]).presliding(world)
    return tuple(
        weighed(Cause("presliding", name, {"displacement": micro}), float(cost[k]), levels[name])
        for k, (name, micro) in enumerate(zip(world.names, world.micro, strict=True))
        if not has_presliding(causes, name)
    )


def _sound(run: Run, plan: Plan, world: World) -> bool:
    """Whether every axis follows what it is asked, as late as its loop is slow, and its torque neither rings nor ends."""
    return bool(np.isfinite(run.given).all()) and all(_follows(run, plan, world, k) for k in range(len(world.names)))


def _follows(run: Run, plan: Plan, world: World, k: int) -> bool:
    drive, known, torque = world.drives[k], world.machine.nominal[k], run.given[:, k]
    behind = float(np.abs(run.position[:, k] - plan.position[:, k]).max())
    lag = world.slower / (2.0 * np.pi * drive.bandwidth * drive.position_share)
    smooth = np.convolve(torque, np.full(41, 1.0 / 41.0), mode="same")
    return bool(
        behind < 0.2 * travel(world.machine, k) + 2.0 * lag * world.machine.limits[k].max_speed
        and rms(torque - smooth) < 0.3 * rms(smooth) + 0.05 * known.rated_torque
        and np.mean(np.abs(torque) > 2.9 * known.rated_torque) < 0.02
    )
