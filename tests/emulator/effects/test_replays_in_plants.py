"""What effects cost together, and in closed forms; each alone is held against its plant in test_conformance.py."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from effect_bench import Array, effect

from drivetwin.emulator.conformance.bench import GEAR, LINK, SAMPLE, Kind, axis, record
from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw, Motion
from drivetwin.emulator.dynamics.replay import motor_torque
from drivetwin.emulator.effects import AxisEffect, DriveEffect, Effect
from drivetwin.emulator.effects.transmission_effect import TransmissionEffect

PLANTS = {
    "stribeck": {"static_torque": 1.1, "stribeck_velocity": 0.2, "exponent": 1.3},
    "presliding": {"stiffness": 60.0, "damping": 0.1},
    "backlash": {"gap": 0.003, "stiffness": 20000.0, "damping": 20.0},
    "elasticity": {"stiffness": 1100.0, "damping": 0.6},
    "transmission_error": {"amplitude": 5e-4, "order": 2.0, "phase": 0.6},
    "delay": {"delay": 0.0026},
    "torque_ripple": {"amplitude": 1.0, "order": 6.0, "phase": 0.3},
    "magnetic_saturation": {"knee": 8.0},
    "inertia": {"difference": 0.1},
    "gravity": {"moment": 2.0, "angle": 0.4},
    "spring": {"stiffness": 4.0, "rest": 0.3},
    "encoder_eccentricity": {"amplitude": 3e-4, "phase": 0.5},
}


def of_axis(found: Effect) -> AxisEffect:
    assert isinstance(found, AxisEffect)
    return found


TOGETHER = {
    "an uneven gear behind a spring": ("transmission_error", "elasticity"),
    "a gap behind a spring": ("elasticity", "backlash"),
    "bristles behind a spring": ("elasticity", "presliding"),
    "a late reading of a spring": ("elasticity", "delay"),
    "stribeck behind a spring": ("stribeck", "elasticity"),
    "a late reading of a motor that cogs": ("torque_ripple", "delay"),
    "a spring on a motor that saturates": ("magnetic_saturation", "elasticity"),
    "a motor that saturates under more inertia": ("inertia", "magnetic_saturation"),
    "a gap under a weight": ("gravity", "backlash"),
    "a weight on a spring": ("gravity", "elasticity"),
    "more inertia before a spring": ("inertia", "elasticity"),
    "a gap under a hose": ("spring", "backlash"),
    "a disc that is not centred, read late": ("encoder_eccentricity", "delay"),
    "a late reading of a disc that is not centred": ("delay", "encoder_eccentricity"),
}


@pytest.mark.parametrize("names", TOGETHER.values(), ids=TOGETHER)
def test_two_effects_cost_what_the_second_adds_to_an_axis_with_the_first(names: tuple[str, str]) -> None:
    assert explained_together("hinge", *names) > 0.99


def test_a_gap_on_a_slide_is_pressed_by_a_weight() -> None:
    assert explained_together("slide", "gravity", "backlash") > 0.99


def explained_together(kind: Kind, *names: str) -> float:
    """Share of the gap's energy of a plant with two effects."""
    first, second = (effect(name, **PLANTS[name]) for name in names)
    both = record(kind, first, second)
    on_first = of_axis(first.effect).predict(both.motion, both.axis)
    left = both.judged(on_first + of_axis(second.effect).predict(both.motion, axis(kind, first)))
    explained = float(1.0 - np.sum((both.gap - left) ** 2) / np.sum(both.gap**2))
    print(f"{' and '.join(names)}: {explained:.4f}")
    return explained


def swing(frequency: float, amplitude: float, seconds: float = 8.0) -> Motion:
    """A sine of a weightless axis, started from rest by a slow rise."""
    time = np.arange(round(seconds / SAMPLE), dtype=np.float64) * SAMPLE
    turn = 2.0 * pi * frequency
    rise = np.clip(time / 3.0, 0.0, 1.0)
    envelope = amplitude * rise**3 * (10.0 - 15.0 * rise + 6.0 * rise**2)
    position = envelope * np.sin(turn * time)
    velocity = np.gradient(position, SAMPLE)
    acceleration = np.gradient(velocity, SAMPLE)
    inertia = np.full_like(time, 0.25)
    return Motion(position, velocity, acceleration, np.zeros_like(time), time, inertia * acceleration, inertia, 0.05)


