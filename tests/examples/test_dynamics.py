"""Dynamics of the wafer handler against MuJoCo and Pinocchio, and against what mechanics asks of any such model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pinocchio
import pytest
from wafer_handler.dynamics_check import (
    States,
    maximum_relative_difference,
    mujoco_torque,
    pinocchio_model,
    pinocchio_torque,
    random_states,
    relative_difference,
)
from wafer_handler.scara.dynamics import (
    GRAVITY,
    PARAMETERS,
    BaseParameters,
    base_parameters,
    coriolis,
    friction,
    gravity,
    lift_torque,
    mass_matrix,
    regressor,
    rotation_torque,
    stretch_torque,
    torque,
)
from wafer_handler.scara.geometry import BELT_OFFSET, BELTS, load_geometry
from wafer_handler.scara.kinematics import chain
from wafer_handler.scara.kinematics import links as dh_links
from wafer_handler.scara.link_parameters import Body, LinkParameters, from_model

from drivetwin.controller.machine import load_machine
from drivetwin.foundation.errors import UserError
from drivetwin.identification.friction_law import FrictionLaw
from drivetwin.motion.inverse_dynamics import read_mjcf
from drivetwin.recording.recording import Samples

MACHINE, GEOMETRY = load_machine("scara"), load_geometry()
PLANT = Path(__file__).parents[2] / "emulator" / "machines" / "scara" / "scara.xml"
NOMINAL = from_model(MACHINE.model_path)


def lopsided(seed: int) -> LinkParameters:
    """Physical links of no symmetry: every body's centre lies beside the line through its joints."""
    random = np.random.default_rng(seed)

    def body() -> Body:
        return Body(random.uniform(0.3, 4.0), random.uniform(-0.1, 0.2), random.uniform(-0.1, 0.1), random.uniform(0.001, 0.05))

    return LinkParameters(random.uniform(5, 15), body(), body(), body(), body(), (11.0, 0.03, 0.04))


ALL_LINKS = (NOMINAL, *(lopsided(seed) for seed in range(3)))


def base_of(links: LinkParameters) -> BaseParameters:
    return base_parameters(links, GEOMETRY)


def ours(links: LinkParameters, states: States) -> Samples:
    return torque(base_of(links), states.joints, states.velocity, states.acceleration)


def test_closed_form_is_mujoco_s_and_pinocchio_s_inverse_dynamics() -> None:
    difference = maximum_relative_difference(seed=0, states=10_000)
    assert difference.mujoco < 1e-12
    assert difference.pinocchio < 1e-12


def test_the_plant_s_own_links_give_the_plant_s_torque() -> None:
    states = random_states(MACHINE, 1, 1000)
    assert relative_difference(ours(from_model(PLANT), states), mujoco_torque(read_mjcf(PLANT), states)) < 1e-12


@pytest.mark.parametrize("seed", range(3))
def test_links_without_symmetry_agree_too(seed: int) -> None:
    links, states = lopsided(seed), random_states(MACHINE, seed, 1000)
    model = read_mjcf(MACHINE.model_path)
    for name, body in zip(("hub", "upper_arm", "forearm", "blade"), links.bodies, strict=True):
        index = model.body(name).id
        model.body_mass[index] = body.mass
        model.body_ipos[index, :2] = body.along, body.across
        model.body_iquat[index] = 1.0, 0.0, 0.0, 0.0
        model.body_inertia[index] = body.inertia
    model.body_mass[model.body("carriage").id] = links.carriage
    for joint, armature in zip(("lift", "rotate", "stretch"), links.armature, strict=True):
        model.dof_armature[model.joint(joint).dofadr] = armature
    mujoco.mj_setConst(model, mujoco.MjData(model))
    assert relative_difference(ours(links, states), mujoco_torque(model, states)) < 1e-12
    assert relative_difference(ours(links, states), pinocchio_torque(links, GEOMETRY, states)) < 1e-12


def test_a_wrong_length_or_a_body_turned_round_is_seen() -> None:
    states = random_states(MACHINE, 0, 100)
    theirs = mujoco_torque(read_mjcf(MACHINE.model_path), states)
    longer = base_parameters(NOMINAL, replace(GEOMETRY, arm=0.201))
    assert relative_difference(torque(longer, states.joints, states.velocity, states.acceleration), theirs) > 1e-3
    mirrored = replace(NOMINAL, blade=replace(NOMINAL.blade, along=-NOMINAL.blade.along))
    assert relative_difference(ours(mirrored, states), theirs) > 1e-3


@pytest.mark.parametrize("links", ALL_LINKS)
def test_torque_is_linear_in_the_base_parameters(links: LinkParameters) -> None:
    states, base = random_states(MACHINE, 2, 500), base_of(links)
    rows = regressor(states.joints, states.velocity, states.acceleration)
    assert rows.shape == (500, 3, 9)
    np.testing.assert_allclose(rows @ base.vector(), ours(links, states), rtol=0, atol=1e-11)
    assert [parameter.name for parameter in PARAMETERS] == list(BaseParameters.__dataclass_fields__)


