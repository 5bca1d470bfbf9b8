"""Base parameters and friction from recordings whose truth is known: torque by Pinocchio, motion in closed form."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest
from wafer_handler.dynamics_check import States, pinocchio_torque
from wafer_handler.scara.dynamics import base_parameters
from wafer_handler.scara.geometry import load_geometry
from wafer_handler.scara.identification import ACROSS, AXES, SETTINGS, BaseIdentification, identify_arm
from wafer_handler.scara.link_parameters import LinkParameters, from_model

from drivetwin.controller.machine import load_machine
from drivetwin.foundation.errors import UserError
from drivetwin.identification.friction_law import FrictionLaw
from drivetwin.identification.result import Parameter
from drivetwin.motion.inverse_dynamics import Model, load_model
from drivetwin.recording.recording import AxisInfo, Recording, RecordingInfo, Samples

MACHINE, GEOMETRY = load_machine("scara"), load_geometry()
SYMMETRIC = from_model(MACHINE.model_path)
LOPSIDED = replace(
    SYMMETRIC,
    forearm=replace(SYMMETRIC.forearm, across=0.02),
    blade=replace(SYMMETRIC.blade, across=-0.03),
)
PERIOD, SECONDS = 1e-3, 12.0
FRICTION = {
    "lift": FrictionLaw(coulomb=31.0, viscous=165.0),
    "rotate": FrictionLaw(coulomb=1.9, viscous=1.15, offset=0.08),
    "stretch": FrictionLaw(coulomb=0.85, viscous=0.5, offset=-0.03),
}
STRIBECK = FRICTION | {
    "rotate": replace(FRICTION["rotate"], static_rise=0.6, stribeck_velocity=0.25),
    "stretch": replace(FRICTION["stretch"], static_rise=0.3, stribeck_velocity=0.25),
}
NOISE = {"lift": 3.2, "rotate": 0.08, "stretch": 0.08}
"""Of a current sensor with 0.4 % of rated torque, joint side [N, N·m, N·m]."""

UNKNOWN = dict.fromkeys(AXES, FrictionLaw())
CENTRES = {"lift": 0.17, "rotate": 0.0, "stretch": 0.75}
REACHES = {"lift": 0.05, "rotate": 0.5, "stretch": 0.25}
TONES = {"lift": (0.31, 0.73, 1.3), "rotate": (0.37, 0.61, 1.1), "stretch": (0.29, 0.83, 1.4)}


def motion(seed: int) -> States:
    """Three sines an axis, each with phases of its own, swelling from rest and back as sin²; derivatives in closed form."""
    time = np.arange(round(SECONDS / PERIOD), dtype=np.float64) * PERIOD
    random, slow = np.random.default_rng(seed), 2.0 * np.pi / SECONDS
    swell = (
        0.5 * (1.0 - np.cos(slow * time)),
        0.5 * slow * np.sin(slow * time),
        0.5 * slow**2 * np.cos(slow * time),
    )
    joints, velocity, acceleration = (np.empty((len(time), len(AXES))) for _ in range(3))
    for column, axis in enumerate(AXES):
        rates = 2.0 * np.pi * np.array(TONES[axis])
        sizes, phases = REACHES[axis] / np.arange(1, 4), random.uniform(0.0, 2.0 * np.pi, 3)
        wave = [np.sin(np.outer(time, rates) + phases + order * np.pi / 2.0) @ (sizes * rates**order) for order in range(3)]
        joints[:, column] = CENTRES[axis] + swell[0] * wave[0]
        velocity[:, column] = swell[1] * wave[0] + swell[0] * wave[1]
        acceleration[:, column] = swell[2] * wave[0] + 2.0 * swell[1] * wave[1] + swell[0] * wave[2]
    return States(joints, velocity, acceleration)


def recorded(name: str, states: States, torque: Samples, axes: tuple[str, ...] = AXES) -> Recording:
    columns = {
        axis: {"torque": torque[:, AXES.index(axis)], "position": states.joints[:, AXES.index(axis)]} for axis in axes
    }
    known = {axis: AxisInfo(joint=axis, position_resolution=1e-8) for axis in axes}
    info = RecordingInfo(machine="scara", sample_period=PERIOD, axes=known)
    return Recording(name, info, np.arange(len(torque), dtype=np.float64) * PERIOD, columns)


def captured(links: LinkParameters, laws: dict[str, FrictionLaw], noise: float = 0.0, seed: int = 0) -> list[Recording]:
    """Two recordings of all axes together; `noise` is a share of NOISE."""
    recordings, random = [], np.random.default_rng(1000 + seed)
    for number in range(2):
        states = motion(2 * seed + number)
        friction = np.column_stack([laws[axis].torque(states.velocity[:, k]) for k, axis in enumerate(AXES)])
        hiss = noise * random.standard_normal(friction.shape) * np.array(list(NOISE.values()))
        recordings.append(recorded(f"run_{number}", states, pinocchio_torque(links, GEOMETRY, states) + friction + hiss))
    return recordings


@pytest.fixture(scope="module")
def model() -> Model:
    return load_model(MACHINE.model_path)


def truth(links: LinkParameters) -> dict[str, float]:
    return asdict(base_parameters(links, GEOMETRY))


FAR = 2.5
"""Half widths of a 90 % interval that an estimate is off by once in 25,000 (4.1 standard deviations)."""


def off_by(parameter: Parameter, true: float) -> float:
    """How far from the truth, in half widths of its interval."""
    low, high = parameter.interval
    return abs(parameter.value - true) / (0.5 * (high - low))


def assert_friction(found: BaseIdentification, laws: dict[str, FrictionLaw], tolerance: float) -> None:
    for axis in AXES:
        law, true = found.laws[axis], laws[axis]
        assert law.coulomb == pytest.approx(true.coulomb, rel=tolerance)
        assert law.viscous == pytest.approx(true.viscous, rel=tolerance)
        assert law.offset == pytest.approx(true.offset, abs=tolerance * true.coulomb)
        assert law.static_rise == pytest.approx(true.static_rise, rel=10.0 * tolerance, abs=0.0)


def test_all_nine_are_recovered_from_torque_without_noise(model: Model) -> None:
    """What is left is the differences' own error, and the low-pass, which bends products of the motion a little."""
    found = identify_arm(model, captured(LOPSIDED, FRICTION), UNKNOWN)
    true = truth(LOPSIDED)
    assert set(found.parameters) == set(true), "D' and E' are there, and are kept"
    for name, value in true.items():
        assert found.parameters[name].value == pytest.approx(value, rel=1e-3), name
        assert getattr(found.base, name) == found.parameters[name].value
    assert_friction(found, FRICTION, 5e-4)
    assert max(found.relative_error.values()) < 2e-4


