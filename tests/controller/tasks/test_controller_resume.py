"""`resume: true`: after trouble that can be cleared the controller resets, configures, homes what has to be, and goes on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from task_bench import TaskBench, Trouble

from drivetwin.controller.outcome import Ending
from drivetwin.controller.pacing import Lockstep
from drivetwin.emulator.drive.state_machine import State
from drivetwin.emulator.faults.library import read_fault

POSES = [{"lift": 0.3, "rotate": 1.0, "stretch": 1.2}, {"lift": 0.05, "rotate": -1.0, "stretch": 0.3}]

OFF = State.SWITCH_ON_DISABLED

HOMING_MODE = bytes((0x2F, 0x60, 0x60, 0, 6))


@pytest.fixture(autouse=True)
def _impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """In process a PDO that has not come is not on its way."""
    monkeypatch.setattr(Lockstep, "first_answer", 0.005)
    monkeypatch.setattr(Lockstep, "further_answer", 0.005)


def struck(lasts: float | None, **given: Any) -> Trouble:
    """A fault once rotate moves, that ends after `lasts` seconds."""
    fault = read_fault(given)
    end: dict[str, Any] = {} if lasts is None else {"lasts": lasts, "undo": fault.end}
    return Trouble(lambda bench: bench.virtual.now() > 2.0 and bench.moving(1), fault.strike, **end)


def homings(bench: TaskBench) -> list[int]:
    """Nodes that were told to home, in their order."""
    return [frame.arbitration_id & 0x7F for frame in bench.frames if bytes(frame.data[:5]) == HOMING_MODE]


@pytest.mark.parametrize(
    ("trouble", "homed_again"),
    [
        (struck(None, fault="drive_fault", node=2, code=0x7500), []),
        (struck(0.6, fault="sto", node=2), []),
        (struck(0.6, fault="undervoltage", node="all"), []),
        (struck(0.6, fault="jam", node=2), []),
        (struck(0.6, fault="encoder_loss", node=2), [2]),
        (struck(None, fault="encoder_glitch", node=2, increments=100_000), [2]),
        (struck(None, fault="node_resets", node=2), [2]),
        (struck(None, fault="power_cycle", node=2, off=0.8), [2]),
        (struck(None, fault="power_cycle", off=0.8), [1, 2, 3]),
        (struck(0.6, fault="bus_off", node=2), [2]),
        (struck(0.6, fault="heartbeat_lost", node=2), [2]),
    ],
    ids=lambda value: "" if isinstance(value, list) else None,
)
def test_the_task_is_ended_and_only_who_lost_its_zero_homes_again(
    trouble: Trouble, homed_again: list[int], tmp_path: Path
) -> None:
    bench = TaskBench(troubles=[trouble])
    outcome = bench.told("path", tmp_path, resume=True, poses=POSES)
    assert outcome.ending is Ending.DONE
    assert outcome.recoveries >= 1
    assert homings(bench) == [1, 2, 3, *homed_again]
    np.testing.assert_allclose(bench.positions[-1], [0.05, -1.0, 0.3], atol=1e-3)
    assert bench.states[-1] == (OFF, OFF, OFF)
    went = np.array(bench.positions)[:, 1]
    assert went.max() == pytest.approx(1.0, abs=1e-2), "the pose at which it struck was reached"


def test_no_axis_is_enabled_before_the_fault_was_reset(tmp_path: Path) -> None:
    trouble = struck(0.6, fault="sto", node=2)
    bench = TaskBench(troubles=[trouble])
    bench.told("path", tmp_path, resume=True, poses=POSES)
    gone = bench.struck + 0.6
    for time, states in zip(bench.time, bench.states, strict=True):
        if bench.struck + 0.2 < time < gone:
            assert State.OPERATION_ENABLED not in states


def test_a_node_that_stays_away_ends_the_task(tmp_path: Path) -> None:
    bench = TaskBench(troubles=[struck(None, fault="node_dies", node=2)])
    outcome = bench.told("path", tmp_path, resume=True, poses=POSES)
    assert outcome.ending is Ending.STOPPED
    assert outcome.reason.startswith("axis rotate (node 2) did not come back within 10 s")
    assert outcome.node == 2
    assert State.OPERATION_ENABLED not in bench.states[-1]


def test_a_fault_whose_cause_stays_ends_the_task(tmp_path: Path) -> None:
    bench = TaskBench(troubles=[struck(None, fault="sto", node=2)])
    outcome = bench.told("path", tmp_path, resume=True, poses=POSES)
    assert outcome.ending is Ending.STOPPED
    assert outcome.reason.startswith("axis rotate (node 2) cannot be reset: is the cause of its fault still there?")
    assert bench.states[-1] == (OFF, State.FAULT, OFF)


def test_trouble_that_comes_again_and_again_ends_the_task(tmp_path: Path) -> None:
    bench = TaskBench(troubles=[struck(None, fault="friction_rise", node=2, torque=500.0)])
    outcome = bench.told("path", tmp_path, resume=True, poses=POSES)
    assert outcome.ending is Ending.STOPPED
    assert outcome.recoveries == 5
    assert outcome.emcy == 0x8611


def test_without_resume_the_first_trouble_is_the_end(tmp_path: Path) -> None:
    bench = TaskBench(troubles=[struck(None, fault="drive_fault", node=2, code=0x7500)])
    outcome = bench.told("path", tmp_path, poses=POSES)
    assert (outcome.ending, outcome.recoveries) == (Ending.STOPPED, 0)


def test_after_a_power_cycle_the_controller_starts_again_from_nothing(tmp_path: Path) -> None:
    """The same task on the same machine, whose drives have forgotten everything."""
    bench = TaskBench()
    assert bench.told("path", tmp_path, poses=POSES).ending is Ending.DONE
    read_fault({"fault": "power_cycle", "off": 0.0}).strike(bench.virtual)
    assert bench.told("path", tmp_path, poses=POSES).ending is Ending.DONE
    assert homings(bench) == [1, 2, 3] * 2
