"""A load that is felt as inertia alone: one parameter under two names, and neither is right against the other."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from plain_bench import INERTIA, PERIOD, Machine
from test_sticking import recorded

from drivetwin.diagnosis.propose.nominal import is_multiple, nominal_parameters
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.state import state_of
from drivetwin.recording.recording import Recording

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
    """Nor does the load stand for anything else: what it costs on a lift is weight as well."""
    bench = Machine().bench(tmp_path)
    state = state_of(bench, (), bench.white, {})
    held = {(bench.nominals[number].effect, bench.nominals[number].axis) for number in state.held("payload", "turn")}
    assert held == {("inertia", "turn")}


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
