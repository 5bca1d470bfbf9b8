"""What is drawn for a blind test: how many of each, and effects of a size that matters."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from drivetwin.blind import draw, record
from drivetwin.blind.case import FOREIGN, Case
from drivetwin.blind.draw import draw_cases
from drivetwin.blind.foreign import FOREIGN_EFFECTS
from drivetwin.blind.levels import levels_of
from drivetwin.blind.machines import draw_machine, off
from drivetwin.blind.motions import draw_plans
from drivetwin.blind.record import record_case
from drivetwin.blind.sizes import draw_cause, suits
from drivetwin.emulator.effects import library
from drivetwin.motion.filtering import derivative, zero_phase
from drivetwin.motion.inverse_dynamics import load_model
from drivetwin.recording.reader import find_recordings, read_recording


@pytest.fixture(scope="module")
def cases() -> tuple[Case, ...]:
    return draw_cases(300, 7)


def test_three_hundred_cases_have_the_kinds_that_were_promised(cases: tuple[Case, ...]) -> None:
    assert Counter(case.kind for case in cases) == {"clean": 50, "foreign": 50, "double": 40, "single": 160}
    assert {case.kind: len(case.causes) for case in cases} == {"clean": 0, "foreign": 1, "double": 2, "single": 1}


def test_single_effects_are_balanced_over_the_library(cases: tuple[Case, ...]) -> None:
    effects = Counter(case.causes[0].effect for case in cases if case.kind == "single")
    assert set(effects) == set(library()) - {"belt_elasticity", "residual_table"}
    assert max(effects.values()) - min(effects.values()) <= 1


def test_foreign_effects_are_balanced_and_none_is_in_the_library(cases: tuple[Case, ...]) -> None:
    effects = Counter(case.causes[0].effect for case in cases if case.kind == "foreign")
    assert set(effects) == {FOREIGN + name for name in FOREIGN_EFFECTS}
    assert len(effects) >= 8
    assert max(effects.values()) - min(effects.values()) <= 1
    assert not set(FOREIGN_EFFECTS) & set(library())


def test_pairs_are_two_effects_that_nobody_mistakes_for_one(cases: tuple[Case, ...]) -> None:
    for case in cases:
        if case.kind == "double":
            first, second = (library()[cause.effect] for cause in case.causes)
            assert first is not second
            assert first.family != second.family or case.causes[0].axis != case.causes[1].axis
            assert not first.looks & second.looks
            assert not first.stops | second.stops


def test_every_effect_that_is_drawn_says_what_it_looks_like() -> None:
    assert {name for name, kind in library().items() if not kind.looks} == {"belt_elasticity", "residual_table"}


@pytest.mark.parametrize(
    ("effect", "family", "axes"),
    [
        ("payload", "turntable", []),
        ("payload", "stage", []),
        ("payload", "lift", ["lift"]),
        ("payload", "elbow", ["elbow"]),
        ("coupling", "arm", []),
        ("coupling", "elbow", ["elbow"]),
        ("gravity", "arm", ["shoulder"]),
        ("gravity", "turntable", []),
        ("gravity", "stage", []),
        ("coulomb", "elbow", ["base", "elbow"]),
    ],
)
def test_an_effect_is_drawn_where_it_makes_sense_and_is_not_another(effect: str, family: str, axes: list[str]) -> None:
    machine = draw_machine(family, 3)
    assert [axis for axis in machine.axes if suits(effect, machine, axis)] == axes


def test_no_axis_has_a_spring_and_a_dead_time_that_trip_its_drive_before_anything_is_recorded(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of as many pairs as four blind tests of 300 cases have; nothing else is drawn."""
    monkeypatch.setattr(draw, "SHARES", {"clean": 0.0, "foreign": 0.0, "double": 1.0, "single": 0.0})
    pairs = [case.causes for seed in (7, 2026, 2028, 2029) for case in draw_cases(40, seed)]
    together = [{one.effect for one in pair} for pair in pairs if pair[0].axis == pair[1].axis]
    assert any("delay" in effects for effects in together)
    assert {"elasticity", "delay"} not in together


