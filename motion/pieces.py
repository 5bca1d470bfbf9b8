"""A recording with gaps as pieces that the filter can work on; pieces that are too short are left out."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from pathlib import Path

from drivetwin.foundation.errors import UserError
from drivetwin.motion.axis_motion import least_samples
from drivetwin.recording.reader import find_recordings, read_recording
from drivetwin.recording.recording import Recording

logger = logging.getLogger(__name__)


def read_all(paths: Iterable[Path], cutoff_hz: float, *, allow_gaps: bool) -> list[Recording]:
    """All recordings in `paths`, folders of one or of many, in their order; as `read_pieces`."""
    folders = [folder for path in paths for folder in find_recordings(path)]
    return [piece for folder in folders for piece in read_pieces(folder, cutoff_hz, allow_gaps=allow_gaps)]


def read_pieces(folder: Path, cutoff_hz: float, *, allow_gaps: bool) -> list[Recording]:
    """The recording in `folder`, or its pieces between gaps that are long enough for a filter of `cutoff_hz` [Hz].

    Raises UserError as `read_recording`, and where no piece is long enough.
    """
    pieces = read_recording(folder, allow_gaps=allow_gaps)
    if len(pieces) == 1:
        return pieces
    long = [piece for piece in pieces if len(piece.time) >= least_samples(piece.info.sample_period, cutoff_hz)]
    if not long:
        raise UserError(
            f"{folder}: none of its {len(pieces)} pieces between gaps is long enough for the filter: record again without "
            "losing samples, or raise the cut-off with --cutoff"
        )
    if len(long) < len(pieces):
        logger.warning("%s: %d short pieces between gaps are left out", folder, len(pieces) - len(long))
    return long
