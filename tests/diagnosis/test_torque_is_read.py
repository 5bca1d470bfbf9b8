"""When the torque was recorded: what a set reads earlier, what it only knows, and where friction is no delay."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rig_bench import COULOMB, PERIOD, Swing, as_modelled, compared, moved, recording, stroked, written_model

from drivetwin.diagnosis.diagnose import proposer_of
from drivetwin.diagnosis.prepare.prepared import prepared
from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.bench import bench_of
from drivetwin.diagnosis.weigh.moves import Search
from drivetwin.diagnosis.weigh.state import State, state_of
from drivetwin.recording.recording import Recording

SECONDS = 20.0
STIFF, SOFT = 3e-5, 3e-4
"""Ways over which friction comes back after it has turned round [rad]."""


def small_and_large_strokes(seed: int) -> Swing:
    """Three small strokes for each large one: most of the motion is near a reversal."""
    rng = np.random.default_rng(seed)

    def stroke(number: int, here: float) -> tuple[float, float]:
        large = number % 4 == 3
        there = -np.sign(here or 1.0) * (rng.uniform(0.5, 0.8) if large else rng.uniform(0.02, 0.05))
        return there, 1.0 if large else rng.uniform(0.4, 0.6)

    return stroked(SECONDS, stroke)


def yielding(at: Swing, over: float) -> Array:
    """What a friction of Dahl's (1968), that comes back over some way [rad], costs more than the model's."""
    share = np.zeros(len(at.position))
    for k, way in enumerate(np.diff(at.position), start=1):
        end = np.sign(way)
        share[k] = end + (share[k - 1] - end) * np.exp(-abs(way) / over)
    return np.asarray(COULOMB["turn"] * (share - np.sign(at.velocity)))


def recorded(seed: int, name: str, over: float) -> Recording:
    """The machine as modelled, but for friction that yields, which the model lacks; torque and position at the same time."""
    both = {"turn": small_and_large_strokes(seed), "lift": moved(seed, SECONDS)["lift"]}
    torques = as_modelled(both)
    torques["turn"] = torques["turn"] + yielding(both["turn"], over)
    return recording(torques, {axis: at.position for axis, at in both.items()}, seed, name, 5.0)


def searched(folder: Path, over: float) -> State:
    """The set that is found for it."""
    ready = prepared(written_model(folder), [recorded(1, "fitted", over)], [recorded(2, "held", over)], Settings())
    return Search(proposer_of(ready, Settings()), lambda _stage, _share: None).run().state


def test_torque_without_a_gap_is_read_as_it_was_recorded(tmp_path: Path) -> None:
    """Its least squares would have it earlier, and the torque of all motion far from a reversal would then be wrong."""
    found = searched(tmp_path, STIFF)
    assert not found.effects
    assert not any(found.late.values())


def test_friction_that_yields_is_no_torque_that_is_late(tmp_path: Path) -> None:
    """It shows at reversals alone. What no Maxwell slip has of Dahl's curve may move the torque by a fraction of a sample."""
    found = searched(tmp_path, SOFT)
    assert [one.effect.name for one in found.effects] == ["presliding"]
    assert found.late["turn"] < 0.5 * PERIOD


def test_a_set_that_reads_torque_as_recorded_knows_how_late_it_is(tmp_path: Path) -> None:
    """The torque of `turn` is a quarter of a sample late, that of `lift` is not: what its loops asked for is compared so.

    A straight line holds for inertia. Where friction turns round, torque steps, and the line says less.
    """
    both = moved(1, SECONDS)
    torques, late = as_modelled(both), 0.25 * PERIOD
    torques["turn"] = np.interp(both["turn"].time - late, both["turn"].time, torques["turn"])
    rows = compared(tmp_path, recording(torques, {axis: at.position for axis, at in both.items()}, noise=3.0))
    bench = bench_of(rows, Settings(), dict.fromkeys(rows.axes, True))
    state = state_of(bench, (), bench.white, {})
    found = state.recorded_late()
    assert 0.6 * late < found["turn"] < 1.1 * late
    assert found.get("lift", 0.0) == pytest.approx(0.0, abs=0.1 * late)