def test_stribeck_torque_is_fitted_anew_on_a_given_shape(model: Model) -> None:
    """The laws that come in say the shape alone: their torques are wrong here, and what comes out is right."""
    wrong = {
        axis: replace(law, coulomb=7.0, viscous=3.0, offset=1.0, static_rise=law.static_rise and 9.0)
        for axis, law in STRIBECK.items()
    }
    found = identify_arm(model, captured(SYMMETRIC, STRIBECK), wrong)
    assert_friction(found, STRIBECK, 3e-3)
    assert "static_rise" not in found.friction["lift"]
    assert found.laws["rotate"].stribeck_velocity == 0.25


def test_the_friction_curve_is_torque_less_the_rigid_arm_s(model: Model) -> None:
    found = identify_arm(model, captured(SYMMETRIC, FRICTION), UNKNOWN)
    for axis in AXES:
        curve, law = found.curves[axis], FRICTION[axis]
        fast = np.abs(curve.velocity) > 0.3 * np.abs(curve.velocity).max()
        assert fast.sum() > 1000
        np.testing.assert_allclose(curve.torque[fast], law.torque(curve.velocity[fast]), atol=0.05 * law.coulomb)


@pytest.mark.parametrize("seed", range(3))
def test_moments_across_are_dropped_where_there_are_none(model: Model, seed: int) -> None:
    found = identify_arm(model, captured(SYMMETRIC, FRICTION, noise=1.0, seed=seed), UNKNOWN)
    assert set(found.parameters) == set(truth(SYMMETRIC)) - set(ACROSS)
    assert (found.base.forearm_moment_across, found.base.blade_moment_across) == (0.0, 0.0)
    for name, parameter in found.parameters.items():
        assert off_by(parameter, truth(SYMMETRIC)[name]) < FAR, name


