"""An axis whose friction turns round sticks for some milliseconds: what stiction holds then is no gap, and no spring."""

from __future__ import annotations

from math import copysign, pi, sin
from pathlib import Path

import numpy as np
import pytest
from rig_bench import COULOMB, PERIOD, TURNING, VISCOUS, compared, lift_torque, moved, recording

from drivetwin.diagnosis.prepare.rows import Rows
from drivetwin.diagnosis.report.result import Array
from drivetwin.emulator.effects.torque_offset import TorqueOffset

SECONDS = 20.0
STEPS = 20
"""Of the test's own plant, a sample."""
GAIN = 60.0 * TURNING
"""Of the velocity loop: at a reversal it takes some 10 ms to ask for friction the other way round."""


def sticking(pull: float) -> tuple[Array, Array]:
    """Position and torque (n,) of the column under a velocity loop, `pull` [N·m] besides; it sticks (Karnopp 1985)."""
    step, level = PERIOD / STEPS, COULOMB["turn"]
    count = round(SECONDS / PERIOD)
    position, torque = np.empty(count), np.empty(count)
    q, v = 0.0, 0.0
    for sample in range(count):
        wanted = 0.0
        for part in range(STEPS):
            time = sample * PERIOD + part * step
            asked = 0.7 * sin(2.0 * pi * 0.43 * time) + 0.3 * sin(2.0 * pi * 0.16 * time)
            wanted = GAIN * (asked - v)
            if part == 0:
                position[sample], torque[sample] = q, wanted
            drives = wanted - pull - VISCOUS["turn"] * v
            if v == 0.0 and abs(drives) <= level:
                continue
            direction = copysign(1.0, v if v != 0.0 else drives)
            faster = v + step / TURNING * (drives - direction * level)
            v = faster if faster * direction > 0.0 else 0.0
            q += step * v
    return position, torque


def recorded(folder: Path, pull: float) -> Rows:
    """The other axis moves as it is modelled."""
    position, torque = sticking(pull)
    lift = moved(3, SECONDS)["lift"]
    told = recording({"turn": torque, "lift": lift_torque(lift)}, {"turn": position, "lift": lift.position}, noise=1.0)
    return compared(folder, told)


def test_the_column_sticks_as_it_turns_round() -> None:
    """Longer than a sample, and not long enough to be a standstill of its own."""
    position, _ = sticking(0.0)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], (np.diff(position) == 0.0).astype(int), [0]))))
    lasts = (edges[1::2] - edges[::2]) * PERIOD
    assert len(lasts) > 15
    assert 0.004 < np.median(lasts) < 0.02


def test_what_stiction_holds_as_an_axis_turns_round_is_no_gap(tmp_path: Path) -> None:
    rows = recorded(tmp_path, pull=0.0)
    assert np.abs(rows.target["turn"]).max() < 0.05 * COULOMB["turn"]


def test_nor_is_it_one_beside_an_effect(tmp_path: Path) -> None:
    """While it sticks, nothing that pulls at it is felt: neither in the gap nor in what the effect is said to cost."""
    rows = recorded(tmp_path, pull=0.6)
    cost = rows.cost("turn", TorqueOffset(-0.6), rows.simulation.dynamics()["turn"])["turn"]
    assert np.sqrt(np.mean(rows.target["turn"] ** 2)) == pytest.approx(0.6, rel=0.05)
    assert np.abs(rows.target["turn"] - cost).max() < 0.05 * COULOMB["turn"]
