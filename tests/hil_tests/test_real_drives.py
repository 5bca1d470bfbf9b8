"""drives: real: what is refused before anything moves, which cases are left out, and how a bus of another's drives is judged.

No real drive is here: `drivetwin emulate` in a process of its own has the drives, on the wall clock; the judge only listens.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from processes import PATIENCE, Ended, drivetwin, emulator, start
from real_bench import KEEPS_LIMITS, SLOWER, real_bench
from stage_bench import LIMITS, REFERENCE, bench_file, scenario_file

from drivetwin.bus.channel import host_bus
from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.bench import Bench, read_bench
from drivetwin.hil_tests.judge import skipped
from drivetwin.hil_tests.motion_plan import what_moves
from drivetwin.hil_tests.results import Acceptance, write_junit, write_report, write_results
from drivetwin.hil_tests.run import run_all, run_one
from drivetwin.hil_tests.scenario import read_scenario
from drivetwin.hil_tests.stand.real_stand import run_real_case
from drivetwin.hil_tests.suite import CASES, find_cases
from drivetwin.hil_tests.verdict import Outcome

# -- before anything moves -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"bus": "embedded"}, "embedded is made for a case, and real drives are on none"),
        ({"real": {"limits": "limits.yaml"}}, "unix:/nowhere is not named like a physical bus .* add any_bus: true to real"),
        ({"clock": "sync"}, "clock: real drives have their own clock"),
        ({"bit_timing": True}, "bit_timing: their wire is not modelled where drives are real"),
        ({"truth": "own.json"}, "truth: their plant is not modelled|no effects file"),
        ({"real": {"any_bus": True}}, "real.limits: name the file"),
        ({"real": {"limits": "elsewhere.yaml", "any_bus": True}}, "elsewhere.yaml does not exist"),
        ({"real": {"limits": "limits.yaml", "anybus": True}}, "real.anybus: is not a known key; there are any_bus, limits"),
        ({"command": REFERENCE}, r"only the controller can keep to real.limits; give it \{limits\}"),
        ({"limits": {}}, "there is no 'travel'; this bench has none"),
        ({"limits": LIMITS | {"torque": {}}}, "limits: real drives need travel .*, speed and torque of slide"),
        ({"slide": SLOWER | {"travel": [-0.16, 0.1]}}, r"travel \[-0.16, 0.1\] is wider than \[-0.15, 0.15\] of machine stage"),
        ({"slide": SLOWER | {"torque": 754.5}}, "slide: torque 754.5 is more than 753.982 of machine stage"),
        ({"slide": SLOWER | {"speed": 1.1}}, "slide: speed 1.1 is more than 1 of limits in bench.yaml"),
        ({"slide": SLOWER | {"travel": [0.1, -0.1]}}, r"axes.slide.travel: expected \[lowest, highest\]"),
        ({"slide": {"travel": [-0.1, 0.1], "speed": 0.1}}, "axes.slide.torque: Field required"),
    ],
)
def test_what_could_hurt_is_refused(tmp_path: Path, changes: dict[str, Any], said: str) -> None:
    with pytest.raises(UserError, match=said):
        read_bench(real_bench(tmp_path, **({"bus": "unix:/nowhere"} | changes)), real=True)


def test_limits_of_every_axis_are_needed(tmp_path: Path) -> None:
    path = real_bench(tmp_path, "can0")
    (tmp_path / "limits.yaml").write_text("axes: {}\n")
    with pytest.raises(UserError, match=r"limits.yaml: axes: limits of none, and the machine has slide"):
        read_bench(path, real=True)


def test_real_drives_are_moved_only_where_somebody_says_so(tmp_path: Path) -> None:
    """Whoever reads a bench without saying it, as the pytest plugin and the mutants' table do, is refused."""
    path = real_bench(tmp_path, "can0", real={"limits": "limits.yaml"})
    assert read_bench(path, real=True).bus == "can0"
    with pytest.raises(UserError, match="a machine will move: add --real to `drivetwin accept`, once it is clear"):
        read_bench(path)
    with pytest.raises(UserError, match="clock: real drives have their own clock"):
        read_bench(path, real=True, changes={"clock": "sync"})


def test_virtual_drives_stay_where_real_ones_cannot_be(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="--real is for a bench whose file says drives: real"):
        read_bench(bench_file(tmp_path, REFERENCE), real=True)
    with pytest.raises(UserError, match="real: is for drives: real, and these are virtual"):
        read_bench(bench_file(tmp_path, REFERENCE, real={"any_bus": True}))
    with pytest.raises(UserError, match="can0 may have real drives"):
        read_bench(bench_file(tmp_path, REFERENCE, bus="can0"))


# -- which cases ---------------------------------------------------------------------------------------------------------


