"""A load that is felt as inertia alone: one parameter under two names, and neither is right against the other."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from plain_bench import INERTIA, PERIOD, Machine
from rig_bench import as_modelled, compared, moved, recording
from test_sticking import recorded

from drivetwin.diagnosis.prepare.prepared import prepared
from drivetwin.diagnosis.propose.nominal import is_multiple, nominal_parameters
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.bench import bench_of
from drivetwin.diagnosis.weigh.state import state_of
from drivetwin.recording.recording import Recording, RecordingInfo

PENDULUM = """<mujoco model="pendulum"><worldbody><body>
<joint name="arm" axis="0 1 0" frictionloss="0.5" damping="0.1" armature="0.1"/>
<inertial pos="0 0 -0.4" mass="2" diaginertia="0.02 0.02 0.02"/></body></worldbody>
<actuator><motor name="arm" joint="arm"/></actuator></mujoco>"""
HEAVIER = 0.2
"""Of the table's inertia: what is mounted on it."""


def loaded(seed: int, seconds: float) -> Recording:
    """A table that turns about the vertical, with something mounted on it."""
    whole = Machine().recording(seed, seconds, f"loaded{seed}")
    position = whole.columns["turn"]["position"]
    acceleration = np.gradient(np.gradient(position, PERIOD), PERIOD)
    torque = whole.columns["turn"]["torque"] + HEAVIER * INERTIA * acceleration
    return replace(whole, columns={"turn": {"position": position, "torque": torque}})


def test_the_inertia_of_a_table_is_not_free_beside_a_load_on_it(tmp_path: Path) -> None:
    bench = Machine().bench(tmp_path)
    state = state_of(bench, (), bench.white, {})
    held = {(bench.nominals[number].effect, bench.nominals[number].axis) for number in state.held("payload", "turn")}
    assert held == {("inertia", "turn")}


def test_a_load_on_a_lift_is_not_its_inertia(tmp_path: Path) -> None:
    """It has weight. That of the column below it is inertia."""
    both = moved(1, 20.0)
    rows = compared(tmp_path, recording(as_modelled(both), {axis: at.position for axis, at in both.items()}))
    bench = bench_of(rows, Settings(), dict.fromkeys(rows.axes, True))
    assert bench.same["lift", "payload"] == frozenset()
    (number,) = bench.same["turn", "payload"]
    assert (bench.nominals[number].effect, bench.nominals[number].axis) == ("inertia", "turn")


@pytest.mark.parametrize(("frequency", "rate", "cutoff"), [(6.0, 100.0, None), (6.0, 100.0, 20.0), (15.0, 250.0, None)])
def test_a_pendulum_that_turns_round_in_every_row_has_a_mass(
    frequency: float, rate: float, cutoff: float | None, tmp_path: Path
) -> None:
    """Where a row is never free of a reversal, all rows say what is a multiple of what: a load of weight is not inertia."""
    time = np.arange(round(20.0 * rate)) / rate
    position = 0.05 * np.sin(2.0 * np.pi * frequency * time)
    acceleration = -((2.0 * np.pi * frequency) ** 2) * position
    torque = 0.3 * acceleration + 8.0 * np.sin(position) + 0.5 * np.sign(np.cos(2.0 * np.pi * frequency * time))
    known = {"joint": "arm", "torque_resolution": 1e-3, "position_resolution": 1e-7}
    told = {"schema": "recording/1", "machine": "pendulum", "sample_period": 1.0 / rate, "axes": {"arm": known}}
    info = RecordingInfo.model_validate(told)
    whole = Recording("shaken", info, time, {"arm": {"position": position, "torque": torque}})
    model = tmp_path / "pendulum.xml"
    model.write_text(PENDULUM, encoding="utf-8")
    rows = prepared(model, [whole], [whole], Settings(cutoff_hz=cutoff)).rows
    assert np.mean(np.abs(rows.moves["arm"] - 1.0) < 0.01) < 0.25
    bench = bench_of(rows, Settings(), {"arm": True})
    assert not bench.same["arm", "payload"]


def test_a_load_and_an_inertia_are_named_as_not_distinguished() -> None:
    found = Machine().diagnosed([loaded(1, 30.0)], [loaded(2, 20.0)])
    mounted = [one for one in found.causes if one.effect in ("inertia", "payload") and one.probability > 0.3]
    assert mounted
    names = {mounted[0].effect, *mounted[0].indistinguishable_from}
    assert {"inertia", "payload"} <= names


def test_what_a_mass_costs_is_inertia_whatever_the_rows_say_in_which_the_column_sticks(tmp_path: Path) -> None:
    """There a model's torque is that of the filtered motion, and an axis's own is filtered itself."""
    rows = recorded(tmp_path, 0.0)
    own = next(one.column["turn"] for one in nominal_parameters(rows, Settings()) if one.effect == "inertia")
    sticks = np.abs(rows.moves["turn"] - 1.0) > 0.05
    assert 0 < sticks.sum() < 0.5 * len(sticks)
    assert is_multiple(rows, "turn", 3.0 * own + np.where(sticks, np.ptp(own), 0.0), own)
    assert not is_multiple(rows, "turn", 3.0 * own + np.where(sticks, 0.0, 0.1 * np.ptp(own)), own)
