"""Play whose search went down a wrong valley is found from all its starts again: torque by the test's own integration."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from repeats import repeated
from rig_bench import COULOMB, MOTOR, TURNING, VISCOUS, Swing, ready, strokes

from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.propose.search import Begun
from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.bench import Bench, bench_of
from drivetwin.diagnosis.weigh.colouring import coloured
from drivetwin.diagnosis.weigh.needed import needed
from drivetwin.diagnosis.weigh.pair import Pair
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.restart import Restart
from drivetwin.diagnosis.weigh.state import state_of
from drivetwin.diagnosis.weigh.yielding import settled_on
from drivetwin.emulator.effects.backlash import Backlash
from drivetwin.emulator.effects.coulomb import Coulomb
from drivetwin.emulator.effects.presliding import Presliding
from drivetwin.emulator.effects.stribeck import Stribeck

TRUE = Backlash(4e-3, 3e3, 8.0, 0.5)
FINER = 20
"""Steps of the integration a sample."""
WIDE, MORE = Backlash(0.02, 3e3, 8.0, 0.0), 4.5
"""A play that takes all of the friction, and by how much that is higher than modelled [N·m]."""
WAY = 2e-3
"""On which friction gives way before it slides [rad], where it does."""


def loose(at: Swing, play: Backlash = TRUE, more: float = 0.0) -> Array:
    """Motor torque less that of the rigid axis: a link between two flanks, with its share of the friction; semi-implicit.

    `more`: by which the level of friction is higher than modelled [N·m].
    """
    step = float(at.time[1] - at.time[0]) / FINER
    fine = np.arange((len(at.time) - 1) * FINER + 1) * step
    motor, speed = (np.interp(fine, at.time - at.time[0], values) for values in (at.position, at.velocity))
    link, behind = TURNING - MOTOR, 1.0 - play.motor_friction_share
    level, viscous = behind * (COULOMB["turn"] + more), behind * VISCOUS["turn"]
    place, moves = float(motor[0]), 0.0
    through = np.zeros(len(fine))
    for k in range(len(fine)):
        twist = motor[k] - place
        if abs(twist) > 0.5 * play.gap:
            push = play.stiffness * (twist - np.copysign(0.5 * play.gap, twist)) + play.damping * (speed[k] - moves)
            through[k] = push if push * twist > 0.0 else 0.0
        driven = moves + step * (through[k] - viscous * moves) / link
        moves = np.copysign(max(0.0, abs(driven) - step * level / link), driven)
        place += step * moves
    way, own = np.sign(at.velocity), play.motor_friction_share
    before = own * ((COULOMB["turn"] + more) * way + VISCOUS["turn"] * at.velocity)
    rigid = COULOMB["turn"] * way + VISCOUS["turn"] * at.velocity
    return np.asarray(through[::FINER] + before - link * at.acceleration - rigid)


def loose_and_yielding(at: Swing) -> Array:
    """The same with the friction of either side on a spring that slips at its level: Coulomb friction that gives way first."""
    step = float(at.time[1] - at.time[0]) / FINER
    fine = np.arange((len(at.time) - 1) * FINER + 1) * step
    motor, speed = (np.interp(fine, at.time - at.time[0], values) for values in (at.position, at.velocity))
    link, level, viscous = TURNING - MOTOR, 0.5 * COULOMB["turn"], 0.5 * VISCOUS["turn"]
    place, moves, held, own = float(motor[0]), 0.0, 0.0, 0.0
    through, before = np.zeros(len(fine)), np.zeros(len(fine))
    for k in range(len(fine)):
        own = float(np.clip(own + level / WAY * step * speed[k], -level, level))
        before[k] = own + viscous * speed[k]
        twist = motor[k] - place
        if abs(twist) > 0.5 * TRUE.gap:
            push = TRUE.stiffness * (twist - np.copysign(0.5 * TRUE.gap, twist)) + TRUE.damping * (speed[k] - moves)
            through[k] = push if push * twist > 0.0 else 0.0
        held = float(np.clip(held + level / WAY * step * moves, -level, level))
        moves += step * (through[k] - viscous * moves - held) / link
        place += step * moves
    rigid = COULOMB["turn"] * np.sign(at.velocity) + VISCOUS["turn"] * at.velocity
    return np.asarray((through + before)[::FINER] - link * at.acceleration - rigid)


def bench_of_play(folder: Path, torque: Callable[[Swing], Array] = loose, longest: float = 20.0) -> Bench:
    made = ready(folder, *(strokes(seed, seconds, {"turn": torque}) for seed, seconds in ((1, longest), (2, 4.0))))
    return bench_of(made.rows, Settings(), made.absolute)


def test_a_level_of_friction_behind_play_is_tried_as_large_as_what_stood_in_its_place(tmp_path: Path) -> None:
    """A small level costs more than none where a large one explains all: play that takes too little friction swings."""
    bench = bench_of_play(tmp_path, partial(loose, play=WIDE, more=MORE), 12.0)
    falling = placed(bench.rows, "turn", Stribeck(8.0, 2.0, 2.0))  # on average the level that explains all
    beside = coloured(state_of(bench, [placed(bench.rows, "turn", WIDE)], bench.white, {}), ())
    proposer, pair = Proposer(bench, bench, {"turn": [Coulomb]}, {}), Pair(beside, beside)
    best = proposer.evaluated(beside, Begun("turn", Coulomb(COULOMB["turn"] + MORE), 0.0, 1))
    assert best is not None
    assert best.score > 100.0
    assert not proposer.proposals(pair)
    (found,) = proposer.instead(pair, falling)
    assert isinstance(found.effect.effect, Coulomb)
    assert found.effect.effect.coulomb == pytest.approx(COULOMB["turn"] + MORE, rel=0.05)
    assert found.score > 0.9 * best.score


@pytest.mark.parametrize("begun", repeated(Backlash(0.0, 300.0, 1.0), TRUE))
def test_play_is_found_again_wherever_its_search_went(begun: Backlash, tmp_path: Path) -> None:
    bench = bench_of_play(tmp_path)
    wrong = state_of(bench, [placed(bench.rows, "turn", begun)], bench.white, {})
    valley = coloured(settled_on(wrong), ())
    found = Restart(Proposer(bench, bench, {"turn": [Backlash]}, {})).restarted(Pair(valley, valley), ())
    (play,) = found.whole.effects
    assert isinstance(play.effect, Backlash)
    assert play.effect.gap == pytest.approx(TRUE.gap, rel=0.1)
    assert play.effect.motor_friction_share == pytest.approx(TRUE.motor_friction_share, abs=0.1)
    assert found.whole.left["turn"] < 0.1


def test_play_that_was_bent_to_a_friction_that_yields_is_found_again_beside_it(tmp_path: Path) -> None:
    bench = bench_of_play(tmp_path, loose_and_yielding, 4.0)
    alone = state_of(bench, [placed(bench.rows, "turn", TRUE)], bench.white, {})
    bent = coloured(settled_on(alone), ())
    found = Restart(Proposer(bench, bench, {"turn": [Backlash, Presliding]}, {})).restarted(Pair(bent, bent), ())
    friction, play = (one.effect for one in found.whole.effects)
    assert isinstance(play, Backlash)
    assert isinstance(friction, Presliding)
    assert play.gap == pytest.approx(TRUE.gap, rel=0.1)
    assert COULOMB["turn"] / friction.stiffness == pytest.approx(WAY, rel=0.5)
    assert found.whole.left["turn"] < 0.1 * bent.left["turn"]


def test_play_takes_over_what_friction_gave_way_by_for_it(tmp_path: Path) -> None:
    """Its flanks are as soft as both together. From where they stood they would not get there, and the friction would stay."""
    bench = bench_of_play(tmp_path, longest=8.0)
    friction, stiff = Presliding(1.1 * TRUE.stiffness, TRUE.damping), replace(TRUE, stiffness=20.0 * TRUE.stiffness)
    both = [placed(bench.rows, "turn", one) for one in (friction, stiff)]
    (play,) = (one.effect for one in needed(state_of(bench, both, bench.white, {})).effects)
    assert isinstance(play, Backlash)
    assert play.stiffness == pytest.approx(TRUE.stiffness, rel=0.02)
    assert play.gap == pytest.approx(TRUE.gap, rel=0.02)
