"""The withheld plants against closed forms, and against MuJoCo's dynamics, which they do not use."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import exp, pi, sqrt

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from drivetwin.blind.case import Cause
from drivetwin.blind.machines import FAMILIES, DrawnMachine, draw_machine
from drivetwin.blind.plants.axis import STIFF
from drivetwin.blind.plants.formulations import withheld_plant
from drivetwin.blind.plants.friction import LUGRE, MAXWELL_SLIP
from drivetwin.blind.plants.rigid import accelerations, rigid_bodies
from drivetwin.blind.plants.withheld import LateEncoders, WithheldPlant
from drivetwin.emulator.drive.servo import SERVO_PERIOD

Array = NDArray[np.float64]
Effect = tuple[str, dict[str, float]]

BOTH = pytest.mark.parametrize("formulation", [LUGRE, MAXWELL_SLIP])


class Drives:
    """Stand in for the loops: motor torque from joint torque, a servo period at a time."""

    def __init__(self, gear: float, law: Callable[[], float]) -> None:
        self.periods = 1
        self.brakes = np.zeros(1, dtype=np.bool_)
        self._gear, self._law = gear, law

    def run(self, period: int, motor_position: Array, motor_torque: Array) -> None:
        motor_torque[0] = self._law() / self._gear


class Bench:
    """One axis of a family and its plant, pushed by a joint torque or held at a speed."""

    def __init__(self, family: str, formulation: int, *causes: Effect, frictionless: bool = False) -> None:
        machine = draw_machine(family, 3)
        self.name, axis = next(iter(machine.axes.items()))
        self.axis = replace(axis, coulomb=1e-9, viscous=0.0) if frictionless else axis
        self.machine = DrawnMachine(machine.family, machine.model, {self.name: self.axis})
        self.plant: WithheldPlant = withheld_plant(
            self.machine, tuple(Cause(effect, self.name, values) for effect, values in causes), formulation, 0
        )
        self.state = self.plant._state[0]

    @property
    def rotor(self) -> float:
        return self.axis.rotor_inertia * self.axis.gear_ratio**2

    def push(self, law: Callable[[], float], seconds: float) -> Array:
        """Motor and joint positions (n, 2) under a torque law."""
        drives = Drives(self.axis.gear_ratio, law)
        track = []
        for _ in range(round(seconds / SERVO_PERIOD)):
            self.plant.advance(drives)  # type: ignore[arg-type]
            track.append((float(self.state["motor_position"]), float(self.state["position"])))
        return np.array(track)

    def torque_at(self, speed: float, seconds: float = 0.3) -> tuple[float, float]:
        """Mean speed and torque of the last fifth of `seconds` at a speed that a PI loop holds."""
        gain, integral, seen = 0.1 * self.axis.inertia / SERVO_PERIOD, 0.0, []

        def law() -> float:
            nonlocal integral
            error = speed - float(self.state["motor_velocity"])
            integral += gain * error * SERVO_PERIOD / 0.004
            seen.append((float(self.state["velocity"]), gain * error + integral))
            return gain * error + integral

        self.push(law, seconds)
        return tuple(np.mean(seen[-len(seen) // 5 :], axis=0))


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("loaded", [False, True])
def test_the_closed_form_accelerates_as_mujoco_does(family: str, loaded: bool) -> None:
    for seed in range(3):
        machine = draw_machine(family, seed)
        spec = mujoco.MjSpec.from_string(machine.model)
        names = list(machine.axes)
        if loaded:
            off_axis = (0.0, 0.0, 0.0) if machine.axes[names[-1]].slide else (0.2, 0.05, -0.1)
            body = spec.joint(names[-1]).parent.add_body(pos=off_axis)
            body.add_geom(size=(0.01, 0.0, 0.0), mass=1.3)
        model = spec.compile()
        model.dof_frictionloss[:] = 0.0
        model.dof_damping[:] = 0.0
        bodies, data = rigid_bodies(model), mujoco.MjData(model)
        random = np.random.default_rng(seed)
        for _ in range(20):
            position, velocity, torque = random.normal(size=(3, model.nv))
            data.qpos[:], data.qvel[:], data.qfrc_applied[:] = position, velocity, torque
            mujoco.mj_forward(model, data)
            found = np.empty(model.nv)
            accelerations(bodies.inertia, bodies.swing, bodies.weight, bodies.outer, position, velocity, torque, found)
            np.testing.assert_allclose(found, data.qacc, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("share", [0.01, 0.03, 0.2, 0.8])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_lugre_slides_on_its_stribeck_curve(share: float, direction: float) -> None:
    axis = draw_machine("turntable", 3).axes["table"]
    static, slow = 1.7 * axis.coulomb, 0.03 * axis.max_speed
    curve = {"static_torque": static, "stribeck_velocity": slow, "exponent": 2.0}
    bench = Bench("turntable", LUGRE, ("stribeck", curve))

    speed, torque = bench.torque_at(direction * share * axis.max_speed)

    shape = exp(-((speed / slow) ** 2))
    expected = direction * (axis.coulomb + (static - axis.coulomb) * shape) + axis.viscous * speed
    assert speed == pytest.approx(direction * share * axis.max_speed, rel=1e-3)
    assert torque == pytest.approx(expected, rel=2e-3)


@BOTH
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_sliding_costs_coulomb_asymmetry_and_viscous_friction(formulation: int, direction: float) -> None:
    axis = draw_machine("turntable", 3).axes["table"]
    coulomb, viscous = {"asymmetry": 0.3 * axis.coulomb}, {"asymmetry": 0.4 * axis.viscous}
    bench = Bench("turntable", formulation, ("coulomb_asymmetry", coulomb), ("viscous_asymmetry", viscous))

    speed, torque = bench.torque_at(direction * 0.5 * axis.max_speed)

    slope = axis.viscous + direction * 0.4 * axis.viscous
    assert torque == pytest.approx(direction * axis.coulomb + 0.3 * axis.coulomb + slope * speed, rel=2e-3)


@BOTH
def test_below_breakaway_it_gives_way_by_less_than_an_engineer_could_see(formulation: int) -> None:
    bench = Bench("turntable", formulation)

    track = bench.push(lambda: 0.8 * bench.axis.coulomb, 1.0)

    start = bench.axis.power_on_position
    assert 0.0 < track[-1, 1] - start < 4.0 * STIFF * bench.axis.room
    assert abs(track[-1, 1] - track[len(track) // 2, 1]) < 1e-2 * STIFF * bench.axis.room


@BOTH
def test_friction_that_is_meant_to_give_way_has_the_stiffness_that_was_asked(formulation: int) -> None:
    axis = draw_machine("turntable", 3).axes["table"]
    stiffness = axis.coulomb / (0.005 * axis.room)
    bench = Bench("turntable", formulation, ("presliding", {"stiffness": stiffness, "damping": 5.0}))

    track = bench.push(lambda: 0.01 * axis.coulomb, 6.0)

    assert track[-1, 1] - track[0, 1] == pytest.approx(0.01 * axis.coulomb / stiffness, rel=0.16)


@BOTH
def test_an_elastic_axis_swings_at_the_frequency_of_two_masses(formulation: int) -> None:
    bench = Bench("turntable", formulation, ("elasticity", {"stiffness": 900.0, "damping": 0.0}), frictionless=True)
    links = bench.axis.inertia - bench.rotor
    bench.plant._axes["hardening"] = 0.0
    bench.state["motor_velocity"] = 0.01

    track = bench.push(lambda: 0.0, 2.0)

    twist = track[:, 0] - track[:, 1]
    rises = np.flatnonzero((twist[:-1] < 0.0) & (twist[1:] >= 0.0))
    period = (rises[-1] - rises[0]) / (len(rises) - 1) * SERVO_PERIOD
    assert 1.0 / period == pytest.approx(sqrt(900.0 * (1.0 / bench.rotor + 1.0 / links)) / (2.0 * pi), rel=2e-3)


@BOTH
def test_backlash_is_lost_motion_of_its_gap(formulation: int) -> None:
    gap, stiffness = 0.02, 5000.0
    bench = Bench("turntable", formulation, ("backlash", {"gap": gap, "stiffness": stiffness, "damping": 3.0}))
    small = 0.3 * bench.axis.coulomb

    there = bench.push(lambda: small - 3.0 * float(bench.state["motor_velocity"]), 1.0)[-1]
    back = bench.push(lambda: -small - 3.0 * float(bench.state["motor_velocity"]), 1.0)[-1]

    assert there[1] == pytest.approx(back[1], abs=1e-4)
    assert there[0] - back[0] == pytest.approx(gap + 2.0 * small / stiffness, rel=1e-2)


@BOTH
def test_a_transmission_error_is_the_sine_between_motor_and_joint(formulation: int) -> None:
    amplitude, order, phase = 4e-4, 2.0, 0.7
    values = {"amplitude": amplitude, "order": order, "phase": phase}
    bench = Bench("turntable", formulation, ("transmission_error", values), frictionless=True)
    bench.state["motor_velocity"] = bench.state["velocity"] = 0.02

    track = bench.push(lambda: 0.0, 4.0)

    error = track[:, 1] - track[:, 0]
    expected = amplitude * np.sin(order * bench.axis.gear_ratio * track[:, 0] + phase)
    assert np.ptp(track[:, 0]) * order * bench.axis.gear_ratio > 2.0 * pi
    np.testing.assert_allclose(error, expected, atol=0.1 * amplitude)


@BOTH
def test_gravity_spring_and_offset_pull_as_their_formulae_say(formulation: int) -> None:
    effects = (
        ("gravity", {"moment": 2.0, "angle": 0.4}),
        ("spring", {"stiffness": 0.7, "rest": 0.1}),
        ("torque_offset", {"offset": 0.3}),
        ("torque_constant", {"error": 0.2}),
        ("inertia", {"difference": 0.05}),
    )
    bench = Bench("turntable", formulation, *effects, frictionless=True)
    start = float(bench.state["position"])

    track = bench.push(lambda: 0.9, 0.05)

    inertia = bench.axis.inertia + 0.05
    acceleration = (1.2 * 0.9 + 0.3 - 2.0 * np.sin(start - 0.4) - 0.7 * (start - 0.1)) / inertia
    assert track[-1, 1] - start == pytest.approx(0.5 * acceleration * 0.05**2, rel=5e-3)


@BOTH
def test_a_saturated_motor_pushes_by_the_root_of_a_cubic(formulation: int) -> None:
    """x + x³ / 0.5² = 0.9, by numpy's companion matrix."""
    bench = Bench("turntable", formulation, ("magnetic_saturation", {"knee": 0.5}), frictionless=True)
    start = float(bench.state["position"])

    track = bench.push(lambda: 0.9, 0.05)

    roots = np.roots([4.0, 0.0, 1.0, -0.9])
    shaft = float(roots[np.abs(roots.imag) < 1e-9].real[0])
    assert track[-1, 1] - start == pytest.approx(0.5 * shaft / bench.axis.inertia * 0.05**2, rel=5e-3)


