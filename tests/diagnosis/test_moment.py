"""The moment at which a patch reads torque: where least of the gap is left, as its parameters are fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plain_bench import COGGING, COULOMB, ORDER, PHASE, SLIDES, STICKS, Machine

from drivetwin.diagnosis.prepare.prepared import prepared
from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.bench import Bench, bench_of
from drivetwin.diagnosis.weigh.colouring import coloured
from drivetwin.diagnosis.weigh.refit import refitted
from drivetwin.diagnosis.weigh.state import State, state_of
from drivetwin.diagnosis.weigh.yielding import settled_on
from drivetwin.emulator.effects.stribeck import Stribeck
from drivetwin.emulator.effects.torque_ripple import TorqueRipple
from drivetwin.recording.recording import Recording

LATE, LATER = 0.001, 0.006
"""By which torque is polled late, usually and for a while every second [s]."""


def polled(seed: int, seconds: float) -> Recording:
    """Torque of a bus that is busy for a part of every second."""
    whole = Machine().recording(seed, seconds, f"polled{seed}")
    at = whole.time - np.where(whole.time % 1.0 < 0.25, LATER, LATE)
    torque = np.interp(at, whole.time, whole.columns["turn"]["torque"])
    return replace(whole, columns={"turn": {**whole.columns["turn"], "torque": torque}})


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    path = tmp_path_factory.mktemp("polled") / "model.xml"
    path.write_text(Machine().model, encoding="utf-8")
    ready = prepared(path, [polled(1, 30.0)], [polled(2, 20.0)], Settings())
    return bench_of(ready.rows, Settings(), ready.absolute)


def found(bench: Bench, late: float) -> State:
    """The effects of the machine, weighed in the noise that they leave, the torque read `late` [s]."""
    effects = (Stribeck(COULOMB + STICKS, SLIDES, 2.0), TorqueRipple(COGGING, ORDER, PHASE))
    state = state_of(bench, [placed(bench.rows, "turn", one) for one in effects], bench.white, {"turn": late})
    return settled_on(coloured(state, ()), 20)


def left(state: State, late: float) -> float:
    """Energy that its effects leave of the torque as it is read then [N²·m²]."""
    return float(np.sum(state.read({"turn": late}).target["turn"] ** 2))


@pytest.mark.parametrize("first", [0.001, 0.003, 0.005])
def test_a_patch_reads_torque_when_it_leaves_least_wherever_the_search_had_read_it(bench: Bench, first: float) -> None:
    """By a scan. Of a recording that is not equally late throughout, likelihood has another moment."""
    state = found(bench, first)
    patch = refitted(state, ())
    moments = np.linspace(0.0, 0.008, 161)
    best = moments[int(np.argmin([left(patch.state, float(late)) for late in moments]))]
    assert LATE < best < LATER
    assert patch.late["turn"] == pytest.approx(best, abs=1e-4)
    (ripple,) = [one.effect for one in patch.effects if isinstance(one.effect, TorqueRipple)]
    assert ripple.amplitude == pytest.approx(COGGING, rel=0.01)
    likely = state.late["turn"] - float(state.fit.coefficients[bench.timing("turn")])
    assert abs(likely - best) > 1e-4


@pytest.mark.parametrize("deviations", [2.0, 10.0])
def test_energy_that_is_left_knows_no_torque_read_unusually_far_off(bench: Bench, deviations: float) -> None:
    """A gap that is all timing: none of it is left up to three deviations, and beyond what these do not take."""
    as_it_stands = state_of(bench, (), bench.white, {})
    timing = bench.nominals[bench.timing("turn")]
    off = deviations * timing.spread * timing.column["turn"]
    state = replace(as_it_stands, target={"turn": off})
    beyond = max(0.0, deviations - 3.0) * timing.spread * timing.column["turn"]
    expected = float(beyond @ beyond) / bench.rows.gap_energy["turn"]
    assert state.left["turn"] == pytest.approx(expected, rel=1e-3, abs=1e-3)