def read(folder: Path, **changes: Any) -> Any:
    return read_scenario(scenario_file(folder, **changes), read_bench(real_bench(folder, "can0"), real=True))


MOVE = {"task": "move", "parameters": {"moves": [{"axis": "slide", "to": 0.1}, {"axis": "slide", "to": -0.05}]}}
STRANGE = {"task": "path", "parameters": {"poses": [{"wheel": 1.0}]}}
FAULT = {"fault": "sto", "node": 1, "when": {"time": 1.0}}


@pytest.mark.parametrize(
    ("changes", "because"),
    [
        ({"faults": [FAULT], "expect": [{"outcome": "stopped"}, "no_emergency"]}, "faults strike virtual drives .*: sto"),
        (
            {"task": {"task": "home", "resume": True}, "expect": [{"outcome": "done"}, "no_emergency"]},
            "resume lets a controller reset a drive's fault and enable it again by itself, and here drives are real",
        ),
        ({"expect": [{"outcome": "done"}, "limits", "no_jump"]}, "what only a plant's truth shows; .*: limits, no_jump"),
        ({"expect": [{"outcome": "done"}]}, "what only a plant's truth shows; these drives are real: nothing"),
        (
            {"task": MOVE, "slide": {"travel": [-0.04, 0.12]}, "expect": [{"outcome": "done"}, "no_emergency"]},
            "slide is to go to -0.05 m, and its limits are -0.04 .. 0.12",
        ),
        (
            {"task": STRANGE, "expect": [{"outcome": "done"}, "no_emergency"]},
            "wheel is to move, and machine stage has no such axis",
        ),
    ],
)
def test_a_case_that_is_not_for_real_drives_is_skipped(tmp_path: Path, changes: dict[str, Any], because: str) -> None:
    slide = SLOWER | changes.pop("slide", {})
    bench = read_bench(real_bench(tmp_path, "can0", slide=slide), real=True)
    case = read_scenario(scenario_file(tmp_path, **changes), bench)
    with pytest.raises(AssertionError, match=because):
        raise AssertionError(case.skipped_because)
    assert run_one(bench, case, tmp_path / "out").outcome is Outcome.SKIPPED


def test_what_needs_the_truth_is_not_judged_and_needs_no_limit(tmp_path: Path) -> None:
    expect = [{"outcome": "done"}, "no_emergency", {"synchronised": {"apart": "no_such_limit"}}, "limits"]
    case = read(tmp_path, task=MOVE, expect=expect)
    assert case.skipped_because is None
    assert [one.name for one in case.expectations] == ["outcome", "no_emergency", "torque_limit_kept"]
    assert case.not_judged == ("synchronised", "limits")


def test_targets_that_nobody_can_read_are_an_error(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="nobody can read from its parameters where axes go"):
        read(tmp_path, task={"task": "move", "parameters": {"way": 1}}, expect=[{"outcome": "done"}, "no_emergency"])


def test_what_moves_is_said_in_the_order_of_the_cases(tmp_path: Path) -> None:
    scenario_file(tmp_path / "own", "04_moves/to_and_fro", task=MOVE, expect=[{"outcome": "done"}, "no_emergency"])
    scenario_file(tmp_path / "own", "08_faults/sto", task=MOVE, faults=[FAULT], expect=[{"outcome": "stopped"}])
    bench = read_bench(real_bench(tmp_path, "can0"), real=True)
    chosen = ["01_boot.configured", "02_enable.enable", "03_homing.home", "04_moves.to_and_fro", "08_faults.sto"]
    assert list(what_moves(find_cases(bench, [CASES, tmp_path / "own"], chosen), bench)) == [
        "slide: -0.15 .. 0.15 m, at most 0.2 m/s and 400 N",
        "Homing leaves this travel: it ends at the switch.",
        "01_boot.configured: nothing moves",
        "02_enable.enable: every axis is enabled and holds where it stands",
        "03_homing.home: every axis goes to its switch, and from there into its limits",
        "04_moves.to_and_fro: every axis goes to its switch, then slide -0.05 .. 0.1 m",
    ]


def test_what_would_move_is_said_before_it_is_refused(tmp_path: Path) -> None:
    """Whoever adds --real has read the plan."""
    bench, out = real_bench(tmp_path, "unix:/nowhere"), tmp_path / "out"
    done = drivetwin("accept", "--bench", bench, "--select", "03_homing.home", "--out", out)
    assert done.status == 2
    assert "slide: -0.15 .. 0.15 m, at most 0.2 m/s and 400 N" in done.out
    assert "03_homing.home: every axis goes to its switch, and from there into its limits" in done.out
    assert "its drives are real, and a machine will move: add --real to `drivetwin accept`, once it is clear" in done.err
    assert not out.exists()


