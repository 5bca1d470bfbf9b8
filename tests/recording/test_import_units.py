"""Units against values worked out by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from drivetwin.foundation.errors import UserError
from drivetwin.recording.import_map import AxisMap, ColumnMap
from drivetwin.recording.to_joint import to_joint_side
from drivetwin.recording.units import Kind, canonical, quantity

PI = np.pi

HINGE: dict[str, Any] = {
    "gear_ratio": 50.0,
    "encoder_increments": 1000,
    "motor_rated_torque": 2.0,
    "torque_constant": 0.1,
}
SLIDE: dict[str, Any] = {"joint_type": "slide", "gear_ratio": 200 * PI}  # a screw with a lead of 10 mm


def convert(name: str, axis: dict[str, Any], raw: float = 1.0, **column: Any) -> float:
    columns = {"torque": {"column": 1}, "position": {"column": 2}}
    entry = AxisMap.model_validate(axis | {"columns": columns})
    values = to_joint_side("file: x", name, np.array([raw]), ColumnMap.model_validate({"column": "c"} | column), entry)
    return float(values[0])


@pytest.mark.parametrize(
    ("name", "axis", "column", "raw", "expected"),
    [
        ("position", HINGE, {"unit": "deg"}, 180, PI),
        ("position", HINGE, {"unit": "rev", "side": "motor"}, 50, 2 * PI),
        ("position", HINGE, {"unit": "inc"}, 25000, PI),
        ("position", {"position_resolution": 1e-3}, {"unit": "inc"}, 7, 7e-3),
        ("position", HINGE | {"user_units_per_motor_turn": 7200}, {"unit": "user"}, 3600 * 50, PI),
        ("position", SLIDE, {"unit": "mm"}, 5, 5e-3),
        ("position", SLIDE, {"unit": "µm"}, 5, 5e-6),
        ("position", SLIDE, {"unit": "rev", "side": "motor"}, 1, 0.010),
        ("velocity", HINGE, {"unit": "rpm", "side": "motor"}, 3000, 2 * PI),
        ("velocity", HINGE, {"unit": "deg/s", "sign": -1}, 90, -PI / 2),
        ("velocity", HINGE, {"unit": "rad/s", "scale": 0.5, "offset": 3}, 10, 8),
        ("velocity", HINGE, {"unit": "inc/s"}, 50000, 2 * PI),
        ("velocity", SLIDE, {"unit": "m/min"}, 30, 0.5),
        ("velocity", SLIDE, {"unit": "rpm", "side": "motor"}, 6000, 1.0),
        ("torque", HINGE, {"unit": "mN·m", "side": "motor"}, 100, 5.0),
        ("torque", HINGE, {"unit": "Nm"}, 3, 3.0),
        ("torque", HINGE, {"unit": "A"}, 2, 10.0),
        ("torque", HINGE, {"unit": "permille"}, 500, 50.0),
        ("torque", HINGE, {"unit": "% of rated"}, 10, 10.0),
        ("torque", {"rated_torque": 20.0}, {"unit": "%"}, 10, 2.0),
        ("torque", SLIDE, {"unit": "kN"}, 1.5, 1500.0),
        ("torque", SLIDE, {"unit": "N·m", "side": "motor"}, 1, 200 * PI),
        ("torque", SLIDE | {"force_constant": 35.0}, {"unit": "V"}, 2, 70.0),
        ("torque_offset", SLIDE | {"torque_constant": 0.1}, {"unit": "mA"}, 1000, 20 * PI),
        ("temperature", {}, {"unit": "K"}, 300, 26.85),
        ("temperature", {}, {"unit": "°C"}, 30, 30.0),
    ],
)
def test_by_hand(name: str, axis: dict[str, Any], column: dict[str, Any], raw: float, expected: float) -> None:
    assert convert(name, axis, raw, **column) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "axis", "column", "message"),
    [
        ("position", {}, {"unit": "mm"}, "does not fit a joint of type hinge"),
        ("position", {"joint_type": "slide"}, {"unit": "deg"}, "give `side: motor` with gear_ratio"),
        ("position", {}, {"unit": "deg", "side": "motor"}, "the map lacks gear_ratio"),
        ("position", {}, {"unit": "inc"}, "needs encoder_increments .* or position_resolution"),
        ("position", {}, {"unit": "user"}, "needs user_units_per_motor_turn"),
        ("position", {"joint_type": "slide"}, {"unit": "mm", "side": "motor"}, "leave out `side: motor`"),
        ("torque", {}, {"unit": "permille"}, "needs rated_torque .* or motor_rated_torque"),
        ("torque", {}, {"unit": "A"}, "needs torque_constant .* or force_constant"),
        ("torque", {}, {"unit": "N"}, "does not fit a joint of type hinge"),
        ("torque", {}, {"unit": "rpm"}, "'rpm' is not a unit for torque; one of: N, mN"),
    ],
)
def test_what_is_missing_is_said(name: str, axis: dict[str, Any], column: dict[str, Any], message: str) -> None:
    with pytest.raises(UserError, match=f"^file: x: .*{message}"):
        convert(name, axis, **column)


def test_spellings_of_a_newton_metre() -> None:
    assert {canonical(text) for text in ("Nm", "N m", "N.m", "N*m", "N⋅m", "[N·m]")} == {"N·m"}
    assert canonical("mNm") == "mN·m"
    assert canonical("Ncm") == "N·cm"
    assert canonical("parsec") is None


def test_constants_with_units() -> None:
    kinds = (Kind.TORQUE,)
    assert quantity("9.84 mN·m", kinds) == pytest.approx(9.84e-3)
    assert quantity("3e-2Nm", kinds) == pytest.approx(0.03)
    assert quantity(2, kinds) == quantity("2", kinds) == 2.0
    with pytest.raises(ValueError, match="is not a unit allowed here"):
        quantity("3 rpm", kinds)
    with pytest.raises(ValueError, match="neither a number"):
        quantity("much", kinds)
