"""Behind a gap an axis moves by its own friction, of which the model has but the nominal one."""

from __future__ import annotations

import numpy as np
import pytest
from rig_bench import COULOMB, MOTOR, PERIOD, TURNING, VISCOUS, as_modelled, compared, moved, recording

from diagnosis.propose.nominal import nominal_parameters
from diagnosis.report.result import Array
from diagnosis.state import State, state_with
from emulator.effects import PlacedEffect
from emulator.effects.backlash import Backlash
from emulator.effects.coulomb import Coulomb
from emulator.effects.stribeck import Stribeck
from emulator.effects.viscous import Viscous

SECONDS = 24.0
GAP, STIFFNESS, DAMPING = 2e-3, 5e3, 60.0
"""Whole play [rad], and the flanks' stiffness and damping [N·m/rad, N·m·s/rad]."""
TRUE = {"coulomb": 0.9 * COULOMB["turn"], "viscous": 1.15 * VISCOUS["turn"]}
"""Friction of the turning axis, of which the model has the nominal values."""
NOISE = {"turn": 0.06, "lift": 0.3}
SUBSTEPS = 40


@pytest.fixture(scope="module")
def rattling(tmp_path_factory: pytest.TempPathFactory) -> State:
    """The column behind a gap, driven by a motor that moves as it is told: integrated here, in steps of 50 us."""
    both = moved(5, SECONDS)
    turn = both["turn"]
    torques = as_modelled(both)
    torques["turn"] = MOTOR * turn.acceleration + contact_torque(turn.position, turn.velocity)
    read = {axis: at.position for axis, at in both.items()}
    comparison = compared(tmp_path_factory.mktemp("rig"), recording(torques, read, 5))
    return state_with(comparison, nominal_parameters(comparison), (), NOISE)


def contact_torque(motor: Array, speed: Array) -> Array:
    """Of the flanks on the motor (n,) [N·m]; the load behind them is TURNING less the motor, with the true friction."""
    load, step = TURNING - MOTOR, PERIOD / SUBSTEPS
    at, moves, torques = float(motor[0]) - 0.5 * GAP, 0.0, np.empty(len(motor))
    for number in range(len(motor)):
        ahead = motor[min(number + 1, len(motor) - 1)] - motor[number]
        gained = speed[min(number + 1, len(motor) - 1)] - speed[number]
        for share in np.arange(SUBSTEPS) / SUBSTEPS:
            torque = flanks(motor[number] + share * ahead - at, speed[number] + share * gained - moves)
            if share == 0.0:
                torques[number] = torque
            free = moves + step / load * (torque - TRUE["viscous"] * moves)
            held = step / load * TRUE["coulomb"]
            moves = np.sign(free) * max(0.0, abs(free) - held)
            at += step * moves
    return torques


def flanks(twist: float, speed: float) -> float:
    """Torque between motor and load; flanks do not pull."""
    beyond = abs(twist) - 0.5 * GAP
    if beyond <= 0.0:
        return 0.0
    side = 1.0 if twist > 0.0 else -1.0
    return side * max(0.0, STIFFNESS * beyond + side * DAMPING * speed)


GAPPED = PlacedEffect("turn", Backlash(GAP, STIFFNESS, DAMPING), {})
RIGHT = (PlacedEffect("turn", Coulomb(TRUE["coulomb"]), {}), PlacedEffect("turn", Viscous(TRUE["viscous"]), {}))


def left(state: State) -> float:
    """Mean square on the turning axis [N²·m²]."""
    return float(np.mean(state.residual["turn"] ** 2))


def test_beside_a_gap_friction_that_is_off_leaves_hardly_more_than_the_true_one(rattling: State) -> None:
    told = state_with(rattling.comparison, rattling.nominals, (*RIGHT, GAPPED), NOISE)
    fitted = state_with(rattling.comparison, rattling.nominals, (GAPPED,), NOISE)
    assert left(fitted) < 1.5 * left(told)
    law = fitted.dynamics["turn"].friction
    assert law.coulomb < 0.95 * COULOMB["turn"], "halfway to the truth at least"
    assert law.viscous > 1.07 * VISCOUS["turn"], "halfway to the truth at least"


def test_without_a_gap_the_model_s_own_friction_is_kept(rattling: State) -> None:
    state = state_with(rattling.comparison, rattling.nominals, (PlacedEffect("turn", Stribeck(2.0, 0.05), {}),), NOISE)
    assert state.corrected == ()
