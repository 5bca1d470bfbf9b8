"""The first cause of a report as the patch that predicts motion which the diagnosis has not seen."""

from __future__ import annotations

from pathlib import Path

import pytest

from blind.diagnoser import first_cause
from diagnosis.prepare.simulation import Simulation, simulation
from diagnosis.report.prediction import Patch
from diagnosis.report.schema import CausePart
from drivetwin.recording.recording import AxisInfo
from emulator.effects.inertia import Inertia
from emulator.effects.stribeck import Stribeck

MODEL = """<mujoco><worldbody><body name="arm"><joint name="shoulder" type="hinge" frictionloss="1" armature="0.1"/>
<geom type="capsule" size="0.05" fromto="0 0 0 0.4 0 0" mass="2"/></body></worldbody>
<actuator><motor name="shoulder" joint="shoulder"/></actuator></mujoco>"""


@pytest.fixture
def twin(tmp_path: Path) -> Simulation:
    (tmp_path / "model.xml").write_text(MODEL, encoding="utf-8")
    return simulation(tmp_path / "model.xml", {"shoulder": AxisInfo(joint="shoulder", actuator="shoulder")})


def cause(effect: str, **parameters: float) -> CausePart:
    told = {name: {"value": value, "unit": "1", "ci90": (value, value)} for name, value in parameters.items()}
    return CausePart.model_validate(
        {
            "step": 1,
            "effect": effect,
            "axis": None if effect == "none" else "shoulder",
            "probability": 1.0,
            "parameters": told,
            "gap_closed": None,
            "indistinguishable_from": [],
            "tell_apart_by": "",
        }
    )


def test_cause_is_the_effect_with_its_parameters(twin: Simulation) -> None:
    (placed,) = first_cause(twin, cause("stribeck", static_torque=1.3, stribeck_velocity=0.02, exponent=1.5)).effects
    assert (placed.axis, placed.effect) == ("shoulder", Stribeck(1.3, 0.02, 1.5))


def test_heavier_body_is_a_share_of_its_mass(twin: Simulation) -> None:
    patch = first_cause(twin, cause("inertia", difference=0.01, mass_scale_arm=1.04))
    assert [placed.effect for placed in patch.effects] == [Inertia(0.01)]
    assert patch.heavier == {twin.model.body("arm").id: pytest.approx(0.04)}


@pytest.mark.parametrize("effect", ["unknown", "none"])
def test_no_effect_adds_nothing(twin: Simulation, effect: str) -> None:
    assert first_cause(twin, cause(effect)) == Patch((), {})
