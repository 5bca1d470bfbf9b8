"""Friction effects in a plant against closed forms: run-outs, energy, breakaway, hysteresis."""

from __future__ import annotations

import re
from math import cos, exp, pi, sin

import numpy as np
import pytest
from effect_bench import PERIOD, WHOLE, Rig, effect, frequency, hinge, slide, two_axes

from drivetwin.foundation.errors import UserError

SIGNS = [1.0, -1.0]


@pytest.mark.parametrize("sign", SIGNS)
@pytest.mark.parametrize("make", [hinge, slide])
def test_quadratic_friction_runs_out_as_its_differential_equation(make: object, sign: float) -> None:
    """J v' = -k v |v|: v = v0 / (1 + k v0 t / J)."""
    rig = make(effect("viscous_nonlinear", quadratic=0.4))  # type: ignore[operator]
    rig.start(velocity=2.0 * sign)
    rig.run(0.5)
    assert rig.velocity == pytest.approx(sign * 2.0 / (1.0 + 0.4 * 2.0 * 0.5 / WHOLE), rel=1e-3)


def test_cubic_friction_runs_out_as_its_differential_equation() -> None:
    """J v' = -k v³: v = v0 / sqrt(1 + 2 k v0² t / J)."""
    rig = hinge(effect("viscous_nonlinear", quadratic=0.0, cubic=0.3))
    rig.start(velocity=2.0)
    rig.run(0.5)
    assert rig.velocity == pytest.approx(2.0 / np.sqrt(1.0 + 2.0 * 0.3 * 4.0 * 0.5 / WHOLE), rel=1e-3)


def test_friction_that_would_push_at_some_speed_is_refused() -> None:
    with pytest.raises(UserError, match=r"viscous 1, quadratic -2 and cubic 0\.9 together would push"):
        hinge(effect("viscous", viscous=1.0), effect("viscous_nonlinear", quadratic=-2.0, cubic=0.9))
    hinge(effect("viscous", viscous=1.0), effect("viscous_nonlinear", quadratic=-2.0, cubic=1.1))


@pytest.mark.parametrize("way", SIGNS)
def test_a_lift_asks_its_load_and_friction_by_the_efficiency(way: float) -> None:
    """Steady: T = m g +- (coulomb + c T), so T = (m g + coulomb) / (1 - c) up and (m g - coulomb) / (1 + c) down."""
    weight, coulomb, share = 0.2 * 9.81, 0.5, 0.2
    rig = slide(effect("coulomb", coulomb=coulomb), effect("load_friction", coefficient=share), gravity=-9.81)
    torque = (weight + way * coulomb) / (1.0 - way * share)
    rig.start(velocity=0.3 * way)
    rig.run(0.2, torque)
    assert rig.velocity == pytest.approx(0.3 * way, rel=1e-6)
    rig.run(0.2, 1.1 * torque)
    gained = 0.1 * torque * (1.0 - way * share) * 0.2 / WHOLE
    assert rig.velocity == pytest.approx(0.3 * way + gained, rel=1e-3)


POSITION_FRICTION = {"amplitude": 0.6, "period": 0.125, "phase": 0.7}


@pytest.mark.parametrize("position", [0.0, 0.03, 0.09, 0.5, -0.3])
def test_breakaway_varies_with_the_position(position: float) -> None:
    level = 1.0 + 0.6 * sin(2.0 * pi * position / 0.125 + 0.7)
    rig = hinge(effect("coulomb", coulomb=1.0), effect("position_friction", **POSITION_FRICTION))
    rig.start(position)
    rig.run(0.1, 0.98 * level)
    assert abs(rig.position - position) < 1e-6
    rig.run(0.1, 1.05 * level)
    assert rig.position > position + 1e-5


def test_energy_lost_on_the_way_is_the_integral_of_position_friction() -> None:
    rig = hinge(effect("coulomb", coulomb=1.0), effect("position_friction", **POSITION_FRICTION))
    rig.start(velocity=3.0)
    for seconds in (0.01, 0.03, 0.05):
        rig.run(seconds)
        wave = 2.0 * pi / 0.125
        lost = rig.position - 0.6 / wave * (cos(wave * rig.position + 0.7) - cos(0.7))
        assert 0.5 * WHOLE * (9.0 - rig.velocity**2) == pytest.approx(lost, rel=2e-3)


