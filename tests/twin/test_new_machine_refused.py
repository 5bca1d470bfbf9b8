"""Models and machine.yaml files that make no machine: one line, by file, key and axis."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from new_machine_bench import finger, gantry, run

from drivetwin.controller.machine import load_machine


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
