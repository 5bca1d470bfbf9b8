"""Models as others write them: motors and bodies without names, meshes in files; the patch is of the right body, and loads."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from rig_bench import CARRIAGE, GRAVITY, MODEL, as_modelled, lift_torque, moved, recording, strokes

from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.prepare.inputs import read_inputs
from drivetwin.diagnosis.prepare.prepared import prepared
from drivetwin.diagnosis.propose.nominal import nominal_parameters
from drivetwin.diagnosis.report.result import Diagnosis
from drivetwin.diagnosis.report.wording import verdict_sentence
from drivetwin.diagnosis.settings import Settings
from drivetwin.recording.recording import Recording
from drivetwin.recording.writer import write_recording

SECONDS = 20.0
HEAVIER, LIGHTER = 0.3, -0.1
"""By how much the true carriage differs from the model's [kg]."""


def of_mass(more: float, seed: int, name: str) -> Recording:
    """Of a carriage with more mass where the model has its centre, 0.3 m from the column's hinge."""
    both = moved(seed, SECONDS)
    torques = as_modelled(both)
    torques["turn"] = torques["turn"] + more * 0.3**2 * both["turn"].acceleration
    torques["lift"] = torques["lift"] + more * (GRAVITY + both["lift"].acceleration)
    return recording(torques, {axis: at.position for axis, at in both.items()}, seed, name)


def diagnosed(model: Path, fitted: Recording, held: Recording) -> Diagnosis:
    return diagnose(model, [fitted], [held], Settings(), lambda _stage, _share: None)


def written(folder: Path, xml: str) -> Path:
    path = folder / "column.xml"
    path.write_text(xml, encoding="utf-8")
    return path


def patched(found: Diagnosis, place: Path) -> mujoco.MjModel:
    """The patched model, loaded from a folder of its own."""
    place.mkdir()
    (place / "patched.xml").write_text(found.model_xml, encoding="utf-8")
    return mujoco.MjModel.from_xml_path(str(place / "patched.xml"))


def with_the_column_at_rest(seed: int, name: str) -> Recording:
    """Only the lift moves, with a carriage that is heavier than modelled."""
    lift = moved(seed, SECONDS)["lift"]
    rest = np.zeros_like(lift.position)
    torques = {"turn": rest, "lift": lift_torque(lift) + HEAVIER * (GRAVITY + lift.acceleration)}
    return recording(torques, {"turn": rest, "lift": lift.position}, seed, name)


def test_an_axis_that_never_moves_does_not_hinder_the_others(tmp_path: Path) -> None:
    fitted, held = with_the_column_at_rest(1, "fitted"), with_the_column_at_rest(2, "held")
    found = diagnosed(written(tmp_path, MODEL), fitted, held)
    assert [(one.axis, one.effect.name) for one in found.selected] == [("lift", "payload")]
    assert not found.axes["turn"].significant


NAMELESS = MODEL.replace("</worldbody>", '<body><geom type="sphere" size="0.1" mass="7" pos="3 0 0"/></body></worldbody>')


def test_of_bodies_without_names_the_right_one_carries_a_payload(tmp_path: Path) -> None:
    """Its mass alone would explain it too, but 15 % are more than a nominal mass is off."""
    assert "<body name" not in NAMELESS
    found = diagnosed(written(tmp_path, NAMELESS), of_mass(HEAVIER, 1, "fitted"), of_mass(HEAVIER, 2, "held"))
    (load,) = found.selected
    assert (load.axis, load.effect.name) == ("lift", "payload")
    told = {name: estimate.value for name, estimate in found.causes[0].parameters.items()}
    assert told["mass"] == pytest.approx(HEAVIER, rel=0.01)
    assert told["x"] == pytest.approx(0.3, abs=0.01)


def test_of_bodies_without_names_the_right_one_is_made_lighter(tmp_path: Path) -> None:
    found = diagnosed(written(tmp_path, NAMELESS), of_mass(LIGHTER, 1, "fitted"), of_mass(LIGHTER, 2, "held"))
    model = patched(found, tmp_path / "out")
    column, carriage = (int(model.joint(axis).bodyid[0]) for axis in ("turn", "lift"))
    assert found.selected == ()
    assert model.body_mass[carriage] == pytest.approx(CARRIAGE + LIGHTER, rel=0.001)
    assert sorted(model.body_mass[[column, model.nbody - 1]]) == [5.0, 7.0]
    (mass,) = found.masses
    assert (mass.body, mass.axis, mass.nominal) == (model.body(carriage).name, "lift", CARRIAGE)
    assert mass.mass.value == pytest.approx(model.body_mass[carriage], rel=1e-9)
    assert mass.mass.ci90[0] < CARRIAGE + LIGHTER < mass.mass.ci90[1] < CARRIAGE
    assert mass.gap_closed is not None
    assert mass.gap_closed.validation == pytest.approx(mass.share, abs=0.02), "it is all that the gap is made of"
    assert mass.gap_closed.validation > 0.9
    assert verdict_sentence(found).startswith(f"The gap is explained by the mass of {mass.body}: lift ")
    (share,) = [each for each in found.axes["lift"].shares if each.of == "masses"]
    assert share.share == pytest.approx(mass.share, abs=1e-9)


