"""Beside a large effect, parameters of the model that are a little off are found as if it were not there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rig_bench import COULOMB, VISCOUS, compared, strokes

from diagnosis.hypotheses import hypotheses
from diagnosis.propose.nominal import nominal_parameters
from diagnosis.state import State, state_with

OFFSET = 4.0
OFF = {"viscous": 0.05, "coulomb": -0.04}
"""Shares by which the model's friction on the turning axis is wrong."""
SIZE = {"viscous": VISCOUS["turn"], "coulomb": COULOMB["turn"]}


def pulled(folder: Path) -> State:
    """A constant torque on the turning axis, hundreds of times the energy of the friction that is wrong."""
    recording = strokes(
        4,
        30.0,
        {
            "turn": lambda at: (
                OFFSET
                + OFF["viscous"] * SIZE["viscous"] * at.velocity
                + OFF["coulomb"] * SIZE["coulomb"] * np.sign(at.velocity)
            )
        },
    )
    comparison = compared(folder, recording)
    return state_with(comparison, nominal_parameters(comparison), (), {"turn": 0.03, "lift": 0.15})


def test_nominal_parameters_move_beside_a_candidate_as_far_as_without_it(tmp_path: Path) -> None:
    state = pulled(tmp_path)
    offset = next(one for one in hypotheses(state) if (one.effect, one.axis) == ("torque_offset", "turn"))
    assert offset.found is not None
    found = {
        nominal.effect: coefficient
        for nominal, coefficient in zip(state.nominals, offset.found.fitted.coefficients, strict=True)
        if nominal.axis == "turn" and nominal.effect in OFF
    }
    for effect, share in OFF.items():
        assert found[effect] == pytest.approx(share * SIZE[effect], rel=0.2)
