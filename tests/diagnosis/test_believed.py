"""Which set of effects is left once each has a probability, and how long a wave a search may make."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from plain_bench import Machine

from drivetwin.diagnosis.prepare.prepared import prepared
from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.averaging import Answer, believed
from drivetwin.diagnosis.weigh.state import State, bench_of, first_colours, state_of
from drivetwin.emulator.effects import Effect
from drivetwin.emulator.effects.position_friction import PositionFriction
from drivetwin.emulator.effects.torque_offset import TorqueOffset
from drivetwin.emulator.effects.waves import travel

WAVE, OFFSET = PositionFriction(0.1, 0.5), TorqueOffset(0.3)


@pytest.fixture(scope="module")
def state(tmp_path_factory: pytest.TempPathFactory) -> State:
    """A set of a wave and an offset."""
    machine = Machine()
    model = tmp_path_factory.mktemp("plain") / "model.xml"
    model.write_text(machine.model, encoding="utf-8")
    ready = prepared(Path(model), [machine.recording(1, 20.0, "one")], [machine.recording(2, 20.0, "two")], Settings())
    bench = bench_of(ready.rows, Settings(), ready.absolute)
    return state_of(bench, [placed(bench.rows, "turn", one) for one in (WAVE, OFFSET)], first_colours(bench))


def answer(state: State, chosen: Effect, probability: float) -> Answer:
    return Answer(placed(state.bench.rows, "turn", chosen), probability, ())


def names(state: State) -> list[str]:
    return sorted(one.effect.name for one in state.effects)


def test_what_is_less_probable_than_not_is_given_up(state: State) -> None:
    left = believed(state, [answer(state, WAVE, 0.4), answer(state, OFFSET, 0.9)])
    assert names(left) == ["torque_offset"]


def test_no_search_makes_a_wave_longer_than_the_travel(state: State) -> None:
    motion = state.rows.motion["turn"]
    low, high = WAVE.bounds(motion, state.dynamics["turn"])["period"]
    assert low < 0.5 < high
    assert high == pytest.approx(float(np.ptp(motion.position)), rel=0.2)
    assert high == travel(motion)
