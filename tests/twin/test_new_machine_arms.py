"""Machines of arms: inertia that changes with the pose, light axes, limits that no motor has, fingers that follow."""

from __future__ import annotations

import json
from math import pi
from pathlib import Path

import pytest
from new_machine_bench import finger, run

from drivetwin.controller.machine import load_machine
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine as load_virtual_machine
from drivetwin.emulator.plant import Plant
from drivetwin.hil_tests.bench import read_bench

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
