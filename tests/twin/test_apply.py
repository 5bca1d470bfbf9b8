"""What `drivetwin apply` writes, against MuJoCo's own mass matrix and inverse dynamics of the file that it wrote."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from drivetwin.cli import main
from drivetwin.emulator.effects import read_effects

ARM = """<mujoco model="arm"><compiler angle="radian"/><option timestep="0.001"/><worldbody>
<body name="upper"><joint name="shoulder" axis="0 1 0" armature="0.2" frictionloss="0.7" damping="0.4 0.05 0"/>
<inertial pos="0.2 0 0" mass="3" diaginertia="0.3 0.2 0.1"/>
<body name="lower" pos="0.4 0 0"><joint name="elbow" axis="0 1 0" armature="0.05" frictionloss="0.2" damping="0.1"/>
<inertial pos="0.1 0 0" mass="1.5" diaginertia="0.02 0.03 0.01"/>
<body name="flange" pos="0.25 0 0"><inertial pos="0 0 0" mass="0.5" diaginertia="0.01 0.01 0.01"/></body></body></body>
</worldbody><actuator><motor name="m1" joint="shoulder"/><position name="m2" joint="elbow" kp="10"/></actuator></mujoco>"""


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    path = tmp_path / "arm.xml"
    path.write_text(ARM, encoding="utf-8")
    return path


def apply(monkeypatch: pytest.MonkeyPatch, findings: dict[str, Any], model: Path, *more: str) -> tuple[int, Path]:
    file = model.parent / "findings.json"
    file.write_text(json.dumps(findings), encoding="utf-8")
    out = model.parent / "out" / "twin.xml"
    monkeypatch.setattr(sys, "argv", ["drivetwin", "apply", str(file), str(model), "--out", str(out), *more])
    try:
        main()
    except SystemExit as ended:
        return int(ended.code or 0), out
    return 0, out


def identified(**axes: dict[str, tuple[float, str]]) -> dict[str, Any]:
    """identified/1 of axes on the joints of their names."""
    return {
        "schema": "identified/1",
        "machine": "arm",
        "axes": {
            name: {"joint": name, "parameters": {key: {"value": value, "unit": unit} for key, (value, unit) in given.items()}}
            for name, given in axes.items()
        },
    }


def effects(*entries: tuple[str, str, dict[str, tuple[float, str]]]) -> dict[str, Any]:
    return {
        "schema": "effects/1",
        "effects": [
            {"effect": effect, "axis": axis, "parameters": {key: {"value": v, "unit": u} for key, (v, u) in given.items()}}
            for effect, axis, given in entries
        ],
    }


def viscous(value: float, low: float, high: float) -> dict[str, Any]:
    """identified.json of the elbow with an interval."""
    told = {"value": value, "unit": "N·m·s/rad", "ci90": [low, high]}
    axes = {"elbow": {"joint": "elbow", "parameters": {"viscous": told}}}
    return {"schema": "identified/1", "machine": "arm", "axes": axes}


def inertia(model: Path, joint: str) -> float:
    """Diagonal of MuJoCo's mass matrix at qpos0."""
    compiled = mujoco.MjModel.from_xml_path(str(model))
    data = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, data)
    mass = np.zeros((compiled.nv, compiled.nv))
    mujoco.mj_fullM(compiled, data, mass)
    at = int(compiled.joint(joint).dofadr[0])
    return float(mass[at, at])


def torque(model: Path, q: list[float], v: list[float], a: list[float]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """mj_inverse without constraints: friction loss is none of it, damping is."""
    compiled = mujoco.MjModel.from_xml_path(str(model))
    compiled.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT) | int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    data = mujoco.MjData(compiled)
    data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
    mujoco.mj_inverse(compiled, data)
    return np.array(data.qfrc_inverse)


