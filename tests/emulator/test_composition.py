"""A machine's own friction stays where effects are added, and what gives way is said; a model of one's own is the plant."""

from __future__ import annotations

from pathlib import Path

import mujoco
import pytest
from plant_bench import PlantBench, placed

from drivetwin.emulator.composition import composed
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.plant import Plant
from drivetwin.foundation.errors import UserError

STAGE = load_machine("stage")
OWN = read_effects(STAGE.effects_path)
JOINTS = {"slide": "slide"}

MODEL = """<mujoco model="mine"><worldbody><body name="carriage"><joint name="slide" type="slide" axis="1 0 0" {joint}/>
<geom type="box" size="0.1 0.1 0.04" mass="80"/></body></worldbody><actuator>{actuator}</actuator></mujoco>"""


def model(folder: Path, joint: str = "", actuator: str = '<position name="servo" joint="slide" kp="1000"/>') -> Path:
    path = folder / "mine.xml"
    path.write_text(MODEL.format(joint=joint, actuator=actuator), encoding="utf-8")
    return path


def test_an_added_effect_acts_beside_the_machines_own_friction() -> None:
    """Stribeck rises from the stage's own Coulomb friction, which a truth in its place would have taken away."""
    found = composed(OWN, [placed("slide", "stribeck", static_torque=30.0, stribeck_velocity=0.01)])
    law = Plant(STAGE, found.effects).truth()["slide"]
    assert (law["coulomb"], law["viscous"], law["static_torque"]) == (20.4, 203.5, 30.0)
    assert found.gave_way == ()
    bench = PlantBench("stage", "slide", found.effects)
    speed, torque = bench.slide_at(0.002)
    assert torque == pytest.approx(20.4 + 9.6 * 2.718281828 ** -((speed / 0.01) ** 2) + (203.5 - 36.0) * speed, rel=0.01)


def test_an_added_effect_that_the_machine_has_takes_its_place_and_that_is_said() -> None:
    found = composed(OWN, [placed("slide", "viscous_asymmetry", asymmetry=-10.0)])
    assert Plant(STAGE, found.effects).truth()["slide"]["viscous_positive"] == pytest.approx(193.5)
    assert found.gave_way == (
        "slide: the added viscous_asymmetry takes the place of the machine's own (asymmetry -36)",
    )


def test_an_axis_has_every_ripple() -> None:
    first = placed("slide", "torque_ripple", amplitude=1.0, order=2.0)
    found = composed([*OWN, first], [placed("slide", "torque_ripple", amplitude=2.0, order=7.0)])
    assert [one.effect.name for one in found.effects].count("torque_ripple") == 2
    assert found.gave_way == ()


def test_friction_of_a_model_of_ones_own_is_not_replaced_by_the_machines(tmp_path: Path) -> None:
    mine = model(tmp_path, 'frictionloss="33" armature="14"')
    found = composed(OWN, (), mine, JOINTS)
    law = Plant(STAGE, found.effects, mine).truth()["slide"]
    assert (law["coulomb"], law["viscous"], law["viscous_positive"]) == (33.0, 203.5, 167.5)
    assert found.gave_way == (f"slide: frictionloss 33 of {mine} takes the place of the machine's own coulomb 20.4",)


def test_an_added_friction_that_replaces_the_models_is_said(tmp_path: Path) -> None:
    mine = model(tmp_path, 'frictionloss="33"')
    found = composed(OWN, [placed("slide", "coulomb", coulomb=25.0)], mine, JOINTS)
    assert Plant(STAGE, found.effects, mine).truth()["slide"]["coulomb"] == 25.0
    assert found.gave_way[-1] == f"slide: the added coulomb 25 takes the place of frictionloss 33 of {mine}"


@pytest.mark.parametrize(("armature", "inertia"), [("", 95.0), ('armature="12.5"', 92.5)])
def test_an_armature_is_all_of_the_motors_inertia(armature: str, inertia: float, tmp_path: Path) -> None:
    """80 kg and 3.8e-5 kg·m² on a screw of 10 mm a turn, 15.0 kg; or what the model says that the motor is."""
    told = Plant(STAGE, OWN, model(tmp_path, armature)).truth()["slide"]["inertia"]
    assert told == pytest.approx(inertia, rel=1e-4)


def test_a_position_servo_of_the_model_gives_way_to_the_drive(tmp_path: Path) -> None:
    """Without torque of the drive nothing pulls the axis to where the model's own servo wanted it."""
    plant = Plant(STAGE, OWN, model(tmp_path))
    assert plant.model.actuator_biastype[0] == int(mujoco.mjtBias.mjBIAS_NONE)
    assert plant.joint_positions()[0] == -0.1


def test_a_model_without_the_machines_joint_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.xml"
    path.write_text(MODEL.format(joint="", actuator="").replace('name="slide"', 'name="x"'), encoding="utf-8")
    with pytest.raises(UserError, match=r"other\.xml: axis slide moves joint 'slide'; the model's hinges and slides: x"):
        Plant(STAGE, OWN, path)
