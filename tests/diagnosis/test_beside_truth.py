"""The true set of a key, as a search's set is held against it."""

from __future__ import annotations

from pathlib import Path

import pytest
from beside_truth import true_effects
from plain_bench import Machine

from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.emulator.effects.presliding import Presliding
from drivetwin.emulator.effects.torque_offset import TorqueOffset


def told(effect: str, share: float, **parameters: float) -> dict[str, object]:
    return {"effect": effect, "axis": "turn", "parameters": parameters, "size": 0.1, "share": share}


def test_what_can_be_asked_for_and_matters_is_in_the_true_set(tmp_path: Path) -> None:
    bench = Machine().bench(tmp_path, 5.0)
    proposer = Proposer(bench, bench, {"turn": [TorqueOffset, Presliding]}, {})
    key = [
        told("torque_offset", 0.9, offset=0.4),
        told("presliding", 0.05, displacement=1e-3),
        told("viscous_nonlinear", 0.5, quadratic=1.0),
        told("foreign:fan", 0.5),
        told("torque_offset", 0.001, offset=0.1),
    ]
    offset, friction = (one.effect for one in true_effects(key, proposer))
    assert offset == TorqueOffset(0.4)
    assert isinstance(friction, Presliding)
    level = bench.rows.simulation.dynamics()["turn"].friction.coulomb
    assert friction.stiffness == pytest.approx(1.6 * level / 1e-3)
