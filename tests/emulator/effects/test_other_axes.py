"""An effect acts on its own axis and on no other: two hinges side by side, an effect on the second."""

from __future__ import annotations

import numpy as np
import pytest
from effect_bench import PERIOD, Rig, effect, two_axes

from drivetwin.emulator.effects import library

PARAMETERS = {
    "coulomb": {"coulomb": 0.7},
    "viscous": {"viscous": 0.9},
    "coulomb_asymmetry": {"asymmetry": 0.2},
    "viscous_asymmetry": {"asymmetry": 0.3},
    "stribeck": {"static_torque": 1.1, "stribeck_velocity": 0.4},
    "viscous_nonlinear": {"quadratic": 0.3},
    "presliding": {"stiffness": 2000.0},
    "load_friction": {"coefficient": 0.15},
    "position_friction": {"amplitude": 0.3, "period": 0.07},
    "temperature_drift": {"cold": 0.8, "time_constant": 0.5},
    "inertia": {"difference": 0.02},
    "payload": {"mass": 0.3, "x": 0.2},
    "gravity": {"moment": 1.2},
    "spring": {"stiffness": 3.0},
    "backlash": {"gap": 0.01, "stiffness": 2000.0},
    "elasticity": {"stiffness": 2000.0},
    "transmission_error": {"amplitude": 0.001},
    "torque_constant": {"error": -0.08},
    "magnetic_saturation": {"knee": 3.0},
    "torque_offset": {"offset": 0.25},
    "torque_ripple": {"amplitude": 0.2, "order": 12.0},
    "encoder_eccentricity": {"amplitude": 0.001},
    "delay": {"delay": 0.002},
    "residual_table": {"low": -1.0, "high": 1.0, "top": 2.0, "forward_3": 0.3, "position_06": 0.2},
}
ELSEWHERE = {"belt_elasticity", "coupling", "torque_saturation", "current_bandwidth"}
"""Between axes, and in the loops of a drive: other tests."""


def test_every_effect_is_here_or_elsewhere() -> None:
    assert set(PARAMETERS) | ELSEWHERE == set(library())


def readings(*effects: object) -> np.ndarray:
    """What both encoders say while both motors push alike and both brakes close in the end, (n, 2)."""
    base = [effect(name, axis, **{name: 0.4}) for axis in ("axis", "second") for name in ("coulomb", "viscous")]
    given = {(one.axis, one.effect.name) for one in effects}  # type: ignore[attr-defined]
    kept = [one for one in base if (one.axis, one.effect.name) not in given]
    rig = Rig(two_axes(), *kept, *effects, axes=("axis", "second"), brake=20.0)  # type: ignore[arg-type]
    rows = []
    for k in range(round(0.3 / PERIOD)):
        rig.mechanism.read()
        rows.append(rig.mechanism.motor_position.copy())
        rig.mechanism.motor_torque[:] = 2.0 / 50.0
        rig.mechanism.brakes[:] = k * PERIOD > 0.2
        rig.mechanism.step()
    return np.array(rows)


@pytest.mark.parametrize("name", PARAMETERS)
def test_the_first_axis_does_not_feel_what_the_second_has(name: str) -> None:
    plain, changed = readings(), readings(effect(name, "second", **PARAMETERS[name]))
    assert np.abs(changed[:, 0] - plain[:, 0]).max() < 1e-9
    assert np.abs(changed[:, 1] - plain[:, 1]).max() > 1e-3
    assert np.ptp(plain[-100:, 0]) < 1e-4
    assert np.ptp(changed[-100:, 0]) < 1e-4