@pytest.mark.parametrize("frequency", [2.0, 8.0, 15.0, 30.0])
def test_a_link_on_a_spring_weighs_by_its_resonance(frequency: float) -> None:
    """Without friction: J_l a / (1 - (f/f0)²) through the spring instead of J_l a; f0 = 20 Hz. With little damping."""
    stiffness = LINK * (2.0 * pi * 20.0) ** 2
    motion = swing(frequency, 0.05)
    cost = of_axis(effect("elasticity", stiffness=stiffness, damping=0.5).effect).predict(motion, AxisDynamics(GEAR))
    weighs = 1.0 / (1.0 - (frequency / 20.0) ** 2) - 1.0
    steady = slice(5000, 7900)
    moved = motion.acceleration[steady]
    fitted = float(cost[steady] @ moved) / float(moved @ moved)
    assert fitted == pytest.approx(LINK * weighs, rel=0.03)


def test_a_spring_too_stiff_to_follow_is_rigid() -> None:
    motion = swing(3.0, 0.2)
    stiff = effect("backlash", gap=0.0, stiffness=1e9, damping=0.0).effect
    assert np.abs(of_axis(stiff).predict(motion, AxisDynamics(GEAR))[100:-100]).max() < 1e-2 * np.abs(motion.rigid_torque).max()


def test_a_link_that_its_brake_like_friction_holds_stays_where_it_is() -> None:
    """A motor that swings within the breakaway of its load turns against a spring on a wall."""
    motion = swing(2.0, 0.01)
    motion = replace(motion, torque=1000.0 * motion.position + 0.05 * motion.acceleration)
    stuck = AxisDynamics(GEAR, friction=FrictionLaw(coulomb=50.0))
    spring = of_axis(effect("elasticity", stiffness=1000.0).effect)
    torque = spring.predict(motion, stuck) + motor_torque(motion, stuck)
    assert torque == pytest.approx(motion.torque, abs=1e-7)


def asked(seconds: float = 4.0) -> Array:
    time = np.arange(round(seconds / SAMPLE), dtype=np.float64) * SAMPLE
    return np.asarray(3.0 * np.sin(2.0 * pi * 3.0 * time) + 1.5 * np.sin(2.0 * pi * 11.0 * time))


def test_a_slow_current_loop_answers_as_its_differential_equation() -> None:
    """Against the servo's own filter at 125 us, and -3 dB at its bandwidth."""
    fine = np.interp(np.arange(32000, dtype=np.float64) * 125e-6, np.arange(4000) * SAMPLE, asked())
    given, share = np.empty_like(fine), 1.0 - np.exp(-2.0 * pi * 20.0 * 125e-6)
    now = fine[0]
    for k, torque in enumerate(fine):
        now += share * (torque - now)
        given[k] = now
    slow = effect("current_bandwidth", bandwidth=20.0).effect
    assert isinstance(slow, DriveEffect)
    left = slow.respond(asked(), SAMPLE) - given[::8]
    assert np.sqrt(np.mean(left**2)) < 0.02 * np.sqrt(np.mean(asked() ** 2))
    tone = np.sin(2.0 * pi * 20.0 * np.arange(4000, dtype=np.float64) * SAMPLE)
    assert np.abs(slow.respond(tone, SAMPLE)[2000:]).max() == pytest.approx(1.0 / np.sqrt(2.0), rel=0.01)


@pytest.mark.parametrize("frequency", [2.0, 8.0, 30.0])
def test_a_second_encoder_sees_a_spring_give_by_what_the_link_weighs(frequency: float) -> None:
    """q - m = m (1 / (1 - (f/f0)²) - 1) of a link without friction; f0 = 20 Hz."""
    motion = swing(frequency, 0.05)
    spring = of_axis(effect("elasticity", stiffness=LINK * (2.0 * pi * 20.0) ** 2, damping=0.5).effect)
    ahead = spring.deflect(motion, AxisDynamics(GEAR))
    assert ahead is not None
    steady = slice(5000, 7900)
    moved = motion.position[steady]
    further = float(ahead[steady] @ moved) / float(moved @ moved)
    assert further == pytest.approx(1.0 / (1.0 - (frequency / 20.0) ** 2) - 1.0, rel=0.03)


def test_a_second_encoder_sees_half_the_play_behind_friction_and_all_of_an_uneven_gear() -> None:
    """A link that friction brakes lags by half the gap and what the flank gives; q = m + e(m) on a rigid gear."""
    motion, braked = swing(0.5, 0.2), AxisDynamics(GEAR, friction=FrictionLaw(coulomb=3.0))
    ahead = of_axis(effect("backlash", gap=0.002, stiffness=20000.0, damping=50.0).effect).deflect(motion, braked)
    quick = np.abs(motion.velocity) > 0.3
    assert ahead is not None
    assert ahead[quick] == pytest.approx(-np.sign(motion.velocity[quick]) * (0.001 + 3.0 / 20000.0), rel=0.15)
    uneven = of_axis(effect("transmission_error", amplitude=5e-4, order=2.0, phase=0.6).effect)
    assert uneven.deflect(motion, braked) == pytest.approx(5e-4 * np.sin(2.0 * GEAR * motion.position + 0.6), abs=1e-12)


