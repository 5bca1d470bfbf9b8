"""Draws the cases of the wide generator: worlds, causes of any size from 1 to 30 %, small nuisances beside them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivetwin.blind.case import Case, Cause, Kind
from drivetwin.blind.wide.channel import passed
from drivetwin.blind.wide.effects import DRIVE, LIBRARY, NUISANCES, Ground, Sizable, suits
from drivetwin.blind.wide.families import FAMILIES, draw_family
from drivetwin.blind.wide.foreign import FOREIGN
from drivetwin.blind.wide.friction import yielding_way
from drivetwin.blind.wide.machines import Draw, Machine
from drivetwin.blind.wide.motion import Plan
from drivetwin.blind.wide.robots import ROBOTS, draw_robot, robot_files
from drivetwin.blind.wide.simulator import Motion, Run
from drivetwin.blind.wide.truth import DRIVES, LAWS
from drivetwin.blind.wide.world import World, draw_world, motion_of, rms, slowed, travel
from drivetwin.foundation.children import end_with_parent
from drivetwin.foundation.errors import UserError

SHARES: dict[Kind, float] = {"double": 0.15, "four": 0.05, "clean": 0.15, "foreign": 0.15}
"""Of all cases; the rest have one cause."""

SIZES = (0.01, 0.3)
"""Torque of a cause over the axis's, both rms in motion; any octave as likely."""

BESIDE = (0.02, 0.1)
"""Energy of a nuisance over that of the cause."""

WEIGHTS = {"rotary": 1.0, "pendulum": 1.0, "linear": 1.0, "lift": 0.8, "gantry": 0.8, "arm2": 0.8, "arm3": 0.8, "scara": 0.8}
"""How often a family is drawn; 0.6 for those that are not named, 3 for public robots together."""

FOUR = 4

_TRIES, _PATIENCE, _STEPS, _SLOWER = 600, 6, 5, 5
_CLOSE, _HIDDEN, _REACHED = 0.15, 0.2, 0.8
_STRIDE = 4


@dataclass(frozen=True)
class Item(Cause):
    """An effect that is there, what it costs over the axis's torque (rms in motion), and its share of the gap's energy."""

    size: float
    share: float


@dataclass(frozen=True)
class Level:
    """Of one axis in motion, rms [N·m or N]: torque, noise-free gap to the nominal model, noise of the recorded torque."""

    torque: float
    gap: float
    noise: float


@dataclass(frozen=True)
class WideCase(Case):
    """A case of this generator; `machine` is its family, `causes` and `nuisances` are items, `levels` go by axis.

    `attempt`, `slower` and `micro` (n,) make the same world again; `noise` (n,) is added to the channels of a clean case.
    """

    axes: tuple[str, ...]
    friction: tuple[str, ...]
    drive: str
    nuisances: tuple[Item, ...]
    levels: dict[str, Level]
    attempt: int
    slower: float
    micro: tuple[float, ...]
    noise: tuple[float, ...]

    @property
    def all_effects(self) -> tuple[Cause, ...]:
        """Causes and nuisances, a position that is recorded late as the library's `delay`."""
        return (*self.causes, *(_of_library(item) for item in self.nuisances))

    @property
    def items(self) -> tuple[Cause, ...]:
        """Everything that acts, but for the presliding that every axis has."""
        return (*self.causes, *(item for item in self.nuisances if item.effect != "presliding"))


def _of_library(item: Cause) -> Cause:
    late = item.effect == "out_of_step" and item.parameters["delay"] > 0.0
    return Cause("delay", item.axis, item.parameters) if late else item


@dataclass(frozen=True)
class Choice:
    """What may be drawn: machine families, effects of the library, foreign ones; `robots` holds public models, None without."""

    families: tuple[str, ...]
    effects: tuple[str, ...]
    foreign: tuple[str, ...]
    robots: Path | None = None