def test_position_friction_beyond_coulomb_is_refused() -> None:
    with pytest.raises(UserError, match=r"position_amplitude 0\.6 is more than coulomb 0\.5: it would push"):
        hinge(effect("coulomb", coulomb=0.5), effect("position_friction", **POSITION_FRICTION))


def test_cold_viscous_friction_runs_out_by_its_time_constant() -> None:
    """J v' = -b (1 + c exp(-t/T)) v: v = v0 exp(-b/J (t + c T (1 - exp(-t/T))))."""
    viscous, cold, time = 0.5, 1.5, 0.2
    rig = hinge(effect("viscous", viscous=viscous), effect("temperature_drift", cold=cold, time_constant=time))
    rig.start(velocity=2.0)
    for _ in range(3):
        rig.run(0.1)
        now = float(rig.data.time)
        grown = now + cold * time * (1.0 - exp(-now / time))
        assert rig.velocity == pytest.approx(2.0 * exp(-viscous / WHOLE * grown), rel=2e-3)


def test_a_cold_axis_holds_more_and_a_warm_one_what_its_law_says() -> None:
    rig = hinge(effect("coulomb", coulomb=1.0), effect("temperature_drift", cold=0.5, time_constant=0.5))
    rig.run(0.05, 1.3)
    assert abs(rig.position) < 1e-6
    rig.run(2.0)
    rig.run(0.05, 1.03)
    assert rig.position > 1e-5


def test_cold_friction_is_asymmetric_as_much_more() -> None:
    """J v' = -(1 + c) asymmetry on a drift so slow that nothing warms, with no other torque in the direction of motion."""
    effects = (effect("coulomb", coulomb=1.0), effect("coulomb_asymmetry", asymmetry=0.4))
    rig = hinge(*effects, effect("temperature_drift", cold=0.5, time_constant=1e6))
    rig.start(velocity=2.0)
    rig.run(0.1)
    assert rig.velocity == pytest.approx(2.0 - 1.5 * 1.4 * 0.1 / WHOLE, rel=1e-3)


STIFFNESS = 2000.0
SHARE = 2.0 * 1.0 / (STIFFNESS * 5.0)
"""Stretch at which the first of four bristles slips under a level of 1 N·m [rad]: levels k/4 (1 + 2 + 3 + 4) shares."""


def bristly(damping: float = 0.0) -> Rig:
    return hinge(effect("coulomb", coulomb=1.0), effect("presliding", stiffness=STIFFNESS, damping=damping))


def test_a_small_push_swings_on_the_bristles() -> None:
    rig = bristly()
    rig.start(velocity=0.5 * SHARE * np.sqrt(STIFFNESS / WHOLE))
    trace = rig.run(0.5)
    assert trace.max() == pytest.approx(0.5 * SHARE, rel=1e-2)
    assert frequency(trace) == pytest.approx(np.sqrt(STIFFNESS / WHOLE) / (2.0 * pi), rel=1e-3)


def test_damping_of_the_bristles_lets_the_swing_decay() -> None:
    damping = 0.5
    rig = bristly(damping)
    rig.start(velocity=0.5 * SHARE * np.sqrt(STIFFNESS / WHOLE))
    trace = np.abs(rig.run(1.0))
    window = round(0.1 / PERIOD)
    assert trace[-window:].max() / trace[:window].max() == pytest.approx(exp(-damping / (2.0 * WHOLE) * 0.9), rel=0.1)


@pytest.mark.parametrize("stretch", [0.9, 2.5, 5.0])
def test_hysteresis_loop_loses_what_the_slipping_elements_lose(stretch: float) -> None:
    """A closed loop between +-X: each element with its limit y < X loses 4 k/4 y (X - y) (Masing)."""
    forces, positions = follow_triangle(bristly(), stretch * SHARE)
    reach = positions.max()
    area = float(np.sum(0.5 * (forces[1:] + forces[:-1]) * np.diff(positions)))
    limits = [i * SHARE for i in (1, 2, 3, 4)]
    lost = sum(STIFFNESS * limit * (reach - limit) for limit in limits if limit < reach)
    assert area == pytest.approx(lost, rel=0.02, abs=0.02 * STIFFNESS * SHARE**2)


