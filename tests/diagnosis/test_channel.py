"""A torque column that its channel delays, and says so: it is compared with the motion that needed it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from repeats import repeated
from rig_bench import COULOMB, MODEL, PERIOD, as_modelled, moved, recording
from scipy import signal

from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.prepare.channel import step_of, torque_of, unchanged
from drivetwin.diagnosis.report.result import Array, Diagnosis, Verdict
from drivetwin.diagnosis.settings import Settings
from drivetwin.motion.earlier import earlier
from drivetwin.recording.recording import Recording

LATE = 2
"""Samples, 4 ms."""


def told(torque: Array, delay: float | None, bandwidth: float | None) -> Recording:
    found = recording({"turn": torque}, {"turn": np.zeros_like(torque)}, noise=0.0)
    found.info.axes["turn"].torque_delay, found.info.axes["turn"].torque_bandwidth_hz = delay, bandwidth
    found.columns["turn"]["torque"] = torque
    return found


@pytest.mark.parametrize("delay", [-0.0013, 0.0007, 0.0031])
def test_a_delay_is_taken_back_between_samples(delay: float) -> None:
    time, inner = np.arange(500) * PERIOD, slice(20, -20)
    true = np.sin(2.0 * np.pi * 40.0 * time)
    late = np.sin(2.0 * np.pi * 40.0 * (time - delay))
    np.testing.assert_allclose(torque_of(told(late, delay, None), "turn")[inner], true[inner], atol=2e-3)


def test_noise_between_samples_is_as_loud_as_on_them() -> None:
    """Up to 0.8 of half the sample rate, where slow recordings are compared: else noise would say how late a torque is."""
    noise = signal.sosfiltfilt(signal.butter(8, 0.8, output="sos"), np.random.default_rng(5).normal(size=4000))
    assert np.std(earlier(noise, 0.5 * PERIOD, PERIOD)) == pytest.approx(np.std(noise), rel=5e-3)


def test_a_torque_in_steps_says_how_long_it_stays_on_each() -> None:
    torque = np.array([0.0, 0.0, 0.5, 0.5, 0.5, 1.5, 1.0, 1.0])
    np.testing.assert_allclose(unchanged(torque, 0.1), [0.2, 0.2, 0.3, 0.3, 0.3, 0.1, 0.2, 0.2])
    assert step_of(torque) == 0.5
    assert step_of(np.zeros(5)) == 0.0


def test_a_low_pass_is_taken_back_where_it_only_delays() -> None:
    """Of first order at 80 Hz, a torque at 4 Hz: as scipy simulates it."""
    time = np.arange(2000) * PERIOD
    true = np.sin(2.0 * np.pi * 4.0 * time)
    pole = 2.0 * np.pi * 80.0
    late = signal.lsim(([pole], [1.0, pole]), true, time)[1]
    inner = slice(200, -20)
    assert np.max(np.abs(late - true)[inner]) > 0.045
    np.testing.assert_allclose(torque_of(told(late, None, 80.0), "turn")[inner], true[inner], atol=0.003)


def test_without_a_word_the_torque_is_as_recorded() -> None:
    torque = np.random.default_rng(0).standard_normal(100)
    assert torque_of(told(torque, None, None), "turn") is torque


def diagnosed(place: Path, delay: float | None) -> Diagnosis:
    model = place / "column.xml"
    model.write_text(MODEL, encoding="utf-8")
    return diagnose(model, [late(1, "fitted", delay)], [late(2, "held", delay)], Settings(), lambda _stage, _share: None)


def late(seed: int, name: str, delay: float | None) -> Recording:
    both = moved(seed, 10.0)
    shifted = {axis: np.concatenate([np.full(LATE, torque[0]), torque[:-LATE]]) for axis, torque in as_modelled(both).items()}
    found = recording(shifted, {axis: at.position for axis, at in both.items()}, seed, name, noise=1.0)
    for info in found.info.axes.values():
        info.torque_delay = delay
    return found


def test_a_torque_that_is_late_makes_no_gap_whether_it_says_so_or_not(tmp_path: Path) -> None:
    assert diagnosed(tmp_path, LATE * PERIOD).verdict is Verdict.NO_GAP
    found = diagnosed(tmp_path, None)
    assert found.verdict is Verdict.NO_GAP
    assert sorted(found.notes) == [
        f"{axis}: its torque is recorded 4 ms late; read so much earlier" for axis in ("lift", "turn")
    ]


@pytest.mark.parametrize("late", repeated(0.0061, 0.0007, 0.0023, 0.021))
def test_how_late_a_torque_is_is_found_beside_an_effect(late: float, tmp_path: Path) -> None:
    """A carriage with more Coulomb friction and a column that is heavier, torque late by no whole sample."""
    model = tmp_path / "column.xml"
    model.write_text(MODEL, encoding="utf-8")

    def recorded(seed: int, name: str) -> Recording:
        both = moved(seed, 10.0)
        torque = as_modelled(both)
        torque = torque | {"lift": torque["lift"] + 4.0 * np.sign(both["lift"].velocity)}
        shifted = {
            axis: np.interp(np.arange(len(rows)) * PERIOD - late, np.arange(len(rows)) * PERIOD, rows)
            for axis, rows in torque.items()
        }
        return recording(shifted, {axis: at.position for axis, at in both.items()}, seed, name, noise=1.0)

    found = diagnose(model, [recorded(1, "fitted")], [recorded(2, "held")], Settings(), lambda _stage, _share: None)
    assert [(one.effect.name, one.axis) for one in found.selected] == [("coulomb", "lift")]
    (coulomb,) = found.selected
    assert coulomb.effect.coulomb == pytest.approx(COULOMB["lift"] + 4.0, rel=0.01)  # type: ignore[attr-defined]
    told = {note.split(":")[0]: float(note.split("recorded ")[1].split(" ms")[0]) for note in found.notes}
    assert told == {axis: pytest.approx(late * 1e3, abs=0.15) for axis in ("lift", "turn")}
