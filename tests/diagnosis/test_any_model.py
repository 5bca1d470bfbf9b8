"""Whatever MJCF says a model in, its torque is MuJoCo's own, and the patched model's as well, to nine digits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import mujoco
import numpy as np
import pinocchio
import pytest
from model_forms import FORMS, INERTIA, JOINT, Form, written

from drivetwin.cli import main
from drivetwin.diagnosis.prepare.kinematics import Kinematics
from drivetwin.diagnosis.prepare.simulation import Simulation, simulation
from drivetwin.diagnosis.report.patched_model import patched_xml
from drivetwin.diagnosis.report.result import Array
from drivetwin.emulator.effects.coupling import Coupling
from drivetwin.emulator.effects.payload import Payload
from drivetwin.foundation.errors import UserError
from drivetwin.motion import compilation
from drivetwin.recording.recording import AxisInfo, Recording, RecordingInfo
from drivetwin.recording.writer import write_recording

EXACT = 1e-9
"""Of the largest torque."""
JOINTS = ("shoulder", "elbow")


def twin_of(path: Path, joints: Sequence[str] = JOINTS) -> Simulation:
    return simulation(path, {joint: AxisInfo(joint=joint) for joint in joints})


def motion(home: Array, rows: int = 60) -> Kinematics:
    rng = np.random.default_rng(11)
    return Kinematics(home + rng.uniform(-1.2, 1.2, (rows, len(home))), *(rng.normal(0.0, 2.0, (2, rows, len(home)))))


def home_of(model: mujoco.MjModel, joints: Sequence[str] = JOINTS) -> Array:
    return np.array([model.qpos0[model.joint(joint).qposadr[0]] for joint in joints])


def of_mujoco(model: mujoco.MjModel, kinematics: Kinematics, joints: Sequence[str] = JOINTS) -> Array:
    """mj_inverse of the model itself, and its `frictionloss`, which MuJoCo has as a constraint; the rest stands at qpos0."""
    off = int(model.opt.disableflags)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    model.opt.enableflags = 0
    data = mujoco.MjData(model)
    places, dofs = ([int(getattr(model.joint(joint), name)[0]) for joint in joints] for name in ("qposadr", "dofadr"))
    coulomb = 0.0 if off & int(mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS) else model.dof_frictionloss[dofs]
    torque = np.empty_like(kinematics.position)
    for row, (q, v, a) in enumerate(zip(kinematics.position, kinematics.velocity, kinematics.acceleration, strict=True)):
        data.qpos[:], data.qvel[:], data.qacc[:] = model.qpos0, 0.0, 0.0
        data.qpos[places], data.qvel[dofs], data.qacc[dofs] = q, v, a
        mujoco.mj_inverse(model, data)
        torque[row] = data.qfrc_inverse[dofs] + coulomb * np.sign(v)
    return torque


def of_the_twin(twin: Simulation, kinematics: Kinematics) -> Array:
    """What the diagnosis takes the axes to cost: rigid bodies, and the friction that it may find off."""
    torque = twin.torques(kinematics)
    for axis, (dynamics, v) in enumerate(zip(twin.dynamics().values(), kinematics.velocity.T, strict=True)):
        law = dynamics.friction
        torque[:, axis] += law.coulomb * np.sign(v) + law.viscous * v + law.quadratic * v * np.abs(v) + law.cubic * v**3
    return torque


def same(one: Array, other: Array) -> None:
    np.testing.assert_allclose(one, other, rtol=0.0, atol=EXACT * float(np.abs(other).max()))


# A user's model may still have it, so the diagnosis has to understand it for as long as MuJoCo does.
pytestmark = pytest.mark.filterwarnings("ignore:compiler attribute 'settotalmass' is deprecated:UserWarning")


@pytest.fixture(autouse=True)
def what_is_deprecated_is_taken(mujoco_warns_of_nothing: None) -> None:  # noqa: ARG001 - it comes first
    """MuJoCo warns of `settotalmass`, and of nothing else here."""
    others: list[str] = []
    mujoco.set_mju_user_warning(lambda text: None if "settotalmass" in text else others.append(text))


@pytest.mark.parametrize("name", FORMS)
def test_the_torque_is_mujocos_own(name: str, tmp_path: Path) -> None:
    path = written(tmp_path, FORMS[name])
    model = mujoco.MjModel.from_xml_path(str(path))
    kinematics = motion(home_of(model))
    same(of_the_twin(twin_of(path), kinematics), of_mujoco(model, kinematics))


@pytest.mark.parametrize("share", [0.0, 0.07])
@pytest.mark.parametrize("name", FORMS)
def test_a_patched_model_is_the_model_with_heavier_bodies(name: str, share: float, tmp_path: Path) -> None:
    """Read where no asset is, against MuJoCo's own model with mass and inertia changed in its arrays."""
    path = written(tmp_path / "model", FORMS[name])
    twin = twin_of(path)
    heavier = {body: share * (1 + body) for body in twin.moving_bodies()} if share else {}
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "patched.xml").write_text(patched_xml(twin, heavier), encoding="utf-8")
    patched = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "patched.xml"))
    model = mujoco.MjModel.from_xml_path(str(path))
    for body, more in heavier.items():
        model.body_mass[body] *= 1.0 + more
        model.body_inertia[body] *= 1.0 + more
    mujoco.mj_setConst(model, mujoco.MjData(model))
    kinematics = motion(home_of(model))
    same(of_mujoco(patched, kinematics), of_mujoco(model, kinematics))
    counts = ("nu", "nsensor", "nkey", "ncam", "ngeom", "nmesh", "npair", "nexclude", "neq", "ntendon", "nq")
    assert [getattr(patched, count) for count in counts] == [getattr(model, count) for count in counts]


