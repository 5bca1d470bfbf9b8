"""Controllers that hang, crash, flood, never start or leave things behind: each ends with its verdict, and nothing stays."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import can
import pytest
from stage_bench import bad, bench_file, scenario_file

from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.bench import read_bench
from drivetwin.hil_tests.folder import digest
from drivetwin.hil_tests.run import run_one
from drivetwin.hil_tests.scenario import read_scenario
from drivetwin.hil_tests.stand.stand import run_case
from drivetwin.hil_tests.verdict import CaseResult, Outcome
from drivetwin.recording.reader import read_recording


@pytest.fixture(autouse=True)
def nothing_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """After each test no process that knows its folder lives, and no socket is left."""
    sockets = tmp_path / "s"
    sockets.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(sockets))
    yield
    assert processes_of(tmp_path) == []
    assert list(sockets.iterdir()) == []


def processes_of(folder: Path) -> list[str]:
    """Command lines of the processes that name a folder."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            command = entry.read_bytes().replace(b"\0", b" ").decode(errors="replace")
        except OSError:
            continue  # it has just ended
        if str(folder) in command:
            found.append(command)
    return found


def run(folder: Path, what: str, timeouts: dict[str, float] | None = None, **changes: Any) -> CaseResult:
    patient = {"start": 60.0, "silence": 60.0, "simulated": 10.0}
    bench = read_bench(bench_file(folder, bad(what), timeouts=timeouts or patient))
    return run_one(bench, read_scenario(scenario_file(folder, **changes), bench), folder / "out")


def the_failure(result: CaseResult, expectation: str) -> str:
    """The message of the one failure of an expectation."""
    (message,) = [failure.message for failure in result.failures if failure.expectation == expectation]
    return message


@pytest.mark.parametrize(
    ("what", "timeouts", "ending"),
    [
        ("never_joins", {"start": 1.5}, r"ended as 'never started' .*it sent no frame within 1.5 s of its start"),
        ("hangs", {"start": 60.0, "silence": 1.0}, r"ended as 'hangs' .*it lived but sent nothing for 1 s"),
    ],
)
def test_a_controller_that_says_nothing_is_ended(
    tmp_path: Path, what: str, timeouts: dict[str, float], ending: str
) -> None:
    """Wall-clock seconds are waited for what never comes, and asserted on nowhere."""
    result = run(tmp_path, what, timeouts)
    assert result.outcome is Outcome.REJECTED
    with pytest.raises(AssertionError, match=ending):
        raise AssertionError(the_failure(result, "outcome"))


@pytest.mark.parametrize(
    ("what", "said"),
    [
        ("crashes", ("'crashed' (exit status 1)", "ZeroDivisionError: the controller's own mistake")),
        ("floods", ("'floods'", "more frames than the wire carries, for more than a second")),
        ("never_ends", ("'never ends'", "went on for more than 10 s of simulated time")),
        ("refuses", ("'refused' (exit status 2)", "this machine is none of mine")),
        ("stops", ("'stopped' (exit status 3)",)),
    ],
)
def test_a_controller_that_ends_otherwise_than_expected_is_rejected(tmp_path: Path, what: str, said: tuple[str, ...]) -> None:
    result = run(tmp_path, what)
    message = the_failure(result, "outcome")
    assert all(part in message for part in said), message


def test_what_a_controller_leaves_running_is_told_and_ended(tmp_path: Path) -> None:
    result = run(tmp_path, "leaves_a_process")
    assert [failure.expectation for failure in result.failures] == ["leaves nothing"]
    assert "start 1: processes of its own that still lived" in result.failures[0].message


def test_an_outcome_may_be_expected_or_one_of_two(tmp_path: Path) -> None:
    assert run(tmp_path, "refuses", expect=[{"outcome": "refused"}]).outcome is Outcome.ACCEPTED
    assert run(tmp_path, "stops", expect=[{"outcome": "refused or stopped"}]).outcome is Outcome.ACCEPTED


def test_a_controller_is_started_as_often_as_the_case_says(tmp_path: Path) -> None:
    result = run(tmp_path, "does_nothing", starts=2, expect=[{"outcome": ["done", "stopped"]}])
    assert "ended as 'done' (exit status 0) at start 2, expected 'stopped'" in the_failure(result, "outcome")
    assert (tmp_path / "out" / "controller_2" / "task.json").exists()


def test_what_an_unready_controller_leaves_enabled_is_seen_after_it_has_gone(tmp_path: Path) -> None:
    """The default RPDO 1 enables in one step, the drive then stands under power: what the plant says counts."""
    expect: list[Any] = [{"outcome": "done"}, "state_sequence", "disabled_at_end", "nothing_moves"]
    result = run(tmp_path, "enables_in_one_step", expect=expect)
    failed = {failure.expectation: failure for failure in result.failures}
    assert set(failed) == {"state_sequence", "disabled_at_end", "nothing_moves"}
    assert "from ready to switch on to operation enabled: a step was left out" in failed["state_sequence"].message
    assert (failed["state_sequence"].axis, failed["state_sequence"].time) == ("slide", 0.005)
    assert failed["nothing_moves"].message == "the drive is enabled"


def test_the_controller_is_killed_where_the_case_says(tmp_path: Path) -> None:
    fault = {"fault": "controller_killed", "when": {"sync": 0, "time": 1.0}}
    result = run(tmp_path, "never_ends", faults=[fault], expect=[{"outcome": "killed"}])
    assert result.outcome is Outcome.ACCEPTED
    assert result.simulated == pytest.approx(1.1, abs=0.003)


