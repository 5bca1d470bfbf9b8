"""What a patch keeps: nothing that leaves more of the gap on unseen motion than the simulation as it stands."""

from __future__ import annotations

from pathlib import Path

from rig_bench import ready, strokes

from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.report.build import worth_a_name
from drivetwin.diagnosis.report.prediction import Patch
from drivetwin.emulator.effects.coulomb_asymmetry import CoulombAsymmetry
from drivetwin.emulator.effects.torque_offset import TorqueOffset


def test_two_effects_that_need_each_other_and_do_harm_together_are_left_out(tmp_path: Path) -> None:
    """Of a machine as modelled: 5 N less and 4 N more. Without either of them alone more is left than with both."""
    made = ready(tmp_path, strokes(1, 8.0, {}))
    patch = Patch(tuple(placed(made.rows, "lift", one) for one in (CoulombAsymmetry(4.0), TorqueOffset(5.0))))
    assert worth_a_name(made, patch, 0.01).effects == ()
