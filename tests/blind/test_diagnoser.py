"""The process that diagnoses: whose code it runs, and the first cause of a report as a patch for motion that is new to it."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.blind.diagnoser import first_cause
from drivetwin.blind.diagnoser_process import refuse_other_code
from drivetwin.diagnosis.report.prediction import Patch
from drivetwin.diagnosis.report.schema import CausePart
from drivetwin.emulator.effects.stribeck import Stribeck
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import INSTALLED


def cause(effect: str, **parameters: float) -> CausePart:
    told = {name: {"value": value, "unit": "1", "ci90": (value, value)} for name, value in parameters.items()}
    return CausePart.model_validate(
        {
            "effect": effect,
            "axis": "shoulder",
            "probability": 1.0,
            "share": 1.0,
            "parameters": told,
            "gap_closed": None,
            "indistinguishable_from": [],
            "tell_apart_by": "",
            "or_by_sensor": "",
        }
    )


def test_cause_is_the_effect_with_its_parameters() -> None:
    (placed,) = first_cause(cause("stribeck", static_torque=1.3, stribeck_velocity=0.02, exponent=1.5)).effects
    assert (placed.axis, placed.effect) == ("shoulder", Stribeck(1.3, 0.02, 1.5))


def test_what_is_unknown_adds_nothing() -> None:
    assert first_cause(cause("unknown")) == Patch()


def test_without_a_cause_nothing_is_added() -> None:
    assert first_cause(None) == Patch()


def test_a_process_that_would_run_other_code_is_refused(tmp_path: Path) -> None:
    refuse_other_code(INSTALLED)
    with pytest.raises(UserError, match=f"runs from {tmp_path}, its diagnosing process would run from {INSTALLED}"):
        refuse_other_code(tmp_path)