def test_moments_across_are_kept_through_noise_where_they_are_there(model: Model) -> None:
    found = identify_arm(model, captured(LOPSIDED, FRICTION, noise=1.0), UNKNOWN)
    for name in ACROSS:
        low, high = found.parameters[name].interval
        assert low * high > 0.0, "the interval excludes 0"
        assert off_by(found.parameters[name], truth(LOPSIDED)[name]) < FAR, name


def test_intervals_hold_the_truth_about_as_often_as_they_say(model: Model) -> None:
    """90 % of 7 parameters in 12 draws, 84 in all: fewer than 65 are inside by chance once in 100,000 (binomial)."""
    inside = []
    for seed in range(12):
        found = identify_arm(model, captured(SYMMETRIC, FRICTION, noise=1.0, seed=10 + seed), UNKNOWN)
        for name, value in truth(SYMMETRIC).items():
            if name not in ACROSS:
                low, high = found.parameters[name].interval
                inside.append(low <= value <= high)
    assert len(inside) == 84
    assert sum(inside) >= 65


def test_a_recording_that_lacks_an_axis_is_refused(model: Model) -> None:
    states = motion(0)
    torque = pinocchio_torque(SYMMETRIC, GEOMETRY, states)
    whole, partial = recorded("whole", states, torque), recorded("partial", states, torque, ("lift", "stretch"))
    with pytest.raises(UserError, match="recording 'partial' has axes lift, stretch; expected lift, rotate, stretch"):
        identify_arm(model, [whole, partial], UNKNOWN)


def test_an_axis_that_never_moves_is_refused(model: Model) -> None:
    states = motion(0)
    moves = np.array([1.0, 0.0, 1.0])
    held = States(np.where(moves, states.joints, states.joints[0]), states.velocity * moves, states.acceleration * moves)
    torque = pinocchio_torque(SYMMETRIC, GEOMETRY, held)
    with pytest.raises(UserError, match="rotate stands still in every recording"):
        identify_arm(model, [recorded("held", held, torque)], UNKNOWN)


def only(states: States, moving: tuple[str, ...], held: States) -> States:
    """The named axes as in `states`, the others as in `held`."""
    moves = np.array([axis in moving for axis in AXES])
    return States(
        np.where(moves, states.joints, held.joints),
        np.where(moves, states.velocity, held.velocity),
        np.where(moves, states.acceleration, held.acceleration),
    )


def held_at(stretch: float, give: float) -> States:
    """All axes held, the arm at `stretch` [rad]; they give way by `give` [m or rad] at 2 Hz, as loops do that hold."""
    rate, time = 2.0 * np.pi * 2.0, np.arange(round(SECONDS / PERIOD), dtype=np.float64) * PERIOD
    wave, centre = np.sin(np.outer(time, np.full(3, rate)) + np.arange(3)), np.array([CENTRES["lift"], 0.0, stretch])
    turned = np.cos(np.outer(time, np.full(3, rate)) + np.arange(3))
    return States(centre + give * wave, give * rate * turned, -give * rate**2 * wave)


def torque_of(states: States, random: np.random.Generator, noise: float) -> Samples:
    friction = np.column_stack([FRICTION[axis].torque(states.velocity[:, k]) for k, axis in enumerate(AXES)])
    hiss = noise * random.standard_normal(friction.shape) * np.array(list(NOISE.values()))
    return np.asarray(pinocchio_torque(SYMMETRIC, GEOMETRY, states) + friction + hiss)