FOLLOWER = """<body><joint name="weight" type="slide" axis="0 0 1"/>
<inertial pos="0 1 0" mass="3" diaginertia="1e-6 1e-6 1e-6"/></body></worldbody>
<equality><joint joint1="weight" joint2="lift" polycoef="0 -0.5 0 0 0"/></equality>"""


def test_a_follower_on_a_branch_of_its_own_is_made_heavier(tmp_path: Path) -> None:
    """A counterweight on the column's cable, which goes down half as far as the carriage goes up: nobody's payload."""
    model = written(tmp_path, MODEL.replace("</worldbody>", FOLLOWER))
    column = mujoco.MjModel.from_xml_path(str(model))
    recorded = strokes(1, 4.0)
    rows = prepared(model, [recorded], [recorded], Settings()).rows
    place = {rows.simulation.model.body(body).name: rows.simulation.carrier(body) for body in rows.simulation.moving_bodies()}
    assert column.nbody == 4
    assert sorted(axis for found in place.values() if found is not None for axis in found[:1]) == ["lift", "turn"]
    assert list(place.values()).count(None) == 1
    nominals = nominal_parameters(rows, Settings())
    (weight,) = [one for one in nominals if one.body is not None and one.axis is None]
    assert weight.off_by(0.1) is None


@pytest.mark.parametrize("drives", ["joint", "jointinparent"])
def test_a_motor_needs_no_name(drives: str, tmp_path: Path) -> None:
    xml = MODEL
    for axis in ("turn", "lift"):
        xml = xml.replace(f'<motor name="{axis}" joint="{axis}"/>', f'<motor {drives}="{axis}"/>')
    assert "motor name" not in xml
    model = written(tmp_path, xml)
    for number, name in ((1, "fitted"), (2, "held")):
        write_recording(of_the_model_alone(of_mass(HEAVIER, number, name)), tmp_path / name)
    inputs = read_inputs(model, [tmp_path / "fitted"], [tmp_path / "held"], cutoff_hz=48.0, allow_gaps=False)
    found = diagnosed(inputs.model, *inputs.training, *inputs.validation)
    assert patched(found, tmp_path / "out").nu == 2


def of_the_model_alone(told: Recording) -> Recording:
    """As one that says neither motor nor gear."""
    for info in told.info.axes.values():
        info.actuator = info.gear_ratio = None
    return told


def test_a_model_with_meshes_is_patched_wherever_the_report_goes(tmp_path: Path) -> None:
    assets = tmp_path / "model" / "shapes"
    assets.mkdir(parents=True)
    (assets / "bar.obj").write_text(TETRAHEDRON, encoding="utf-8")
    visual = '<geom type="mesh" mesh="bar" mass="0" contype="0" conaffinity="0"/>'
    xml = MODEL.replace('<compiler angle="radian"/>', '<compiler angle="radian" meshdir="shapes"/>')
    xml = xml.replace("<worldbody>", '<asset><mesh name="bar" file="bar.obj"/></asset><worldbody>')
    xml = xml.replace('<inertial pos="0 0 0"', f'{visual}<inertial pos="0 0 0"')
    found = diagnosed(written(tmp_path / "model", xml), strokes(1, SECONDS), strokes(2, SECONDS))
    assert patched(found, tmp_path / "out").nmesh == 1


def test_a_servo_of_the_model_counts_as_the_torque_of_its_joint_and_full_inertia_is_patched(tmp_path: Path) -> None:
    """As vendors write it: position servos, and the whole inertia tensor."""
    xml = MODEL.replace('diaginertia="1e-6 1e-6 1e-6"', 'fullinertia="2e-6 2e-6 3e-6 1e-7 0 0"')
    xml = xml.replace("<motor", "<position kp='200'")
    found = diagnosed(written(tmp_path, xml), of_mass(LIGHTER, 1, "fitted"), of_mass(LIGHTER, 2, "held"))
    model = patched(found, tmp_path / "out")
    carriage = int(model.joint("lift").bodyid[0])
    assert model.body_mass[carriage] == pytest.approx(CARRIAGE + LIGHTER, rel=0.001)
    as_given = mujoco.MjModel.from_xml_string(xml)
    expected = as_given.body_inertia[carriage] * model.body_mass[carriage] / CARRIAGE
    assert model.body_inertia[carriage] == pytest.approx(expected, rel=1e-9)
    assert model.actuator_gainprm[:, 0].tolist() == [200.0, 200.0]


TETRAHEDRON = """v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 2 3 4
f 1 4 3
"""
