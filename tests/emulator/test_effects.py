"""The effects/1 reader, the library, and each effect's prediction against its formula."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from plant_bench import placed

from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw, Motion
from drivetwin.emulator.effects import PlacedEffect, StaticEffect, library, read_effects
from drivetwin.emulator.machine import available_machines, load_machine
from drivetwin.emulator.plant import Plant
from drivetwin.foundation.errors import UserError

CONTRACT = {
    "schema": "effects/1",
    "effects": [
        {
            "effect": "stribeck",
            "axis": "rotate",
            "parameters": {
                "static_torque": {"value": 1.3, "unit": "N·m"},
                "stribeck_velocity": {"value": 0.05, "unit": "rad/s"},
                "exponent": {"value": 2.0, "unit": "1"},
            },
        }
    ],
}


def one(effect: str, axis: str = "rotate", **values: tuple[object, str]) -> dict[str, object]:
    """A file with one effect; parameters as (value, unit)."""
    parameters = {name: {"value": value, "unit": unit} for name, (value, unit) in values.items()}
    return {"schema": "effects/1", "effects": [{"effect": effect, "axis": axis, "parameters": parameters}]}


def read(tmp_path: Path, content: object) -> tuple[PlacedEffect, ...]:
    path = tmp_path / "effects.json"
    path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return read_effects(path)


def test_the_contracts_example(tmp_path: Path) -> None:
    (found,) = read(tmp_path, CONTRACT)
    assert found.axis == "rotate"
    assert found.effect == placed("rotate", "stribeck", static_torque=1.3, stribeck_velocity=0.05, exponent=2.0).effect


def test_exponent_is_gaussian_where_it_is_not_given(tmp_path: Path) -> None:
    content = one("stribeck", static_torque=(1.3, "N·m"), stribeck_velocity=(0.05, "rad/s"))
    assert read(tmp_path, content)[0].effect == placed("rotate", "stribeck", static_torque=1.3, stribeck_velocity=0.05).effect


def ripples(*orders: float) -> dict[str, object]:
    """Several orders of cogging on one axis."""
    values = [{"amplitude": (0.1, "N·m"), "order": (order, "1"), "phase": (0.0, "rad")} for order in orders]
    return {"schema": "effects/1", "effects": [each for one_of in values for each in one("torque_ripple", **one_of)["effects"]]}  # type: ignore[attr-defined,arg-type]


def test_an_axis_may_have_several_orders_of_cogging(tmp_path: Path) -> None:
    found = read(tmp_path, ripples(6.0, 0.5))
    assert [(each.axis, vars(each.effect)["order"]) for each in found] == [("rotate", 6.0), ("rotate", 0.5)]


def test_only_effects_that_may_stand_several_times_say_so() -> None:
    assert {name for name, kind in library().items() if kind.several} == {"torque_ripple"}


def test_an_order_below_half_a_wave_a_turn_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"order = 0\.4 is outside 0\.5"):
        read(tmp_path, ripples(0.4))


@pytest.mark.parametrize("name", available_machines())
def test_the_machines_own_files(name: str) -> None:
    machine = load_machine(name)
    Plant(machine, read_effects(machine.effects_path))


REFUSED = [
    (one("squeak"), r"effects\[0\]: unknown effect 'squeak'; the library has backlash, belt_elasticity, coulomb, "),
    (one("coulomb", coulmb=(1, "N·m")), r"effects\[0\]: coulomb has no parameter 'coulmb'; it has coulomb"),
    (one("coulomb"), r"effects\[0\]: coulomb needs coulomb"),
    (one("stribeck", static_torque=(1, "N·m")), r"effects\[0\]: stribeck needs stribeck_velocity$"),
    (one("coulomb", coulomb=(-0.1, "N·m")), r"effects\[0\]: coulomb = -0.1 is outside 0.0 .. inf"),
    (
        one("stribeck", static_torque=(1, "N·m"), stribeck_velocity=(1, "rad/s"), exponent=(9, "1")),
        r"effects\[0\]: exponent = 9.0 is outside 0.3 .. 4.0",
    ),
    ('{"schema": "effects/1", "effects": [', "is not JSON"),
    ({**CONTRACT, "schema": "effects/2"}, r"schema: Input should be 'effects/1' \(expected format effects/1\)"),
    ({"effects": []}, "schema: Field required"),
    ({"schema": "effects/1"}, "effects: Field required"),
    ([], r"effects.json: Input should be .* \(expected format effects/1\)"),
    (one("coulomb", coulomb=("much", "N·m")), "effects.0.parameters.coulomb.value: Input should be a valid number"),
    ({"schema": "effects/1", "effects": [{"effect": "coulomb", "parameters": {}}]}, "effects.0.axis: Field required"),
    (one("coulomb_asymmetry", asymmetry=(float("inf"), "N·m")), "asymmetry.value: Input should be a finite number"),
    (one("coulomb_asymmetry", asymmetry=(float("nan"), "N·m")), "asymmetry.value: Input should be a finite number"),
    (
        {"schema": "effects/1", "effects": 2 * one("viscous", viscous=(1, "N·m·s/rad"))["effects"]},  # type: ignore[operator]
        r"effects\[1\]: viscous stands twice on axis 'rotate'",
    ),
]


@pytest.mark.parametrize(("content", "message"), REFUSED)
def test_refusals(tmp_path: Path, content: object, message: str) -> None:
    with pytest.raises(UserError, match=message) as refusal:
        read(tmp_path, content)
    assert str(tmp_path / "effects.json") in str(refusal.value)


def test_no_file(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"no effects file .*mine.json; give an effects/1 JSON file"):
        read_effects(tmp_path / "mine.json")


def test_a_directory(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="cannot read"):
        read_effects(tmp_path)


@pytest.mark.parametrize(
    ("axis", "effect", "unit", "expected"),
    [
        ("rotate", "coulomb", "mN·m", "N·m"),
        ("rotate", "coulomb", "N", "N·m"),
        ("lift", "coulomb", "N·m", "N"),
        ("lift", "viscous", "N·m·s/rad", "N·s/m"),
    ],
)
def test_a_unit_that_is_not_the_joints(tmp_path: Path, axis: str, effect: str, unit: str, expected: str) -> None:
    """1300 mN·m must not become 1300 N·m."""
    effects = read(tmp_path, one(effect, axis, **{effect: (1.0, unit)}))
    with pytest.raises(UserError, match=f"{effect} on axis '{axis}': {effect} is given in '{unit}', expected '{expected}'"):
        Plant(load_machine("scara"), effects)


CONTRACT_TABLE = {
    "friction": "coulomb viscous coulomb_asymmetry viscous_asymmetry stribeck viscous_nonlinear presliding load_friction "
    "position_friction temperature_drift",
    "rigid body": "inertia payload gravity spring coupling",
    "transmission": "backlash elasticity transmission_error",
    "motor and drive": "torque_constant torque_saturation torque_ripple torque_offset current_bandwidth",
    "sensing and timing": "encoder_eccentricity delay",
}
"""The gap report's table of effects."""