def test_limits_that_are_too_wide_are_refused_without_a_plan(tmp_path: Path) -> None:
    bench = real_bench(tmp_path, "unix:/nowhere", slide=SLOWER | {"speed": 1.1})
    done = drivetwin("accept", "--bench", bench, "--out", tmp_path / "out")
    assert (done.status, done.out) == (2, "")
    assert "slide: speed 1.1 is more than 1 of limits in bench.yaml" in done.err


# -- on a bus whose drives are another's ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def drives(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with emulator("--machine", "stage", bus=f"unix:{tmp_path_factory.mktemp('drives')}/bus") as bus:
        yield bus


def accept(bench: Path, out: Path, *cases: str) -> Ended:
    selected = [word for case in cases for word in ("--select", case)]
    return drivetwin("accept", "--bench", bench, "--real", "--out", out, *selected)


def results(out: Path) -> dict[str, Any]:
    read_back: dict[str, Any] = json.loads((out / "results.json").read_text(encoding="utf-8"))
    return {f"{case['number']:02d}_{case['group']}.{case['name']}": case for case in read_back["cases"]}


def test_a_sound_controller_is_accepted_by_what_the_bus_shows(tmp_path: Path, drives: str) -> None:
    scenario_file(tmp_path / "own", "08_faults/sto", faults=[FAULT], expect=[{"outcome": "stopped"}, "stopped"])
    bench = real_bench(tmp_path, drives)
    selected = [word for case in ("01_boot.configured", "*.enable", "*.home", "*.sto") for word in ("--select", case)]
    words = ("--cases", str(tmp_path / "own"), *selected)
    done = drivetwin("accept", "--bench", bench, "--real", "--out", tmp_path / "out", *words)
    assert (done.status, done.err) == (0, ""), done.out
    cases = results(tmp_path / "out")
    outcomes = {name: case["outcome"] for name, case in cases.items()}
    accepted = dict.fromkeys(("01_boot.configured", "02_enable.enable", "03_homing.home"), "accepted")
    assert outcomes == accepted | {"08_faults.sto": "skipped"}
    assert cases["08_faults.sto"]["skipped_because"].startswith("faults strike virtual drives and their plant")
    assert cases["01_boot.configured"]["not_judged"] == ["nothing_moves"]
    assert cases["02_enable.enable"]["not_judged"] == ["no_jump", "holds", "nothing_moves", "limits", "disabled_at_end"]
    assert done.out.index("01_boot.configured: nothing moves") < done.out.index("accepted")
    folder = tmp_path / "out" / "cases" / "02_enable.enable"
    assert " 201#" in (folder / "bus.log").read_text(encoding="ascii")
    assert not (folder / "truth").exists()
    junit = (tmp_path / "out" / "junit.xml").read_text(encoding="utf-8")
    assert "not judged, for want of the plant's truth: nothing moves" in junit
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert f"The drives were real, on {drives}" in report
    assert "simulated, from power on" not in report


@pytest.mark.parametrize(
    ("mutant", "case", "expectation"),
    [
        ("maps_pdo_in_the_wrong_order", "01_boot.configured", "pdo_mapping"),
        ("leaves_out_switching_on", "02_enable.enable", "state_sequence"),
        ("leaves_drives_enabled", "02_enable.enable", "state_sequence"),
        (None, "01_boot.configured", "torque_limit_kept"),
        ("skips_homing", "03_homing.home", "homing_attained"),
    ],
)
def test_a_broken_controller_is_rejected_there_too(
    tmp_path: Path, drives: str, mutant: str | None, case: str, expectation: str
) -> None:
    """Without a mutant: the reference controller that is not told its limits."""
    unlimited = [*REFERENCE, "--log", "{limits}.log"]
    broken = [*KEEPS_LIMITS[:2], "drivetwin.mutants", mutant, *KEEPS_LIMITS[3:]] if mutant else unlimited
    done = accept(real_bench(tmp_path, drives, command=broken), tmp_path / "out", case, "11_soak.to_and_fro")
    assert done.status == 1, done.out
    cases = results(tmp_path / "out")
    assert expectation in [failure["expectation"] for failure in cases[case]["failures"]]
    assert cases["11_soak.to_and_fro"]["skipped_because"] == f"{case} was rejected, and drives are real: nothing more is run"


def test_the_judge_sends_nothing(tmp_path: Path) -> None:
    """A controller that says nothing, on a bus on which nobody else is: its host hears no frame."""
    hosted = host_bus(f"unix:{tmp_path}/bus")
    try:
        bench: Bench = read_bench(real_bench(tmp_path, hosted.name, command=["true", "{limits}"]), real=True)
        result = run_one(bench, read_scenario(CASES / "01_boot/configured.yaml", bench), tmp_path / "out")
        assert hosted.bus.recv(0.0) is None
    finally:
        hosted.close()
    assert result.outcome is Outcome.REJECTED
    assert {failure.expectation for failure in result.failures} == {
        *("operational", "pdo_mapping", "heartbeat", "torque_limit_kept")
    }


