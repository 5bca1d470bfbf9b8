"""The wide generator's equations against closed forms and against MuJoCo's own dynamics."""

from __future__ import annotations

from math import exp, pi, sqrt

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import ellipk

from drivetwin.blind.case import Cause
from drivetwin.blind.wide.effects import DRIVE, LIBRARY, SENSING, put
from drivetwin.blind.wide.families import draw_family
from drivetwin.blind.wide.friction import ELEMENTS, level, presliding
from drivetwin.blind.wide.machines import AxisLimits, Link, Machine, Nominal
from drivetwin.blind.wide.rigid import rigid_bodies
from drivetwin.blind.wide.simulator import TICK, Demand, Motion, Outside, Run, _unsaturated, move, needed, quiet
from drivetwin.blind.wide.truth import COULOMB, LAWS, LUGRE, PID, TORQUE, Axes, blank

Array = NDArray[np.float64]

LIMIT = AxisLimits(-1.0, 1.0, 1.0, 5.0, 20.0)


def one_axis(*, slide: bool, mass: float, com: float = 0.0, rotor: float = 0.0) -> Machine:
    """A block on a horizontal slide, or a point mass that hangs `com` below a hinge."""
    axis = (1.0, 0.0, 0.0) if slide else (0.0, 1.0, 0.0)
    link = Link("axis", -1, (0.0, 0.0, 0.0), axis, slide, mass, (0.0, 0.0, -com), (1e-6, 1e-6, 1e-6))
    return Machine("test", (link,), (LIMIT,), (Nominal(1.0, 0.1, rotor, 10.0),))


def axes_of(machine: Machine) -> Axes:
    """Records with rotors and gears only, on drives that ask for nothing."""
    axes = blank(len(machine.links))
    axes["law"] = COULOMB
    for axis, known, limit in zip(axes, machine.nominal, machine.limits, strict=True):
        axis["rotor"], axis["gear_ratio"], axis["stiffness"], axis["drive"] = known.rotor, limit.gear_ratio, 1.0, PID
    return axes


def let_go(machine: Machine, axes: Axes, start: list[float], seconds: float, pull: float = 0.0) -> Run:
    """From rest at `start`, pulled by a constant torque [N·m or N] on every joint."""
    count = int(seconds / TICK)
    still = np.tile(start, (count, 1))
    none = np.zeros_like(still)
    outside = Outside(none + pull, none + 1.0, none + 1.0)
    return move(rigid_bodies(machine.xml()), axes, Demand(still, none, none, none), outside, 0.0, np.zeros(len(start)))


def test_spring_and_damper_swing_down_as_the_closed_form_says() -> None:
    machine, mass, stiffness, damping = one_axis(slide=True, mass=2.0, rotor=0.5), 2.5, 400.0, 3.0
    axes = axes_of(machine)
    axes["viscous"], axes["spring"], axes["spring_rest"] = damping, stiffness, 0.1
    run = let_go(machine, axes, [0.0], 3.0)
    time = np.arange(len(run.position)) * TICK
    decay, swing = damping / (2.0 * mass), sqrt(stiffness / mass - (damping / (2.0 * mass)) ** 2)
    expected = 0.1 - 0.1 * np.exp(-decay * time) * (np.cos(swing * time) + decay / swing * np.sin(swing * time))
    assert np.abs(run.position[:, 0] - expected).max() < 0.0002


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_a_pulled_link_in_its_gap_feels_only_its_own_share_of_friction(share: float) -> None:
    """m v' = pull - (1 - share) d v from rest; the motor, which nothing touches, stands."""
    machine, damping, pull = one_axis(slide=True, mass=2.0, rotor=0.5), 3.0, 4.0
    axes = axes_of(machine)
    axes["viscous"], axes["gap"], axes["flank"], axes["motor_friction"] = damping, 10.0, 1e4, share
    run = let_go(machine, axes, [0.0], 0.5, pull)
    time, rate = np.arange(len(run.joint)) * TICK, (1.0 - share) * damping / 2.0
    way = pull / 2.0 * (0.5 * time**2 if rate == 0.0 else (time - (1.0 - np.exp(-rate * time)) / rate) / rate)
    assert np.abs(run.joint[:, 0] - way).max() < 0.002 * way[-1]
    assert np.abs(run.position).max() == 0.0