def choice(only: Sequence[str] = (), without: Sequence[str] = (), robots: Path | None = None) -> Choice:
    """What is left of all families and effects; `only` keeps what it names of each kind of name that it names at all.

    Raises UserError for a name that there is not, or where nothing is left of a kind.
    """
    groups = (tuple(FAMILIES) + ((ROBOTS,) if robots else ()), tuple(LIBRARY), tuple(FOREIGN))
    known = {name for group in groups for name in group}
    for name in (*only, *without):
        if name not in known:
            raise UserError(f"{name}: no family or effect of this generator; there are {', '.join(sorted(known))}")
    kept = []
    for group in groups:
        named = tuple(name for name in group if name in only) or group
        left = tuple(name for name in named if name not in without)
        if not left:
            raise UserError(f"nothing is left to draw of {', '.join(group)}; name fewer families or effects")
        kept.append(left)
    return Choice(kept[0], kept[1], kept[2], robots)


def draw_wide(count: int, seed: int, allowed: Choice, workers: int = 1) -> tuple[WideCase, ...]:
    """`count` cases, the same ones for the same arguments however many `workers` draw them."""
    return tuple(each_wide(count, seed, allowed, workers))


def each_wide(count: int, seed: int, allowed: Choice, workers: int = 1) -> Iterator[WideCase]:
    """The cases of `draw_wide` one after the other, as they are drawn."""
    draw = np.random.default_rng([seed, 11])
    plans = _plans(draw, count, allowed)
    draw.shuffle(plans)
    seeds = [int(own) for own in draw.choice(2**31, size=count, replace=False)]
    drawn = partial(_case, allowed=allowed)
    numbers, kinds, effects = range(count), [kind for kind, _ in plans], [effects for _, effects in plans]
    if workers == 1 or count == 1:
        yield from map(drawn, numbers, seeds, kinds, effects)
        return
    with ProcessPoolExecutor(workers, get_context("spawn"), end_with_parent, (os.getpid(),)) as pool:
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


def _plans(draw: Draw, count: int, allowed: Choice) -> list[tuple[Kind, tuple[str, ...]]]:
    """Kind of each case and its effects; singles, pairs and foreign ones go round their lists."""
    effects, foreign = _round(draw, allowed.effects), _round(draw, allowed.foreign)
    counts = {kind: int(share * count + 0.5) for kind, share in SHARES.items()}
    counts["single"] = count - sum(counts.values())
    plans: list[tuple[Kind, tuple[str, ...]]] = []
    for kind, number in counts.items():
        for _ in range(number):
            plans.append((kind, _effects_of(kind, effects, foreign)))
    return plans


def _effects_of(kind: Kind, effects: Iterator[str], foreign: Iterator[str]) -> tuple[str, ...]:
    match kind:
        case "clean":
            return ()
        case "foreign":
            return (next(foreign),)
        case "double":
            return (next(effects), next(effects))
        case "four":
            return tuple(next(effects) for _ in range(FOUR))
        case _:
            return (next(effects),)


def _round(draw: Draw, names: Sequence[str]) -> Iterator[str]:
    while True:
        yield from (names[index] for index in draw.permutation(len(names)))


def _family(draw: Draw, allowed: Choice) -> str:
    """A family's name, of a public robot its file's."""
    weights = np.array([3.0 if name == ROBOTS else WEIGHTS.get(name, 0.6) for name in allowed.families])
    name = allowed.families[int(draw.choice(len(weights), p=weights / weights.sum()))]
    if name != ROBOTS:
        return name
    assert allowed.robots is not None
    return str(draw.choice(robot_files(allowed.robots)))


