"""60B2h counts thousandths of rated torque: what rounding leaves of a fine torque is carried on, not lost."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from streaming_bench import streaming

from drivetwin.foundation.errors import UserError


def test_rounding_is_carried_from_cycle_to_cycle(tmp_path: Path) -> None:
    """Up to any cycle the sum of what is sent is within half a count of the sum of what was asked for."""
    with streaming("stage", "servoone", (), tmp_path / "bus.log") as bench:
        drive = bench.session.drives[0]
        count = float(drive.read(0x6076)) * 1e-6 * drive.axis.gear_ratio
        asked = count * (0.3 + 5.0 * np.sin(np.arange(2000) / 300.0))
        sent = np.array(drive.torque_offsets(asked))
        with pytest.raises(UserError, match=r"axis slide \(node 1\): a torque offset of .* is beyond the .* of 60B2h"):
            drive.torque_offsets(np.full(3, 40000.0 * count))
    assert np.abs(np.cumsum(sent) - np.cumsum(asked / count)).max() <= 0.5 + 1e-9
    assert np.abs(sent - asked / count).max() <= 1.0 + 1e-9
    assert np.abs(np.cumsum(np.rint(asked / count)) - np.cumsum(asked / count)).max() > 5.0, "plain rounding would lose some"
