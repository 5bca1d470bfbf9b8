"""A machine made of a robot's model: what it takes from the model, that it runs, and what is refused, by file, key and axis."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable
from math import pi
from pathlib import Path
from typing import Any

import mujoco
import pytest
import yaml

from drivetwin.cli import main
from drivetwin.controller.machine import load_machine
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine as load_virtual_machine
from drivetwin.emulator.plant import Plant
from drivetwin.hil_tests.bench import read_bench
from drivetwin.hil_tests.suite import CASES, find_cases

GANTRY = """<mujoco model="gantry"><compiler autolimits="true"/><worldbody>
<body name="bridge"><joint name="x" type="slide" axis="1 0 0" range="-0.3 0.3" armature="12" frictionloss="30" damping="90"/>
<inertial pos="0 0 0" mass="40" diaginertia="1 1 1"/>
<body name="quill"><joint name="z" type="slide" axis="0 0 1" {z}/><inertial pos="0 0 0" mass="6" diaginertia="1 1 1"/>
</body></body></worldbody><actuator><motor name="mx" joint="x" gear="{gear}"/>{servo}</actuator></mujoco>"""
PEAK_Z = 1.3 * 2.0 * (6.0 * 9.81 + 8.0)
ROTOR_Z = PEAK_Z * 2.0 * pi / 0.01 / 1e5
"""Of z, of which the model says nothing [N, kg]: peak force of its motor by the weight, and the rotor of such a motor."""
SERVO = '<position name="mz" joint="z" kp="5000" kv="100" {0}/>'


def gantry(folder: Path, servo: str = "", z: str = 'range="0 0.2" frictionloss="8"') -> Path:
    """Two slides; one on a screw of 20 mm a turn, the other with a servo and nothing said of its motor."""
    path = folder / "gantry.xml"
    path.write_text(GANTRY.format(gear=2.0 * pi / 0.02, servo=SERVO.format(servo), z=z), encoding="utf-8")
    return path


def run(monkeypatch: pytest.MonkeyPatch, *words: str | Path) -> int:
    monkeypatch.setattr(sys, "argv", ["drivetwin", *map(str, words)])
    try:
        main()
    except SystemExit as ended:
        return int(ended.code or 0)
    return 0


@pytest.fixture(scope="module")
def made_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("gantry")
    with pytest.MonkeyPatch.context() as patch:
        assert run(patch, "machine", "new", gantry(folder), "--out", folder / "made", "--quiet") == 0
    return folder / "made"


@pytest.fixture
def made(made_once: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made_once, tmp_path / "made"))


def test_both_halves_are_of_the_model(made: Path) -> None:
    virtual, known = load_virtual_machine(str(made)), load_machine(str(made / "machine.yaml"))
    assert virtual.machine == known.machine == "gantry"
    assert {name: axis.node_id for name, axis in virtual.axes.items()} == {"x": 1, "z": 2}
    assert virtual.axes["x"].gear_ratio == pytest.approx(2.0 * pi / 0.02)
    assert known.axes["x"].gear_ratio == pytest.approx(2.0 * pi / 0.02)
    assert known.axes["z"].feed == 0.01
    assert known.axes["x"].travel == pytest.approx((-0.276, 0.276))
    assert virtual.axes["x"].limit_switches.negative == pytest.approx(-0.294)
    assert known.axes["x"].motor_inertia == pytest.approx(12.0 / (2.0 * pi / 0.02) ** 2)
    assert known.groups == (("x",), ("z",))


def test_loops_torque_and_brake_are_by_what_hangs_on_the_axis(made: Path) -> None:
    """x moves 12 + 46 kg; z 6 kg, which weigh 6 x 9.81 N, and the rotor of a motor that bears twice that and the friction."""
    virtual = load_virtual_machine(str(made))
    x, z = virtual.axes["x"], virtual.axes["z"]
    assert x.loops.velocity_gain == pytest.approx(2.0 * pi * 15.0 * 58.0, rel=1e-3)
    assert z.loops.velocity_gain == pytest.approx(2.0 * pi * 15.0 * (6.0 + ROTOR_Z), rel=1e-3)
    assert x.motor.holding_brake == 0.0
    assert z.motor.holding_brake * z.gear_ratio == pytest.approx(1.5 * 6.0 * 9.81, rel=1e-3)
    assert z.motor.peak_torque * z.gear_ratio == pytest.approx(PEAK_Z, rel=1e-3)


def test_the_plant_has_the_models_friction_and_inertia(made: Path) -> None:
    virtual = load_virtual_machine(str(made))
    truth = Plant(virtual, read_effects(virtual.effects_path)).truth()
    assert (truth["x"]["coulomb"], truth["x"]["viscous"], truth["z"]["coulomb"]) == (30.0, 90.0, 8.0)
    assert truth["x"]["inertia"] == pytest.approx(58.0)
    assert truth["z"]["inertia"] == pytest.approx(6.0 + ROTOR_Z)


def test_what_was_assumed_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    run(monkeypatch, "machine", "new", gantry(tmp_path, z=""), "--out", tmp_path / "made")
    said = capsys.readouterr().out
    for line in (
        "z: travel -0.25 to 0.25 m, for",
        "z: armature 0.962 kg, the rotor of a motor of its torque",
        "z: a screw of 10 mm a turn",
        "x: speed 0.5 m/s, acceleration 3.33 m/s²; velocity loop of 15 Hz",
    ):
        assert f"assumed: {line}" in said
        assert f"# {line}" in (tmp_path / "made/machine.yaml").read_text(encoding="utf-8")
    assert "x: armature" not in said
    (row,) = [line.replace("│", " ") for line in said.splitlines() if line.replace("│", " ").split()[:3] == ["x", "1", "x"]]
    assert "314.2 rad/m" in row
    assert "0.5 m/s" in row


def test_an_actuators_force_is_the_motors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run(monkeypatch, "machine", "new", gantry(tmp_path, 'forcerange="-100 100"'), "--out", tmp_path / "made", "-q")
    axis = load_virtual_machine(str(tmp_path / "made")).axes["z"]
    assert axis.motor.peak_torque * axis.gear_ratio == pytest.approx(100.0, rel=1e-3)


def test_homing_stops_before_the_mechanical_end(made: Path) -> None:
    """A limit switch is 1 % of the room before the end; at the speed of the search an axis stops within half of that."""
    for axis, room in zip(load_machine(str(made)).axes.values(), (0.6, 0.2), strict=True):
        homing = axis.homing
        assert homing.search_speed**2 / (2.0 * homing.acceleration) < 0.00501 * room


def test_its_bench_runs_every_case_in_limits_of_the_machine(made: Path) -> None:
    """All but the one of the wall clock; an axis may follow as far behind as a loop of 15 Hz without integral does."""
    bench = read_bench(made / "bench.yaml")
    assert bench.machine_place == str(made.resolve())
    skipped = [case.identity for case in find_cases(bench, [CASES], ()) if case.skipped_because is not None]
    assert skipped == ["09_bus.sync_jitter"]
    (single,) = find_cases(bench, [CASES], ["04_moves.single"])
    to = {move["axis"]: move["to"] for move in single.task.parameters["moves"]}
    assert -0.276 < to["x"] < 0.276
    axis = load_virtual_machine(str(made)).axes["x"]
    behind = (load_machine(str(made)).axes["x"].max_acceleration + 30.0 / 58.0) / (2.0 * pi * 15.0 * axis.loops.position_gain)
    told = bench.limit("tracking_error")
    assert isinstance(told, dict)
    assert told["x"] == pytest.approx(2.0 * behind, rel=1e-2)


def test_it_is_identified_over_the_bus(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Brought up, homed, moved and fitted as any machine: within 2 % of what model.xml says."""
    assert run(monkeypatch, "identify", "--machine", made, "--out", tmp_path / "found", "--quiet") == 0
    found = json.loads((tmp_path / "found/identified.json").read_text(encoding="utf-8"))["axes"]
    values = {name: {key: one["value"] for key, one in axis["parameters"].items()} for name, axis in found.items()}
    assert values["x"]["inertia"] == pytest.approx(58.0, rel=0.02)
    assert values["x"]["coulomb"] == pytest.approx(30.0, rel=0.02)
    assert values["x"]["viscous"] == pytest.approx(90.0, rel=0.02)
    assert values["z"]["inertia"] == pytest.approx(6.0 + ROTOR_Z, rel=0.02)
    assert values["z"]["coulomb"] == pytest.approx(8.0, rel=0.02)