def test_a_patched_model_is_diagnosed_as_the_same_model(tmp_path: Path) -> None:
    path = written(tmp_path, INERTIA["fullinertia"])
    twin = twin_of(path)
    again = tmp_path / "patched.xml"
    again.write_text(patched_xml(twin, {}), encoding="utf-8")
    kinematics = motion(np.zeros(2))
    same(twin_of(again).torques(kinematics), twin.torques(kinematics))


def test_full_inertia_is_pinocchios(tmp_path: Path) -> None:
    full = np.array([[0.3, 0.04, -0.03], [0.04, 0.2, 0.02], [-0.03, 0.02, 0.25]])
    form = Form(
        upper='<inertial pos="0.2 0.1 0" mass="3" fullinertia="0.3 0.2 0.25 0.04 -0.03 0.02"/>',
        lower='<inertial pos="0 0.1 0.3" mass="2" fullinertia="0.3 0.2 0.25 0.04 -0.03 0.02"/>',
        shoulder="",
        elbow="",
    )
    xml = form.xml.replace('euler="0.3 0.2 0.1"', "").replace('axis="0.2 1 0" pos="0.01 0 0"', 'axis="1 0 0"')
    path = tmp_path / "arm.xml"
    path.write_text(xml, encoding="utf-8")
    arm = pinocchio.Model()
    arm.gravity.linear = np.array([0.0, 0.0, -9.81])
    upper = arm.addJoint(0, pinocchio.JointModelRY(), pinocchio.SE3(np.eye(3), np.array([0.0, 0.0, 1.0])), "shoulder")
    arm.appendBodyToJoint(upper, pinocchio.Inertia(3.0, np.array([0.2, 0.1, 0.0]), full), pinocchio.SE3.Identity())
    lower = arm.addJoint(upper, pinocchio.JointModelRX(), pinocchio.SE3(np.eye(3), np.array([0.4, 0.0, 0.0])), "elbow")
    arm.appendBodyToJoint(lower, pinocchio.Inertia(2.0, np.array([0.0, 0.1, 0.3]), full), pinocchio.SE3.Identity())
    data, kinematics = arm.createData(), motion(np.zeros(2))
    rows = zip(kinematics.position, kinematics.velocity, kinematics.acceleration, strict=True)
    expected = np.array([pinocchio.rnea(arm, data, *row) for row in rows])
    same(twin_of(path).torques(kinematics), expected)
    again = tmp_path / "patched.xml"
    again.write_text(patched_xml(twin_of(path), {}), encoding="utf-8")
    same(twin_of(again).torques(kinematics), expected)


