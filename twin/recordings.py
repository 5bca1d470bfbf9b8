"""The recordings that move a model: read, on joints that the model has, with unique names."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from drivetwin.foundation.errors import UserError
from drivetwin.motion.inverse_dynamics import read_mjcf
from drivetwin.motion.pieces import read_all
from drivetwin.recording.reader import check_joints
from drivetwin.recording.recording import Recording


def read_for(model: Path, paths: Sequence[Path], cutoff_hz: float, *, allow_gaps: bool) -> list[Recording]:
    """All recordings in folders, in their order. Raises UserError for a joint that the model lacks and a name that two have."""
    compiled = read_mjcf(model)
    joints = [compiled.joint(number).name for number in range(compiled.njnt)]
    read = read_all(paths, cutoff_hz, allow_gaps=allow_gaps)
    for recording in read:
        check_joints(recording, joints)
    ordered = sorted(read, key=lambda each: each.name)
    for one, other in pairwise(ordered):
        if one.name == other.name:
            raise UserError(f"{one.source} and {other.source} are both named '{one.name}': give one of them, or rename it")
    return read
