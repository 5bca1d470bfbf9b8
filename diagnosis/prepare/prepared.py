"""Recordings made ready: filtered once, on one simulation, with what they can be asked."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

from drivetwin.diagnosis.prepare.asked_torque import AskedTorque, completed, levelled, notes
from drivetwin.diagnosis.prepare.cutoff import chosen_cutoff, motion_cutoff
from drivetwin.diagnosis.prepare.drive_law import law_is_far, law_missing
from drivetwin.diagnosis.prepare.hold_back import hold_back
from drivetwin.diagnosis.prepare.motion import begins, prepare, standstill_of
from drivetwin.diagnosis.prepare.positions import by_the_model, left_out, positions, relative_axes
from drivetwin.diagnosis.prepare.rates import ENOUGH, fast_enough
from drivetwin.diagnosis.prepare.rows import Rows
from drivetwin.diagnosis.prepare.run import Run
from drivetwin.diagnosis.prepare.simulation import Simulation, simulation
from drivetwin.diagnosis.prepare.smoothed import smoothed
from drivetwin.diagnosis.prepare.started import started
from drivetwin.diagnosis.prepare.steadied import steadied
from drivetwin.diagnosis.prepare.testable import Testable, is_absolute, is_integrated, testable
from drivetwin.diagnosis.prepare.turns import placed_within_a_turn
from drivetwin.diagnosis.settings import Settings
from drivetwin.emulator.effects import Effect
from drivetwin.emulator.effects.base import Look
from drivetwin.foundation.errors import UserError
from drivetwin.recording.recording import Recording

ENOUGH_TO_PLACE = 0.1
"""Share of the time of all training recordings that absolute ones must hold, for what is found on them to place the others."""


@dataclass(frozen=True)
class Aside:
    """A recording that is fitted once what was found on others places it. `recording` is as the model places it.

    `zeros` [rad or m]: by how much the model moved its axes; `adrift`: relative axes whose zero it does not tell. `prepare`:
    makes the recording ready, at this or another zero.
    """

    recording: Recording
    zeros: Mapping[str, float]
    adrift: tuple[str, ...]
    prepare: Callable[[Recording], Run]

    @property
    def relative(self) -> tuple[str, ...]:
        """Axes whose position has a zero of the recording's own."""
        return relative_axes(self.recording)


@dataclass(frozen=True)
class Asking:
    """What says, beside the rows, which effects an axis can be asked for. `absolute`: its position means the same in all that
    is fitted; `turned`: axes of which it does within a turn of the motor; `dated`: their times count from one start.
    """

    absolute: Mapping[str, bool]
    turned: frozenset[str]
    unrecorded: Mapping[str, AskedTorque]
    dated: bool

    def of(self, rows: Rows, runs: Sequence[Run]) -> dict[str, Testable]:
        """By axis; `runs` are the rows' as they were recorded."""
        return {
            axis: testable(
                rows,
                axis,
                self.absolute[axis],
                axis in self.turned,
                law_missing(runs, axis),
                self.unrecorded.get(axis),
                dated=self.dated,
            )
            for axis in rows.axes
        }


@dataclass(frozen=True)
class Prepared:
    """What is fitted (`runs`, `rows`) and what is not (`checks`); `held_back`: they are of the same recordings.

    `standstill` [rad/s or m/s]: of each axis, the middle one of its recordings'. `notes`: what a reader needs to
    know of what was used. `adrift`: by name of a validation recording, axes whose position has a zero that nothing tells yet.
    `aside`: recordings to be fitted once they are placed.
    `turned_one_way`: axes that are placed by a wave of their torque, and go one way in every recording.
    `apart` [s]: by how much torque and position of each axis still differ in time, once that is known.
    """

    simulation: Simulation
    runs: Sequence[Run]
    checks: Sequence[Run]
    rows: Rows
    cutoff_hz: float
    standstill: Mapping[str, float]
    asking: Asking
    testable: Mapping[str, Testable]
    held_back: bool
    notes: tuple[str, ...]
    adrift: Mapping[str, tuple[str, ...]]
    aside: tuple[Aside, ...] = ()
    turned_one_way: frozenset[str] = frozenset()
    apart: Mapping[str, float] = field(default_factory=dict)

    @property
    def absolute(self) -> Mapping[str, bool]:
        """Whether the position of an axis means the same in all recordings on which its effects of the position are sought."""
        return self.asking.absolute

    def with_more(self, more: Sequence[Run], told: Sequence[str]) -> Prepared:
        """The same with the recordings that were left aside fitted too, as they are placed now; `told`: notes of that."""
        runs = [*self.runs, *more]
        rows = replace(self.rows, runs=[run.thinned() for run in runs])
        asked = self.asking.of(rows, runs)
        return replace(self, runs=runs, rows=rows, testable=asked, aside=(), notes=(*self.notes, *told))

    def waves_alike(self, kind: type[Effect], axis: str) -> tuple[str, ...]:
        """Names of other effects whose wave is that of an effect, half a period off, while every recording goes one way.

        One changes its sign with the direction and the other does not; where its zero is, nothing tells.
        """
        if axis not in self.turned_one_way or Look.WAVE not in kind.looks:
            return ()
        others = [one for one in self.testable[axis].kinds if Look.WAVE in one.looks]
        return tuple(one.name for one in others if (Look.LEVEL in one.looks) != (Look.LEVEL in kind.looks))

    def aligned(self, late: Mapping[str, float], apart: Mapping[str, float]) -> Prepared:
        """The same with the torque of some axes read `late` [s] earlier: it was recorded after the motion that needed it.

        `apart` [s]: what of the fit's timing that leaves.
        """
        told = [f"{axis}: its torque is recorded {each * 1e3:.2g} ms late; read so much earlier" for axis, each in late.items()]
        runs, checks = [run.aligned(late) for run in self.runs], [run.aligned(late) for run in self.checks]
        rows = replace(self.rows, runs=[run.aligned(late) for run in self.rows.runs])
        return replace(self, runs=runs, checks=checks, rows=rows, notes=(*self.notes, *told), apart=apart)


