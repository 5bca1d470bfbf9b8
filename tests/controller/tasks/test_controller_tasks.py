"""Each task, wholly, from drives that have power to drives that are disabled; judged by the plant's truth."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from task_bench import TaskBench

from drivetwin.controller.outcome import Ending
from drivetwin.controller.pacing import Lockstep
from drivetwin.emulator.drive.state_machine import State

PROFILES = ["servoone", "cia402-full"]

OFF = (State.SWITCH_ON_DISABLED,) * 3


def enabled(bench: TaskBench) -> list[bool]:
    return [all(state is State.OPERATION_ENABLED for state in states) for states in bench.states]


@pytest.mark.parametrize("profile", PROFILES)
def test_boot_configures_and_moves_nothing(profile: str, tmp_path: Path) -> None:
    bench = TaskBench(profile=profile)
    before = bench.virtual.plant.joint_positions().copy()
    assert bench.told("boot", tmp_path).ending is Ending.DONE
    assert set(bench.states) == {OFF}
    np.testing.assert_allclose(bench.positions[-1], before, rtol=0.0, atol=1e-6)  # as far as a held brake gives
    for drive in bench.virtual.drives:
        assert drive.device.nmt.state == 5
        assert drive.dictionary[0x1017].value == 100
        if profile == "servoone":
            assert (drive.dictionary[0x280D].value, drive.dictionary[0x280E].value) == (1, 200)


def test_drives_that_consume_heartbeats_watch_the_controller_until_it_leaves(tmp_path: Path) -> None:
    bench = TaskBench(profile="cia402-full")
    assert bench.told("enable", tmp_path, hold=1.0).ending is Ending.DONE
    written = [bytes(frame.data) for frame in bench.frames if frame.arbitration_id == 0x601 and frame.data[1:3] == b"\x16\x10"]
    values = [int.from_bytes(data[4:], "little") for data in written if data[0] == 0x23]
    assert values == [0x7F << 16 | 200, 0]
    beats = [time for time, frame in bench.sent if frame.arbitration_id == 0x77F]
    np.testing.assert_allclose(np.diff(beats), 0.05, atol=1e-9)
    assert all(not drive.device.emergency.register for drive in bench.virtual.drives)


@pytest.mark.parametrize("profile", PROFILES)
def test_enable_holds_every_axis_where_it_stands(profile: str, tmp_path: Path) -> None:
    """Less the loops' stiffness under the lift's weight, some tenths of a millimetre when its brake opens."""
    bench = TaskBench(profile=profile)
    before = bench.virtual.plant.joint_positions().copy()
    assert bench.told("enable", tmp_path, hold=0.5).ending is Ending.DONE
    held = np.array(bench.positions)[enabled(bench)]
    assert len(held) == pytest.approx(250, abs=15)
    assert (np.abs(held - before).max(axis=0) < [1e-3, 1e-3, 1e-3]).all()
    assert bench.states[-1] == OFF


def test_home_leaves_the_drives_zero_at_the_machines(tmp_path: Path) -> None:
    bench = TaskBench()
    assert bench.told("home", tmp_path).ending is Ending.DONE
    told = [float(drive.dictionary[0x6064].read()) * 1e-8 for drive in bench.virtual.drives]
    np.testing.assert_allclose(told, bench.virtual.plant.joint_positions(), atol=2e-4)


@pytest.mark.parametrize("profile", PROFILES)
def test_single_moves_end_where_they_were_told(profile: str, tmp_path: Path) -> None:
    bench = TaskBench(profile=profile)
    moves = [{"axis": "rotate", "to": 1.0}, {"axis": "lift", "to": 0.2}, {"axis": "rotate", "to": 0.5}]
    assert bench.told("move", tmp_path, moves=moves).ending is Ending.DONE
    np.testing.assert_allclose(bench.positions[-1][:2], [0.2, 0.5], atol=2e-4)
    assert np.array(bench.positions)[:, 1].max() == pytest.approx(1.0, abs=1e-2)


def test_a_path_s_axes_go_together(tmp_path: Path) -> None:
    """At half of one axis's way the others are at half of theirs."""
    bench = TaskBench()
    poses = [{"lift": 0.05, "rotate": -1.0, "stretch": 0.3}, {"lift": 0.30, "rotate": 1.0, "stretch": 1.2}]
    assert bench.told("path", tmp_path, poses=poses, dwell=0.5).ending is Ending.DONE
    positions = np.array(bench.positions)
    last = positions[-1]
    np.testing.assert_allclose(last, [0.30, 1.0, 1.2], atol=2e-4)
    share = (positions - [0.05, -1.0, 0.3]) / [0.25, 2.0, 0.9]
    under_way = slice(int(np.flatnonzero(share[:, 1] < 0.05)[-1]) + 1, int(np.flatnonzero(share[:, 1] < 0.95)[-1]))
    apart = share[under_way].max(axis=1) - share[under_way].min(axis=1)
    assert apart.max() < 0.01