def _case(number: int, seed: int, kind: Kind, effects: tuple[str, ...], allowed: Choice) -> WideCase:
    """The first attempt at which machine, effects and drives go together; raises UserError where none does.

    A family that has been drawn is kept for some attempts, so that those that are hard to fit are not drawn less often.
    """
    for attempt in range(_TRIES):
        draw = np.random.default_rng([seed, 3, attempt])
        family = _family(np.random.default_rng([seed, 4, attempt // _PATIENCE]), allowed)
        world = _world(seed, attempt, family, allowed.robots)
        placed = _placed(draw, world.machine, kind, effects)
        if placed is None:
            continue
        found = _Drawing(draw, world, kind).case(placed)
        if found is not None:
            return replace(found, number=number, seed=seed, machine=family, attempt=attempt)
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


class _Drawing:
    """Sizes the effects of one case along the first validation plan, moves the machine, and weighs what each costs."""

    def __init__(self, draw: Draw, world: World, kind: Kind) -> None:
        self.draw, self.world, self.kind = draw, world, kind
        self.plan = next(plan for plan in world.plans if plan.name == "validate_1")
        self.motion = motion_of(self.plan.position, _STRIDE)
        self.moving = world.moving(self.motion)
        self.nominal = world.nominal_needs(self.motion)
        self.torque = np.array([rms(self.nominal[moves, k]) for k, moves in enumerate(self.moving.T)])

    def case(self, placed: list[tuple[str, int]]) -> WideCase | None:
        """The case, but for its names; None where an axis hardly moves, a cause stays too small or hidden, or drives swing."""
        if self.torque.min() <= 0.0:
            return None
        causes: tuple[Cause, ...] = ()
        scale, least = 0.0, max(SIZES[0], self._least(placed))
        if least >= SIZES[1]:
            return None
        for effect, axis in placed:
            size = float(np.exp(self.draw.uniform(np.log(least), np.log(SIZES[1]))))
            cause, cost = self._sized({**LIBRARY, **FOREIGN}[effect], effect, axis, size * self.torque[axis], causes)
            if cost < _REACHED * SIZES[0] * self.torque[axis]:
                return None
            causes, scale = (*causes, cause), max(scale, cost / self.torque[axis])
        scale = scale or self._quiet()
        if not self._stiffened(causes, scale) and self.kind != "clean":
            return None
        return self._moved(causes, self._nuisances(causes, [axis for _, axis in placed], scale))

    def _least(self, placed: list[tuple[str, int]]) -> float:
        """Size below which a cause is hidden by presliding, be it the stiffest on every axis: a fifth of the cause's energy."""
        if not placed:
            return 0.0
        own = [axis for effect, axis in placed if effect == "presliding"]
        stiff = replace(self.world, micro=tuple(float(way) for way in self._stiffest()))
        costs = self._presliding(stiff) / self.torque
        worst = max((float(cost) for k, cost in enumerate(costs) if k not in own), default=0.0)
        return float(worst / _HIDDEN**0.5)

    def _stiffest(self) -> NDArray[np.float64]:
        return np.array([yielding_way(link.slide)[0] for link in self.world.machine.links])

    def _quiet(self) -> float:
        """What may be there of a clean case, rms over the torque's: some of the noise."""
        noise = np.array([np.hypot(one.torque_noise, one.torque_quantum / 12.0**0.5) for one in self.world.channels])
        return float(np.min(0.6 * noise / self.torque))

    def _ground(self, axis: int) -> Ground:
        machine, limit, moves = self.world.machine, self.world.machine.limits[axis], self.moving[:, axis]
        return Ground(
            draw=self.draw,
            machine=machine,
            axis=axis,
            torque=float(self.torque[axis]),
            top_torque=float(np.abs(self.nominal[moves, axis]).max()),
            links=self.world.links[axis],
            travel=travel(machine, axis),
            middle=(limit.low + limit.high) / 2.0,
            speed=float(np.quantile(np.abs(self.motion.velocity[moves, axis]), 0.98)),
            parent=machine.links[axis].parent,
        )

    def _sized(
        self, make: Callable[[Ground], Sizable], effect: str, axis: int, target: float, before: tuple[Cause, ...]
    ) -> tuple[Cause, float]:
        """An effect and its cost [N·m or N], `target` or as near as its bounds allow (secant on logarithms)."""
        sizable, name = make(self._ground(axis)), self.world.names[axis]
        base = self.world.needs(before, self.motion, self.plan)
        factor, tried = 0.1, list[tuple[float, float, Cause]]()
        for _ in range(_STEPS):
            cause = Cause(effect, name, {key: float(f"{value:.6g}") for key, value in sizable(factor).items()})
            cost = rms(self.world.cost(cause, base, (*before, cause), self.motion, self.plan)[self.moving[:, axis]])
            tried.append((float(np.log(max(cost / target, 1e-9))), factor, cause))
            if abs(tried[-1][0]) < _CLOSE:
                break
            slope = 1.0
            if len(tried) > 1:
                (error, at, _), (last, before_at, _) = tried[-1], tried[-2]
                slope = float(np.clip((error - last) / np.log(at / before_at), 0.4, 3.0))
            factor *= float(np.exp(np.clip(-tried[-1][0] / slope, -4.0, 4.0)))
        error, _, cause = min(tried, key=lambda one: abs(one[0]))
        return cause, target * float(np.exp(error))

    def _stiffened(self, causes: tuple[Cause, ...], scale: float) -> bool:
        """Make presliding cost a tenth of the energy of the causes or less; whether it hides none where it is stiffest."""
        least = self._stiffest()
        free = np.array([not _has_presliding(causes, name) for name in self.world.names])
        for _ in range(_STEPS):
            costs = self._presliding(self.world)
            over = costs / (BESIDE[1] ** 0.5 * scale * self.torque)
            micro = np.array(self.world.micro)
            loud = free & (over > 1.0) & (micro > least)
            if not loud.any():
                break
            softer = np.maximum(least, micro * np.minimum(0.5, over**-2.0))
            self.world = replace(self.world, micro=tuple(float(f"{way:.6g}") for way in np.where(loud, softer, micro)))
        return bool((over[free] < (1.5 * _HIDDEN / BESIDE[1]) ** 0.5).all())

    def _presliding(self, world: World) -> NDArray[np.float64]:
        """Rms in motion (n,) of what presliding costs each axis [N·m or N]."""
        cost = world.needs((), self.motion, self.plan) - self.nominal
        return np.array([rms(cost[moves, k]) for k, moves in enumerate(self.moving.T)])

    def _nuisances(self, causes: tuple[Cause, ...], own: list[int], scale: float) -> tuple[Cause, ...]:
        """Two to four, three in four on an axis of a cause, none of a kind that its axis has."""
        found: tuple[Cause, ...] = ()
        for number in range(int(self.draw.integers(2, 5))):
            near = own and (number == 0 or self.draw.random() < 0.75)
            axis = int(self.draw.choice(own)) if near else int(self.draw.integers(len(self.world.names)))
            taken = {item.effect for item in (*causes, *found) if item.axis == self.world.names[axis]}
            names = [name for name in NUISANCES if name not in taken and suits(name, self.world.machine, axis)]
            name = str(self.draw.choice(names))
            target = float(self.draw.uniform(*BESIDE)) ** 0.5 * scale * float(self.torque[axis])
            found = (*found, self._sized(NUISANCES[name], name, axis, target, (*causes, *found))[0])
        return found

    def _moved(self, causes: tuple[Cause, ...], nuisances: tuple[Cause, ...]) -> WideCase | None:
        """Move the machine through all plans; with slower drives where it swings, None where nothing helps."""
        for _ in range(_SLOWER):
            runs = [(self.world.moved((*causes, *nuisances), plan), plan) for plan in self.world.plans]
            if all(_sound(run, plan, self.world) for run, plan in runs):
                return self._weighed(causes, nuisances, [one for one in runs if one[1].name.startswith("validate")])
            self.world = slowed(self.world)
        return None

    def _weighed(
        self, causes: tuple[Cause, ...], nuisances: tuple[Cause, ...], runs: list[tuple[Run, Plan]]
    ) -> WideCase:
        """The case with what everything costs along the motion that was recorded."""
        world, items = self.world, (*causes, *nuisances)
        recorded = [_Recorded.of(world, items, run, plan) for run, plan in runs]
        noise = np.array([np.hypot(one.torque_noise, one.torque_quantum / 12.0**0.5) for one in world.channels])
        axes = range(len(world.names))
        torque, gap = (
            np.array([rms(np.concatenate([getattr(one, what)[one.moving[:, k], k] for one in recorded])) for k in axes])
            for what in ("torque", "gap")
        )
        more = np.maximum(0.0, 2.0 * gap - noise) if self.kind == "clean" else 0.0 * noise
        levels = {
            name: Level(*(float(f"{value:.4g}") for value in (torque[k], gap[k], noise[k] + more[k])))
            for k, name in enumerate(world.names)
        }
        weighed = tuple(self._item(item, items, recorded, levels[item.axis]) for item in items)
        yielding = zip(world.names, self._presliding(world), world.micro, strict=True)
        presliding = tuple(
            _weighed(Cause("presliding", name, {"displacement": micro}), cost, levels[name])
            for name, cost, micro in yielding
            if not _has_presliding(causes, name)
        )
        first = world.names.index(causes[0].axis) if causes else 0
        return WideCase(
            number=0,
            seed=0,
            machine=world.machine.family,
            kind=self.kind,
            causes=weighed[: len(causes)],
            formulation=LAWS[world.laws[first]],
            axes=world.names,
            friction=tuple(LAWS[law] for law in world.laws),
            drive=DRIVES[world.drives[0].law] if world.drives[0].told else "untold",
            nuisances=(*weighed[len(causes) :], *presliding),
            levels=levels,
            attempt=0,
            slower=world.slower,
            micro=world.micro,
            noise=tuple(float(f"{value:.6g}") for value in more),
        )

    def _item(self, item: Cause, items: tuple[Cause, ...], recorded: list[_Recorded], level: Level) -> Item:
        """An item with its size and share: the others are there, it is taken away."""
        k, others = self.world.names.index(item.axis), tuple(one for one in items if one is not item)
        costs = [
            self.world.cost(item, one.base(item), others, one.motion, one.plan)[one.moving[:, k]] for one in recorded
        ]
        return _weighed(item, rms(np.concatenate(costs)), level)


@dataclass(frozen=True)
class _Recorded:
    """A validation recording without noise: motion of the motors, torque that it needs, gap (k, n) to the nominal model.

    `asked` (k, n) is what the drives asked for.
    """

    plan: Plan
    motion: Motion
    torque: NDArray[np.float64]
    asked: NDArray[np.float64]
    gap: NDArray[np.float64]
    moving: NDArray[np.bool_]

    @classmethod
    def of(cls, world: World, items: tuple[Cause, ...], run: Run, plan: Plan) -> _Recorded:
        """From what the simulator did."""
        motion = Motion(run.position, run.velocity, run.acceleration)
        torque = world.needs(items, motion, plan)
        measured = [passed(torque[:, k], _of(items, name)) for k, name in enumerate(world.names)]
        gap = np.column_stack(measured) - world.nominal_needs(world.read(motion, items))
        return cls(plan, motion, torque, run.asked, gap, world.moving(motion))

    def base(self, item: Cause) -> NDArray[np.float64]:
        """Torque (k, n) on which an item makes its difference: a saturation and a slow current loop on the asked one."""
        return self.asked if item.effect in DRIVE else self.torque


def _weighed(item: Cause, cost: float, level: Level) -> Item:
    """An item by what it costs (rms in motion) [N·m or N]; what tells in the asked torque only is no part of the gap."""
    of = level.gap**2 + (cost**2 if item.effect in DRIVE else 0.0)
    share = min(1.0, cost**2 / of) if of > 0.0 else 0.0
    return Item(item.effect, item.axis, item.parameters, float(f"{cost / level.torque:.4g}"), float(f"{share:.4g}"))


def _has_presliding(causes: Sequence[Cause], axis: str) -> bool:
    return any(cause.effect == "presliding" and cause.axis == axis for cause in causes)


def _of(items: Sequence[Cause], axis: str) -> tuple[Cause, ...]:
    return tuple(item for item in items if item.axis == axis)


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