@pytest.mark.parametrize("give", [0.0, 2e-6])
def test_rotate_at_one_pose_of_the_arm_does_not_tell_its_inertia(model: Model, give: float) -> None:
    """There J2 + 4 E sin theta3 is one number: no solution of the regression is better than another."""
    held, random = held_at(CENTRES["stretch"], give), np.random.default_rng(5)
    moves = [only(motion(0), moving, held) for moving in (("lift", "rotate"), ("stretch",))]
    recordings = [recorded(f"run_{k}", one, torque_of(one, random, 1.0)) for k, one in enumerate(moves)]
    told_by = r"rotate_inertia, blade_moment \(told by rotate accelerating with the arm folded and with it stretched\)"
    with pytest.raises(UserError, match=rf"do not tell .*{told_by}"):
        identify_arm(model, recordings, UNKNOWN)


def test_axes_that_never_move_together_do_not_tell_their_coupling(model: Model) -> None:
    poses = [only(motion(0), ("lift", "rotate"), held_at(pose, 0.0)) for pose in (0.4, 1.1)]
    moves = [*poses, only(motion(0), ("stretch",), held_at(CENTRES["stretch"], 0.0))]
    recordings = [recorded(f"run_{k}", one, torque_of(one, np.random.default_rng(k), 1.0)) for k, one in enumerate(moves)]
    with pytest.raises(UserError, match=r"do not tell coupling_inertia \(told by rotate and stretch accelerating together\)"):
        identify_arm(model, recordings, UNKNOWN)


def test_one_speed_does_not_tell_viscous_from_coulomb_friction(model: Model) -> None:
    """A lift that cruises at one speed both ways, its ramps left out: coulomb + viscous v is all there is of its friction."""
    cruise, settings = 0.05, replace(SETTINGS, reversal_margin=0.2)
    states = motion(0)
    time = np.arange(len(states.joints), dtype=np.float64) * PERIOD
    inside = np.abs(np.mod(time, 3.0) - 1.5)  # 1.5 .. 0 .. 1.5: a triangle of 3 s
    joints, velocity, acceleration = (part.copy() for part in (states.joints, states.velocity, states.acceleration))
    joints[:, 0] = CENTRES["lift"] + cruise * (inside - 0.75)
    velocity[:, 0], acceleration[:, 0] = cruise * np.sign(np.mod(time, 3.0) - 1.5), 0.0
    lifted = States(joints, velocity, acceleration)
    with pytest.raises(UserError, match=r"lift\.coulomb, lift\.viscous \(told by lift moving at several speeds"):
        identify_arm(model, [recorded("run", lifted, torque_of(lifted, np.random.default_rng(0), 1.0))], UNKNOWN, settings)


def test_a_moment_across_that_nothing_tells_is_left_out_and_spoils_no_other(model: Model) -> None:
    """Rotate and stretch together about one pose: H - 2 E' cos theta3 is one number, and E' = 0 by the drawing."""
    close = held_at(CENTRES["stretch"], 0.0)
    near = motion(0)
    joints = near.joints.copy()
    shrink = np.array([1.0, 1.0, 0.02])
    joints[:, 2] = CENTRES["stretch"] + 0.02 * (joints[:, 2] - CENTRES["stretch"])
    together = States(joints, near.velocity * shrink, near.acceleration * shrink)
    moves = [only(motion(0), ("lift", "rotate"), held_at(pose, 0.0)) for pose in (0.4, 1.1)]
    moves += [only(motion(0), ("stretch",), close), together]
    random = np.random.default_rng(0)
    recordings = [recorded(f"run_{k}", one, torque_of(one, random, 0.0)) for k, one in enumerate(moves)]
    found = identify_arm(model, recordings, UNKNOWN)
    assert "blade_moment_across" not in found.parameters
    assert found.base.coupling_inertia == pytest.approx(truth(SYMMETRIC)["coupling_inertia"], rel=0.01)
