"""The expectation `torque_limit_kept`: what 6072h lets each real drive give, against the limits file of the bench."""

from __future__ import annotations

from pathlib import Path

import pytest
from made_evidence import evidence, standing

from drivetwin.hil_tests.bench import read_bench
from drivetwin.hil_tests.evidence import TorqueLimit
from drivetwin.hil_tests.expectations.torque_limit_kept import TorqueLimitKept

ON_CAN0 = read_bench(Path("hil_tests/benches/scara_can0.yaml"), real=True)
KEPT = (TorqueLimit(0.1, "lift", 800.0), TorqueLimit(0.1, "rotate", 19.99), TorqueLimit(0.1, "stretch", 20.0))


def said(*limits: TorqueLimit) -> list[tuple[str | None, str, float | None, float | None]]:
    """Axis, message, what was measured and its limit."""
    finding = TorqueLimitKept().judge(evidence(standing(2.0), bench=ON_CAN0, torque_limits=limits))
    return [(one.axis, one.message, one.measured, one.limit) for one in finding.failures]


def test_limits_that_are_kept_are_accepted() -> None:
    assert said(*KEPT) == []


@pytest.mark.parametrize("before", [KEPT[:2], KEPT], ids=["at the start", "raised later"])
def test_a_drive_that_may_give_more_is_told_once(before: tuple[TorqueLimit, ...]) -> None:
    more, still_more = TorqueLimit(0.2, "stretch", 20.1), TorqueLimit(0.3, "stretch", 40.0)
    assert said(*before, more, still_more) == [("stretch", "node 3 may give more than real.limits say (6072h)", 20.1, 20.0)]


def test_what_nobody_wrote_or_read_is_not_taken_for_kept() -> None:
    unknown = TorqueLimit(0.1, "stretch", None)
    assert said(*KEPT[:2], unknown, KEPT[2]) == [
        ("stretch", "the controller neither wrote nor read back 6072h of node 3 before it started it", None, 20.0)
    ]
    assert said(*KEPT[:2]) == [("stretch", "node 3 was never started, and nobody knows its 6072h", None, 20.0)]


def test_virtual_drives_have_no_limits_file_to_keep() -> None:
    assert TorqueLimitKept().judge(evidence(standing(2.0))).failures == ()
