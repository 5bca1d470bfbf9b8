"""Which proposals are added first: the best of all, and not two that imitate it from an axis that only feels it."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
from carts_bench import CUTOFF, GEAR, LOWER, MODEL, MOTOR, PERIOD, TIME, UPPER, VISCOUS, slope, waves

from drivetwin.diagnosis.prepare.prepared import prepared
from drivetwin.diagnosis.prepare.run import AxisRun, Run
from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.bench import Bench, bench_of
from drivetwin.diagnosis.weigh.moves import Search, _settled
from drivetwin.diagnosis.weigh.pair import Pair, empty
from drivetwin.diagnosis.weigh.proposal import Proposal
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.state import State, state_of
from drivetwin.emulator.effects import AxisEffect, PlacedEffect
from drivetwin.emulator.effects.elasticity import Elasticity
from drivetwin.emulator.effects.torque_offset import TorqueOffset
from drivetwin.emulator.effects.viscous import Viscous
from drivetwin.recording.recording import Recording, RecordingInfo

NOISE = 0.02
LOWER_GAP, UPPER_GAP, OFFSET = 25.0, 10.0, 10.0
"""Of a spring under the lower cart, which the upper one feels, and of a force on the upper one [N]."""
SEEN = 20.0
"""Of that on the lower cart, what a spring of the upper one explains [N]."""


def gap(rate: float, time: Array = TIME) -> Array:
    """A force of 1 N that no parameter of the model explains (n,)."""
    return np.asarray(np.sin(2.0 * np.pi * rate * time))


def felt_gap(rate: float, run: Run, own: AxisRun) -> Array:
    return run.felt(own, gap(rate, own.motion.time))


def bench(folder: Path) -> Bench:
    """Two carts: both lack what a spring costs, the upper one a force as well."""
    lower, upper = waves((0.15, 0.4, 0.0), (0.01, 2.1, 1.0)), waves((0.2, 0.6, 0.5), (0.02, 2.7, 0.0))
    rng = np.random.default_rng(1)
    torques = {
        "lower": (LOWER + UPPER) * slope(slope(lower)) + UPPER * slope(slope(upper)) + LOWER_GAP * gap(11.0),
        "upper": UPPER * slope(slope(lower)) + (MOTOR + UPPER) * slope(slope(upper)) + VISCOUS * slope(upper),
    }
    torques["upper"] = torques["upper"] + UPPER_GAP * gap(13.0) + OFFSET * gap(17.0)
    read = {"lower": lower, "upper": upper}
    columns = {
        axis: {"position": read[axis], "torque": torque + NOISE * rng.standard_normal(len(TIME))}
        for axis, torque in torques.items()
    }
    axes = {axis: {"joint": axis, "actuator": axis, "gear_ratio": of} for axis, of in (("lower", 1.0), ("upper", GEAR))}
    info = RecordingInfo.model_validate({"schema": "recording/1", "machine": "carts", "sample_period": PERIOD, "axes": axes})
    recording = Recording("waves", info, TIME, columns)
    path = folder / "carts.xml"
    path.write_text(MODEL, encoding="utf-8")
    ready = prepared(path, [recording], [recording], Settings(cutoff_hz=CUTOFF))
    return bench_of(ready.rows, Settings(), ready.absolute)


def proposed(state: State, axis: str, effect: AxisEffect, costs: dict[str, tuple[float, float]]) -> Proposal:
    """An effect that costs so many newtons at a rate on each cart, and what the set gains by it."""
    rows = state.rows
    felt = {on: size * rows.rows(on, partial(felt_gap, rate)) for on, (size, rate) in costs.items()}
    column = state.system.whiten(felt)
    gained = state.system.fit_tuned((), column, frozenset()).evidence - state.fit.evidence
    left = state.energy(state.patched, (), felt)
    taken = {on: state.left[on] - left[on] for on in felt}
    return Proposal(PlacedEffect(axis, effect, {}), gained, 0.0, taken, column, (), frozenset(), 1)


def test_the_best_of_all_comes_before_two_that_gain_more_together(tmp_path: Path) -> None:
    own = bench(tmp_path)
    state = empty(own, own).whole
    true = proposed(state, "lower", Elasticity(9000.0), {"lower": (LOWER_GAP, 11.0), "upper": (UPPER_GAP, 13.0)})
    imitation = proposed(state, "upper", Elasticity(7000.0), {"lower": (SEEN, 11.0), "upper": (UPPER_GAP, 13.0)})
    force = proposed(state, "upper", TorqueOffset(OFFSET), {"upper": (OFFSET, 17.0)})
    search = Search(Proposer(own, own, {"lower": [Elasticity], "upper": [Elasticity, TorqueOffset]}, {}), lambda *_: None)
    together = search._of_all(state, [imitation, force])
    assert true.score > imitation.score
    assert together > true.score
    assert search.best([true, imitation, force], state)[0] is true


def test_what_is_added_on_an_axis_leaves_the_effects_of_others_where_they_are(tmp_path: Path) -> None:
    """All settle before an exchange; to move them all at every step takes the time of as many axes."""
    own = bench(tmp_path)
    stands, added = (placed(own.rows, axis, effect) for axis, effect in (("upper", Viscous(1.0)), ("lower", Viscous(2.0))))
    state = state_of(own, [stands], own.white, {})
    found = _settled(Pair(state, state), [added])
    effects = {one.axis: one for one in found.effects}
    assert effects["upper"] is stands
    assert effects["lower"] != added
