"""What must not change the answer: unit of torque, clock, names, sample rate, order of recordings, where one is cut."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from plain_bench import COGGING, COULOMB, ORDER, PERIOD, STICKS, Machine
from repeats import repeated
from scipy.interpolate import CubicSpline

from drivetwin.diagnosis.report.result import Array, Diagnosis
from drivetwin.recording.recording import Recording

SECONDS = 15.0


def fitted_of(machine: Machine, begin: float = 0.0) -> list[Recording]:
    """Two of half the time each, the second later than the first."""
    return [
        machine.recording(1, SECONDS / 2.0, "one", begin),
        machine.recording(2, SECONDS / 2.0, "two", begin + SECONDS),
    ]


def held_of(machine: Machine, begin: float = 0.0) -> list[Recording]:
    return [machine.recording(3, SECONDS / 2.0, "three", begin + 2.0 * SECONDS)]


@cache
def answer() -> Diagnosis:
    """To what every other one is held."""
    return Machine().diagnosed(fitted_of(Machine()), held_of(Machine()))


def selected(found: Diagnosis) -> list[str]:
    return sorted(one.effect.name for one in found.selected)


def alike(found: Diagnosis, usual: Diagnosis | None = None) -> None:
    """The same answer, and the same share of the gap closed."""
    usual = usual or answer()
    same_answer(found, usual)
    ((gap, left),) = ((found.axes[axis].gap_rms, found.after_rms[axis]) for axis in found.axes)
    ((usual_gap, usual_left),) = ((usual.axes[axis].gap_rms, usual.after_rms[axis]) for axis in usual.axes)
    assert left / gap == pytest.approx(usual_left / usual_gap, abs=0.05)


def same_answer(found: Diagnosis, usual: Diagnosis) -> None:
    """The same first answer, the same selected effects, and probabilities within 0.15."""
    assert found.verdict == usual.verdict
    assert found.causes[0].effect == usual.causes[0].effect
    assert selected(found) == selected(usual)
    for one in usual.causes:
        if one.probability > 0.2:
            other = max(each.probability for each in found.causes if each.effect == one.effect)
            assert other == pytest.approx(one.probability, abs=0.15), one.effect


def test_the_machine_as_it_is_told_first() -> None:
    """The Stribeck level and the cogging, in their sizes."""
    found = answer()
    assert selected(found) == ["stribeck", "torque_ripple"]
    values = {name: value for one in found.selected for name, value in vars(one.effect).items()}
    assert values["amplitude"] == pytest.approx(COGGING, rel=0.05)
    assert values["order"] == pytest.approx(ORDER, rel=0.01)
    assert values["static_torque"] == pytest.approx(COULOMB + STICKS, rel=0.1)


@dataclass(frozen=True)
class Told:
    """How the machine is told: unit of its torque, beginning of its clock [s], name of its axis."""

    scale: float = 1.0
    begin: float = 0.0
    axis: str = "turn"


@pytest.mark.parametrize(
    "told",
    repeated(
        Told(5e3, 123456.789, "achse_ü"),
        *(Told(scale=scale) for scale in (5e3, 1e-3, 0.37, 20.0)),
        *(Told(begin=begin) for begin in (123456.789, -1e4, 1e6)),
        *(Told(axis=axis) for axis in ("achse_ü", "a", "Joint 7", "unknown", "lift.x")),
    ),
    ids=str,
)
def test_torque_in_another_unit_another_clock_another_name_of_the_axis(told: Told) -> None:
    """All at once; `make test-long` has each alone as well."""
    machine = Machine(torque_scale=told.scale, axis=told.axis)
    found = machine.diagnosed(fitted_of(machine, told.begin), held_of(machine, told.begin))
    alike(found)
    assert found.axes[told.axis].gap_rms == pytest.approx(told.scale * answer().axes["turn"].gap_rms, rel=1e-3)


def test_recordings_in_another_order() -> None:
    alike(Machine().diagnosed(fitted_of(Machine())[::-1], held_of(Machine())))


def test_recordings_given_twice() -> None:
    """They tell nothing new, but neither do they tell anything else."""
    again = [replace(one, name=f"{one.name}-again") for one in fitted_of(Machine())]
    alike(Machine().diagnosed([*fitted_of(Machine()), *again], held_of(Machine())))


def test_recordings_decimated() -> None:
    """Every second sample, as a slower recorder would have taken them."""
    alike(Machine().diagnosed(*(each_second(recordings) for recordings in (fitted_of(Machine()), held_of(Machine())))))


def each_second(recordings: Sequence[Recording]) -> list[Recording]:
    return [at(one, np.asarray(one.time)[::2], 2.0 * PERIOD) for one in recordings]


@pytest.mark.parametrize("period", repeated(0.0041, 0.0031, 0.0052))
def test_recordings_resampled(period: float) -> None:
    """By a cubic spline, as an export to another rate does: it rounds the jumps of friction off, so that more is left."""

    def resampled(recordings: Sequence[Recording]) -> list[Recording]:
        return [at(one, np.arange(one.time[0], one.time[-1], period), period) for one in recordings]

    found = Machine().diagnosed(resampled(fitted_of(Machine())), resampled(held_of(Machine())))
    same_answer(found, answer())
    for one, usual in zip(found.selected, answer().selected, strict=True):
        assert vars(one.effect) == pytest.approx(vars(usual.effect), rel=0.05)


def at(one: Recording, time: Array, period: float) -> Recording:
    """A recording at other instants."""
    columns = {
        axis: {key: np.asarray(CubicSpline(one.time, values)(time)) for key, values in own.items()}
        for axis, own in one.columns.items()
    }
    return replace(one, info=one.info.model_copy(update={"sample_period": period}), time=time, columns=columns)


@pytest.mark.parametrize("share", repeated(0.43, 0.3, 0.7))
def test_a_recording_cut_in_two(share: float) -> None:
    """As if the recorder had been stopped and started again at once."""
    machine = Machine()
    whole = machine.recording(4, SECONDS, "whole")
    held = held_of(machine)
    alike(machine.diagnosed(cut(whole, round(share * SECONDS / PERIOD)), held), _of_whole())


@cache
def _of_whole() -> Diagnosis:
    machine = Machine()
    return machine.diagnosed([machine.recording(4, SECONDS, "whole")], held_of(machine))


def cut(whole: Recording, at: int) -> Sequence[Recording]:
    parts = []
    for number, span in enumerate((slice(0, at), slice(at, None))):
        columns = {axis: {key: values[span] for key, values in one.items()} for axis, one in whole.columns.items()}
        parts.append(replace(whole, name=f"{whole.name}-{number}", time=whole.time[span], columns=columns))
    assert sum(len(part.time) for part in parts) == len(np.asarray(whole.time))
    return parts
