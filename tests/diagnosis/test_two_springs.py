"""Two springs in series are one: play that has closed does not stand beside one. Torque by the test's own integration."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rig_bench import COULOMB, MOTOR, TURNING, VISCOUS, Swing, ready, strokes

from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.bench import bench_of
from drivetwin.diagnosis.weigh.colouring import coloured
from drivetwin.diagnosis.weigh.exchange import Exchange
from drivetwin.diagnosis.weigh.moves import EXCHANGES
from drivetwin.diagnosis.weigh.pair import Pair
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.state import state_of
from drivetwin.emulator.effects.backlash import Backlash
from drivetwin.emulator.effects.elasticity import Elasticity

STIFFNESS, DAMPING, MOTORS = 600.0, 4.0, 0.3
"""Between motor and link [N·m/rad, N·m·s/rad], and the motor's share of the friction."""
FINER = 20
"""Steps of the integration a sample."""


def on_a_spring(at: Swing) -> Array:
    """Motor torque less that of the rigid axis; semi-implicit."""
    step = float(at.time[1] - at.time[0]) / FINER
    fine = np.arange((len(at.time) - 1) * FINER + 1) * step
    motor, speed = (np.interp(fine, at.time - at.time[0], values) for values in (at.position, at.velocity))
    link, level, viscous = TURNING - MOTOR, (1.0 - MOTORS) * COULOMB["turn"], (1.0 - MOTORS) * VISCOUS["turn"]
    place, moves = float(motor[0]), 0.0
    through = np.zeros(len(fine))
    for k in range(len(fine)):
        through[k] = STIFFNESS * (motor[k] - place) + DAMPING * (speed[k] - moves)
        driven = moves + step * (through[k] - viscous * moves) / link
        moves = np.copysign(max(0.0, abs(driven) - step * level / link), driven)
        place += step * moves
    rigid = COULOMB["turn"] * np.sign(at.velocity) + VISCOUS["turn"] * at.velocity
    return np.asarray(through[::FINER] - link * at.acceleration - (1.0 - MOTORS) * rigid)


def test_play_that_has_closed_gives_its_place_to_the_spring_beside_it(tmp_path: Path) -> None:
    made = ready(tmp_path, strokes(1, 8.0, {"turn": on_a_spring}))
    bench = bench_of(made.rows, Settings(), made.absolute)
    soft, stiff = Backlash(0.0, 1.1 * STIFFNESS, DAMPING, 0.0), Elasticity(11.0 * STIFFNESS, 0.0, MOTORS)
    both = [placed(bench.rows, "turn", one) for one in (soft, stiff)]
    state = coloured(state_of(bench, both, bench.white, {}), ())
    exchange = Exchange(Proposer(bench, bench, {"turn": [Backlash, Elasticity]}, {}), {}, lambda _stage, _share: None)
    pair = Pair(state, state)
    for _ in range(EXCHANGES):
        pair, _, _ = exchange.exchanged(pair, ())
    (spring,) = pair.whole.effects
    assert isinstance(spring.effect, Elasticity)
    assert abs(spring.effect.stiffness / STIFFNESS - 1.0) < 0.05
