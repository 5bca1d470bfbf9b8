"""What a motor, a spring or a gear costs beside bodies that the model lacks: by formulas of a carriage that is lifted."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from rig_bench import CARRIAGE, COULOMB, GRAVITY, LIFTING, VISCOUS, moved, ready, strokes

from drivetwin.diagnosis.propose.placing import in_order, placed
from drivetwin.diagnosis.report.prediction import Patch, predict
from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.bench import bench_of
from drivetwin.diagnosis.weigh.state import state_of
from drivetwin.emulator.effects import Effect
from drivetwin.emulator.effects.magnetic_saturation import MagneticSaturation
from drivetwin.emulator.effects.payload import Payload
from drivetwin.emulator.effects.torque_constant import TorqueConstant

MASS = 0.4 * CARRIAGE
"""Of the payload [kg]."""
WEAKER, KNEE = -0.2, 3.0 * CARRIAGE * GRAVITY
"""Error of the torque constant, and force at which the motor's iron saturates [N]."""


def weaker(shaft: Array) -> Array:
    return shaft / (1.0 + WEAKER)


def saturated(shaft: Array) -> Array:
    return np.asarray(shaft * (1.0 + (shaft / KNEE) ** 2))


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize(("motor", "reported"), [(TorqueConstant(WEAKER), weaker), (MagneticSaturation(KNEE), saturated)])
def test_a_motor_gives_the_torque_of_a_payload_too(motor: Effect, reported: Callable[[Array], Array], tmp_path: Path) -> None:
    made = ready(tmp_path, strokes(3, 6.0))
    at, (run,) = moved(3, 6.0)["lift"], made.runs
    needed = (LIFTING + MASS) * at.acceleration + (CARRIAGE + MASS) * GRAVITY
    shaft = needed + COULOMB["lift"] * np.sign(at.velocity) + VISCOUS["lift"] * at.velocity
    effects = in_order([placed(made.rows, "lift", one) for one in (Payload(MASS), motor)])
    own = predict(made.simulation, run, Patch(effects)).axes["lift"]
    slides = own.used & (np.abs(at.velocity) > 0.3 * np.abs(at.velocity).max())  # no reversal is near
    true, change = run.smooth(reported(shaft)), run.smooth(reported(shaft) - shaft)
    assert rms((own.after - true)[slides]) < 0.005 * rms(change[slides])

    bench = bench_of(made.rows, Settings(), made.absolute)
    state = state_of(bench, effects, bench.white, {})
    costs = np.sum([felt.cost["lift"] for felt in state.felts], axis=0)
    added = made.rows.picked("lift", [own.after - own.before])
    assert rms(costs - added) < 0.005 * rms(added)