def prepared(
    model: Path, training: Sequence[Recording], validation: Sequence[Recording], settings: Settings, *, aside: bool = True
) -> Prepared:
    """Raises UserError where a recording's axes do not fit the model, or no axis moves in what is fitted.

    `aside`: whether training recordings with a relative position may wait for what is found on the others. They do not where no
    validation is given, for blocks of every recording that is fitted are held back then.
    """
    given_to_fit, given_to_check = training, validation
    held_back = not validation
    twin = simulation(model, training[0].info.axes)
    whole = completed(model, twin, training, validation, settings)
    training, validation, unrecorded = whole.training, whole.validation, whole.asked
    validation, slow = fast_enough(training, validation)
    cutoff = settings.cutoff_hz or chosen_cutoff([*training, *validation])
    steady = steadied(twin, training, validation, cutoff, settings.model_error)
    smooth = smoothed(twin, steady.training, steady.validation, cutoff, steady.by_velocity)
    training, validation = smooth.training, smooth.validation
    floating = [axis for axis, how in unrecorded.items() if how.floats]
    waits = aside and not held_back
    fit_at = positions(twin, training, cutoff, floating, ENOUGH_TO_PLACE if waits else ENOUGH)
    check_at = positions(twin, validation, cutoff, floating)
    more_at = by_the_model(twin, fit_at.aside if waits else (), cutoff, floating)
    training, more, validation = (levelled(twin, part.recordings, floating) for part in (fit_at, more_at, check_at))
    recordings = [*training, *more, *validation]
    motion = motion_cutoff(recordings, twin.home_inertia(), steady.by_velocity)
    standstill = standstill_of(twin, recordings, min(cutoff, motion))
    ways = [
        partial(
            prepare,
            twin,
            cutoff_hz=cutoff,
            motion_hz=motion,
            stands=still,
            began=start,
            reversal=settings.reversal,
            asked=unrecorded,
        )
        for still, start in zip(standstill, begins(recordings), strict=True)
    ]
    every = [way(recording) for way, recording in zip(ways, recordings, strict=True)]
    given, first, last = ", ".join(one.name for one in training), len(training), len(training) + len(more)
    fitted, beside = every[:first], every[first:last]
    absolute = {axis: is_absolute(fitted, axis) for axis in twin.axes}
    if more and not _places_others(fitted, absolute, more):
        return prepared(model, given_to_fit, given_to_check, settings, aside=False)
    turned = placed_within_a_turn(twin, fitted, every[last:], [axis for axis in twin.axes if not absolute[axis]])
    clock = started(twin.axes, [*turned.runs, *beside], turned.checks)
    runs, checks = hold_back(clock.runs[:first]) if held_back else (clock.runs[:first], clock.checks)
    if not checks:
        raise UserError(f"{given}: too short to hold a quarter back for validation: record longer, or give --validate")
    foreign = [axis for axis in twin.axes if law_is_far(runs, axis)]
    runs, checks = ([run.of_unknown_loops(foreign) for run in part] for part in (runs, checks))
    rows = Rows(twin, [run.thinned() for run in runs], settings.blocks)
    if not any(rows.count(axis) for axis in twin.axes):
        raise UserError(
            f"{given}: no axis moves faster than its position's noise: nothing can be asked of them; "
            "record a motion, or give the true `position_resolution`"
        )
    asking = Asking(absolute, turned.axes, unrecorded, dated=bool(clock.notes))
    adrift = {name: tuple(axis for axis in axes if axis not in turned.axes) for name, axes in check_at.adrift.items()}
    middle = {axis: sorted(each[axis].velocity for each in standstill)[len(standstill) // 2] for axis in twin.axes}
    later = [_began(one) - _began(run) for one, run in zip(clock.runs[first:], beside, strict=True)]
    waiting = tuple(
        Aside(one, more_at.zeros[one.name], more_at.adrift[one.name], partial(_prepared_later, way, shift, foreign))
        for one, way, shift in zip(more, ways[first:last], later, strict=True)
    )
    unused = (() if waits else left_out(fit_at)) + left_out(check_at)
    placed = (*fit_at.notes, *unused, *check_at.notes, *turned.notes, *clock.notes)
    told = (*notes(unrecorded), *slow, *steady.notes, *smooth.notes, *placed)
    asked = asking.of(rows, runs)
    return Prepared(
        twin,
        runs,
        checks,
        rows,
        cutoff,
        middle,
        asking,
        asked,
        held_back,
        told,
        adrift,
        waiting,
        turned_one_way=turned.one_way,
    )


def _places_others(runs: Sequence[Run], absolute: Mapping[str, bool], others: Sequence[Recording]) -> bool:
    """Whether recordings of absolute axes can place others: something moves in them, and no position was integrated, which
    begins anywhere and does not say so.
    """
    moves = any(run.axes[axis].fitted.any() for run in runs for axis in absolute)
    every = [*(run.recording for run in runs), *others]
    return moves and all(absolute.values()) and not any(is_integrated(one, axis) for one in every for axis in absolute)


def _prepared_later(way: Callable[[Recording], Run], shift: float, foreign: Sequence[str], recording: Recording) -> Run:
    """A recording made ready as others, its time counted from `shift` [s] before."""
    return way(recording).later(shift).of_unknown_loops(foreign)


def _began(run: Run) -> float:
    return float(next(iter(run.axes.values())).motion.time[0])