@BOTH
def test_an_eccentric_disc_reads_its_eccentricity(formulation: int) -> None:
    amplitude = 2e-4
    bench = Bench("turntable", formulation, ("encoder_eccentricity", {"amplitude": amplitude, "phase": 0.3}))
    gear = bench.axis.gear_ratio
    errors = []
    for angle in np.linspace(0.0, 2.0 * pi, 200):
        bench.state["motor_position"] = angle / gear
        bench.plant._read()
        errors.append(float(bench.plant.motor_position[0]) - angle - amplitude * gear * np.sin(angle + 0.3))
    assert np.abs(errors).max() < (amplitude * gear) ** 2


@BOTH
@pytest.mark.parametrize("delay", [0.0, 0.0007, 0.003])
def test_a_late_encoder_reads_a_ramp_late(formulation: int, delay: float) -> None:
    encoders = LateEncoders(np.array([delay]), formulation)
    for period in range(200):
        reading = encoders.read(np.array([3.0 * period * SERVO_PERIOD]))
    expected = 3.0 * (199 * SERVO_PERIOD - delay)
    assert float(reading[0]) == pytest.approx(expected, abs=3.0 * SERVO_PERIOD / 2.0)


@BOTH
def test_friction_that_warms_up_falls_from_cold_to_one(formulation: int) -> None:
    bench = Bench("turntable", formulation, ("temperature_drift", {"cold": 0.8, "time_constant": 3.0}))
    speed = 0.3 * bench.axis.max_speed
    warm = bench.axis.coulomb + bench.axis.viscous * speed

    first = bench.torque_at(speed)[1]
    bench.plant._time = 60.0
    last = bench.torque_at(speed)[1]

    assert first == pytest.approx(warm * exp(np.log(1.8) * exp(-0.27 / 3.0)), rel=0.02)
    assert last == pytest.approx(warm, rel=2e-3)


@BOTH
def test_friction_by_load_and_by_position(formulation: int) -> None:
    values = {"amplitude": 0.0, "period": 1.0, "phase": 0.0}
    bench = Bench("turntable", formulation, ("load_friction", {"coefficient": 0.2}), ("position_friction", values))
    speed, torque = bench.torque_at(0.4 * bench.axis.max_speed)
    expected = (bench.axis.coulomb + bench.axis.viscous * speed) / (1.0 - 0.2)
    assert torque == pytest.approx(expected, rel=5e-3)