def test_library_has_every_effect_of_the_contract_in_its_family() -> None:
    by_contract = {(name, family) for family, names in CONTRACT_TABLE.items() for name in names.split()}
    ours = {(name, effect.family) for name, effect in library().items()}
    assert ours - by_contract == {
        ("belt_elasticity", "transmission"),
        ("magnetic_saturation", "motor and drive"),
        ("residual_table", "friction"),
    }
    assert by_contract <= ours


@pytest.mark.parametrize("name", library())
def test_one_effect_is_one_file(name: str) -> None:
    effect = library()[name]
    assert effect.name == name
    assert (EFFECTS / f"{name}.py").is_file()
    assert {parameter.name for parameter in effect.parameters} == {field.name for field in fields(effect)}
    assert f"| `{name}` |" in (EFFECTS.parents[1] / "docs" / "effects.md").read_text(encoding="utf-8")


EFFECTS = Path(__file__).parents[2] / "emulator" / "effects"

POSITION = np.array([0.3, -0.7, 0.01, 1.2, -0.002, 0.5])
VELOCITY = np.array([-1.5, -0.05, -0.01, 0.01, 0.05, 1.5])
ACCELERATION = np.array([1.0, -2.0, 3.0, -4.0, 5.0, -6.0])
TORQUE = np.array([2.0, -1.0, 0.5, -0.5, 1.5, -2.5])
TIME = np.array([0.0, 1.0, 2.0, 10.0, 20.0, 100.0])
INERTIA = np.full(6, 0.3)
MOTION = Motion(POSITION, VELOCITY, ACCELERATION, TORQUE, TIME, INERTIA * ACCELERATION, INERTIA, 0.1)
AXIS = AxisDynamics(gear_ratio=50.0, friction=FrictionLaw(coulomb=0.8, viscous=0.3))

SIGN, SPEED = np.sign(VELOCITY), np.abs(VELOCITY)

