"""Recordings made ready: filtered once, on one simulation, with what they can be asked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from drivetwin.diagnosis.prepare.asked_torque import completed, levelled, notes
from drivetwin.diagnosis.prepare.cutoff import chosen_cutoff, motion_cutoff
from drivetwin.diagnosis.prepare.drive_law import law_is_far, law_missing
from drivetwin.diagnosis.prepare.hold_back import hold_back
from drivetwin.diagnosis.prepare.motion import begins, prepare, standstill_of
from drivetwin.diagnosis.prepare.positions import positions
from drivetwin.diagnosis.prepare.rates import fast_enough
from drivetwin.diagnosis.prepare.rows import Rows
from drivetwin.diagnosis.prepare.run import Run
from drivetwin.diagnosis.prepare.simulation import Simulation, simulation
from drivetwin.diagnosis.prepare.smoothed import smoothed
from drivetwin.diagnosis.prepare.started import started
from drivetwin.diagnosis.prepare.steadied import steadied
from drivetwin.diagnosis.prepare.testable import Testable, is_absolute, testable
from drivetwin.diagnosis.prepare.turns import placed_within_a_turn
from drivetwin.diagnosis.settings import Settings
from drivetwin.emulator.effects import Effect
from drivetwin.emulator.effects.base import Look
from drivetwin.foundation.errors import UserError
from drivetwin.recording.recording import Recording


@dataclass(frozen=True)
class Prepared:
    """What is fitted (`runs`, `rows`) and what is not (`checks`); `held_back`: they are of the same recordings.

    `standstill` [rad/s or m/s]: of each axis, the middle one of its recordings'. `notes`: what a reader needs to
    know of what was used. `adrift`: by name of a validation recording, axes whose position has a zero that nothing tells yet.
    `turned_one_way`: axes that are placed by a wave of their torque, and go one way in every recording.
    `apart` [s]: by how much torque and position of each axis still differ in time, once that is known.
    """

    simulation: Simulation
    runs: Sequence[Run]
    checks: Sequence[Run]
    rows: Rows
    cutoff_hz: float
    standstill: Mapping[str, float]
    absolute: Mapping[str, bool]
    testable: Mapping[str, Testable]
    held_back: bool
    notes: tuple[str, ...]
    adrift: Mapping[str, tuple[str, ...]]
    turned_one_way: frozenset[str] = frozenset()
    apart: Mapping[str, float] = field(default_factory=dict)

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


def prepared(model: Path, training: Sequence[Recording], validation: Sequence[Recording], settings: Settings) -> Prepared:
    """Raises UserError where a recording's axes do not fit the model, or no axis moves in what is fitted."""
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
    fit_at, check_at = (positions(twin, part, cutoff, floating) for part in (training, validation))
    training, validation = (levelled(twin, part.recordings, floating) for part in (fit_at, check_at))
    recordings = [*training, *validation]
    motion = motion_cutoff(recordings, twin.home_inertia(), steady.by_velocity)
    standstill = standstill_of(twin, recordings, min(cutoff, motion))
    each = zip(recordings, standstill, begins(recordings), strict=True)
    every = [prepare(twin, one, cutoff, motion, still, start, settings.reversal, unrecorded) for one, still, start in each]
    given, fitted = ", ".join(one.name for one in training), every[: len(training)]
    absolute = {axis: is_absolute(fitted, axis) for axis in twin.axes}
    turned = placed_within_a_turn(twin, fitted, every[len(training) :], [axis for axis in twin.axes if not absolute[axis]])
    clock = started(twin.axes, turned.runs, turned.checks)
    runs, checks = hold_back(clock.runs) if held_back else (clock.runs, clock.checks)
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
    asked = {
        axis: testable(
            rows,
            axis,
            absolute[axis],
            axis in turned.axes,
            law_missing(runs, axis),
            unrecorded.get(axis),
            dated=bool(clock.notes),
        )
        for axis in twin.axes
    }
    adrift = {name: tuple(axis for axis in axes if axis not in turned.axes) for name, axes in check_at.adrift.items()}
    middle = {axis: sorted(each[axis].velocity for each in standstill)[len(standstill) // 2] for axis in twin.axes}
    placed = (*fit_at.notes, *check_at.notes, *turned.notes, *clock.notes)
    told = (*notes(unrecorded), *slow, *steady.notes, *smooth.notes, *placed)
    return Prepared(twin, runs, checks, rows, cutoff, middle, absolute, asked, held_back, told, adrift, turned.one_way)