def test_base_parameters_are_all_that_the_axes_feel_and_none_is_too_many() -> None:
    """Pinocchio's regressor of all 50 inertial parameters, projected by the belts, and the motors span the same nine."""
    states = random_states(MACHINE, 3, 200)
    model = pinocchio_model(NOMINAL, GEOMETRY)
    data = model.createData()
    stands, rates = states.joints @ BELTS.T + BELT_OFFSET, states.velocity @ BELTS.T
    accelerations = states.acceleration @ BELTS.T
    full = [
        BELTS.T @ pinocchio.computeJointTorqueRegressor(model, data, *row)
        for row in zip(stands, rates, accelerations, strict=True)
    ]
    motors = np.einsum("ni,ij->nij", states.acceleration, np.eye(3)).reshape(-1, 3)
    standard = np.hstack([np.vstack(full), motors])
    base = regressor(states.joints, states.velocity, states.acceleration).reshape(-1, 9)
    assert standard.shape == (600, 53)
    assert np.linalg.matrix_rank(standard, rtol=1e-10) == 9
    assert np.linalg.matrix_rank(base, rtol=1e-10) == 9
    assert np.linalg.matrix_rank(np.hstack([standard, base]), rtol=1e-10) == 9


def test_symmetric_links_have_no_moments_across() -> None:
    base = base_of(NOMINAL)
    assert base.forearm_moment_across == pytest.approx(0.0, abs=1e-15)
    assert base.blade_moment_across == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("links", ALL_LINKS)
def test_mass_matrix_is_positive_definite_over_the_workspace(links: LinkParameters) -> None:
    joints = np.zeros((721, 3))
    joints[:, 2] = np.linspace(-np.pi, np.pi, 721)
    matrix = mass_matrix(base_of(links), joints)
    np.testing.assert_array_equal(matrix, np.swapaxes(matrix, -1, -2))
    assert np.linalg.eigvalsh(matrix).min() > 0.0


@pytest.mark.parametrize("links", ALL_LINKS)
def test_rate_of_the_mass_matrix_less_twice_coriolis_is_skew_symmetric(links: LinkParameters) -> None:
    base, states, step = base_of(links), random_states(MACHINE, 4, 500), 1e-5
    ahead, behind = (mass_matrix(base, states.joints + sign * step * states.velocity) for sign in (1, -1))
    skew = (ahead - behind) / (2 * step) - 2 * coriolis(base, states.joints, states.velocity)
    np.testing.assert_allclose(skew, -np.swapaxes(skew, -1, -2), rtol=0, atol=1e-8)
    assert np.abs(skew).max() > 0.1


@pytest.mark.parametrize("links", ALL_LINKS)
def test_work_of_the_torque_is_the_change_of_energy(links: LinkParameters) -> None:
    base, random = base_of(links), np.random.default_rng(5)
    nodes, weights = np.polynomial.legendre.leggauss(200)
    time = np.concatenate([[0.0], nodes + 1.0, [2.0]])[:, None]
    middle = np.array([0.15, 0.0, 0.75])
    waves = [(random.uniform(1, 4, 3), random.uniform(0, 6, 3), random.uniform(0.05, 0.2, 3)) for _ in range(3)]
    joints = middle + sum(size * np.sin(rate * time + phase) for rate, phase, size in waves)
    velocity = sum(size * rate * np.cos(rate * time + phase) for rate, phase, size in waves)
    acceleration = -sum(size * rate**2 * np.sin(rate * time + phase) for rate, phase, size in waves)
    power = (torque(base, joints, velocity, acceleration) * velocity).sum(axis=1)
    kinetic = 0.5 * np.einsum("ni,nij,nj->n", velocity, mass_matrix(base, joints), velocity)
    energy = kinetic + base.moving_mass * GRAVITY * joints[:, 0]
    assert weights @ power[1:-1] == pytest.approx(energy[-1] - energy[0], rel=1e-10)


def test_gravity_is_what_mujoco_holds_the_arm_with() -> None:
    still = States(random_states(MACHINE, 6, 5).joints, np.zeros((5, 3)), np.zeros((5, 3)))
    held = mujoco_torque(read_mjcf(MACHINE.model_path), still)
    np.testing.assert_allclose(held, np.tile(gravity(base_of(NOMINAL)), (5, 1)), rtol=0, atol=1e-11)
    assert -read_mjcf(MACHINE.model_path).opt.gravity[2] == GRAVITY


# The paper's decoupled equations are special cases of the full model.


def test_lift_equation_is_exact_whatever_the_arm_does() -> None:
    states, base = random_states(MACHINE, 7, 500), base_of(NOMINAL)
    theirs = pinocchio_torque(NOMINAL, GEOMETRY, states)[:, 0]
    np.testing.assert_allclose(lift_torque(base, states.acceleration[:, 0]), theirs, rtol=0, atol=1e-10)
    printed = base.moving_mass * (states.acceleration[:, 0] + GRAVITY)
    np.testing.assert_allclose(theirs - printed, base.lift_armature * states.acceleration[:, 0], rtol=0, atol=1e-10)