NEEDED = 0.3 * ACCELERATION + 0.8 * SIGN + 0.3 * VELOCITY
"""Torque of the axis as it is."""


def loaded(coefficient: float) -> np.ndarray:
    """The torque that carries its own friction, T = needed + coefficient |T| sgn(v), by iteration."""
    torque: np.ndarray = NEEDED
    for _ in range(60):
        torque = NEEDED + coefficient * np.abs(torque) * SIGN
    return torque


PREDICTIONS = [
    ("coulomb", {"coulomb": 1.0}, 0.2 * SIGN),
    ("viscous", {"viscous": 0.5}, 0.2 * VELOCITY),
    ("coulomb_asymmetry", {"asymmetry": 0.1}, np.full(6, 0.1)),
    ("viscous_asymmetry", {"asymmetry": 0.1}, 0.1 * SPEED),
    (
        "stribeck",
        {"static_torque": 1.3, "stribeck_velocity": 0.05, "exponent": 1.5},
        (1.3 - 0.8) * np.exp(-((SPEED / 0.05) ** 1.5)) * SIGN,
    ),
    ("viscous_nonlinear", {"quadratic": 0.2, "cubic": 0.05}, SIGN * (0.2 * SPEED**2 + 0.05 * SPEED**3)),
    ("load_friction", {"coefficient": 0.1}, 0.1 * np.abs(loaded(0.1)) * SIGN),
    (
        "position_friction",
        {"amplitude": 0.4, "period": 0.25, "phase": 1.0},
        0.4 * np.sin(2.0 * np.pi / 0.25 * POSITION + 1.0) * SIGN,
    ),
    (
        "temperature_drift",
        {"cold": 0.5, "time_constant": 10.0},
        0.5 * np.exp(-TIME / 10.0) * (0.8 * SIGN + 0.3 * VELOCITY),
    ),
    ("inertia", {"difference": 0.2}, 0.2 * ACCELERATION),
    ("gravity", {"moment": 3.0, "angle": 0.2}, 3.0 * np.sin(POSITION - 0.2)),
    ("spring", {"stiffness": 5.0, "rest": 0.1}, 5.0 * (POSITION - 0.1)),
    ("torque_constant", {"error": 0.1}, -0.1 / 1.1 * NEEDED),
    ("magnetic_saturation", {"knee": 2.0}, NEEDED**3 / 4.0),
    ("torque_offset", {"offset": 0.3}, np.full(6, -0.3)),
    ("torque_ripple", {"amplitude": 0.2, "order": 6.0, "phase": 0.5}, -0.2 * np.sin(6.0 * 50.0 * POSITION + 0.5)),
]


@pytest.mark.parametrize(("effect", "parameters", "expected"), PREDICTIONS)
def test_prediction_is_what_the_effect_adds_to_a_plant_that_has_friction(
    effect: str,
    parameters: dict[str, float],
    expected: np.ndarray,
) -> None:
    static = placed("rotate", effect, **parameters).effect
    assert isinstance(static, StaticEffect)
    assert static.predict(MOTION, AXIS) == pytest.approx(expected, abs=1e-12)


def test_every_static_effect_is_among_the_predictions() -> None:
    static = {name for name, effect in library().items() if issubclass(effect, StaticEffect)}
    assert static == {name for name, _, _ in PREDICTIONS}


def test_law_at_rest_resists_nothing_by_itself() -> None:
    still = replace(MOTION, velocity=np.zeros(6))
    law = FrictionLaw(coulomb=1.0, static_torque=2.0, stribeck_velocity=0.1, load_coefficient=0.2, cold=0.3)
    assert (law.resistance(still) == 0.0).all()


def test_friction_of_a_load_is_of_what_the_axis_asks_for_and_not_of_what_was_measured() -> None:
    """T = (L + w F) / (1 - w c) where the motor drives, by (1 + w c) where the load does; c of a noise would be a friction."""
    noisy = replace(MOTION, torque=np.array([9.0, -7.0, 3.0, 0.0, -5.0, 8.0]))
    law = FrictionLaw(coulomb=0.5, viscous=0.1, load_coefficient=0.2, cold=0.3, warming_time=1e9)
    needed = MOTION.rigid_torque + 1.3 * (0.5 * np.sign(MOTION.velocity) + 0.1 * MOTION.velocity)
    asked = needed / (1.0 - 1.3 * 0.2 * np.sign(needed * MOTION.velocity))
    assert law.resistance(noisy) == pytest.approx(asked - MOTION.rigid_torque, rel=1e-6)
