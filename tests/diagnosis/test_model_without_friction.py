"""A model without friction, as a CAD export gives it, of a machine that has some: what it is called, and its size."""

from __future__ import annotations

import pytest
from plain_bench import COULOMB, VISCOUS, Machine

from drivetwin.diagnosis.report.result import Diagnosis

RIGID = Machine(friction=False)


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    return RIGID.diagnosed([RIGID.recording(1, 30.0, "fitted")], [RIGID.recording(2, 15.0, "held")])


@pytest.mark.parametrize(("effect", "parameter", "true"), [("coulomb", "coulomb", COULOMB), ("viscous", "viscous", VISCOUS)])
def test_friction_is_named_as_what_it_is(found: Diagnosis, effect: str, parameter: str, true: float) -> None:
    causes = {cause.effect: cause for cause in found.causes if cause.gap_closed is not None}
    assert causes[effect].parameters[parameter].value == pytest.approx(true, rel=0.1)
    assert causes[effect].probability > 0.9


def test_what_a_model_with_friction_would_miss_is_found_beside_it(found: Diagnosis) -> None:
    selected = {one.effect.name for one in found.selected}
    assert {"stribeck", "torque_ripple"} <= selected
    assert found.after_rms["turn"] < 0.1 * found.axes["turn"].gap_rms
