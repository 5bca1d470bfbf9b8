"""What a recorded case is: what a user would have, over the bus, the same each time, and no truth in it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import can
import numpy as np
import pytest
from repeats import LONG

from drivetwin.blind import record
from drivetwin.blind.case import Case, Cause
from drivetwin.blind.machines import FAMILIES, DrawnMachine, draw_machine
from drivetwin.blind.motions import Plan, Plans, draw_plans
from drivetwin.blind.plants import FORMULATIONS
from drivetwin.blind.record import record_case
from drivetwin.bus.channel import InprocBus
from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.motion import first_setpoint as usual_first_setpoint
from drivetwin.controller.trajectory import move, stroke
from drivetwin.motion.filtering import derivative, zero_phase
from drivetwin.motion.inverse_dynamics import load_model
from drivetwin.recording.reader import find_recordings, read_recording
from drivetwin.recording.recording import Recording

CAUSE = Cause("torque_offset", "table", {"offset": 0.4321987})
FOLDERS = ("training", "validation", "fresh")


class CountingBus(InprocBus):
    """Counts the SYNCs that the controller sends."""

    syncs = 0

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        CountingBus.syncs += msg.arbitration_id == 0x80
        super().send(msg, timeout)


@pytest.fixture(scope="module")
def short() -> Iterator[type[CountingBus]]:
    """Motion of a second and a half a recording, over the whole travel of every axis."""

    def plans(machine: DrawnMachine, _: int) -> Plans:
        made = []
        for name in FOLDERS:
            paths = {}
            for axis, drawn in machine.axes.items():
                low, high = drawn.middle - 0.3 * drawn.room, drawn.middle + 0.3 * drawn.room
                go = stroke(low, high, 0.5 * drawn.max_speed, 0.8 * drawn.max_acceleration, 0.001)
                paths[axis] = np.concatenate([go, move(high, low, drawn.max_speed, 0.8 * drawn.max_acceleration, 0.001)])
            made.append((Plan(name, paths),))
        return Plans(*made)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(record, "draw_plans", plans)
        patch.setattr(record, "InprocBus", CountingBus)
        yield CountingBus


@dataclass(frozen=True)
class Recorded:
    """A case, the folder in which it was recorded, and how many SYNCs that took."""

    case: Case
    folder: Path
    syncs: int


@pytest.fixture(scope="module")
def recorded(short: type[CountingBus], tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    """A turntable with an offset; to be read only."""
    case = Case(4, 21345678, "turntable", "single", (CAUSE,), "lugre")
    folder = tmp_path_factory.mktemp("recorded") / "004"
    short.syncs = 0
    record_case(case, folder)
    return Recorded(case, folder, short.syncs)


def recordings(directory: Path) -> list[Recording]:
    return [read_recording(path)[0] for folder in FOLDERS for path in find_recordings(directory / folder)]


def test_a_case_is_what_a_user_would_have(recorded: Recorded) -> None:
    assert sorted(path.name for path in recorded.folder.iterdir()) == [
        "fresh",
        "model.xml",
        "model_off.xml",
        "training",
        "validation",
    ]
    found = recordings(recorded.folder)
    axis = draw_machine("turntable", recorded.case.seed).axes["table"]
    for recording in found:
        info = recording.info.axes["table"]
        assert (info.joint, info.actuator, info.gear_ratio) == ("table", "table", axis.gear_ratio)
        assert info.rated_torque == pytest.approx(axis.rated_torque, rel=2e-3)
        assert info.torque_resolution == pytest.approx(1e-3 * axis.rated_torque, rel=2e-2)
        assert info.drive is not None
        assert info.drive.position_gain == pytest.approx(axis.bandwidth / 4.0, rel=1e-3)
        assert info.drive.velocity_gain == pytest.approx(axis.bandwidth * axis.inertia, rel=1e-3)
        assert None not in (info.drive.torque_limit, info.drive.servo_period, info.drive.current_loop_time_constant)
        assert set(recording.columns["table"]) == {"torque", "position", "position_demand"}


def test_all_recordings_of_a_case_are_of_one_power_on(recorded: Recorded) -> None:
    found = recordings(recorded.folder)
    for earlier, later in pairwise(found):
        assert later.time[0] > earlier.time[-1]
    assert found[0].time[0] > 0.5  # homing came before
    assert round(found[-1].time[-1] / 0.001) < recorded.syncs <= round(found[-1].time[-1] / 0.001) + 1100


def test_nothing_of_the_truth_is_written(recorded: Recorded) -> None:
    for path in recorded.folder.rglob("*"):
        if path.is_file() and path.suffix in (".json", ".xml"):
            text = path.read_text(encoding="utf-8")
            for told in ("torque_offset", "0.4321", "21345678", "lugre", "single"):
                assert told not in text, f"{path.name} tells {told}"


def same_bytes(once: Path, again: Path) -> None:
    """Each file of one folder stands in the other as well."""
    for path in sorted(once.rglob("*")):
        if path.is_file():
            assert path.read_bytes() == (again / path.relative_to(once)).read_bytes(), path


def test_recording_twice_is_bit_identical(recorded: Recorded, tmp_path: Path) -> None:
    record_case(recorded.case, tmp_path / "again")
    same_bytes(recorded.folder, tmp_path / "again")


@pytest.mark.usefixtures("short")
def test_a_foreign_cause_is_recorded_twice_alike(tmp_path: Path) -> None:
    wind = Cause("foreign:wind", "table", {"torque": 0.3, "time_constant": 0.2})
    for name in ("once", "again"):
        record_case(Case(0, 21, "turntable", "single", (wind,), "maxwell_slip"), tmp_path / name)
    same_bytes(tmp_path / "once", tmp_path / "again")


@pytest.mark.usefixtures("short")
@pytest.mark.parametrize("family", FAMILIES)
def test_a_clean_machine_is_its_model_within_noise(tmp_path: Path, family: str) -> None:
    """Torque of the nominal model by MuJoCo's inverse dynamics, while sliding; noise from what is faster than any motion.

    Every family, every formulation; `make test-long` has every pair.
    """
    own = list(FAMILIES).index(family) % len(FORMULATIONS)
    for number, formulation in enumerate(FORMULATIONS):
        if not LONG and number != own:
            continue
        directory = tmp_path / formulation
        record_case(Case(0, 30 + number, family, "clean", (), formulation), directory)
        nominal = draw_machine(family, 30 + number).axes
        model = load_model(directory / "model.xml")
        for recording in recordings(directory):
            position = np.column_stack([zero_phase(recording.columns[name]["position"], 0.001, 48.0) for name in nominal])
            velocity = np.column_stack([derivative(column, 0.001) for column in position.T])
            acceleration = np.column_stack([derivative(column, 0.001) for column in velocity.T])
            rigid = model.torques(list(nominal), position, velocity, acceleration)
            for index, (name, axis) in enumerate(nominal.items()):
                speed = velocity[:, index]
                expected = rigid[:, index] + axis.coulomb * np.sign(speed) + axis.viscous * speed
                measured = zero_phase(recording.columns[name]["torque"], 0.001, 48.0)
                gap = measured - zero_phase(expected, 0.001, 48.0)
                sliding = _away_from_reversals(speed, 0.02 * axis.max_speed)
                assert np.sqrt(np.mean(gap[sliding] ** 2)) < 0.012 * axis.rated_torque
                assert abs(np.mean(gap[sliding])) < 0.002 * axis.rated_torque


def _away_from_reversals(speed: np.ndarray, least: float) -> np.ndarray:
    """Samples that are 0.04 s from any at less than `least`: farther than the filter reaches."""
    slow = np.convolve(np.abs(speed) < least, np.ones(81), mode="same") > 0.0
    slow[:100] = slow[-100:] = True
    return ~slow


def test_the_nominal_model_is_the_truth_without_its_causes() -> None:
    machine = draw_machine("scara3", 3)
    model = machine.compiled()
    for name, axis in machine.axes.items():
        dof = model.joint(name).dofadr[0]
        assert model.dof_armature[dof] == pytest.approx(axis.rotor_inertia * axis.gear_ratio**2, rel=1e-5)
        assert model.dof_frictionloss[dof] == pytest.approx(axis.coulomb, rel=1e-5)
        assert model.dof_damping[dof] == pytest.approx(axis.viscous, rel=1e-5)
        assert model.actuator(name).gear[0] == pytest.approx(axis.gear_ratio, rel=1e-5)
    assert not model.jnt_limited.any()


@pytest.mark.parametrize("family", FAMILIES)
def test_motion_is_a_minute_to_fit_on_and_twenty_seconds_twice_and_stays_in_the_travel(family: str) -> None:
    for seed in range(3):
        machine = draw_machine(family, seed)
        seconds = dict.fromkeys(FOLDERS, 0.0)
        for folder, plan in draw_plans(machine, seed):
            for name, path in plan.paths.items():
                low, high = machine.axes[name].travel
                assert low < path.min()
                assert path.max() < high
                assert np.abs(np.diff(path)).max() / 0.001 < 1.001 * machine.axes[name].max_speed
            seconds[folder] += 0.001 * max(len(path) for path in plan.paths.values())
        assert 45.0 < seconds["training"] < 85.0
        assert 15.0 < seconds["validation"] < 32.0
        assert 15.0 < seconds["fresh"] < 32.0


def test_validation_and_fresh_motion_are_other_motion() -> None:
    machine = draw_machine("stage", 2)
    plans = draw_plans(machine, 2)
    paths = [plan.paths["slide"] for _, plan in plans]
    shortest = min(len(path) for path in paths)
    assert all(np.abs(np.corrcoef(a[:shortest], b[:shortest])[0, 1]) < 0.9 for a in paths for b in paths if a is not b)


@pytest.mark.usefixtures("short")
def test_axis_that_another_pushes_back_onto_its_switch_after_homing_is_led_off_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Coupled to the axis before it, it is homed first, and pushed 60 urad back when that brakes at its switch."""
    steps = []

    def spied(drive: DriveNode, period: float) -> int:
        first = usual_first_setpoint(drive, period)
        steps.append((drive.name, (first - drive.position) * drive.unit))
        return first

    monkeypatch.setattr("drivetwin.controller.motion.first_setpoint", spied)
    pushed = Cause("coupling", "stretch", {"inertia": 0.019851157314030317, "ratio": 0.5897743901840812})
    record_case(Case(0, 1437442207, "scara3", "single", (pushed,), "lugre"), tmp_path)
    assert [name for name, step in steps if step > 0.0] == ["stretch"]
    assert len(recordings(tmp_path)) == len(FOLDERS)