def test_soak_works_for_as_long_as_it_is_told(tmp_path: Path) -> None:
    bench = TaskBench()
    assert bench.told("soak", tmp_path, seconds=4.0).ending is Ending.DONE
    moving = np.array(bench.time)[(np.abs(np.array(bench.speeds)) > 0.05).all(axis=1)]
    assert moving[-1] - moving[0] > 4.0
    assert bench.states[-1] == OFF


@pytest.fixture
def computed(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """What was computed while axes were held, in real time with SYNCs going on."""
    found: list[object] = []

    def meanwhile(_: Lockstep, compute: Callable[[], object], _run_cycle: Callable[[], None]) -> object:
        found.append(compute())
        return found[-1]

    monkeypatch.setattr(Lockstep, "meanwhile", meanwhile)
    return found


@pytest.mark.parametrize("profile", PROFILES)
def test_feed_forward_lessens_the_true_tracking_error(profile: str, tmp_path: Path, computed: list[object]) -> None:
    bench = TaskBench(profile=profile)
    assert bench.told("feed_forward", tmp_path).ending is Ending.DONE
    assert len(computed) == 2, "the fit, and the torque that the model says"
    told = json.loads((tmp_path / "feed_forward.json").read_text(encoding="utf-8"))
    for axis in ("lift", "rotate", "stretch"):
        assert told["tracking_error_with"][axis] < 0.5 * told["tracking_error_without"][axis]


def test_identified_friction_is_the_plants(tmp_path: Path, computed: list[object]) -> None:
    bench = TaskBench()
    assert bench.told("identify", tmp_path).ending is Ending.DONE
    assert len(computed) == 1
    found = json.loads((tmp_path / "identified.json").read_text(encoding="utf-8"))["axes"]
    for axis, truth in bench.virtual.plant.truth().items():
        for name in ("coulomb", "viscous"):
            assert found[axis]["parameters"][name]["value"] == pytest.approx(truth[name], rel=0.03)


def test_three_axes_take_a_longer_cycle_than_asked_and_say_why(tmp_path: Path) -> None:
    bench = TaskBench()
    outcome = bench.told("boot", tmp_path, cycle=0.001)
    assert outcome.cycle == pytest.approx(0.002)
    assert outcome.cycle_reason.startswith("the PDOs of 3 axes take 87 % of 1 Mbit/s in the 1 ms requested")
    assert bench.virtual.cycle() == pytest.approx(0.002)


def test_one_axis_takes_the_cycle_that_was_asked_for(tmp_path: Path) -> None:
    outcome = TaskBench("stage").told("boot", tmp_path, cycle=0.001)
    assert (outcome.cycle, outcome.cycle_reason) == (0.001, "")


def test_the_same_task_is_the_same_frames(tmp_path: Path) -> None:
    sent = []
    for number in range(2):
        bench = TaskBench()
        out = tmp_path / str(number)
        out.mkdir()
        bench.told("path", out, poses=[{"lift": 0.2, "rotate": 0.5}])
        sent.append([(time, frame.arbitration_id, bytes(frame.data)) for time, frame in bench.sent])
    assert sent[0] == sent[1]


def test_no_sdo_while_an_axis_follows_set_points(tmp_path: Path) -> None:
    """An axis follows in interpolated position mode (6060h is 7) while the controlword has bit 4 and enables operation."""
    bench = TaskBench()
    bench.told("move", tmp_path, moves=[{"axis": "rotate", "to": 0.0}])
    mode, following = dict.fromkeys((1, 2, 3), 0), dict.fromkeys((1, 2, 3), False)
    rows = 0
    for frame in bench.frames:
        service, node = frame.arbitration_id & 0x780, frame.arbitration_id & 0x7F
        if service == 0x200:
            following[node] = frame.data[0] & 0x1F == 0x1F and mode[node] == 7
            rows += following[node]
        if service == 0x600:
            assert not any(following.values())
            if bytes(frame.data[:4]) == b"\x2f\x60\x60\x00":
                mode[node] = frame.data[4]
    assert rows > 1000
