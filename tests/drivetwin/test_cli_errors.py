"""Bad input to the command line: one line on stderr that says what to do, exit status 2, nothing half-written."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable
from pathlib import Path

import pytest
from in_process import Command
from processes import Ended

from drivetwin.bus.channel import host_bus
from drivetwin.controller import bring_up as bring_up_module
from drivetwin.controller.pacing import Lockstep
from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.drive.state_machine import State
from drivetwin.emulator.virtual_machine import VirtualMachine


@pytest.fixture
def refused(command: Command, tmp_path: Path) -> Callable[[str], str]:
    """Run a command line that has to be refused; returns the line. What it leaves behind is nothing."""
    out = f"--out {tmp_path / 'made' / 'out'}"

    def line_of(line: str) -> str:
        before = sorted(tmp_path.rglob("*"))
        err = one_line(command(line.replace("OUT", out)))
        assert sorted(tmp_path.rglob("*")) == before
        return err

    return line_of


@pytest.fixture
def failed(command: Command, tmp_path: Path) -> Callable[[str], str]:
    """Run a command line that has to fail on the bus; returns the line but for its end, which names all that is left: a log."""
    out = tmp_path / "made" / "out"
    log = tmp_path / "made" / "out.failed.log"

    def line_of(line: str) -> str:
        err = one_line(command(line.replace("OUT", f"--out {out}")))
        assert sorted(tmp_path.rglob("*")) == [log.parent, log]
        assert "#" in log.read_text(encoding="ascii")
        told = f"; the bus log until then: {log}\n"
        assert err.endswith(told)
        return err.removesuffix(told)

    return line_of


def one_line(outcome: Ended) -> str:
    """What stderr says of an input that cannot be used."""
    assert outcome.status == 2
    assert outcome.err.startswith("drivetwin: ")
    assert outcome.err.count("\n") == 1, outcome.err
    return outcome.err


Refused = Callable[[str], str]

COULOMB, VISCOUS = {"coulomb": {"value": 20.4, "unit": "N"}}, {"viscous": {"value": 203.5, "unit": "N·s/m"}}
FRICTION = {
    "schema": "identified/1",
    "machine": "stage",
    "axes": {axis: {"joint": axis, "parameters": COULOMB | VISCOUS} for axis in ("slide", "screw")},
}
HALF_IDENTIFIED = FRICTION | {"axes": {"slide": {"joint": "slide", "parameters": COULOMB}}}


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("identify OUT --bus tokenring", "unknown bus 'tokenring'; expected vcan0 or can0 (SocketCAN), unix:PATH, inproc, or ws://"),
        ("identify OUT --bus ws://10.1.2.3:5000", "is not loopback on this machine; write ws://127.0.0.1:5000"),
        ("identify OUT --bus ws://127.0.0.1:1", "no bus at ws://127.0.0.1:1 ([Errno 111] Connection refused); start one with"),
        ("identify OUT --bus vcan77", "cannot open vcan77"),
        ("identify OUT --machine robot", "no machine 'robot'; it knows arm, scara, stage, or give the folder of a machine"),
        ("identify OUT --clock lunar", "unknown clock 'lunar'; expected sync or realtime"),
        ("identify OUT --profile acme", "unknown drive profile 'acme'"),
        ("identify OUT --seed -1", "'--seed': Input should be greater than or equal to 0; it is '-1'; see: drivetwin"),
        ("identify OUT --seed many", "'--seed': Input should be a valid integer"),
        ("diagnose a.xml b --cutoff fast", "as a number; it is 'fast'; see: drivetwin diagnose -h"),
        ("identify OUT --colour red", "No such option: --colour"),
        ("identify OUT --truth nowhere.json", "no effects file nowhere.json"),
        ("identify OUT --truth nowhere.json --bus ws://127.0.0.1:1", "--truth is for the emulator: give it to"),
        ("identify OUT --bus can0 --clock realtime", "can0 may be a real machine: give --limits FILE with travel, speed and"),
        ("identify OUT --bus can0", "can0 may be a real machine, whose drives have their own clock: give --clock realtime"),
        ("identify OUT --limits nowhere.yaml", "nowhere.yaml does not exist"),
        ("emulate --machine robot", "unknown machine 'robot'; known are arm, scara, stage, or give the folder of a machine"),
        ("emulate --profile acme", "unknown drive profile 'acme'"),
        ("emulate --clock lunar", "unknown clock 'lunar'; expected realtime or sync"),
        ("emulate --bit-rate 5M", "--bit-rate 5M is not a bit rate of a classic CAN bus; write 1M, 500k, 250k or 125k"),
        ("emulate --bus inproc", "no other process can join inproc; give --bus vcan0 or --bus ws://"),
        ("emulate --bus ws://0.0.0.0:5000", "is not loopback on this machine"),
        ("emulate --bus vcan77", "cannot open vcan77"),
        ("emulate --truth nowhere.json", "no effects file nowhere.json; give an effects/1 JSON file"),
        ("write-friction nowhere.json", "no file nowhere.json; `drivetwin identify` and `drivetwin fit` write identified.json"),
        ("write-friction nowhere.json --profile cia402-full", "drives of type cia402-full have no friction table to write to"),
        ("diagnose a.xml b --validat c", "(Possible options: --validate); see: drivetwin diagnose -h"),
        ("waltz", "No such command 'waltz'. Did you mean 'fault'; see: drivetwin --help"),
    ],
)
def test_a_line_that_says_what_to_do(refused: Refused, line: str, expected: str) -> None:
    assert expected in refused(line)


def test_a_port_that_is_in_use(refused: Refused) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        err = refused(f"emulate --bus ws://127.0.0.1:{port}")
    assert f"cannot listen on 127.0.0.1:{port} (Address already in use); choose another port" in err


@pytest.mark.parametrize("line", ["emulate --machine stage", "identify OUT --machine stage"])
@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ({"schema": "effects/1", "effects": [{"effect": "gremlins", "axis": "slide", "parameters": {}}]}, "effect 'gremlins'"),
        ({"schema": "effects/9", "effects": []}, "expected format effects/1"),
        (
            {"schema": "effects/1", "effects": [{"effect": "coulomb", "axis": "slide", "parameters": {}}]},
            "coulomb",
        ),
        (
            {
                "schema": "effects/1",
                "effects": [{"effect": "coulomb", "axis": "elbow", "parameters": {"coulomb": {"value": 1.0, "unit": "N"}}}],
            },
            "the effects name axis 'elbow'; machine stage has slide",
        ),
    ],
)
def test_a_truth_that_is_none(
    refused: Refused, tmp_path: Path, line: str, content: dict[str, object], expected: str
) -> None:
    path = tmp_path / "truth.json"
    path.write_text(json.dumps(content))
    bus = "--bus ws://127.0.0.1:0" if line.startswith("emulate") else ""
    assert expected in refused(f"{line} {bus} --truth {path}")


def test_an_output_that_is_somebody_elses(refused: Refused, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter1.tex").touch()
    assert "is a file" in refused(f"identify --machine stage --out {tmp_path / 'file'}")
    assert "cannot be written" in refused(f"identify --machine stage --out {tmp_path / 'file' / 'below'}")
    assert "did not write; choose an empty or a new" in refused(f"identify --machine stage --out {tmp_path / 'thesis'}")


def test_a_limits_file_on_any_bus_is_checked(refused: Refused, tmp_path: Path) -> None:
    path = tmp_path / "limits.yaml"
    path.write_text("axes: {lift: {travel: [0, 1], speed: 1, torque: 1}}")
    assert "axes: limits of lift, and the machine has slide" in refused(f"identify OUT --machine stage --limits {path}")


@pytest.mark.parametrize(
    ("content", "more", "expected"),
    [
        ({"schema": "identified/9", "machine": "stage", "axes": {}}, "", "not a valid identified/1 file: schema: Input should"),
        ([], "", "is not a valid identified/1 file: the file: Input should be an object"),
        ({"schema": "identified/1", "machine": "arm", "axes": {}}, "", "is of machine arm, and --machine is stage"),
        (FRICTION, "--axis elbow", "nothing was identified of axis 'elbow'; the file has slide, screw"),
        (FRICTION, "--axis screw", "machine stage has no axis 'screw', only slide"),
        (FRICTION, "--axis slide", "which drives? give --bus can0, vcan0 or ws://127.0.0.1:PORT, or --dry-run"),
        (HALF_IDENTIFIED, "", "axis slide has no viscous friction, so that its friction is not known at every speed"),
    ],
)
def test_friction_that_cannot_be_written(
    refused: Refused, tmp_path: Path, content: object, more: str, expected: str
) -> None:
    path = tmp_path / "identified.json"
    path.write_text(json.dumps(content))
    assert expected in refused(f"write-friction {path} --machine stage {more}")


def test_a_real_machine_does_not_move_without_a_yes(refused: Refused, tmp_path: Path) -> None:
    path = tmp_path / "limits.yaml"
    path.write_text("axes: {slide: {travel: [-0.1, 0.1], speed: 0.1, torque: 50}}")
    err = refused(f"identify OUT --machine stage --bus can0 --clock realtime --limits {path}")
    assert err == "drivetwin: not confirmed (--yes confirms without asking); nothing was done\n"


def test_a_bus_where_nobody_answers(failed: Refused, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bring_up_module, "BOOT_TIMEOUT", 0.1)
    hosted = host_bus("ws://127.0.0.1:0")
    err = failed(f"identify OUT --machine stage --bus {hosted.name}")
    hosted.close()
    assert "axis slide (node 1) sent no boot-up message" in err
    assert "(nodes that did: none): is the drive powered, and is 1 its node-ID?" in err


def spoiled(monkeypatch: pytest.MonkeyPatch, spoil: Callable[[VirtualMachine], None]) -> list[VirtualMachine]:
    """Every virtual machine that is powered on from now, spoiled."""
    made: list[VirtualMachine] = []
    power_on = VirtualMachine.power_on

    def power_on_spoiled(machine: VirtualMachine) -> None:
        made.append(machine)
        power_on(machine)
        spoil(machine)

    monkeypatch.setattr(VirtualMachine, "power_on", power_on_spoiled)
    return made


def test_a_drive_that_aborts_an_sdo(failed: Refused, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(_value: object) -> None:
        raise SdoAbort(AbortCode.VALUE_TOO_HIGH)

    def spoil(machine: VirtualMachine) -> None:
        machine.drives[0].dictionary[0x607F].on_write = refuse

    spoiled(monkeypatch, spoil)
    err = failed("identify OUT --machine stage")
    assert "axis slide (node 1): writing" in err
    assert "to 607Fh was aborted by the drive: Code 0x06090031" in err


def at(time: float, machine: VirtualMachine, act: Callable[[], None]) -> None:
    """Do something once the machine's time has come to `time` [s]."""
    device = machine.drives[0].device
    tick = device.tick
    done: list[bool] = []

    def tick_and_act(now: float) -> None:
        tick(now)
        if machine.now() > time and not done:
            done.append(True)
            act()

    device.tick = tick_and_act  # type: ignore[method-assign]