def test_friction_of_what_follows_is_the_axiss(tmp_path: Path) -> None:
    """elbow = -2 shoulder: by its power the elbow's friction is 2 times its level, and 4 times its damping, on the shoulder."""
    tail = '<equality><joint joint1="elbow" joint2="shoulder" polycoef="0 -2 0 0 0"/></equality>'
    law = twin_of(written(tmp_path, Form(tail=tail)), ["shoulder"]).dynamics()["shoulder"].friction
    assert (law.coulomb, law.viscous) == pytest.approx((0.7 + 2 * 0.2, 0.4 + 4 * 0.1))


def test_a_tendon_s_friction_is_that_of_the_one_axis_that_pulls_it(tmp_path: Path) -> None:
    tendon = '<tendon><fixed name="rope" frictionloss="0.5"><joint joint="shoulder" coef="3"/>{}</fixed></tendon>'
    law = twin_of(written(tmp_path, Form(tail=tendon.format("")))).dynamics()["shoulder"].friction
    assert law.coulomb == pytest.approx(0.7 + 3 * 0.5)
    path = written(tmp_path / "two", Form(tail=tendon.format('<joint joint="elbow" coef="1"/>')))
    with pytest.raises(
        UserError, match="tendon rope has one frictionloss on axes shoulder, elbow: give the joint of each its own"
    ):
        twin_of(path)


def test_axes_at_a_pose_other_than_qpos0_and_joints_recorded_in_another_order(tmp_path: Path) -> None:
    path = written(tmp_path, JOINT["degrees"])
    model = mujoco.MjModel.from_xml_path(str(path))
    there = motion(home_of(model, ("elbow", "shoulder")) + np.array([1.0, -2.0]))
    same(of_the_twin(twin_of(path, ("elbow", "shoulder")), there), of_mujoco(model, there, ("elbow", "shoulder")))


def test_names_and_defaults_of_the_model_do_not_meet_those_of_an_effect(tmp_path: Path) -> None:
    """A point mass of 2 kg at 0.5 m, and a rotor of 0.3 kg·m² on both: (I + m r²) and the rotor's torque, to the digit."""
    defaults = '<default><tendon damping="3" stiffness="5" frictionloss="1"/><joint armature="0.1"/></default>'
    form = Form(
        head=f'<option gravity="0 0 0"/>{defaults}',
        lower=f'{Form.lower}<body name="elbow_payload"/>',
        tail='<tendon><fixed name="elbow_coupling"><joint joint="elbow" coef="0"/></fixed></tendon>',
    )
    twin = twin_of(written(tmp_path, form))
    still = np.zeros((1, 2))
    one = Kinematics(still, still, np.array([[0.0, 1.0]]))
    plain = twin.torques(one)[0]
    arm = np.cross([0.2, 1.0, 0.0] / np.hypot(0.2, 1.0), [0.5 - 0.01, 0.0, 0.0])
    loaded = twin.torques_of(twin.rigid_with("elbow", Payload(2.0, x=0.5)), one)[0]
    assert loaded[1] - plain[1] == pytest.approx(2.0 * arm @ arm, rel=EXACT)
    coupled = twin.torques_of(twin.rigid_with("elbow", Coupling(0.3, ratio=2.0)), one)[0]
    np.testing.assert_allclose(coupled - plain, [0.6, 0.3], rtol=EXACT)


@pytest.mark.parametrize(
    ("base", "expected"),
    [
        ('<freejoint name="floating"/>', "axis shoulder is carried by free joint floating of body trolley"),
        ('<joint name="eye" type="ball"/>', "axis shoulder is carried by ball joint eye of body trolley"),
        ("<freejoint/>", "axis shoulder is carried by free joint without a name of body trolley"),
    ],
)
def test_a_base_that_moves_as_nobody_recorded(base: str, expected: str, tmp_path: Path) -> None:
    carried = f'<body name="trolley">{base}<geom size="0.1"/><body name="upper"'
    xml = Form().xml.replace('<body name="upper"', carried).replace("</worldbody>", "</body></worldbody>")
    path = tmp_path / "arm.xml"
    path.write_text(xml, encoding="utf-8")
    with pytest.raises(UserError, match=expected):
        twin_of(path)


