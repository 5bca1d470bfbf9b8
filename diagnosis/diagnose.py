"""Diagnosis: recordings to the gap of each axis, its causes, and a simulation that has them. The way: prepare, propose, weigh,
report."""

from __future__ import annotations

import sys
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from threadpoolctl import threadpool_limits

from drivetwin.diagnosis.prepare.prepared import Prepared, prepared
from drivetwin.diagnosis.progress import Progress
from drivetwin.diagnosis.propose.drives import DriveFound, drive_effects
from drivetwin.diagnosis.propose.placing import in_order
from drivetwin.diagnosis.propose.side_by_side import side_by_side
from drivetwin.diagnosis.report.build import build
from drivetwin.diagnosis.report.gaps import axes_with_gap, gaps_of
from drivetwin.diagnosis.report.prediction import Patch
from drivetwin.diagnosis.report.result import Diagnosis
from drivetwin.diagnosis.report.zeros import placed_by, with_aside
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.averaging import preferred, weighed
from drivetwin.diagnosis.weigh.bench import bench_of
from drivetwin.diagnosis.weigh.colouring import coloured
from drivetwin.diagnosis.weigh.moves import Search
from drivetwin.diagnosis.weigh.named import named
from drivetwin.diagnosis.weigh.off import heavier
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.refit import refitted
from drivetwin.diagnosis.weigh.state import State, state_of
from drivetwin.diagnosis.weigh.yielding import settled_on
from drivetwin.emulator.effects import DriveEffect, Effect, ModelEffect
from drivetwin.recording.recording import Recording

TURN = 5e-4
"""After which a thread passes Python's lock on [s]: what runs without it takes less than Python's usual 5 ms."""


@contextmanager
def _threads_that_wait_little() -> Iterator[None]:
    """One for the linear algebra, whose matrices are small; those that search side by side take turns more often."""
    usual = sys.getswitchinterval()
    sys.setswitchinterval(TURN)
    try:
        with threadpool_limits(1):
            yield
    finally:
        sys.setswitchinterval(usual)


def proposer_of(ready: Prepared, settings: Settings) -> Proposer:
    """What every effect that can be asked for on an axis is sought with; on one without a gap, only those of bodies."""
    rows, gaps = ready.rows, axes_with_gap(ready, gaps_of(ready, Patch(), settings))
    without = frozenset(rows.axes) - gaps
    whole = bench_of(rows.searched, settings, ready.absolute, without)
    part = whole if rows.part is rows.searched else bench_of(rows.part, settings, ready.absolute, without)
    kinds = {
        axis: [kind for kind in each.kinds if not issubclass(kind, DriveEffect) and (axis in gaps or _is_felt(kind, gaps))]
        for axis, each in ready.testable.items()
        if rows.count(axis)
    }
    asked = {axis: ready.testable[axis] for axis in kinds}
    veiled = {axis: each.veiled if axis in gaps else () for axis, each in asked.items()}
    return Proposer(whole, part, kinds, {axis: each.askew for axis, each in asked.items()}, veiled)


def on_every_row(state: State, ready: Prepared, settings: Settings) -> State:
    """A set that was found on a part of the rows, moved to what all of them say, in the noise that it leaves there."""
    if state.rows is ready.rows:
        return state
    assert not state.exact, "nominal parameters have other numbers on other rows"
    asked = [(one.axis, type(one.effect)) for one in state.effects if isinstance(one.effect, ModelEffect)]
    every = bench_of(ready.rows, settings, ready.absolute, state.bench.without_gap, asked)
    return settled_on(coloured(state_of(every, state.effects, every.white, state.late), ()))


def _is_felt(kind: type[Effect], gaps: Collection[str]) -> bool:
    """Whether an effect of an axis without a gap may make that of another: a load of an arm is felt by the axes before it."""
    return bool(gaps) and issubclass(kind, ModelEffect)


def _drives(ready: Prepared, late: Mapping[str, float], axes: Iterable[str], settings: Settings) -> list[DriveFound]:
    """Effects between the torque that the loops asked for and what was recorded, that read as `late` [s] as it is."""
    runs = ready.aligned(late, {}).runs
    found = side_by_side(lambda axis: drive_effects(runs, axis, ready.testable[axis].kinds, settings), list(axes))
    return [one for each in found for one in each]


@_threads_that_wait_little()
def diagnose(
    model: Path,
    training: Sequence[Recording],
    validation: Sequence[Recording],
    settings: Settings,
    progress: Progress,
    tables: bool = False,
) -> Diagnosis:
    """The causes of the gap, fitted on `training` and measured on `validation` (if empty, blocks are held back).

    `tables`: what has no name goes into the patch as tables.

    Raises UserError if a recording's axes do not fit the model, or no effect can be tested on any axis.
    """
    progress("filter, inverse dynamics", 0.02)
    ready = prepared(model, training, validation, settings)
    proposer = proposer_of(ready, settings)
    if ready.aside:
        begun = Search(proposer.briefly(), progress).begun()
        ready = with_aside(ready, Patch(in_order(begun.effects)))
        proposer = proposer_of(ready, settings)
    found = Search(proposer, progress).run()
    progress("probabilities", 0.8)
    first = refitted(found.state, heavier(found.state))
    patch = Patch(in_order(first.effects), first.heavier)
    read = placed_by(ready.aligned(first.late, first.state.apart()), patch)
    unexplained = gaps_of(read, patch, settings).unexplained()
    weigh = partial(weighed, unexplained=unexplained, settings=settings)
    answers = side_by_side(weigh, found.families)
    state, answers = preferred(found.state, answers)
    state, answers = named(state, answers, proposer, weigh)
    answers.append(weigh(found.beyond(state)))
    progress("gap, shares, shrink", 0.9)
    state = on_every_row(state, ready, settings)
    values = refitted(state, heavier(state))
    drives = _drives(ready, {**state.recorded_late(), **values.late}, proposer.kinds, settings)
    ready = placed_by(ready.aligned(values.late, values.state.apart()), Patch(in_order(values.effects), values.heavier))
    return build(ready, values, answers, drives, settings, tables)
