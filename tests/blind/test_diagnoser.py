"""The first cause of a report as the patch that predicts motion which the diagnosis has not seen."""

from __future__ import annotations

from drivetwin.blind.diagnoser import first_cause
from drivetwin.diagnosis.report.prediction import Patch
from drivetwin.diagnosis.report.schema import CausePart
from drivetwin.emulator.effects.stribeck import Stribeck


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
