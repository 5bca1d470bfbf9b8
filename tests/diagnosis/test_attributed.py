"""Whose part of the torque is whose, where effects overlap: what two take together they share alike, in whatever order."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from plain_bench import Machine

from drivetwin.diagnosis.prepare.prepared import Prepared, prepared
from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.report.prediction import Patch, attributed, contributions
from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.settings import Settings
from drivetwin.emulator.effects import Effect
from drivetwin.emulator.effects.backlash import Backlash
from drivetwin.emulator.effects.presliding import Presliding
from drivetwin.emulator.effects.torque_offset import TorqueOffset
from drivetwin.emulator.effects.viscous import Viscous
from drivetwin.emulator.effects.viscous_asymmetry import ViscousAsymmetry
from drivetwin.foundation.errors import UserError

PLAY, YIELDING, OFFSET = Backlash(0.05, 2000.0, 5.0), Presliding(40.0), TorqueOffset(0.3)


ASYMMETRY, VISCOUS = ViscousAsymmetry(3.0), Viscous(4.0)
"""An asymmetry that pushes on the machine's own viscous friction, and a friction on which it does not."""


@pytest.fixture(scope="module")
def ready(tmp_path_factory: pytest.TempPathFactory) -> Prepared:
    machine = Machine()
    model = tmp_path_factory.mktemp("plain") / "model.xml"
    model.write_text(machine.model.replace("damping=", 'armature="0.2" damping='), encoding="utf-8")
    return prepared(Path(model), [machine.recording(1, 20.0, "one")], [machine.recording(2, 20.0, "two")], Settings())


def parts(ready: Prepared, *effects: Effect) -> list[Array]:
    """Of the motion that was not fitted."""
    own = tuple(placed(ready.rows, "turn", effect) for effect in effects)
    return [attributed(ready.simulation, ready.checks[0], own, number, "turn") for number in range(len(own))]


def whole(ready: Prepared, *effects: Effect) -> Array:
    """What they cost together."""
    own = tuple(placed(ready.rows, "turn", effect) for effect in effects)
    torque = [part["turn"] for part in contributions(ready.simulation, ready.checks[0], Patch(own))]
    return np.asarray(sum(torque[1:], torque[0]))


def test_two_that_overlap_share_all_that_they_cost_together(ready: Prepared) -> None:
    """Shapley's efficiency. That they overlap: each costs less beside the other than alone."""
    own = parts(ready, PLAY, YIELDING)
    together = whole(ready, PLAY, YIELDING)
    assert own[0] + own[1] == pytest.approx(together, abs=1e-9)
    apart = whole(ready, PLAY) + whole(ready, YIELDING)
    assert float(np.abs(together - apart).max()) > 0.1 * float(np.abs(together).max())


def test_the_part_of_each_is_the_mean_of_coming_first_and_last(ready: Prepared) -> None:
    """Shapley's value of two, written out."""
    first, _ = parts(ready, PLAY, YIELDING)
    last = whole(ready, PLAY, YIELDING) - whole(ready, YIELDING)
    assert first == pytest.approx(0.5 * (whole(ready, PLAY) + last), abs=1e-9)


def test_one_beside_which_nothing_changes_has_what_it_costs_alone(ready: Prepared) -> None:
    *_, offset = parts(ready, PLAY, YIELDING, OFFSET)
    assert offset == pytest.approx(whole(ready, OFFSET), abs=1e-9)


def test_an_effect_without_which_the_others_make_no_mechanism_has_what_it_costs_alone(ready: Prepared) -> None:
    with pytest.raises(UserError, match="it would push"):
        whole(ready, ASYMMETRY, OFFSET)
    own = parts(ready, VISCOUS, ASYMMETRY, OFFSET)
    assert own[0] == pytest.approx(whole(ready, VISCOUS), abs=1e-9)
    assert own[2] == pytest.approx(whole(ready, OFFSET), abs=1e-9)