def follow_triangle(rig: Rig, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Friction's torque and position over the second slow closed loop between +-reach, by a stiff position loop."""
    periods = 8000
    wave = np.concatenate([np.linspace(0, 1, periods), np.linspace(1, -1, 2 * periods), np.linspace(-1, 0, periods)]) * reach
    stiff, damping = 1e5, 2.0 * np.sqrt(1e5 * WHOLE)
    forces, positions = [], []
    for target in np.concatenate([wave, wave]):
        torque = stiff * (target - rig.position) - damping * rig.velocity
        before = rig.velocity
        positions.append(rig.position)
        rig.step(torque)
        forces.append(torque - WHOLE * (rig.velocity - before) / PERIOD)
    return np.array(forces[-len(wave) :]), np.array(positions[-len(wave) :])


def test_an_oscillating_torque_below_breakaway_does_not_make_it_drift() -> None:
    """Where LuGre drifts (Dupont et al. 2002): 0.6 of breakaway with +-0.2 on top; once shaken down it stays."""
    rig = bristly(damping=1.0)
    step = iter(range(10**6))
    trace = rig.run(10.0, lambda: 0.6 + 0.2 * sin(2.0 * pi * 20.0 * next(step) * PERIOD))
    shaken_down, later = trace[60_000 - 1], trace[80_000 - 1]
    assert abs(later - shaken_down) < 1e-3 * SHARE
    assert 0.0 < later < 4.0 * SHARE


def test_sliding_on_bristles_costs_what_it_did() -> None:
    rig = bristly()
    rig.start(velocity=2.0)
    rig.run(0.2)
    assert rig.velocity == pytest.approx(2.0 - 0.2 / WHOLE, rel=2e-3)


def test_bristles_that_the_time_step_cannot_follow_are_refused() -> None:
    most = WHOLE / PERIOD**2
    with pytest.raises(UserError, match=re.escape(f"step of 0.000125 s follows, {most:.3g} at most")):
        hinge(effect("presliding", stiffness=1.01 * most))


def test_a_brake_holds_an_axis_that_has_bristles() -> None:
    rig = hinge(effect("coulomb", coulomb=1.0), effect("presliding", stiffness=STIFFNESS), brake=5.0)
    rig.mechanism.brakes[0] = True
    rig.run(0.2, 4.0)
    assert abs(rig.position) < 1e-6


def test_friction_of_the_model_itself_stays_where_no_effect_takes_its_place() -> None:
    rig = hinge(joint='frictionloss="1.0" damping="0.5"')
    rig.run(0.1, 0.9)
    assert abs(rig.position) < 1e-6
    rig.start(velocity=2.0)
    rig.run(0.1)
    decay = exp(-0.5 / WHOLE * 0.1)
    assert rig.velocity == pytest.approx(2.0 * decay - 1.0 / 0.5 * (1.0 - decay), rel=1e-3)


def test_cold_nonlinear_friction_is_as_much_more() -> None:
    """J v' = -(1 + c) (k v² + n v³), by small steps of its own."""
    cold = (effect("viscous_nonlinear", quadratic=0.4, cubic=0.2), effect("temperature_drift", cold=0.5, time_constant=1e6))
    rig = hinge(*cold)
    rig.start(velocity=2.0)
    rig.run(0.3)
    speed, short = 2.0, 1e-5
    for _ in range(30_000):
        speed -= 1.5 * (0.4 * speed**2 + 0.2 * speed**3) / WHOLE * short
    assert rig.velocity == pytest.approx(speed, rel=1e-3)


def test_each_axis_has_its_own_brake() -> None:
    """Only the second axis varies, and only its brake is engaged."""
    effects = (effect("coulomb", "second", coulomb=1.0), effect("presliding", "second", stiffness=STIFFNESS))
    rig = Rig(two_axes(), *effects, axes=("axis", "second"), brake=20.0)
    rig.mechanism.brakes[:] = (False, True)
    for _ in range(800):
        rig.mechanism.motor_torque[:] = 5.0 / 50.0
        rig.mechanism.step()
    first, second = rig.mechanism.joint_positions()
    assert first > 0.05
    assert abs(second) < 1e-6
