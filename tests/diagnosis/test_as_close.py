"""What leaves hardly more of the gap is not distinguished, however many nats little noise gives for it: torque of a formula."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rig_bench import Swing, ready, strokes

from drivetwin.diagnosis.propose.search import Begun
from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.averaging import Answer, Unexplained, weighed
from drivetwin.diagnosis.weigh.bench import bench_of
from drivetwin.diagnosis.weigh.colouring import coloured
from drivetwin.diagnosis.weigh.proposal import Family, Proposal
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.state import State, state_of
from drivetwin.diagnosis.weigh.yielding import settled_on
from drivetwin.emulator.effects import Effect
from drivetwin.emulator.effects.coulomb import Coulomb
from drivetwin.emulator.effects.stribeck import Stribeck

LEVEL, FADES = 1.0, 0.4
"""By which the friction is higher than modelled [N·m], and the speed over which a bump on it fades [rad/s]."""


def higher(bump: float) -> Stribeck:
    """The level with as much more of it at the lowest speeds."""
    return Stribeck(2.5 + bump * LEVEL, FADES, 1.0)


def answered(folder: Path, bump: float, settings: Settings) -> Answer:
    """Of a Stribeck curve, with the level alone as the other that may be there."""

    def friction(at: Swing) -> Array:
        return np.asarray(LEVEL * (1.0 + bump * np.exp(-np.abs(at.velocity) / FADES)) * np.sign(at.velocity))

    prepared = ready(folder, strokes(1, 12.0, {"turn": friction}, noise=1.0))
    bench = bench_of(prepared.rows, settings, prepared.absolute)
    proposer = Proposer(bench, bench, {"turn": [Coulomb, Stribeck]}, {})
    nothing = state_of(bench, [], bench.white, {})
    curve, level = (proposed(proposer, nothing, one) for one in (higher(bump), Coulomb(2.5)))
    assert curve.settled is not None
    noise = coloured(curve.settled, ())
    curve, level = (replace(one, settled=settled_on(of_noise(noise, one))) for one in (curve, level))
    family = Family(curve.effect, noise.of([]), [curve, level])
    return weighed(family, Unexplained({"turn": 0.0, "lift": 0.0}, {"turn": 0.0, "lift": 0.0}), settings)


def proposed(proposer: Proposer, nothing: State, effect: Effect) -> Proposal:
    found = proposer.evaluated(nothing, Begun("turn", effect, 0.0, 1))
    assert found is not None
    return replace(found, settled=settled_on(nothing.of([found.effect])))


def of_noise(noise: State, one: Proposal) -> State:
    assert one.settled is not None
    return noise.of(one.settled.effects)


@pytest.mark.parametrize(("bump", "listed"), [(0.4, ["coulomb"]), (0.8, [])])
def test_a_small_bump_is_no_reason_to_call_it_a_curve(bump: float, listed: list[str], tmp_path: Path) -> None:
    assert list(answered(tmp_path, bump, Settings()).indistinguishable) == listed


def test_by_nats_alone_a_small_bump_would_be_one(tmp_path: Path) -> None:
    assert answered(tmp_path, 0.4, Settings(as_close=0.0)).indistinguishable == ()