SAYS_MUCH_WHEN_ASKED_TO_END = """
import signal, sys, time
from drivetwin.bus.channel import open_bus
import can
bus = open_bus(sys.argv[1])
def stop(*_):
    for number in range(2000):
        bus.send(can.Message(arbitration_id=0x123, data=number.to_bytes(2, "little"), is_extended_id=False))
        time.sleep(0.001)
    sys.exit(3)
signal.signal(signal.SIGTERM, stop)
bus.send(can.Message(arbitration_id=0x124, is_extended_id=False))
time.sleep(60)
"""
"""Its first frame says that it can be asked."""


def test_what_a_controller_sends_while_it_is_ended_is_heard(tmp_path: Path, drives: str) -> None:
    """More frames than the bus keeps for one who does not listen, which would lose what comes late."""
    said = {"start": PATIENCE, "silence": 0.5, "simulated": 60.0}
    command = ["{python}", "-c", SAYS_MUCH_WHEN_ASKED_TO_END, "{bus}", "{limits}"]
    bench = read_bench(real_bench(tmp_path, drives, command=command, timeouts=said), real=True)
    (tmp_path / "case").mkdir()
    seen = run_real_case(bench, read_scenario(CASES / "01_boot/configured.yaml", bench), tmp_path / "case")
    numbers = [int.from_bytes(frame.data, "little") for frame in seen.frames if frame.identifier == 0x123]
    assert numbers == list(range(2000))


# -- a bus that goes away ------------------------------------------------------------------------------------------------

RESULTS = ("results.json", "junit.xml", "report.html")

LEAVES_THE_BUS_DEAD = """
import os, pathlib, signal, sys, time
os.kill(int(sys.argv[1]), signal.SIGKILL)
time.sleep(60)
"""


def test_a_bus_lost_in_a_case_rejects_it_and_what_was_found_before_is_written(tmp_path: Path) -> None:
    """The controller of this test kills the bus's host, and lives on."""
    host = start("emulate", "--machine", "stage", "--bus", f"unix:{tmp_path}/bus")
    assert host.stdout is not None
    assert "unix:" in host.stdout.readline()
    kills = ["{python}", "-c", LEAVES_THE_BUS_DEAD, str(host.pid), "{limits}"]
    try:
        bench = real_bench(tmp_path, f"unix:{tmp_path}/bus", command=kills)
        done = accept(bench, tmp_path / "out", "01_boot.configured", "02_enable.enable")
    finally:
        host.kill()
        host.communicate()
    assert (done.status, done.err) == (1, ""), done.out
    cases = results(tmp_path / "out")
    said = {one["expectation"]: one["message"] for one in cases["01_boot.configured"]["failures"]}
    assert "the bus was lost: the bus at unix:" in said["bus"]
    assert "the controller ended as 'bus lost'" in said["outcome"]
    assert "01_boot.configured was rejected" in cases["02_enable.enable"]["skipped_because"]
    assert all("the bus was lost" in (tmp_path / "out" / name).read_text(encoding="utf-8") for name in RESULTS)


def test_a_bus_lost_between_two_cases_rejects_the_next(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was found until then is not lost with it."""
    bench = read_bench(real_bench(tmp_path, f"unix:{tmp_path}/bus", command=["true", "{limits}"]), real=True)
    first, second = find_cases(bench, [CASES], ["01_boot.configured", "02_enable.enable"])
    accepted = replace(skipped(first, ""), outcome=Outcome.ACCEPTED)
    run = {first.identity: lambda: accepted}
    kept = run_one
    monkeypatch.setattr("drivetwin.hil_tests.run.run_one", lambda *given: run.get(given[1].identity, lambda: kept(*given))())
    found = run_all(bench, [first, second], tmp_path / "cases", 1, lambda _: None)
    assert [one.outcome for one in found] == [Outcome.ACCEPTED, Outcome.REJECTED]
    assert found[1].failures[0].message.startswith("it was not run: no bus at unix:")
    acceptance = Acceptance(bench, tuple(found), "")
    write_results(acceptance, tmp_path / "results.json", [])
    write_junit(acceptance, tmp_path / "junit.xml", tmp_path, None)
    write_report(acceptance, tmp_path / "report.html", None)
    assert all("it was not run: no bus" in (tmp_path / name).read_text(encoding="utf-8") for name in RESULTS)
    with pytest.raises(UserError, match="no bus at unix:"):
        run_all(bench, [second], tmp_path / "cases", 1, lambda _: None)
