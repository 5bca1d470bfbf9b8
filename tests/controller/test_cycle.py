"""The cycle notices whatever goes wrong on the bus, and says each trouble once."""

from __future__ import annotations

import can
import pytest
from virtual_bench import VirtualBench

from drivetwin.controller.motion import disable, enable_streaming
from drivetwin.controller.pacing import Lockstep
from drivetwin.controller.supervision import MISSED
from drivetwin.controller.trouble import DriveFaultError, TroubleError
from drivetwin.emulator.drive.state_machine import State
from drivetwin.foundation.errors import UserError


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> VirtualBench:
    monkeypatch.setattr(Lockstep, "first_answer", 0.02)
    monkeypatch.setattr(Lockstep, "further_answer", 0.02)
    return VirtualBench("scara").up()


def test_a_cycle_is_outputs_then_sync_then_inputs(bench: VirtualBench) -> None:
    enable_streaming(bench.cycle, bench.drives)
    bench.cycle.run_for(0.003)
    before = bench.cycle.count
    bench.sent.clear()
    bench.cycle.run()
    assert [message.arbitration_id for message in bench.sent] == [0x201, 0x202, 0x203, 0x080, 0x281, 0x282, 0x283]
    assert bench.cycle.count == before + 1
    assert [drive.received for drive in bench.drives] == [1, 1, 1]


def test_a_drive_that_follows_nothing_is_told_changes_at_once_and_all_again_every_ten_cycles(bench: VirtualBench) -> None:
    bench.cycle.run_for(0.03)
    bench.sent.clear()
    bench.cycle.run_for(0.05)
    assert [message.arbitration_id for message in bench.sent].count(0x201) == 5
    bench.drives[0].controlword = 0x06
    bench.sent.clear()
    bench.cycle.run()
    assert [message.data[0] for message in bench.sent if message.arbitration_id == 0x201] == [0x06]


def test_run_for_counts_cycles_not_seconds(bench: VirtualBench) -> None:
    before = bench.virtual.now()
    bench.cycle.run_for(0.25)
    assert bench.cycle.count == 250
    assert bench.virtual.now() - before == pytest.approx(0.25)


def test_silent_drives_are_named_once_and_not_waited_for_again(bench: VirtualBench) -> None:
    bench.cycle.run()
    bench.silent = {1, 3}
    bench.cycle.run_for(0.002)
    assert bench.cycle.missed == 4, "a PDO or two may be lost"
    with pytest.raises(TroubleError, match=r"axis lift \(node 1\) sent no PDO for 3 SYNCs \(3 ms\)") as lift:
        bench.cycle.run()
    with pytest.raises(TroubleError, match=r"axis stretch \(node 3\) sent no PDO for 3 SYNCs \(3 ms\)") as stretch:
        bench.cycle.run()
    assert (lift.value.node, stretch.value.node) == (1, 3)
    missed = bench.cycle.missed
    bench.cycle.run()
    assert [drive.received for drive in bench.drives] == [0, 1, 0]
    assert bench.cycle.missed == missed, "nobody waits for them any more"


def test_a_pdo_that_is_lost_now_and_then_is_no_trouble(bench: VirtualBench) -> None:
    for _ in range(5):
        bench.silent = {2}
        bench.cycle.run_for((MISSED - 1) * bench.cycle.period)
        bench.silent = set()
        bench.cycle.run()
    assert bench.cycle.missed == 5 * (MISSED - 1)


def test_an_emergency_is_told_once(bench: VirtualBench) -> None:
    enable_streaming(bench.cycle, bench.drives)
    bench.virtual.drives[1].fault(0x7500)
    with pytest.raises(DriveFaultError, match=r"axis rotate \(node 2\) reports EMCY 7500h"):
        bench.cycle.run()
    bench.cycle.run_for(0.1)
    assert bench.states()[1] is State.FAULT


def test_an_error_reset_is_no_fault(bench: VirtualBench) -> None:
    bench.virtual.drives[1].fault(0x7500)
    with pytest.raises(DriveFaultError):
        bench.cycle.run()
    enable_streaming(bench.cycle, bench.drives)
    assert bench.states() == [State.OPERATION_ENABLED] * 3
    assert 0x0000 in [int.from_bytes(frame.data[:2], "little") for frame in bench.sent if frame.arbitration_id == 0x82]


def test_a_drive_that_leaves_operation_without_a_word_is_noticed(bench: VirtualBench) -> None:
    enable_streaming(bench.cycle, bench.drives)
    bench.cycle.run_for(0.01)
    bench.virtual.drives[2].machine.state = State.SWITCH_ON_DISABLED  # safe torque off, say
    with pytest.raises(DriveFaultError, match=r"axis stretch \(node 3\) has left operation by itself \(statusword 0.50h\)"):
        bench.cycle.run_for(0.01)


def test_a_drive_that_was_disabled_on_purpose_has_not_left(bench: VirtualBench) -> None:
    enable_streaming(bench.cycle, bench.drives)
    disable(bench.cycle, bench.drives)
    bench.cycle.run_for(0.05)
    assert bench.states() == [State.SWITCH_ON_DISABLED] * 3


def test_frames_that_are_no_answers_are_passed_over(bench: VirtualBench) -> None:
    bench.cycle.run()
    status = bench.drives[0].statusword
    received = bench.bus._received  # the frames as a foreign node would put them there
    received.append(can.Message(arbitration_id=0x181, is_extended_id=False, is_remote_frame=True, dlc=2))
    received.append(can.Message(arbitration_id=0x181, is_extended_id=True, data=b"\xff\xff"))
    received.append(can.Message(arbitration_id=0x181, is_extended_id=False, is_error_frame=True, data=b"\xff\xff"))
    bench.cycle.run()
    assert bench.drives[0].statusword == status


def test_an_axis_that_leaves_its_travel_ends_the_cycle(bench: VirtualBench) -> None:
    drive = bench.drives[0]
    bench.cycle.run()
    here = drive.position * drive.unit
    drive.stay_within(here - 1e-3, here + 1e-3)
    bench.cycle.run()
    drive.stay_within(here + 1e-3, here + 2e-3)
    with pytest.raises(UserError, match="outside"):
        bench.cycle.run()


def test_a_second_answer_to_one_sync_is_no_sample(bench: VirtualBench) -> None:
    """A second SYNC producer would shift every later row by a cycle."""
    bench.cycle.run()
    bench.before_sync = lambda: bench.virtual.receive(can.Message(arbitration_id=0x80, is_extended_id=False))
    bench.cycle.run()
    bench.before_sync = None
    with pytest.raises(UserError, match="2 PDOs for one SYNC"):
        bench.cycle.run()
