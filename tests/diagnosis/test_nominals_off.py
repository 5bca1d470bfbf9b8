"""Nominal parameters that are off by no more than usual are corrected; nothing else is named for them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rig_bench import (
    CARRIAGE,
    COULOMB,
    GRAVITY,
    LIFT_MOTOR,
    LIFTING,
    TURNING,
    VISCOUS,
    Swing,
    as_modelled,
    diagnosed,
    lift_torque,
    moved,
    recording,
    strokes,
)

from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.report.result import Array, Diagnosis
from drivetwin.diagnosis.settings import Settings
from drivetwin.recording.recording import Recording

FRICTION, INERTIA = 0.03, 0.045
"""Shares by which they are: about one standard deviation of what a data sheet gives."""


def test_a_torque_constant_is_not_named_for_friction_and_inertia_that_are_a_little_off(tmp_path: Path) -> None:
    def more(inertia: float, axis: str, at: Swing) -> Array:
        friction = COULOMB[axis] * (1.0 * (at.velocity > 0) - 1.0 * (at.velocity < 0)) + VISCOUS[axis] * at.velocity
        return FRICTION * friction + INERTIA * inertia * at.acceleration

    both = {"turn": lambda at: more(TURNING, "turn", at), "lift": lambda at: more(LIFTING, "lift", at)}
    found = diagnosed(tmp_path, lambda seed, name: strokes(seed, 12.0, both, name))
    assert {one.effect.name for one in found.selected} <= {"coulomb", "viscous", "inertia", "payload"}
    assert found.selected


LIFT = f"""<mujoco model="lift"><option gravity="0 0 -{GRAVITY}"/><worldbody>
<body name="carriage"><joint name="lift" type="slide" axis="0 0 1" armature="{LIFT_MOTOR}"
 frictionloss="{COULOMB["lift"]}" damping="{VISCOUS["lift"]}"/>
<inertial pos="0 0 0" mass="{CARRIAGE}" diaginertia="1e-6 1e-6 1e-6"/></body>
</worldbody><actuator><motor name="lift" joint="lift"/></actuator></mujoco>"""


def of_a_lift(folder: Path, constant: float, lighter: float) -> Diagnosis:
    """What is said of a lift with 5 % less Coulomb friction, another motor constant and a lighter carriage."""

    def recorded(seed: int, name: str) -> Recording:
        both = moved(seed, 12.0)
        at = both["lift"]
        lacks = 0.05 * COULOMB["lift"] * np.sign(at.velocity) + lighter * CARRIAGE * (at.acceleration + GRAVITY)
        positions = {axis: each.position for axis, each in both.items()}
        return recording({"lift": (lift_torque(at) - lacks) / constant}, positions, seed, name)

    (folder / "lift.xml").write_text(LIFT, encoding="utf-8")
    fitted, held = recorded(1, "fitted"), recorded(2, "held")
    return diagnose(folder / "lift.xml", [fitted], [held], Settings(), lambda _stage, _share: None)


def test_what_moved_mass_friction_and_rotor_alike_is_one_motor_constant(tmp_path: Path) -> None:
    """The friction differs besides, so that with friction as modelled no motor constant explains the rest."""
    found = of_a_lift(tmp_path, 1.12, 0.0)
    assert found.causes[0].effect == "torque_constant"
    assert found.causes[0].parameters["error"].value == pytest.approx(0.12, abs=0.02)
    assert not found.masses


@pytest.mark.parametrize("rubs", [0.0, 0.006])
def test_friction_and_inertia_that_are_off_alike_by_little_are_one_motor_constant(rubs: float, tmp_path: Path) -> None:
    """By less than a usual data sheet errs: a name for each of three would say as much. `rubs`: friction differs besides."""

    def recorded(seed: int, name: str) -> Recording:
        both = moved(seed, 12.0)
        torques = as_modelled(both)
        more = rubs * COULOMB["turn"] * np.sign(both["turn"].velocity)
        torques["turn"] = (torques["turn"] + more) / 1.017
        return recording(torques, {axis: at.position for axis, at in both.items()}, seed, name, noise=3.0)

    found = diagnosed(tmp_path, recorded)
    assert {(one.effect.name, one.axis) for one in found.selected} == {("torque_constant", "turn")}
    assert found.causes[0].parameters["error"].value == pytest.approx(0.017, abs=0.003)


def of_a_force(folder: Path, lighter: float, noise: float) -> Diagnosis:
    """What is said of a lift whose weight alone is less, by a force that costs what so much less mass does."""

    def recorded(seed: int, name: str) -> Recording:
        both = moved(seed, 12.0)
        torque = lift_torque(both["lift"]) - lighter * CARRIAGE * GRAVITY
        return recording({"lift": torque}, {axis: at.position for axis, at in both.items()}, seed, name, noise=noise)

    (folder / "lift.xml").write_text(LIFT, encoding="utf-8")
    fitted, held = recorded(1, "fitted"), recorded(2, "held")
    return diagnose(folder / "lift.xml", [fitted], [held], Settings(), lambda _stage, _share: None)


def test_a_force_is_no_lighter_carriage_where_its_inertia_says_so(tmp_path: Path) -> None:
    found = of_a_force(tmp_path, 0.04, 3.0)
    assert not found.masses
    (force,) = found.selected
    assert force.effect.name in ("torque_offset", "coulomb_asymmetry")
    assert {"torque_offset", "coulomb_asymmetry"} == {force.effect.name, *found.causes[0].indistinguishable_from}
    assert abs(getattr(force.effect, force.effect.parameters[0].name)) == pytest.approx(0.04 * CARRIAGE * GRAVITY, rel=0.02)


def test_what_a_lighter_carriage_may_be_as_well_is_listed(tmp_path: Path) -> None:
    """In more noise the two cost the same, and a data sheet errs by as much: the mass is corrected."""
    found = of_a_force(tmp_path, 0.04, 40.0)
    assert [one.body for one in found.masses] == ["carriage"]
    assert not found.selected
    assert {"torque_offset", "coulomb_asymmetry"} <= set(found.masses[0].instead)
    listed = {one.effect: one for one in found.causes}
    assert found.causes[0].effect in ("torque_offset", "coulomb_asymmetry")
    assert listed["torque_offset"].share == pytest.approx(found.masses[0].share, abs=0.1)
    assert 0.02 < listed["torque_offset"].probability < 0.5


def test_a_carriage_that_is_lighter_is_no_motor_constant(tmp_path: Path) -> None:
    found = of_a_lift(tmp_path, 1.0, 0.11)
    (mass,) = found.masses
    assert mass.mass.value == pytest.approx(0.89 * CARRIAGE, rel=0.02)
    assert "torque_constant" not in {one.effect.name for one in found.selected}