def test_what_was_identified_is_the_models_own(arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = identified(
        shoulder={"inertia": (2.0, "kg·m²"), "coulomb": (1.9, "N·m"), "viscous": (1.1, "N·m·s/rad")},
        elbow={"coulomb": (0.4, "N·m")},
    )
    status, out = apply(monkeypatch, found, arm)
    assert status == 0
    assert inertia(out, "shoulder") == pytest.approx(2.0, rel=1e-12)
    compiled = mujoco.MjModel.from_xml_path(str(out))
    assert compiled.dof_frictionloss.tolist() == [1.9, 0.4]
    assert compiled.dof_damping.tolist() == [1.1, 0.1]
    assert inertia(out, "elbow") == inertia(arm, "elbow")
    assert read_effects(out.with_suffix(".effects.json")) == ()


def test_less_inertia_than_the_links_have_makes_what_is_carried_lighter(arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The elbow's links weigh less, all by one share; the shoulder, which carries them, has what was identified of it still."""
    found = identified(shoulder={"inertia": (0.9, "kg·m²")}, elbow={"inertia": (0.06, "kg·m²")})
    _, out = apply(monkeypatch, found, arm)
    assert inertia(out, "elbow") == pytest.approx(0.06, rel=1e-12)
    assert inertia(out, "shoulder") == pytest.approx(0.9, rel=1e-12)
    before, after = (mujoco.MjModel.from_xml_path(str(path)) for path in (arm, out))
    shares = after.body_mass[2:] / before.body_mass[2:]
    assert after.dof_armature[1] == 0.0
    assert shares[0] == pytest.approx(shares[1])
    assert shares[0] == pytest.approx(0.06 / (inertia(arm, "elbow") - 0.05))


def test_an_inertia_that_no_link_allows_is_refused(
    arm: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    status, out = apply(monkeypatch, identified(shoulder={"inertia": (0.1, "kg·m²")}), arm)
    assert status == 2
    assert "joint 'shoulder': an inertia of 0.1 is less than what the axis carries" in capsys.readouterr().err
    assert not out.parent.exists() or not list(out.parent.iterdir())


def test_friction_of_a_follower_stays_the_followers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The belt turns the elbow at -2 times the shoulder: of 2 N·m and 1 N·m·s/rad it takes 2 x 0.2 and 4 x 0.1."""
    path = tmp_path / "belt.xml"
    tied = '<equality><joint joint1="elbow" joint2="shoulder" polycoef="0 -2 0 0 0"/></equality></mujoco>'
    path.write_text(ARM.replace("</mujoco>", tied), encoding="utf-8")
    found = identified(shoulder={"coulomb": (2.0, "N·m"), "viscous": (1.0, "N·m·s/rad")})
    _, out = apply(monkeypatch, found, path)
    compiled = mujoco.MjModel.from_xml_path(str(out))
    assert compiled.dof_frictionloss.tolist() == pytest.approx([1.6, 0.2])
    assert compiled.dof_damping.tolist() == pytest.approx([0.6, 0.1])


def test_friction_by_direction_and_stribeck_stand_beside_the_model(arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given = {"coulomb": 2.0, "coulomb_positive": 2.2, "coulomb_negative": 1.6, "static_torque": 2.5}
    slopes = {"viscous": 1.0, "viscous_positive": 0.8, "viscous_negative": 1.4}
    values = {key: (value, "N·m") for key, value in given.items()} | {key: (v, "N·m·s/rad") for key, v in slopes.items()}
    found = identified(shoulder=values | {"stribeck_velocity": (0.05, "rad/s"), "offset": (0.3, "N·m")})
    found["axes"]["shoulder"]["direction"] = {"real": True}
    _, out = apply(monkeypatch, found, arm)
    compiled = mujoco.MjModel.from_xml_path(str(out))
    assert compiled.dof_frictionloss[0] == pytest.approx(1.9)
    assert compiled.dof_damping[0] == pytest.approx(1.1)
    told = {placed.effect.name: placed.effect for placed in read_effects(out.with_suffix(".effects.json"))}
    assert set(told) == {"coulomb_asymmetry", "viscous_asymmetry", "stribeck"}
    assert told["coulomb_asymmetry"].asymmetry == pytest.approx(0.3)  # type: ignore[attr-defined]
    assert told["viscous_asymmetry"].asymmetry == pytest.approx(-0.3)  # type: ignore[attr-defined]
    assert told["stribeck"].static_torque == pytest.approx(1.9 + 0.5)  # type: ignore[attr-defined]


@pytest.mark.parametrize(("interval", "written"), [((0.1, 0.5), [-0.3]), ((-0.1, 0.7), [])])
def test_an_offset_beyond_doubt_is_a_torque_that_the_shaft_does_not_give(
    interval: tuple[float, float], written: list[float], arm: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = identified(shoulder={"offset": (0.3, "N·m")})
    found["axes"]["shoulder"]["parameters"]["offset"]["ci90"] = interval
    _, out = apply(monkeypatch, found, arm)
    placed = read_effects(out.with_suffix(".effects.json"))
    assert [one.effect.offset for one in placed] == written  # type: ignore[attr-defined]


def test_effects_that_mjcf_holds_cost_what_their_formulae_say(arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A payload at the flange, a spring, and quadratic damping in the place of the model's; delay and ripple stay beside."""
    found = effects(
        ("payload", "elbow", {"mass": (2.0, "kg"), "x": (0.1, "m")}),
        ("spring", "shoulder", {"stiffness": (30.0, "N·m/rad"), "rest": (0.1, "rad")}),
        ("viscous_nonlinear", "shoulder", {"quadratic": (0.5, "N·m·s²/rad²")}),
        ("inertia", "elbow", {"difference": (0.01, "kg·m²")}),
        ("delay", "elbow", {"delay": (0.002, "s")}),
        ("torque_ripple", "shoulder", {"amplitude": (0.2, "N·m"), "order": (6.0, "1")}),
    )
    _, out = apply(monkeypatch, found, arm)
    q, v, a = [0.3, -0.2], [1.5, 0.0], [0.0, 0.0]
    reach = np.array([0.4 * np.cos(0.3) + 0.35 * np.cos(0.1), 0.35 * np.cos(0.1)])  # hinges turn down as they turn up
    weight = -2.0 * 9.81 * reach
    centrifugal = 2.0 * 0.4 * 0.35 * np.sin(-0.2) * 1.5**2 * np.array([0.0, 1.0])
    spring = np.array([30.0 * (0.3 - 0.1), 0.0])
    damping = np.array([(0.5 - 0.05) * 1.5 * 1.5, 0.0])
    assert torque(out, q, v, a) - torque(arm, q, v, a) == pytest.approx(weight + centrifugal + spring + damping)
    assert inertia(out, "elbow") - inertia(arm, "elbow") == pytest.approx(2.0 * 0.35**2 + 0.01)
    beside = read_effects(out.with_suffix(".effects.json"))
    assert {placed.effect.name for placed in beside} == {"torque_ripple", "delay"}


def test_an_axis_may_be_on_a_joint_of_another_name(arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`m1` is the motor of the shoulder; `tilt` is nobody's name, and told."""
    coulomb = {"coulomb": (3.0, "N·m")}
    found = effects(("coulomb", "m1", coulomb), ("coulomb", "tilt", coulomb))
    _, out = apply(monkeypatch, found, arm, "--joint", "tilt=elbow")
    assert mujoco.MjModel.from_xml_path(str(out)).dof_frictionloss.tolist() == [3.0, 3.0]


@pytest.mark.parametrize(
    ("found", "more", "said"),
    [
        (effects(("coulomb", "tilt", {"coulomb": (3.0, "N·m")})), (), "no hinge or slide 'tilt' for axis tilt"),
        (effects(("coulomb", "elbow", {"coulomb": (3.0, "N")})), (), "coulomb is given in 'N', expected 'N·m'"),
        (effects(), ("--joint", "tilt=elbow"), "--joint tilt=...: the file has no such axis"),
        (effects(), ("--joint", "tilt"), "--joint tilt: expected AXIS=JOINT"),
        ({"schema": "recording/1"}, (), "schema is 'recording/1'; expected 'identified/1' or 'effects/1'"),
        (identified(elbow={"coulomb": (-1.0, "kg")}), (), "coulomb is given in 'kg', expected 'N·m'"),
        (
            {"schema": "identified/1", "machine": "arm", "axes": {"elbow": {}}},
            (),
            "is not a valid identified/1 file: axes.elbow.joint: Field required",
        ),
        ({"schema": "identified/1", "machine": "arm", "axes": {}}, (), "axes: there is none, so nothing was identified"),
        (viscous(-3.0, -3.1, -2.9), (), "axes.elbow: viscous is -3 beyond doubt: friction below 0 would push"),
        (viscous(-3.0, 0.1, 0.2), (), "viscous: value is -3, outside of its ci90, 0.1 to 0.2"),
    ],
)
def test_what_cannot_be_written_is_one_line_and_no_file(
    found: dict[str, Any],
    more: tuple[str, ...],
    said: str,
    arm: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    status, out = apply(monkeypatch, found, arm, *more)
    assert status == 2
    told = capsys.readouterr().err
    assert said in told
    assert told.count("\n") == 1
    assert not out.parent.exists() or not list(out.parent.iterdir())


def test_who_gives_the_report_is_told_the_effects_beside_it(
    arm: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    report = arm.with_name("report.json")
    report.write_text(json.dumps({"schema": "gap-report/2"}))
    report.with_name("effects.json").write_text(json.dumps(effects()))
    monkeypatch.setattr(sys, "argv", ["drivetwin", "apply", str(report), str(arm), "--out", str(arm.with_name("out.xml"))])
    with pytest.raises(SystemExit):
        main()
    assert f"expected 'identified/1' or 'effects/1'; give {report.with_name('effects.json')}" in capsys.readouterr().err


def test_the_model_that_is_read_is_not_replaced(
    arm: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    status, _ = apply(monkeypatch, effects(), arm, "--out", str(arm))
    assert status == 2
    assert "would replace it" in capsys.readouterr().err