@pytest.mark.parametrize(
    ("gap", "bears"),
    [
        (0.0, {"elasticity": 14e3}),
        (2e-3, {"flank": 5e4}),
        (4e-3, {"flank": 2.2e7}),
        (1e-3, {"elasticity": 14e3, "flank": 1.4e7}),
    ],
    ids=["spring", "play", "stiff play", "both"],
)
def test_a_hanging_load_begins_where_its_transmission_bears_it(gap: float, bears: dict[str, float]) -> None:
    """Weight over stiffness below its motor, and half a gap; a motor at rest then needs the weight and nothing that swings."""
    link = Link("axis", -1, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), True, 25.0, (0.0, 0.0, 0.0), (1e-6, 1e-6, 1e-6))
    machine = Machine("test", (link,), (LIMIT,), (Nominal(1.0, 0.1, 30.0, 10.0),))
    axes, weight = axes_of(machine), 25.0 * 9.81
    sags = sum(weight / stiffness for stiffness in bears.values())
    axes["gap"] = gap
    for name, stiffness in bears.items():
        axes[name] = stiffness
    still = np.zeros((4000, 1))
    torque = needed(rigid_bodies(machine.xml()), axes, Motion(still, still, still), quiet(*still.shape), 0.0)
    assert np.abs(torque - weight).max() < 1e-3 * weight
    held = Demand(still, still, still, still + weight)
    axes["drive"] = TORQUE
    run = move(rigid_bodies(machine.xml()), axes, held, quiet(*still.shape), 0.0, np.zeros(1))
    assert np.abs(run.joint - run.position + sags + gap / 2.0).max() < 1e-3 * sags


def test_pendulum_swings_with_the_period_of_the_elliptic_integral() -> None:
    mass, length, start = 1.5, 0.4, 1.2
    machine = one_axis(slide=False, mass=mass, com=length, rotor=0.02)
    run = let_go(machine, axes_of(machine), [start], 6.0)
    downwards = np.flatnonzero((run.position[:-1, 0] > 0.0) & (run.position[1:, 0] <= 0.0))
    inertia = mass * length**2 + 1e-6 + 0.02
    period = 4.0 * sqrt(inertia / (mass * 9.81 * length)) * float(ellipk(np.sin(start / 2.0) ** 2))
    assert np.diff(downwards) * TICK == pytest.approx(period, rel=2e-4)


def test_arm_without_friction_keeps_its_energy() -> None:
    machine = draw_family(np.random.default_rng(5), "arm2")
    run = let_go(machine, axes_of(machine), [0.3, -0.4], 2.0)
    model = mujoco.MjModel.from_xml_string(machine.xml())
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data = mujoco.MjData(model)
    energies = []
    for k in range(0, len(run.position), 400):
        data.qpos[:], data.qvel[:] = run.position[k], run.velocity[k]
        mujoco.mj_forward(model, data)
        energies.append(data.energy.copy())
    potential, kinetic = np.array(energies).T
    assert kinetic.max() > 1.0
    assert np.ptp(potential + kinetic) < 0.005 * kinetic.max()


@pytest.mark.parametrize("law", range(len(LAWS)), ids=LAWS)
@pytest.mark.parametrize("velocity", [-0.3, 0.002, 0.02, 0.5])
def test_sliding_costs_what_the_stribeck_curve_says(law: int, velocity: float) -> None:
    axis = blank(1)
    axis["law"], axis["coulomb"], axis["static"], axis["stribeck_velocity"], axis["exponent"] = law, 2.0, 1.0, 0.02, 1.3
    axis["stiffness"], axis["micro_damping"], axis["attraction"] = 2.0 / 1e-4, 5.0, 200.0
    state, after, step = np.zeros(ELEMENTS), np.zeros(ELEMENTS), 1.25e-4
    most = level(axis[0], 0.0, velocity, 0.0, 0.0)
    for _ in range(max(200, int(0.003 / abs(velocity) / step))):
        torque, _ = presliding(axis[0], state, most, velocity, step, after)
        state[:] = after
    expected = (2.0 + 1.0 * exp(-((abs(velocity) / 0.02) ** 1.3))) * np.sign(velocity)
    assert torque == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("law", range(len(LAWS)), ids=LAWS)