FOLDING = """<mujoco model="folding"><compiler angle="radian"/><worldbody>
<body name="column"><joint name="turn" axis="0 0 1" range="-1.5 1.5" frictionloss="1.5" damping="2"/>
<inertial pos="0 0 0" mass="2" diaginertia="0.01 0.01 0.01"/>
<body name="boom"><joint name="lean" axis="0 1 0" range="-0.1 2.2" {lean}/>
<inertial pos="0 0 0.5" mass="3" diaginertia="0.1 0.1 0.002"/></body></body></worldbody></mujoco>"""
UPRIGHT, LEVEL = 0.01 + 0.002, 0.01 + 0.1 + 3 * 0.5**2
"""Inertia about the column [kg·m²]: as the file has the arm, and with the boom level, 72 times as much."""


def folding(folder: Path, lean: str = 'frictionloss="1" damping="1"') -> Path:
    """An arm that stands upright in its file, where hardly any of it is away from the first axis."""
    path = folder / "folding.xml"
    path.write_text(FOLDING.format(lean=lean), encoding="utf-8")
    return path


def test_rotor_and_loops_are_by_the_largest_inertia(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The boom is level on the way, not at qpos0: a tenth of that inertia is the rotor, and the loops are stable with it.

    60 Hz with the boom upright are 6 Hz with it level, and the position loop is two and a half times slower than that.
    """
    assert run(monkeypatch, "machine", "new", folding(tmp_path), "--out", tmp_path / "made", "-q") == 0
    virtual = load_virtual_machine(str(tmp_path / "made"))
    turn, truth = virtual.axes["turn"], Plant(virtual, read_effects(virtual.effects_path)).truth()["turn"]
    rotor = 0.1 * LEVEL
    assert truth["inertia"] == pytest.approx(UPRIGHT + rotor, rel=1e-2)
    assert turn.loops.velocity_gain == pytest.approx(2.0 * pi * 60.0 * (UPRIGHT + rotor), rel=1e-2)
    level = turn.loops.velocity_gain / (LEVEL + rotor)
    assert turn.loops.position_gain == pytest.approx(level / 2.5, rel=1e-2)
    assert turn.loops.integral_time == pytest.approx(2.0 / level, rel=1e-2)


def test_its_bench_allows_what_the_largest_inertia_takes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Twice the following error with the boom level, where the loops are slowest: (a + Coulomb / inertia) / (width gain)."""
    assert run(monkeypatch, "machine", "new", folding(tmp_path), "--out", tmp_path / "made", "-q") == 0
    turn, known = load_virtual_machine(str(tmp_path / "made")).axes["turn"], load_machine(str(tmp_path / "made")).axes["turn"]
    level = 1.1 * LEVEL
    behind = (known.max_acceleration + 1.5 / level) / (turn.loops.velocity_gain / level * turn.loops.position_gain)
    told = read_bench(tmp_path / "made/bench.yaml").limit("tracking_error")
    assert isinstance(told, dict)
    assert told["turn"] == pytest.approx(2.0 * behind, rel=1e-2)


def test_an_arm_that_stands_upright_in_its_file_is_identified(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every inertia and friction within 3 % of the file's."""
    assert run(monkeypatch, "machine", "new", folding(tmp_path), "--out", tmp_path / "made", "-q") == 0
    assert run(monkeypatch, "identify", "--machine", tmp_path / "made", "--out", tmp_path / "found", "--quiet") == 0
    found = json.loads((tmp_path / "found/identified.json").read_text(encoding="utf-8"))["axes"]
    assert sorted(found) == ["lean", "turn"]
    for axis in found.values():
        for name in ("inertia", "coulomb", "viscous"):
            assert axis["parameters"][name]["value"] == pytest.approx(axis["truth"][name], rel=0.03)


def test_a_limit_far_beyond_any_need_is_not_a_motors(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Many files say 1000 N·m where nobody knew: of such a motor's torque, the axis's own would be lost in the noise."""
    path = folding(tmp_path, 'actuatorfrcrange="-5000 5000" frictionloss="1" damping="1"')
    assert run(monkeypatch, "machine", "new", path, "--out", tmp_path / "made") == 0
    lean = load_virtual_machine(str(tmp_path / "made")).axes["lean"]
    needed = 1.3 * 2.0 * (3 * 9.81 * 0.5 + 1.0 + 2.0)
    assert lean.motor.peak_torque * lean.gear_ratio == pytest.approx(10.0 * needed, rel=1e-2)
    said = "lean: peak torque 461 N·m, 10 times what it needs: the model's limit, 5000 N·m, is far beyond"
    assert f"assumed: {said}" in capsys.readouterr().out


def test_viscous_friction_slows_an_axis_down(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Models of servos have the servo's damping on the joint: at 2 rad/s it would take four times what the actuator gives."""
    path = folding(tmp_path, 'actuatorfrcrange="-50 50" damping="100"')
    assert run(monkeypatch, "machine", "new", path, "--out", tmp_path / "made", "-q") == 0
    left = 50.0 / 1.3 - 3 * 9.81 * 0.5
    assert load_machine(str(tmp_path / "made")).axes["lean"].max_speed == pytest.approx(0.5 * left / 100.0, rel=1e-2)


FINGER = """<mujoco model="finger"><compiler angle="radian"/><worldbody><body>
<joint name="bend" axis="0 1 0" range="-1 1" {joint}/><inertial pos="0 0 0" mass="0.01" diaginertia="{0} {0} {0}"/>
</body></worldbody></mujoco>"""


def finger(folder: Path, inertia: float, joint: str) -> Path:
    """One light link."""
    path = folder / "finger.xml"
    path.write_text(FINGER.format(inertia, joint=joint), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("inertia", "joint", "rotor"),
    [
        (1e-5, "", 0.003 * 50**2 / 1e5),
        (3e-4, 'frictionloss="1" damping="1"', 1.3 * 2.0 * 3.0 * 50 / 1e5),
    ],
    ids=["hardly any inertia", "nearly all friction"],
)
def test_a_light_axis_has_a_motor_that_exists(
    inertia: float, joint: str, rotor: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its rated torque is at least 1 mN·m, the unit of 6076h; its rotor needs 10 µs for each rad/s; it is identified."""
    path = finger(tmp_path, inertia, joint)
    assert run(monkeypatch, "machine", "new", path, "--out", tmp_path / "made", "-q") == 0
    virtual = load_virtual_machine(str(tmp_path / "made"))
    motor = virtual.axes["bend"].motor
    assert motor.rated_torque >= 0.001
    assert motor.inertia * 50**2 == pytest.approx(rotor, rel=1e-3)
    assert run(monkeypatch, "identify", "--machine", tmp_path / "made", "--out", tmp_path / "found", "--quiet") == 0
    found = json.loads((tmp_path / "found/identified.json").read_text(encoding="utf-8"))["axes"]["bend"]
    for name in ("inertia", "coulomb", "viscous"):
        assert found["parameters"][name]["value"] == pytest.approx(found["truth"][name], rel=0.03, abs=1e-4)


HAND = """<mujoco model="hand"><worldbody>
<body name="left"><joint name="grip" type="slide" axis="0 1 0" range="0 0.04" frictionloss="2" damping="30"/>
<inertial pos="0 0 0" mass="0.3" diaginertia="1e-4 1e-4 1e-4"/></body>
<body name="right"><joint name="other" type="slide" axis="0 -1 0" range="0 0.04" frictionloss="3" damping="40"/>
<inertial pos="0 0 0" mass="0.3" diaginertia="1e-4 1e-4 1e-4"/></body></worldbody>
<equality><joint joint1="other" joint2="grip"/></equality></mujoco>"""


def test_friction_of_a_finger_that_follows_is_the_axiss(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The drive feels both fingers: 5 N, and 70 N·s/m."""
    path = tmp_path / "hand.xml"
    path.write_text(HAND, encoding="utf-8")
    assert run(monkeypatch, "machine", "new", path, "--out", tmp_path / "made", "-q") == 0
    virtual = load_virtual_machine(str(tmp_path / "made"))
    truth = Plant(virtual, read_effects(virtual.effects_path)).truth()["grip"]
    assert (truth["coulomb"], truth["viscous"]) == (5.0, 70.0)
    assert run(monkeypatch, "identify", "--machine", tmp_path / "made", "--out", tmp_path / "found", "--quiet") == 0
    found = json.loads((tmp_path / "found/identified.json").read_text(encoding="utf-8"))["axes"]["grip"]
    for name in ("inertia", "coulomb", "viscous"):
        assert found["parameters"][name]["value"] == pytest.approx(truth[name], rel=0.03)


def test_an_actuator_too_weak_for_the_bus_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = finger(tmp_path, 1e-5, 'actuatorfrcrange="-0.1 0.1"')
    assert run(monkeypatch, "machine", "new", path, "--out", tmp_path / "made", "-q") == 2
    err = capsys.readouterr().err
    assert "joint 'bend': its actuator gives 0.1 N·m at most, and behind a gear of 50 that is a motor of less than" in err
    assert err.count("\n") == 1
    assert not (tmp_path / "made").exists()


Change = Callable[[dict[str, Any]], object]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda told: told["axes"]["z"].update(joint="w"), "axis z moves joint 'w'; the model's hinges and slides: x, z"),
        (lambda told: told["axes"]["z"].update(node_id=1), "axes: x and z both have node_id 1"),
        (
            lambda told: told["axes"]["z"].update(colour=1),
            "machine.yaml: axes.z.colour: is not a known key; there are actuator, drive, feed, gear, joint, motion, node_id",
        ),
        (lambda told: told["axes"]["z"]["drive"]["motor"].pop("inertia"), "axes.z.drive.motor.inertia: Field required"),
        (
            lambda told: told["axes"]["z"]["drive"]["motor"].update(rated_torque=4e-4),
            "axes.z.drive.motor.rated_torque: Input should be greater than or equal to 0.001",
        ),
        (
            lambda told: told["axes"]["z"]["drive"]["motor"].update(peak_torque=float("inf")),
            "peak_torque: Input should be a fin",
        ),
        (lambda told: told["axes"]["z"]["drive"]["motor"].update(peak_torque=0.01), "motor: peak_torque is 0.01, less than"),
        (lambda told: told["axes"]["z"]["drive"]["motor"].update(rated_torque=1e7), "rated_torque: Input should be less than"),
        (
            lambda told: told["axes"]["z"]["drive"]["encoder"].update(increments_per_revolution=2**40),
            "than or equal to 2147483647",
        ),
        (
            lambda told: told["axes"]["z"]["drive"]["loops"].update(position_gain=400.0),
            "z.drive.loops.position_gain: 400 1/s is",
        ),
        (
            lambda told: told["axes"]["z"]["motion"].update(max_speed=500.0),
            "z.motion.max_speed: 500 crosses the travel within a",
        ),
        (lambda told: told["axes"]["z"]["motion"].update(travel=[-30.0, 0.1]), "z.motion.travel: -30 to 0.1 is beyond"),
        (lambda told: told["axes"]["z"]["motion"]["homing"].update(method=99), "homing.method: 99 is none of 6098h"),
        (lambda told: told.update(groups=[["x"], ["z", "x"]]), "groups: axis 'x' stands in it twice"),
        (lambda told: told["axes"]["z"]["drive"].update(joint="x"), "axes.z.drive: joint belongs beside `drive` and `motion`"),
        (lambda told: told["axes"]["z"]["motion"].update(rest=9.0), "z.motion.rest: 9 is not"),
        (lambda told: told["axes"]["z"]["motion"].update(travel=[0.0, 1.0]), "z.motion.travel: [0.0, 1.0] is not"),
        (lambda told: told["axes"]["z"]["drive"]["loops"].update(velocity_gain=1e5), "z.drive.loops.velocity_gain: 100000"),
        (lambda told: told["axes"]["z"]["motion"]["homing"].update(switch_position=0.1), "switch_position: 0.1, and the"),
        (lambda told: told.update(groups=[["y"]]), "groups: there is no axis 'y'; there are x, z"),
        (lambda told: told.update(schema="machine/9"), "machine.yaml: schema: Input should be 'machine/1'"),
        (lambda told: told.update(model="none.xml"), "no model at"),
    ],
)
def test_a_wrong_machine_is_one_line(
    change: Change, said: str, made: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = made / "machine.yaml"
    told = yaml.safe_load(file.read_text(encoding="utf-8"))
    change(told)
    file.write_text(yaml.safe_dump(told), encoding="utf-8")
    assert run(monkeypatch, "machine", "check", made) == 2
    err = capsys.readouterr().err
    assert said in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda text: text.replace('joint="x"', 'joint="x" forcerange="-0.1 0.1"'), "joint 'x': its actuator gives"),
        (lambda text: text.replace('<joint name="x"', '<freejoint name="free"/></body><body><joint name="x"', 1), None),
        (lambda text: text.replace("</actuator>", "").split("<actuator>")[0] + "</mujoco>", None),
        (lambda text: text.replace('type="slide"', 'type="ball"'), "no actuator drives a hinge or a slide"),
    ],
    ids=["weak", "a free body beside it", "no actuator", "balls"],
)
def test_models_of_which_a_machine_can_be_made_or_not(
    change: Callable[[str], str],
    said: str | None,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = gantry(tmp_path)
    text = change(path.read_text(encoding="utf-8"))
    if "freejoint" in text:
        heavy = '<body name="bridge"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
        text = text.replace('<body name="bridge">', heavy, 1)
    if "ball" in text:
        text = text.replace(' axis="1 0 0" range="-0.3 0.3"', "").replace(' axis="0 0 1" range="0 0.2"', "")
        text = text.split("<actuator>")[0] + "</mujoco>"
    path.write_text(text, encoding="utf-8")
    status = run(monkeypatch, "machine", "new", path, "--out", tmp_path / "made", "-q")
    assert status == (0 if said is None else 2)
    if said is not None:
        assert said in capsys.readouterr().err
        assert not (tmp_path / "made").exists()


BAR = """<mujoco><compiler angle="radian"/><worldbody><body name="arm"><joint name="turn" {joint}/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody><actuator><motor joint="turn" gear="{gear}"/></actuator>
</mujoco>"""


@pytest.mark.parametrize(
    ("joint", "gear", "said"),
    [
        ('armature="-0.2"', 30, "has a negative armature on body arm: correct it"),
        ('frictionloss="-0.2"', 30, "has a negative frictionloss on body arm: correct it"),
        ('damping="-0.2"', 30, "has a negative damping on body arm: correct it"),
        ('range="0 1e-9"', 30, "joint 'turn': its range, 1e-09, is no way that a drive can tell: correct it"),
        ("", 1e8, "joint 'turn': behind a gear of 1e+08 its motor turns at 2e+08 rad/s: correct the gear of its actuator"),
        ('damping="1e12"', 30, "joint 'turn': it takes a motor of 1.73e+11 N·m, more than a drive can tell"),
    ],
    ids=["armature", "frictionloss", "damping", "range", "gear", "torque"],
)
def test_a_joint_that_no_drive_can_move_is_one_line(
    joint: str,
    gear: float,
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / "bar.xml"
    path.write_text(BAR.format(joint=joint, gear=gear), encoding="utf-8")
    assert run(monkeypatch, "machine", "new", path, "--out", tmp_path / "made", "-q") == 2
    err = capsys.readouterr().err
    assert said in err
    assert f"{path}" in err
    assert err.count("\n") == 1
    assert not (tmp_path / "made").exists()


def test_a_model_of_nothing_has_no_axis(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "nothing.xml"
    path.write_text("<mujoco/>", encoding="utf-8")
    assert run(monkeypatch, "machine", "new", path, "--out", tmp_path / "made") == 2
    assert "nothing.xml: no actuator drives a hinge or a slide" in capsys.readouterr().err


def test_travel_is_what_a_drive_can_tell(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """32 bits of 10 nrad are ±21 rad; many files give a joint without an end some large range."""
    path = tmp_path / "bar.xml"
    path.write_text(BAR.format(joint='range="-1e6 1e6"', gear=30), encoding="utf-8")
    assert run(monkeypatch, "machine", "new", path, "--out", tmp_path / "made") == 0
    assert "assumed: turn: travel -20 to 20 rad, of the model's range -1e+06 to 1e+06 rad" in capsys.readouterr().out
    assert load_machine(str(tmp_path / "made")).axes["turn"].travel == pytest.approx((-18.4, 18.4))


def test_more_than_twelve_axes_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    one = '<body><joint name="j{0}"/><geom size="0.1"/></body>'
    path = tmp_path / "many.xml"
    path.write_text(f"<mujoco><worldbody>{''.join(map(one.format, range(13)))}</worldbody></mujoco>", encoding="utf-8")
    assert run(monkeypatch, "machine", "new", path, "--out", tmp_path / "made") == 2
    assert "13 joints are driven, a machine has 12 axes at most" in capsys.readouterr().err


LINK = '<link name="{0}">{1}<collision><geometry><mesh filename="package://none/{0}.stl"/></geometry></collision></link>'
MASS = '<inertial><mass value="{0}"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>'
URDF = """<robot name="two">{base}{upper}{rail}<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
<axis xyz="0 0 1"/><limit lower="-1.5" upper="1.5" effort="60" velocity="{speed}"/>
<dynamics damping="2" friction="1.5"/></joint>
<joint name="slide" type="prismatic"><parent link="upper"/><child link="rail"/><axis xyz="1 0 0"/>
<limit lower="0" upper="0.4" effort="200" velocity="0.3"/></joint></robot>"""


def urdf(folder: Path, rail: str = MASS.format(2), speed: str = "1.2") -> Path:
    """A hinge and a slide; no file of a shape is there, as with most that are downloaded."""
    path = folder / "two.urdf"
    masses = {"base": MASS.format(5), "upper": MASS.format(4), "rail": rail}
    links = {name: LINK.format(name, mass) for name, mass in masses.items()}
    path.write_text(URDF.format(**links, speed=speed), encoding="utf-8")
    return path


def test_a_urdf_is_read_by_its_limits_and_inertias_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert run(monkeypatch, "machine", "new", urdf(tmp_path), "--out", tmp_path / "made", "-q") == 0
    virtual, known = load_virtual_machine(str(tmp_path / "made")), load_machine(str(tmp_path / "made"))
    assert known.machine == "two"
    assert (known.axes["shoulder"].max_speed, known.axes["slide"].max_speed) == (1.2, 0.3)
    assert known.axes["slide"].travel == pytest.approx((0.016, 0.384))
    shoulder = virtual.axes["shoulder"]
    assert shoulder.motor.peak_torque * shoulder.gear_ratio == pytest.approx(60.0, rel=1e-3)
    truth = Plant(virtual, read_effects(virtual.effects_path)).truth()
    assert (truth["shoulder"]["coulomb"], truth["shoulder"]["viscous"]) == (1.5, 2.0)
    assert truth["slide"]["inertia"] == pytest.approx(1.1 * 2.0)


def test_what_mujoco_warns_of_is_no_second_word(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Of a range without room it warns on stderr, and writes MUJOCO_LOG.TXT into the folder that the user is in."""
    path = urdf(tmp_path)
    text = path.read_text(encoding="utf-8").replace('lower="-1.5" upper="1.5"', 'lower="0" upper="0"')
    path.write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    mujoco.set_mju_user_warning(None)
    assert run(monkeypatch, "machine", "new", path, "--out", tmp_path / "made") == 0
    said = capfd.readouterr()
    assert said.err == ""
    assert "assumed: shoulder: travel -3.142 to 3.142 rad, for the model gives it no range" in said.out
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()


def test_a_joint_that_mimics_another_is_no_axis(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = urdf(tmp_path)
    mimic = '<mimic joint="shoulder" multiplier="0.1"/></joint></robot>'
    path.write_text(path.read_text(encoding="utf-8").replace("</joint></robot>", mimic), encoding="utf-8")
    assert run(monkeypatch, "machine", "new", path, "--out", tmp_path / "made", "-q") == 0
    assert list(load_machine(str(tmp_path / "made")).axes) == ["shoulder"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"rail": ""}, "two.urdf is not a MuJoCo model: Error: mass and inertia of moving bodies must be larger"),
        ({"speed": "fast"}, "two.urdf: joint 'shoulder': limit velocity 'fast' is not a number"),
    ],
)
def test_a_urdf_that_cannot_be_used_is_one_line(
    change: dict[str, str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch, "machine", "new", urdf(tmp_path, **change), "--out", tmp_path / "made", "-q") == 2
    err = capsys.readouterr().err
    assert said in err
    assert str(tmp_path / "two.urdf") in err
    assert err.count("\n") == 1
    assert not (tmp_path / "made").exists()


def test_a_name_is_still_a_name(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A folder `stage` here does not hide the built-in machine of that name."""
    (tmp_path / "stage").mkdir()
    monkeypatch.chdir(tmp_path)
    assert load_virtual_machine("stage").built_in
    assert load_machine("stage").axes_path.name == "axes.yaml"
    assert mujoco.MjModel.from_xml_path(str(load_machine("stage").model_path)).nv == 1


def test_a_load_is_by_the_last_body_that_has_a_mass(tmp_path: Path) -> None:
    """A frame at the tool, without any, is no reason to move a load of nothing."""
    path = gantry(tmp_path)
    text = path.read_text(encoding="utf-8").replace(
        'diaginertia="1 1 1"/>\n</body>', 'diaginertia="1 1 1"/><body name="tool"/>\n</body>'
    )
    path.write_text(text, encoding="utf-8")
    assert 'name="tool"' in text
    with pytest.MonkeyPatch.context() as patch:
        assert run(patch, "machine", "new", path, "--out", tmp_path / "made", "--quiet") == 0
    assert read_bench(tmp_path / "made/bench.yaml").limit("payload") == pytest.approx(0.3 * 6.0)
