"""The truth in a case's folder: stretches of equal steps that are long enough to be looked at."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_evidence import evidence, standing

from drivetwin.hil_tests.folder import write_case
from drivetwin.hil_tests.verdict import CaseResult, Outcome
from drivetwin.recording.reader import read_recording

LONG, FREE, POLLS, LATER = 500, 1, 6, 100
"""Steps: of 2 ms; one of 50 ms, after which drives run free at once for what they had waited; of 1 ms; of 2 ms again."""


def test_single_steps_and_a_few_samples_between_polls_are_no_recordings(tmp_path: Path) -> None:
    steps = np.concatenate([np.full(LONG, 0.002), np.full(FREE, 0.05), np.full(POLLS, 0.001), np.full(LATER, 0.002)])
    truth = replace(standing(0.002 * (len(steps) + 1)), time=np.concatenate([[0.0], np.cumsum(steps)]))
    result = CaseResult(3, "homing", "home", "Home", "It homes.", Outcome.ACCEPTED, (), (), "", 1.0, 1.0, tmp_path)
    write_case(result, evidence(truth), tmp_path)
    pieces = [read_recording(folder)[0] for folder in sorted(tmp_path.glob("truth*"))]
    assert [len(piece.time) for piece in pieces] == [LONG + 1, LATER + 1]
    assert [piece.info.sample_period for piece in pieces] == pytest.approx([0.002, 0.002])