def test_friction_that_chatters_costs_its_factor_times_what_it_costs_without(law: int) -> None:
    """A factor that is another one in every period: what sticks for one of them is not damped as if it stuck for long."""
    machine, way, count = one_axis(slide=True, mass=5.0), 1e-3, 4000
    axes = axes_of(machine)
    axes["law"], axes["coulomb"], axes["viscous"], axes["stiffness"] = law, 10.0, 3.0, 10.0 / way
    axes["micro_damping"], axes["attraction"] = 0.3 * sqrt(10.0 / way * 5.0), 200.0
    speed = np.full((count, 1), 0.4)
    motion = Motion(np.cumsum(speed, axis=0) * TICK, speed, np.zeros_like(speed))
    plain = quiet(count, 1)
    factor = np.random.default_rng(0).uniform(0.2, 1.8, (count, 1))
    chatters = Outside(plain.pull, factor, plain.gain)
    constant, chattering = (needed(rigid_bodies(machine.xml()), axes, motion, one, 0.0) for one in (plain, chatters))
    slides = slice(count // 2, None)
    assert constant[slides] == pytest.approx(10.0 + 3.0 * 0.4, rel=0.01)
    assert chattering[slides] == pytest.approx(factor[slides] * constant[slides], rel=1e-6)


@pytest.mark.parametrize("law", range(len(LAWS)), ids=LAWS)
def test_axis_sticks_below_its_friction_and_slides_above(law: int) -> None:
    machine, way = one_axis(slide=True, mass=5.0), 2e-5
    axes = axes_of(machine)
    axes["law"], axes["coulomb"], axes["stiffness"] = law, 10.0, 10.0 / way
    axes["micro_damping"] = 0.3 * sqrt(10.0 / way * 5.0)
    stuck = let_go(machine, axes, [0.0], 1.0, pull=7.0)
    allowed = 20.0 * way if law == LUGRE else 4.0 * way  # LuGre drifts under a load below its friction (Dupont et al. 2002)
    assert np.abs(stuck.position).max() < allowed
    assert np.abs(stuck.velocity[-1]).max() < (1e-4 if law == LUGRE else 1e-6)
    sliding = let_go(machine, axes, [0.0], 1.0, pull=13.0)
    assert sliding.velocity[-1, 0] == pytest.approx(3.0 / 5.0, rel=0.02)


def follow(machine: Machine, axes: Axes, seconds: float = 2.0, bandwidth: float = 20.0) -> tuple[Run, Outside]:
    """Sinusoids on every axis, followed by loops of `bandwidth` [Hz]."""
    n, time = len(machine.links), np.arange(int(seconds / TICK)) * TICK
    bodies = rigid_bodies(machine.xml())
    middle = np.array([(limit.low + limit.high) / 2.0 for limit in machine.limits])
    reach = np.array([0.3 * (limit.high - limit.low) for limit in machine.limits])
    position = middle + reach * np.sin(2.0 * pi * 0.8 * time[:, None] + np.arange(n)) * np.minimum(time[:, None] / 0.5, 1.0)
    velocity = np.gradient(position, TICK, axis=0)
    bodies.data.qpos[:] = middle
    mujoco.mj_forward(bodies.model, bodies.data)
    mujoco.mj_fullM(bodies.model, bodies.data, bodies.mass)
    inertia = np.diag(bodies.mass) + axes["rotor"]
    axes["velocity_gain"] = inertia * 2.0 * pi * bandwidth
    axes["position_gain"] = axes["velocity_gain"] * 2.0 * pi * bandwidth / 5.0
    axes["velocity_lag"], axes["current_lag"] = 3e-4, np.where(axes["current_lag"] > 0.0, axes["current_lag"], 2e-4)
    demand = Demand(position, velocity, np.gradient(velocity, TICK, axis=0), np.zeros_like(position))
    outside = quiet(len(time), n)
    return move(bodies, axes, demand, outside, 0.0, np.zeros(n)), outside


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize("family", ["gantry", "scara", "arm3", "arm6"])
def test_torque_of_a_frictionless_machine_is_mujocos_inverse_dynamics(family: str) -> None:
    machine = draw_family(np.random.default_rng(3), family)
    run, _ = follow(machine, axes_of(machine))
    model = mujoco.MjModel.from_xml_string(machine.xml())
    model.dof_damping[:], model.dof_frictionloss[:] = 0.0, 0.0
    model.jnt_limited[:] = 0
    data = mujoco.MjData(model)
    expected = np.zeros_like(run.given)
    for k in range(len(expected)):
        data.qpos[:], data.qvel[:], data.qacc[:] = run.position[k], run.velocity[k], run.acceleration[k]
        mujoco.mj_inverse(model, data)
        expected[k] = data.qfrc_inverse
    for k in range(len(machine.links)):
        assert rms(run.given[4000:, k] - expected[4000:, k]) < 0.02 * rms(expected[4000:, k])


SIZES: dict[str, dict[str, float]] = {
    "coulomb": {"coulomb": 2.0},
    "viscous": {"viscous": 1.0},
    "coulomb_asymmetry": {"asymmetry": 0.5},
    "viscous_asymmetry": {"asymmetry": 0.1},
    "stribeck": {"static_torque": 2.0, "stribeck_velocity": 0.05, "exponent": 1.2},
    "viscous_nonlinear": {"quadratic": 0.5, "cubic": 0.2},
    "presliding": {"stiffness": 200.0, "damping": 0.5},
    "load_friction": {"coefficient": 0.15},
    "position_friction": {"amplitude": 0.6, "period": 0.5, "phase": 0.4},
    "temperature_drift": {"cold": 0.5, "time_constant": 2.0},
    "inertia": {"difference": 0.1},
    "gravity": {"moment": 1.5, "angle": 0.3},
    "spring": {"stiffness": 3.0, "rest": 0.2},
    "coupling": {"inertia": 0.2, "ratio": -0.5},
    "backlash": {"gap": 0.004, "stiffness": 20000.0, "damping": 10.0},
    "elasticity": {"stiffness": 3000.0, "damping": 3.0, "motor_friction_share": 0.7},
    "transmission_error": {"amplitude": 0.002, "order": 1.0, "phase": 0.3},
    "torque_constant": {"error": 0.1},
    "magnetic_saturation": {"knee": 12.0},
    "torque_offset": {"offset": 0.7},
    "torque_ripple": {"amplitude": 0.7, "order": 2.0, "phase": 1.0},
}
"""One of each effect that a motion needs torque for, on the second axis of an arm; payloads are tested with the model."""


@pytest.mark.parametrize("given", [0.01, -1.0, 7.0, 300.0])
def test_a_saturated_motor_gives_the_root_of_a_cubic(given: float) -> None:
    """x + x³ / 2² = given, by numpy's companion matrix."""
    axes = blank(1)
    axes["saturates_at"] = 2.0
    roots = np.roots([0.25, 0.0, 1.0, -given])
    assert _unsaturated(axes[0], given) == pytest.approx(float(roots[np.abs(roots.imag) < 1e-9].real[0]), rel=1e-9)


@pytest.mark.parametrize("effect", SIZES)
def test_what_a_machine_gives_is_what_its_motion_needs(effect: str) -> None:
    """The simulator forwards and backwards: given torque against the torque that the motion is said to need."""
    machine = draw_family(np.random.default_rng(8), "arm2")
    axes = axes_of(machine)
    axes["law"], axes["coulomb"], axes["viscous"], axes["stiffness"] = LAWS.index("maxwell_slip"), 1.0, 0.2, 1.0 / 2e-3
    axes["micro_damping"] = 0.5
    axes["gear_ratio"] = 20.0
    without = axes.copy()
    put(axes, 1, 0, Cause(effect, "j2", SIZES[effect]))
    run, outside = follow(machine, axes, bandwidth=8.0)
    motion = Motion(run.position, run.velocity, run.acceleration)
    bodies = rigid_bodies(machine.xml())
    told, other = (needed(bodies, one, motion, outside, 0.0)[2000:, 1] for one in (axes, without))
    given = run.given[2000:, 1]
    assert rms(given - told) < 0.005 * rms(given)
    assert rms(given - told) < 0.3 * rms(given - other)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.5, 0.8, 1.0])
