"""A drive type that the procedure cannot use is refused before anything is sent."""

from __future__ import annotations

import pytest
from virtual_bench import VirtualBench

from drivetwin.controller.bring_up import connect
from drivetwin.drive_profiles import load_profile
from drivetwin.foundation.errors import UserError


def test_a_drive_type_without_a_torque_to_capture() -> None:
    bench = VirtualBench("arm")
    sent = len(bench.sent)
    with pytest.raises(UserError, match="dryve_d1 have no torque_actual"):
        connect(bench.link, bench.machine, load_profile("dryve_d1"))
    assert len(bench.sent) == sent
