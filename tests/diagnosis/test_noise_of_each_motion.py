"""Validation that is noisier than what was fitted, or less noisy: each motion has a noise of its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rig_bench import COULOMB, CUTOFF, PERIOD, Swing, strokes, written_model

from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.prepare.prepared import prepared
from drivetwin.diagnosis.report.gaps import gaps_of
from drivetwin.diagnosis.report.prediction import Patch
from drivetwin.diagnosis.report.result import Array, AxisPrediction
from drivetwin.diagnosis.settings import Settings
from drivetwin.motion.filtering import zero_phase
from drivetwin.recording.recording import Recording

QUIET, LOUD = 15.0, 200.0
"""White noise of the torque of what is fitted, and of what it is judged by [quanta]."""
SETTINGS = Settings(cutoff_hz=CUTOFF)


def more_friction(at: Swing) -> Array:
    """A tenth of the Coulomb level more."""
    return np.asarray(0.1 * COULOMB["turn"] * np.sign(at.velocity))


def test_the_noise_of_each_motion_is_its_own(tmp_path: Path) -> None:
    fitted, unseen = strokes(1, 60.0, noise=QUIET), strokes(2, 30.0, noise=LOUD)
    gaps = gaps_of(prepared(written_model(tmp_path), [fitted], [unseen], SETTINGS), Patch(), SETTINGS)
    for found, recording, quiet in (
        (gaps.noise, unseen, strokes(2, 30.0, noise=0.0)),
        (gaps.fitted_noise, fitted, strokes(1, 60.0, noise=0.0)),
    ):
        white = recording.columns["turn"]["torque"] - quiet.columns["turn"]["torque"]
        assert found["turn"].rms == pytest.approx(float(np.std(zero_phase(white, PERIOD, CUTOFF))), rel=0.1)


def test_where_nothing_is_left_nothing_is_unexplained(tmp_path: Path) -> None:
    """Of an axis that stands in one of the motions, with a torque of exactly 0."""
    gaps = gaps_of(prepared(written_model(tmp_path), [strokes(1, 20.0)], [strokes(2, 20.0)], SETTINGS), Patch(), SETTINGS)
    silent = {axis: replace(own, rms=0.0, model_error=0.0) for axis, own in gaps.noise.items()}
    still = [replace(each, axes={axis: at_rest(own) for axis, own in each.axes.items()}) for each in gaps.unseen]
    told = replace(gaps, unseen=still, noise=silent).unexplained()
    assert told == replace(gaps, unseen=gaps.fitted, noise=gaps.fitted_noise).unexplained()


def at_rest(axis: AxisPrediction) -> AxisPrediction:
    none = np.zeros_like(axis.measured)
    return replace(axis, before=none, after=none, measured=none, used=none > 0.0)


@pytest.mark.parametrize("louder", ["fitted", "unseen"])
def test_a_machine_as_modelled_has_no_gap_whichever_motion_is_noisier(louder: str, tmp_path: Path) -> None:
    def record(seed: int, name: str) -> Recording:
        return strokes(seed, 60.0, name=name, noise=LOUD if name == louder else QUIET)

    told = diagnose(written_model(tmp_path), [record(1, "fitted")], [record(2, "unseen")], SETTINGS, lambda *_: None)
    assert told.verdict == "no_gap"


def test_a_gap_of_quiet_motion_is_seen_though_unseen_motion_hides_it(tmp_path: Path) -> None:
    """Where the noise of that motion is larger than the gap: the fitted motion shows it."""
    fitted, unseen = (
        strokes(1, 60.0, {"turn": more_friction}, noise=QUIET),
        strokes(2, 60.0, {"turn": more_friction}, noise=3.0 * LOUD),
    )
    told = diagnose(written_model(tmp_path), [fitted], [unseen], SETTINGS, lambda *_: None)
    assert told.axes["turn"].significant
    assert told.causes[0].effect == "coulomb"
