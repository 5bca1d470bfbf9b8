"""The slope of an effect in a set is that of what the whole set costs: what follows it bends with it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rig_bench import as_modelled, compared, moved, recording

from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.bench import Bench, bench_of
from drivetwin.diagnosis.weigh.state import State, state_of
from drivetwin.emulator.effects import AxisEffect
from drivetwin.emulator.effects.delay import Delay
from drivetwin.emulator.effects.inertia import Inertia
from drivetwin.emulator.effects.magnetic_saturation import MagneticSaturation

MORE, STEP = 0.05, 1e-4
"""Inertia that an axis has more, and a small change of it [kg·m²]."""


@pytest.mark.parametrize("second", [MagneticSaturation(6.0), Delay(0.01)], ids=["on a motor that saturates", "read late"])
def test_an_inertia_has_the_slope_of_the_whole_set(second: AxisEffect, tmp_path: Path) -> None:
    """Against a central difference of what both cost together."""
    both = moved(1, 20.0)
    rows = compared(tmp_path, recording(as_modelled(both), {axis: at.position for axis, at in both.items()}, noise=1.0))
    bench = bench_of(rows, Settings(), dict.fromkeys(rows.axes, True))
    (slope,) = next(felt.tangents for felt in with_inertia(bench, MORE, second).felts if felt.effect.name == "inertia")
    true = (cost(bench, MORE + STEP, second) - cost(bench, MORE - STEP, second)) / (2.0 * STEP)
    along = true * float(true @ slope["turn"]) / float(true @ true)
    assert np.linalg.norm(slope["turn"] - along) < 0.01 * np.linalg.norm(slope["turn"])


def with_inertia(bench: Bench, difference: float, second: AxisEffect) -> State:
    return state_of(bench, [placed(bench.rows, "turn", one) for one in (Inertia(difference), second)], bench.white, {})


def cost(bench: Bench, difference: float, second: AxisEffect) -> Array:
    return np.asarray(np.sum([felt.cost["turn"] for felt in with_inertia(bench, difference, second).felts], axis=0))