def test_rotation_equation_is_exact_while_the_arm_keeps_its_shape() -> None:
    states = random_states(MACHINE, 8, 500)
    only_rotate = np.array([0.0, 1.0, 0.0])
    states = States(states.joints, states.velocity * only_rotate, states.acceleration * only_rotate)
    theirs = pinocchio_torque(NOMINAL, GEOMETRY, states)[:, 1]
    found = rotation_torque(base_of(NOMINAL), states.joints[:, 2], states.acceleration[:, 1])
    np.testing.assert_allclose(found, theirs, rtol=0, atol=1e-12)


def test_erratum_symbols_of_equation_7() -> None:
    """M22 is sum(I + m r²) with r from the column to each centre of mass; with it the term in cos 2 theta3 would count twice.

    With l along the links as printed, the wrist's mass belongs into cos 2 theta3, and the blade adds 4 m5 l5 L3 sin theta3.
    """
    states, base = random_states(MACHINE, 9, 100), base_of(NOMINAL)
    table, height = dh_links(GEOMETRY, states.joints), np.array([0.0, 1.0])
    about_column = np.full(100, NOMINAL.hub.about_joint + NOMINAL.armature[1])
    for count, body in zip((3, 4, 5), NOMINAL.bodies[1:], strict=True):
        centre = chain(table[:count])[:, :2, :] @ np.array([body.along, body.across, *height])
        about_column += body.inertia + body.mass * (centre**2).sum(axis=1)
    m22 = mass_matrix(base, states.joints)[:, 1, 1]
    np.testing.assert_allclose(m22, about_column, rtol=0, atol=1e-12)
    _, _, fore, blade = NOMINAL.bodies
    stretch = states.joints[:, 2]
    printed = base.rotate_inertia - 2 * fore.mass * fore.along * GEOMETRY.arm * np.cos(2 * stretch)
    missing = blade.mass * (
        4 * blade.along * GEOMETRY.arm * np.sin(stretch) - 2 * GEOMETRY.arm**2 * np.cos(2 * stretch)
    )
    np.testing.assert_allclose(m22 - printed, missing, rtol=0, atol=1e-12)
    assert np.abs(missing / m22).max() > 0.2


def test_stretch_equation_is_exact_while_rotate_stands() -> None:
    states = random_states(MACHINE, 10, 500)
    only_stretch = np.array([0.0, 0.0, 1.0])
    states = States(states.joints, states.velocity * only_stretch, states.acceleration * only_stretch)
    theirs = pinocchio_torque(NOMINAL, GEOMETRY, states)
    found = stretch_torque(base_of(NOMINAL), states.joints[:, 2], states.velocity[:, 2], states.acceleration[:, 2])
    np.testing.assert_allclose(found, theirs[:, 2], rtol=0, atol=1e-12)
    reaction = base_of(NOMINAL).coupling_inertia * states.acceleration[:, 2]
    np.testing.assert_allclose(theirs[:, 1], reaction, rtol=0, atol=1e-12)


def test_friction_is_each_axis_s_own_law() -> None:
    laws = (FrictionLaw(coulomb=30.0, viscous=160.0), FrictionLaw(coulomb=2.0), FrictionLaw(viscous=0.5))
    velocity = np.array([[0.1, -1.0, 2.0], [-0.2, 0.0, -1.0]])
    np.testing.assert_allclose(friction(laws, velocity), [[46.0, -2.0, 1.0], [-62.0, 0.0, -0.5]])


def test_motors_behind_the_belts_count_by_their_ratio_squared(tmp_path: Path) -> None:
    text = MACHINE.model_path.read_text(encoding="utf-8")
    path = tmp_path / "model.xml"
    path.write_text(text.replace('<joint name="elbow"', '<joint armature="0.01" name="elbow"'))
    assert from_model(path).armature == pytest.approx((11.05, 0.035, 0.075))
    states = random_states(MACHINE, 11, 100)
    assert relative_difference(ours(from_model(path), states), mujoco_torque(read_mjcf(path), states)) < 1e-12


def test_models_that_are_no_wafer_handler_are_refused(tmp_path: Path) -> None:
    text = MACHINE.model_path.read_text(encoding="utf-8")
    path = tmp_path / "model.xml"
    path.write_text(text.replace('<body name="forearm"', '<body name="fore"'))
    with pytest.raises(UserError, match="has no body 'forearm'"):
        from_model(path)
    path.write_text(text.replace('"wrist"', '"hand"'))
    with pytest.raises(UserError, match="has no joint 'wrist'"):
        from_model(path)
    with pytest.raises(UserError, match="no model at"):
        from_model(tmp_path / "missing.xml")
