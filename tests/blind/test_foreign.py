"""The foreign effects against what their definitions say they do."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import pytest

from drivetwin.blind.foreign import FOREIGN_EFFECTS, Axis, Foreign, Influence, Scale
from drivetwin.blind.foreign.chatter import Chatter
from drivetwin.blind.foreign.counterbalance import Counterbalance
from drivetwin.blind.foreign.dropouts import Dropouts
from drivetwin.blind.foreign.fan import Fan
from drivetwin.blind.foreign.jamming import Jamming
from drivetwin.blind.foreign.pulses import Pulses
from drivetwin.blind.foreign.slosh import Slosh
from drivetwin.blind.foreign.tether import Tether
from drivetwin.blind.foreign.wandering_cogging import WanderingCogging
from drivetwin.blind.foreign.wind import Wind

CYCLE = 0.001
SCALE = Scale(torque=0.2, axis_torque=1.0, friction=0.4, room=3.0, acceleration=4.0)


def along(effect: Foreign, position: np.ndarray) -> list[Influence]:
    """What an effect does along positions (n,), a cycle each."""
    velocity = np.gradient(position, CYCLE)
    return [effect.act(Axis(q, v, k * CYCLE, CYCLE)) for k, (q, v) in enumerate(zip(position, velocity, strict=True))]


def pulls(effect: Foreign, position: np.ndarray) -> np.ndarray:
    """Its torques (n,)."""
    return np.array([influence.pull for influence in along(effect, position)])


def time(seconds: float) -> np.ndarray:
    """Of the cycles."""
    return np.arange(round(seconds / CYCLE)) * CYCLE


def random() -> np.random.Generator:
    return np.random.default_rng(1)


STANDING = np.zeros(60000)


@pytest.mark.parametrize("name", FOREIGN_EFFECTS)
def test_it_is_drawn_acts_and_is_the_same_again(name: str) -> None:
    kind = FOREIGN_EFFECTS[name]
    values = kind.drawn(random(), SCALE)
    motion = np.sin(2.0 * pi * 0.7 * time(20.0))

    first, again = (along(kind(values, np.random.default_rng(3)), motion) for _ in range(2))

    assert first == again
    assert kind.name == name
    assert any(influence != Influence() for influence in first)


def test_a_tether_slips_in_a_loop_of_its_own_area() -> None:
    """Work of one cycle of an elastic-plastic spring: 4 torque (amplitude - yield), after the first."""
    tether = Tether({"short": 0.2, "long": 0.7, "torque": 0.3}, random())
    motion = 1.0 * np.sin(2.0 * pi * 0.5 * time(8.0))
    torque = pulls(tether, motion)
    last = slice(4000, 6001)
    work = -float(np.sum(0.5 * (torque[last][1:] + torque[last][:-1]) * np.diff(motion[last])))
    assert work == pytest.approx(4.0 * 0.3 * ((1.0 - 0.2) + (1.0 - 0.7)), rel=0.01)


def test_a_counterbalance_fades_at_rest() -> None:
    balance = Counterbalance({"stiffness": 2.0, "time_constant": 0.8}, random())
    ramp = np.concatenate([np.linspace(0.0, 1.0, 100), np.full(3000, 1.0)])
    torque = pulls(balance, ramp)
    assert torque[150] < -1.6
    assert torque[150 + 800] == pytest.approx(torque[150] / np.e, rel=0.01)


def test_a_fan_swings_in_time_alone() -> None:
    fan = Fan({"amplitude": 0.5, "frequency": 3.0, "phase": 0.2}, random())
    np.testing.assert_allclose(pulls(fan, np.zeros(4000)), 0.5 * np.sin(2.0 * pi * 3.0 * time(4.0) + 0.2), atol=1e-12)


def test_pulses_come_at_random_and_of_either_sign() -> None:
    torque = pulls(Pulses({"height": 1.0, "pause": 0.6, "length": 0.1}, random()), STANDING)
    starts = np.flatnonzero((torque[:-1] == 0.0) & (torque[1:] != 0.0))
    assert len(starts) == pytest.approx(60.0 / 0.7, rel=0.25)
    assert np.std(np.diff(starts)) > 0.5 * np.mean(np.diff(starts)) * 0.6 / 0.7
    assert torque.max() > 0.6 > -0.6 > torque.min()
    assert np.abs(torque).max() <= 1.2


def test_jamming_is_friction_of_two_levels_in_spells() -> None:
    friction = np.array([influence.friction for influence in along(Jamming({"factor": 2.5, "spell": 1.0}, random()), STANDING)])
    assert set(friction) == {1.0, 2.5}
    assert np.mean(friction == 2.5) == pytest.approx(0.5, abs=0.15)
    assert np.count_nonzero(np.diff(friction)) == pytest.approx(60, abs=15)


def test_chatter_is_friction_times_correlated_noise() -> None:
    chatter = Chatter({"size": 0.25, "time_constant": 0.2}, random())
    friction = np.array([influence.friction for influence in along(chatter, STANDING)])
    assert friction.mean() == pytest.approx(1.0, abs=0.05)
    assert friction.std() == pytest.approx(0.25, rel=0.15)
    assert _correlation(friction, 200) == pytest.approx(1.0 / np.e, abs=0.12)


def test_wind_is_a_correlated_torque() -> None:
    torque = pulls(Wind({"torque": 0.7, "time_constant": 0.2}, random()), STANDING)
    assert torque.std() == pytest.approx(0.7, rel=0.15)
    assert _correlation(torque, 200) == pytest.approx(1.0 / np.e, abs=0.12)


def _correlation(values: np.ndarray, lag: int) -> float:
    return float(np.corrcoef(values[:-lag], values[lag:])[0, 1])


def test_sloshing_resonates_at_its_own_frequency() -> None:
    """Steady state of a shaken oscillator: |push| = inertia |a| sqrt(w² + (2 d f)²) w / |w² - f² + 2 i d w f|, f shaken."""
    w, damping = 2.0 * pi * 2.0, 0.05
    for ratio in (0.5, 1.0, 2.0):
        f = ratio * w
        motion = 0.3 * np.sin(f * time(30.0))
        torque = pulls(Slosh({"inertia": 0.4, "frequency": 2.0, "damping_ratio": damping}, random()), motion)
        gain = abs((w**2 + 2j * damping * w * f) / (w**2 - f**2 + 2j * damping * w * f))
        assert np.sqrt(2.0) * np.std(torque[-5000:]) == pytest.approx(0.4 * 0.3 * f**2 * gain, rel=0.05)


def test_cogging_wanders_in_phase_and_keeps_its_amplitude() -> None:
    cogging = WanderingCogging({"amplitude": 0.3, "period": 0.2, "time_constant": 1.0}, random())
    torque = pulls(cogging, np.linspace(0.0, 6.0, 60000))
    fixed = np.exp(2j * pi * np.linspace(0.0, 6.0, 60000) / 0.2)
    assert np.std(torque) == pytest.approx(0.3 / sqrt(2.0), rel=0.1)
    assert abs(np.mean(torque * fixed)) < 0.3 * 0.5 * 0.5  # a ripple that stays would have 0.3 / 2


def test_dropouts_take_torque_for_moments() -> None:
    dropouts = Dropouts({"gain": 0.4, "pause": 0.4, "length": 0.06}, random())
    gain = np.array([influence.gain for influence in along(dropouts, STANDING)])
    assert set(gain) == {0.4, 1.0}
    assert np.mean(gain == 0.4) == pytest.approx(0.06 / 0.46, rel=0.25)