def test_fit_refuses_it_as_well(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path / "model", Form(tail='<equality><connect name="bar" body1="upper" anchor="0.3 0 0"/></equality>'))
    time = np.arange(2000, dtype=np.float64) * 1e-3
    columns = {"shoulder": {"position": np.sin(9.0 * time), "torque": np.zeros(2000)}}
    axes = {"shoulder": {"joint": "shoulder"}}
    info = RecordingInfo.model_validate({"schema": "recording/1", "machine": "arm", "sample_period": 1e-3, "axes": axes})
    write_recording(Recording("run", info, time, columns), tmp_path / "run")
    command = ["drivetwin", "fit", str(path), str(tmp_path / "run"), "--out", str(tmp_path / "out")]
    monkeypatch.setattr("sys.argv", command)
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert "connect equality bar ties joint shoulder to what was not recorded" in capsys.readouterr().err


LOOP = Form(lower=f'{Form.lower}<body name="hand" pos="0 0 0.3"><joint name="wrist"/><geom size="0.1"/></body>')


@pytest.mark.parametrize(
    ("tie", "expected"),
    [
        ('<connect name="bar" body1="lower" anchor="0.1 0 0"/>', "connect equality bar ties joint shoulder"),
        ('<weld name="glue" body1="hand"/>', "weld equality glue ties joint shoulder"),
        ('<weld body1="lower" body2="upper"/>', "weld equality number 0 ties joint elbow"),
    ],
)
def test_a_loop_that_an_axis_closes(tie: str, expected: str, tmp_path: Path) -> None:
    path = written(tmp_path, Form(lower=LOOP.lower, tail=f"<equality>{tie}</equality>"))
    with pytest.raises(UserError, match=f"{expected} to what was not recorded"):
        twin_of(path)


@pytest.mark.parametrize(
    "tie",
    [
        '<weld body1="hand" body2="lower"/>',
        '<connect body1="hand" body2="lower" anchor="0 0 0"/>',
        '<weld body1="hand" active="false"/>',
    ],
)
def test_a_loop_that_no_axis_moves(tie: str, tmp_path: Path) -> None:
    path = written(tmp_path, Form(lower=LOOP.lower, tail=f"<equality>{tie}</equality>"))
    model = mujoco.MjModel.from_xml_path(str(path))
    kinematics = motion(home_of(model))
    same(of_the_twin(twin_of(path), kinematics), of_mujoco(model, kinematics))


def test_a_spring_that_yields_remembers(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="the spring of elbow yields"):
        twin_of(written(tmp_path, Form(elbow='stiffness="3" springyield="0.1"')))


@pytest.mark.usefixtures("models_compile_apart")
@pytest.mark.parametrize(
    ("program", "expected"),
    [
        ("while True: pass", "takes MuJoCo more than 1 s to compile"),
        ("import os; os.kill(os.getpid(), 11)", "ends MuJoCo (exit status -11)"),
        ("raise RuntimeError('engine error')", "ends MuJoCo (RuntimeError: engine error)"),
    ],
)
def test_a_file_that_hangs_or_ends_mujoco(program: str, expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "program.py").write_text(program, encoding="utf-8")
    monkeypatch.setattr(compilation, "PROGRAM", tmp_path / "program.py")
    monkeypatch.setattr(compilation, "SECONDS", 1.0)
    path = written(tmp_path, Form())
    with pytest.raises(UserError) as refused:
        twin_of(path)
    assert f"{path} {expected}" in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.usefixtures("models_compile_apart")
@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (
            {"upper": '<inertial pos="1e200 0 0" mass="1e200" diaginertia="1 1 1"/>'},
            "asks for no finite torque of joint shoulder",
        ),
        ({"upper": '<inertial pos="0 0 0" mass="1" diaginertia="1 1 9"/>'}, "is not a MuJoCo model"),
        ({"upper": '<inertial pos="0 0 0" mass="1" fullinertia="1 1 1 2 2 2"/>'}, "is not a MuJoCo model"),
        ({"upper": ""}, "is not a MuJoCo model"),
        ({"head": '<asset><mesh name="gone" file="gone.obj"/></asset>'}, "is not a MuJoCo model"),
        ({"compiler": 'angle="gradian"'}, "is not a MuJoCo model"),
    ],
)
def test_a_file_of_which_mujoco_makes_no_model(change: Mapping[str, str], expected: str, tmp_path: Path) -> None:
    path = written(tmp_path, Form(**change))
    with pytest.raises(UserError) as refused:
        twin_of(path)
    assert str(refused.value).startswith(f"{path} ")
    assert expected in str(refused.value)
    assert "\n" not in str(refused.value)