def test_a_drive_that_faults_in_the_middle(failed: Refused, monkeypatch: pytest.MonkeyPatch) -> None:
    made = spoiled(monkeypatch, lambda machine: at(4.0, machine, lambda: machine.drives[1].fault(0x7121)))
    err = failed("identify OUT --machine scara")
    assert "axis rotate (node 2) reports EMCY 7121h" in err
    assert err.endswith("every axis was stopped and is without voltage")
    states = [drive.machine.state for drive in made[0].drives]
    assert states == [State.SWITCH_ON_DISABLED, State.FAULT, State.SWITCH_ON_DISABLED]


def test_a_drive_that_dies_in_the_middle(failed: Refused, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Lockstep, "first_answer", 0.05)
    monkeypatch.setattr(Lockstep, "further_answer", 0.05)

    def die(machine: VirtualMachine) -> None:
        machine.wires[2].bus_off()

    made = spoiled(monkeypatch, lambda machine: at(4.0, machine, lambda: die(machine)))
    err = failed("identify OUT --machine scara")
    assert "axis stretch (node 3) sent no PDO for" in err
    assert "NOT KNOWN TO BE STOPPED: axis stretch (node 3); every other axis was stopped" in err
    states = [drive.machine.state for drive in made[0].drives]
    assert states[:2] == [State.SWITCH_ON_DISABLED] * 2


@pytest.mark.parametrize("name", ["", "emulate", "identify", "import", "fit", "write-friction"])
def test_help_shows_an_example(command: Command, name: str) -> None:
    outcome = command(f"{name} --help")
    assert outcome.status == 0
    assert f"Example: drivetwin {name}".strip() in " ".join(outcome.out.split())
    assert outcome.err == ""
