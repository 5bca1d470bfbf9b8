"""Nominal parameters that are off by no more than usual are corrected; nothing else is named for them."""

from __future__ import annotations

from pathlib import Path

from rig_bench import COULOMB, LIFTING, TURNING, VISCOUS, Swing, diagnosed, strokes

from drivetwin.diagnosis.report.result import Array

FRICTION, INERTIA = 0.03, 0.045
"""Shares by which they are: about one standard deviation of what a data sheet gives."""


def test_a_torque_constant_is_not_named_for_friction_and_inertia_that_are_a_little_off(tmp_path: Path) -> None:
    def more(inertia: float, axis: str, at: Swing) -> Array:
        friction = COULOMB[axis] * (1.0 * (at.velocity > 0) - 1.0 * (at.velocity < 0)) + VISCOUS[axis] * at.velocity
        return FRICTION * friction + INERTIA * inertia * at.acceleration

    both = {"turn": lambda at: more(TURNING, "turn", at), "lift": lambda at: more(LIFTING, "lift", at)}
    found = diagnosed(tmp_path, lambda seed, name: strokes(seed, 12.0, both, name))
    assert {one.effect.name for one in found.selected} <= {"coulomb", "viscous", "inertia", "payload"}
    assert found.selected
