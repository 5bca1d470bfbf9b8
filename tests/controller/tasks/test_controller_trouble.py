"""Whatever goes wrong while axes move: every axis stands in time, without voltage, and the controller says whose it was."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import can
import pytest
from task_bench import TaskBench, Trouble

from drivetwin.controller.outcome import Ending
from drivetwin.controller.pacing import Lockstep
from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.drive.state_machine import State
from drivetwin.emulator.faults.library import read_fault
from drivetwin.emulator.virtual_machine import VirtualMachine

POSES = [{"lift": 0.3, "rotate": 1.0, "stretch": 1.2}, {"lift": 0.05, "rotate": -1.0, "stretch": 0.3}]

OFF = State.SWITCH_ON_DISABLED

RAMP = 0.2
"""From telling the drives to stop to rest [s]: 62 ms of quick-stop ramp, loops, and the friction that ends it."""

ROTATE = 1


@pytest.fixture(autouse=True)
def _impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """In process a PDO that has not come is not on its way."""
    monkeypatch.setattr(Lockstep, "first_answer", 0.005)
    monkeypatch.setattr(Lockstep, "further_answer", 0.005)


def under_way(bench: TaskBench) -> bool:
    return bench.virtual.now() > 2.0 and bench.moving(ROTATE)


def fault(name: str, **parameters: Any) -> Callable[[VirtualMachine], None]:
    return read_fault({"fault": name, "node": 2, **parameters}).strike


def nmt(command: int) -> Callable[[VirtualMachine], None]:
    """Somebody else commands node 2."""
    frame = can.Message(arbitration_id=0, data=bytes((command, 2)), is_extended_id=False)
    return lambda machine: machine.receive(frame)


def leaves_operation(machine: VirtualMachine) -> None:
    machine.drives[ROTATE].machine.state = OFF


def loses_voltage_quietly(machine: VirtualMachine) -> None:
    status = machine.drives[ROTATE].statusword
    machine.drives[ROTATE].dictionary[0x6041].on_read = lambda: status() & ~0x10


def torque_stays_at_its_limit(machine: VirtualMachine) -> None:
    machine.drives[ROTATE].dictionary[0x21A3].on_read = lambda: 1e3


def does_not_watch_its_following_error(strike: Callable[[VirtualMachine], None]) -> Callable[[VirtualMachine], None]:
    def struck(machine: VirtualMachine) -> None:
        machine.drives[ROTATE].dictionary[0x22E7].store(0xFFFFFFFF)
        strike(machine)

    return struck


def runs_away(machine: VirtualMachine) -> None:
    """Its encoder tells less and less than the truth; the drive has no such limit of its own."""
    true = machine.drives[ROTATE].dictionary[0x6064].on_read
    assert true is not None
    begin = machine.now()
    machine.drives[ROTATE].dictionary[0x6064].on_read = lambda: int(true()) + int(1e8 * (machine.now() - begin))


@dataclass(frozen=True)
class Case:
    """What strikes, how soon after it every axis is told to stop [s], what is said, how node 2 ends, and if that is unknown."""

    strike: Callable[[VirtualMachine], None]
    noticed: float
    reason: str
    emcy: int | None = None
    ends: State = OFF
    unknown: bool = False


SETPOINTS_LATE = fault("frames_late", direction="received", cob_id=0x202, delay=0.06)

CASES = {
    "a drive that faults": Case(fault("drive_fault", code=0x7500), 0.01, "reports EMCY 7500h", 0x7500, State.FAULT),
    "overcurrent": Case(fault("drive_fault", code=0x2310), 0.01, "reports EMCY 2310h, overcurrent", 0x2310, State.FAULT),
    "safe torque off": Case(fault("sto"), 0.01, "reports EMCY 5441h", 0x5441, State.FAULT),
    "undervoltage": Case(fault("undervoltage"), 0.01, "reports EMCY 3220h, undervoltage", 0x3220, State.FAULT),
    "encoder loss": Case(fault("encoder_loss"), 0.01, "reports EMCY 7305h", 0x7305, State.FAULT),
    "a jam that the drive notices": Case(fault("jam"), 0.15, "reports EMCY 8611h, following error", 0x8611, State.FAULT),
    "a jam that it does not": Case(does_not_watch_its_following_error(fault("jam")), 0.15, "off its set-point, and may be"),
    "an encoder glitch": Case(fault("encoder_glitch", increments=100_000), 0.01, "and cannot have moved that far"),
    "an encoder that drifts": Case(runs_away, 0.2, "off its set-point, and may be", unknown=True),
    "operation left without a word": Case(leaves_operation, 0.01, "has left operation by itself"),
    "voltage gone without a word": Case(loses_voltage_quietly, 0.01, "is enabled and has no voltage"),
    "torque at its limit": Case(torque_stays_at_its_limit, 0.32, "for 0.3 s: is the axis jammed"),
    "bus off": Case(fault("bus_off"), 0.01, "sent no PDO for 3 SYNCs", ends=State.OPERATION_ENABLED, unknown=True),
    "a dead node": Case(fault("node_dies"), 0.01, "sent no PDO for 3 SYNCs", ends=State.NOT_READY_TO_SWITCH_ON, unknown=True),
    "PDOs lost for good": Case(fault("frames_lost", cob_id=0x282), 0.01, "sent no PDO for 3 SYNCs"),
    "answers that come late": Case(fault("frames_late", delay=0.02), 0.01, "sent no PDO for 3 SYNCs"),
    "set-points that come late": Case(SETPOINTS_LATE, 0.2, "off its set-point, and may be"),
    "answers with wrong bits": Case(fault("frames_corrupted", bits=2), 0.02, "and cannot have moved that far", unknown=True),
    "heartbeats lost": Case(fault("heartbeat_lost"), 0.36, "sent no heartbeat for 0.25 s"),
    "a node that restarts": Case(fault("node_resets", off=0.0), 0.01, "has booted by itself"),
    "NMT reset communication by somebody else": Case(nmt(0x82), 0.01, "has booted by itself"),
    "NMT stop by somebody else": Case(nmt(0x02), 0.01, "sent no PDO for 3 SYNCs"),
    "NMT pre-operational by somebody else": Case(nmt(0x80), 0.01, "sent no PDO for 3 SYNCs"),
    "another node-ID": Case(fault("node_changes_id", new_id=9), 0.01, "sent no PDO for 3 SYNCs", unknown=True),
}


@pytest.mark.parametrize("name", CASES)
def test_every_axis_is_stopped_and_the_trouble_is_named(name: str, tmp_path: Path) -> None:
    case = CASES[name]
    bench = TaskBench(troubles=[Trouble(under_way, case.strike)])
    outcome = bench.told("path", tmp_path, poses=POSES)
    assert outcome.ending is Ending.STOPPED
    assert case.reason in outcome.reason
    assert (outcome.node, outcome.emcy) == (2, case.emcy)
    assert bench.time_to_rest() < case.noticed + RAMP
    assert bench.states[-1] == (OFF, case.ends, OFF)
    assert ("NOT KNOWN TO BE STOPPED: axis rotate (node 2)" in outcome.reason) is case.unknown


def test_an_axis_that_one_which_brakes_later_takes_along_is_waited_for(tmp_path: Path) -> None:
    bench = TaskBench(troubles=[Trouble(lambda bench: bench.moving(ROTATE, 0.4), SETPOINTS_LATE)])
    outcome = bench.told("path", tmp_path, poses=[{"lift": 0.1, "rotate": -1.0, "stretch": 0.4}], cycle=0.002)
    assert "every axis was stopped" in outcome.reason
    assert bench.rests()


def test_a_drive_of_which_nothing_is_heard_stops_by_its_own_supervision(tmp_path: Path) -> None:
    """Off the bus it hears no SYNC: after 200 ms it goes into a fault, whoever else is there."""
    bench = TaskBench(troubles=[Trouble(under_way, fault("bus_off"))])
    bench.told("path", tmp_path, poses=POSES)
    for _ in range(110):
        bench.virtual.receive(can.Message(arbitration_id=0x80, is_extended_id=False))
    assert bench.virtual.drives[ROTATE].machine.state is State.FAULT


@pytest.mark.parametrize(
    "strike",
    [fault("frames_doubled"), fault("frames_lost", cob_id=0x282, every=3), fault("sdo_silent")],
    ids=["doubled frames", "every third PDO lost", "an SDO server that nobody needs now"],
)
def test_what_a_bus_may_do_stops_nothing(strike: Callable[[VirtualMachine], None], tmp_path: Path) -> None:
    bench = TaskBench(troubles=[Trouble(under_way, strike)])
    assert bench.told("path", tmp_path, poses=POSES).ending is Ending.DONE
    assert bench.positions[-1].tolist() == pytest.approx([0.05, -1.0, 0.3], abs=1e-3)


def test_a_recording_with_lost_samples_is_none(tmp_path: Path) -> None:
    lossy = read_fault({"fault": "frames_lost", "node": 1, "cob_id": 0x281, "every": 100}).strike
    bench = TaskBench("stage", troubles=[Trouble(lambda bench: bench.moving(0), lossy)])
    outcome = bench.told("identify", tmp_path)
    assert outcome.ending is Ending.STOPPED
    assert "PDOs were lost, so it is not a recording of the motion" in outcome.reason
    assert not (tmp_path / "identified.json").exists()
    assert bench.states[-1] == (OFF,)


def test_an_sdo_server_that_falls_silent_at_the_start_is_a_refusal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivetwin.controller.link.PumpedSdoClient.RESPONSE_TIMEOUT", 0.02)
    bench = TaskBench()
    bench.virtual.drives[ROTATE].dictionary[0x6085].on_write = lambda _value: fault("sdo_silent")(bench.virtual)
    outcome = bench.told("path", tmp_path, poses=POSES)
    assert outcome.ending is Ending.REFUSED
    assert "axis rotate (node 2) does not answer on inproc (" in outcome.reason
    assert outcome.node == 2
    assert not bench.time, "no SYNC was sent, nothing was enabled"


def test_an_sdo_server_that_falls_silent_later_stops_the_axes_within_a_second(tmp_path: Path) -> None:
    """Axes are homed and the mode is to be changed: the wait is counted in the plant's time."""
    homed = Trouble(lambda bench: bench.virtual.now() > 0.5, fault("sdo_silent"))
    bench = TaskBench(troubles=[homed])
    outcome = bench.told("path", tmp_path, poses=POSES)
    assert outcome.ending is Ending.STOPPED
    assert "axis rotate (node 2) does not answer" in outcome.reason
    assert outcome.node == 2
    assert bench.states[-1] == (OFF, OFF, OFF)
    asked = [time for time, frame in bench.sent if frame.arbitration_id == 0x602]
    assert bench.virtual.now() - asked[-2] < 1.5


def test_an_abort_is_a_refusal_that_names_the_object(tmp_path: Path) -> None:
    bench = TaskBench()
    bench.virtual.drives[ROTATE].dictionary[0x1017].on_write = _refuse
    outcome = bench.told("boot", tmp_path)
    assert outcome.ending is Ending.REFUSED
    assert "axis rotate (node 2): writing 100 to 1017h was aborted by the drive" in outcome.reason


def _refuse(_value: object) -> None:
    raise SdoAbort(AbortCode.VALUE_TOO_HIGH)