def test_play_with_friction_on_both_sides_gives_what_its_motion_needs(share: float) -> None:
    """In the median: single impacts come at other moments forwards and backwards."""
    machine = draw_family(np.random.default_rng(8), "arm2")
    axes = axes_of(machine)
    axes["law"], axes["coulomb"], axes["viscous"], axes["stiffness"] = LAWS.index("maxwell_slip"), 1.0, 0.2, 1.0 / 2e-3
    axes["micro_damping"], axes["gear_ratio"] = 0.5, 20.0
    put(axes, 1, 0, Cause("backlash", "j2", {**SIZES["backlash"], "motor_friction_share": share}))
    run, outside = follow(machine, axes, bandwidth=8.0)
    told = needed(rigid_bodies(machine.xml()), axes, Motion(run.position, run.velocity, run.acceleration), outside, 0.0)
    given = run.given[2000:, 1]
    assert np.median(np.abs(given - told[2000:, 1])) < 0.003 * rms(given)


def test_every_effect_of_the_library_is_tried() -> None:
    assert set(LIBRARY) == set(SIZES) | SENSING | DRIVE | {"payload"}


def test_payload_is_a_point_mass_on_its_body() -> None:
    machine = one_axis(slide=False, mass=1.0, com=0.2)
    model = mujoco.MjModel.from_xml_string(machine.with_payload(0, 0.5, (0.3, 0.0, -0.4)))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mass = np.zeros((1, 1))
    mujoco.mj_fullM(model, data, mass)
    assert mass[0, 0] == pytest.approx(0.2**2 + 1e-6 + 0.5 * (0.3**2 + 0.4**2))
    assert data.qfrc_bias[0] == pytest.approx(-0.5 * 9.81 * 0.3)


