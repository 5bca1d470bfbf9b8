"""What the user may choose about a diagnosis; all of it stands in the report."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class DiagnosisSettings:
    """Choices of the diagnosis.

    cutoff_hz: -3 dB frequency of one pass of the 4th-order Butterworth low-pass [Hz]; it runs forward and backward.
    seed: of what is drawn: the resampled blocks behind the intervals.
    """

    cutoff_hz: float = 48.0
    seed: int = 0