def test_most_machines_have_one_axis_and_every_cause_names_an_axis(cases: tuple[Case, ...]) -> None:
    axes = [list(draw_machine(case.machine, case.seed).axes) for case in cases]
    assert 0.55 < np.mean([len(names) == 1 for names in axes]) < 0.75
    assert all(cause.axis in names for case, names in zip(cases, axes, strict=True) for cause in case.causes)


def test_every_cause_of_the_library_is_one_that_it_accepts(cases: tuple[Case, ...]) -> None:
    for cause in (cause for case in cases for cause in case.causes if case.kind != "foreign"):
        kind = library()[cause.effect]
        bounds = {parameter.name: (parameter.low, parameter.high) for parameter in kind.parameters}
        kind(**cause.parameters)
        for name, value in cause.parameters.items():
            low, high = bounds[name]
            assert low <= value <= high


def test_the_same_seed_draws_the_same_cases_and_another_others() -> None:
    assert draw_cases(12, 5) == draw_cases(12, 5)
    assert [case.seed for case in draw_cases(12, 5)] != [case.seed for case in draw_cases(12, 6)]


@pytest.mark.parametrize("count", [1, 12, 50])
def test_other_counts_keep_the_proportions(count: int) -> None:
    found = Counter(str(case.kind) for case in draw_cases(count, 1))
    assert sum(found.values()) == count
    for kind, share in {"clean": 1 / 6, "foreign": 1 / 6, "double": 2 / 15}.items():
        assert found[kind] == int(share * count + 1e-9)


def test_the_order_tells_nothing(cases: tuple[Case, ...]) -> None:
    assert len({case.kind for case in cases[:20]}) >= 3
    assert [case.number for case in cases] == list(range(300))


def test_a_model_that_is_off_is_off_by_a_few_per_cent_in_everything() -> None:
    ratios = []
    for seed in range(40):
        exact = draw_machine("elbow", seed).compiled()
        changed = mujoco.MjModel.from_xml_string(off(draw_machine("elbow", seed).model, seed))
        for field in ("body_mass", "dof_armature", "dof_frictionloss", "dof_damping"):
            nominal, found = getattr(exact, field), getattr(changed, field)
            ratios.append((found[nominal > 0.0] / nominal[nominal > 0.0]).ravel())
    spread = np.concatenate(ratios) - 1.0
    assert np.abs(spread).max() < 0.0801
    assert np.sqrt(np.mean(spread**2)) == pytest.approx(0.0387, rel=0.1)  # 4 % clipped at two sigma
    assert abs(spread.mean()) < 0.006


@pytest.mark.parametrize("effect", ["coulomb_asymmetry", "inertia"])
def test_an_effect_costs_a_share_of_the_torque_that_an_engineer_would_see(
    effect: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By inverse dynamics of what was recorded: the gap of the nominal model is the effect's torque and the noise."""
    plans = draw_plans(draw_machine("turntable", 11), 11)
    shortest = replace(plans, training=plans.validation, validation=(), fresh=())
    monkeypatch.setattr(record, "draw_plans", lambda *_: shortest)
    axis, machine = "table", draw_machine("turntable", 11)
    nominal = machine.axes[axis]
    cause = draw_cause(np.random.default_rng(0), effect, axis, machine, levels_of(machine, 11))
    record_case(Case(0, 11, "turntable", "single", (cause,), "lugre"), tmp_path)
    model = load_model(tmp_path / "model.xml")
    torque, gap = [], []
    for folder in find_recordings(tmp_path / "training"):
        recording = read_recording(folder)[0]
        period = recording.info.sample_period
        measured = zero_phase(recording.columns[axis]["torque"], period, 48.0)
        position = zero_phase(recording.columns[axis]["position"], period, 48.0)
        velocity = derivative(position, period)
        rigid = model.torques([axis], *(x[:, None] for x in (position, velocity, derivative(velocity, period))))[:, 0]
        expected = rigid + nominal.coulomb * np.sign(velocity) + nominal.viscous * velocity
        moving = np.abs(velocity) > 0.002 * nominal.max_speed
        torque.append(measured[moving])
        gap.append((measured - zero_phase(expected, period, 48.0))[moving])
    share = np.sqrt(np.mean(np.concatenate(gap) ** 2) / np.mean(np.concatenate(torque) ** 2))
    assert 0.06 < share < 0.33
