"""Machines made of a URDF."""

from __future__ import annotations

from pathlib import Path

import mujoco
import pytest
from new_machine_bench import run

from drivetwin.controller.machine import load_machine
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine as load_virtual_machine
from drivetwin.emulator.plant import Plant

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