def test_encoder_reads_late_and_off_centre() -> None:
    machine = one_axis(slide=True, mass=1.0)
    axes = axes_of(machine)
    axes["delay"], axes["eccentricity"], axes["eccentricity_phase"] = 0.0011, 1e-4, 0.5
    run, _ = follow(machine, axes)
    time = np.arange(len(run.position)) * TICK
    late = np.interp(time - 0.0011, time, run.position[:, 0])
    expected = late + 1e-4 * np.sin(20.0 * late + 0.5)
    assert run.reading[10:, 0] == pytest.approx(expected[10:], abs=1e-12)


def test_drive_clips_and_lags() -> None:
    machine = one_axis(slide=True, mass=1.0)
    axes = axes_of(machine)
    axes["torque_limit"], axes["current_lag"] = 2.0, 0.004
    run, _ = follow(machine, axes)
    assert np.abs(run.asked).max() > 2.5
    assert np.abs(run.given).max() <= 2.0
    kept, given = exp(-TICK / 0.004), np.zeros(len(run.asked))
    for k in range(1, len(given)):
        given[k] = kept * given[k - 1] + (1.0 - kept) * np.clip(run.asked[k - 1, 0], -2.0, 2.0)
    assert run.given[:, 0] == pytest.approx(given, abs=1e-9)


def test_rotors_are_no_part_of_the_rigid_bodies() -> None:
    """MuJoCo keeps what simple joints weigh, rotor included, from when the model is compiled."""
    machine = one_axis(slide=True, mass=2.0, rotor=0.5)
    bodies = rigid_bodies(machine.xml())
    mujoco.mj_forward(bodies.model, bodies.data)
    mujoco.mj_fullM(bodies.model, bodies.data, bodies.mass)
    assert bodies.mass[0, 0] == pytest.approx(2.0)