def test_a_fault_that_never_strikes_is_told(tmp_path: Path) -> None:
    fault = {"fault": "sto", "node": 1, "when": {"moving": "slide"}}
    result = run(tmp_path, "does_nothing", faults=[fault])
    assert "sto node 1 never struck" in the_failure(result, "fault")


def test_faults_strike_and_end_by_the_simulated_clock(tmp_path: Path) -> None:
    """The drive tells its loss of torque in the statusword (CiA 402-2), which the log has with the time."""
    fault = {"fault": "node_resets", "node": 1, "off": 0.0, "when": {"time": 0.020}, "after": 0.004}
    result = run(tmp_path, "does_nothing", faults=[fault])
    assert result.outcome is Outcome.ACCEPTED
    boots = [round(frame.timestamp, 6) for frame in frames(tmp_path / "out" / "bus.log") if frame.arbitration_id == 0x701]
    assert boots == [0.0, 0.024]


def frames(log: Path) -> list[can.Message]:
    return list(can.CanutilsLogReader(log))


def test_a_case_leaves_log_truth_and_what_the_controller_said(tmp_path: Path) -> None:
    run(tmp_path, "crashes")
    folder = tmp_path / "out"
    syncs = [frame.timestamp for frame in frames(folder / "bus.log") if frame.arbitration_id == 0x80]
    assert syncs == pytest.approx([0.001 * number for number in range(100)])
    (truth,) = read_recording(folder / "truth")
    assert len(truth.time) == 200  # 100 cycles of the controller and 0.1 s of aftermath
    assert truth.time[-1] == pytest.approx(0.2)
    assert set(truth.columns["slide"]) >= {"position", "velocity", "torque", "position_demand"}
    assert "ZeroDivisionError" in (folder / "controller.log").read_text()


def test_two_runs_in_lockstep_leave_the_same_bytes(tmp_path: Path) -> None:
    found = set()
    for number in (1, 2):
        folder = tmp_path / f"run{number}"
        folder.mkdir()
        run(folder, "enables_in_one_step")
        found.add(digest([folder / "out"]))
    assert len(found) == 1


def test_with_bit_timing_frames_take_their_time(tmp_path: Path) -> None:
    """At 125 kbit/s a SYNC without data is 47 bits at least, 376 us: of what the log has, no 100 ms hold more than fit."""
    changes: dict[str, Any] = {"bit_timing": True, "bit_rate": 125_000, "timeouts": {"start": 60.0, "silence": 60.0}}
    bench = read_bench(bench_file(tmp_path, bad("does_nothing"), **changes))
    expect: list[Any] = [{"outcome": "done"}, {"bus_load": {"share": 1.0}}, {"sync_period": {"jitter": 0.0015}}]
    result = run_one(bench, read_scenario(scenario_file(tmp_path, expect=expect), bench), tmp_path / "out")
    assert result.failures == ()
    assert {measured.name for measured in result.measured} == {"bus load", "SYNC jitter, 99 %"}
    assert sum(one.arbitration_id == 0x80 for one in frames(tmp_path / "out" / "bus.log")) == 50


def test_a_node_that_has_booted_again_is_judged_as_it_is_then(tmp_path: Path) -> None:
    """Nobody has configured it since, and the next frame after the fault starts it."""
    fault = {"fault": "node_resets", "node": 1, "off": 0.0, "when": {"time": 0.0395}}
    assert heartbeat_at_start(tmp_path, "starts_a_node_again") == 0.1
    assert heartbeat_at_start(tmp_path, "starts_a_node_again", faults=[fault]) == 0.0


def test_with_bit_timing_a_node_is_judged_as_it_was_when_its_start_was_whole(tmp_path: Path) -> None:
    """On the wall clock a frame acts when it is whole, some time after it was sent, and others are behind it."""
    changes: dict[str, Any] = {"bit_timing": True, "clock": "realtime", "bit_rate": 50_000}
    assert heartbeat_at_start(tmp_path, "changes_a_node_that_it_has_started", changes) == 0.1


def heartbeat_at_start(folder: Path, what: str, bench: dict[str, Any] | None = None, **changes: Any) -> float:
    """Of the node when it became operational last [s]."""
    read = read_bench(bench_file(folder, bad(what), **({"timeouts": {"start": 60.0, "silence": 60.0}} | (bench or {}))))
    out = folder / f"out{len(list(folder.glob('out*')))}"
    out.mkdir()
    return run_case(read, read_scenario(scenario_file(folder, **changes), read), out).configured["slide"].heartbeat


def test_a_program_that_is_not_there_and_a_place_that_is_not_known_are_told(tmp_path: Path) -> None:
    for command, expected in (
        (["no-such-controller"], "there is no program 'no-such-controller' to start"),
        (["{python}", "{tusk_file}"], r"'tusk_file' is nothing to fill in; there are \{python\}, .*\{task_file\}"),
    ):
        bench = read_bench(bench_file(tmp_path, command))
        with pytest.raises(UserError, match=expected):
            run_one(bench, read_scenario(scenario_file(tmp_path), bench), tmp_path / "out")


def test_a_task_that_the_controller_cannot_do_is_skipped(tmp_path: Path) -> None:
    result = run(tmp_path, "does_nothing", task={"task": "identify"})
    assert result.outcome is Outcome.SKIPPED
    assert result.skipped_because == "the controller 'of the test' does no task 'identify' (tasks in bench.yaml)"