def test_a_second_encoder_sees_what_the_first_one_misreads() -> None:
    """Reading = m + a sin(gear m + phase), and reading(t) = m(t - delay), both on a rigid gear: the joint is where m is."""
    motion, rigid = swing(0.5, 0.2), AxisDynamics(GEAR)
    ahead = of_axis(effect("encoder_eccentricity", amplitude=1e-4, phase=0.4).effect).deflect(motion, rigid)
    assert ahead is not None
    true = motion.position + ahead
    assert true + 1e-4 * np.sin(GEAR * true + 0.4) == pytest.approx(motion.position, abs=1e-12)
    late = of_axis(effect("delay", delay=3.0 * SAMPLE).effect).deflect(motion, rigid)
    assert late is not None
    assert late[:-3] == pytest.approx(motion.position[3:] - motion.position[:-3], abs=1e-12)


@pytest.mark.parametrize(
    ("name", "stiffness", "damping", "level"),
    [("elasticity", 1100.0, 10.0, 3.0), ("elasticity", 20.0, 0.2, 0.3), ("backlash", 20000.0, 20.0, 3.0)],
)
def test_a_stretch_of_a_motion_is_replayed_as_the_whole_is(name: str, stiffness: float, damping: float, level: float) -> None:
    """The joint of a motion that is cut in its middle is where the measured torque has wound up its spring.

    A soft one still rings from the last reversal on.
    """
    motion, braked = swing(1.0, 0.2), AxisDynamics(GEAR, friction=FrictionLaw(coulomb=level, viscous=0.1 * level))
    kind = of_axis(effect(name, **PLANTS[name] | {"stiffness": stiffness, "damping": damping}).effect)
    assert isinstance(kind, TransmissionEffect)
    motion = replace(motion, torque=motor_torque(motion, kind.on(braked)))
    cut = slice(5120, 7500)
    samples = ("position", "velocity", "acceleration", "torque", "time", "rigid_torque", "inertia")
    stretch = replace(motion, **{field: getattr(motion, field)[cut] for field in samples})
    assert abs(stretch.velocity[0]) > 0.3
    for whole, part in ((kind.predict(motion, braked), kind.predict(stretch, braked)),
                        (kind.deflect(motion, braked), kind.deflect(stretch, braked))):  # fmt: skip
        assert whole is not None
        assert part is not None
        assert np.abs(part - whole[cut])[20:].max() < 0.12 * np.abs(whole).max()


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_load_that_rests_at_first_lies_on_the_flank_that_the_first_torque_shows(way: float) -> None:
    """Two strokes, there and on or back; the stretch begins in the rest between them."""
    time = np.arange(round(2.5 / SAMPLE), dtype=np.float64) * SAMPLE
    first, second = (np.clip(time - begin, 0.0, 1.0) for begin in (0.1, 1.4))
    position = 0.2 * (smooth(first) + way * smooth(second))
    velocity = np.gradient(position, SAMPLE)
    acceleration = np.gradient(velocity, SAMPLE)
    inertia = np.full_like(time, 0.25)
    still = Motion(position, velocity, acceleration, np.zeros_like(time), time, inertia * acceleration, inertia, 0.05)
    braked = AxisDynamics(GEAR, friction=FrictionLaw(coulomb=3.0, viscous=0.3))
    play = of_axis(effect("backlash", **PLANTS["backlash"]).effect)
    assert isinstance(play, TransmissionEffect)
    torque = motor_torque(still, play.on(braked))
    cut = slice(1250, 2500)
    whole = replace(still, torque=torque)
    samples = ("position", "velocity", "acceleration", "torque", "time", "rigid_torque", "inertia")
    stretch = replace(whole, **{name: getattr(whole, name)[cut] for name in samples})
    assert np.abs(motor_torque(stretch, play.on(braked)) - torque[cut]).max() < 0.05 * np.abs(torque).max()


def smooth(share: Array) -> Array:
    """From 0 to 1 with the least jerk."""
    return np.asarray(share**3 * (10.0 - 15.0 * share + 6.0 * share**2))
