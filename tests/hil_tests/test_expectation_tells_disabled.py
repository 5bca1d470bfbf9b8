"""The expectation `tells_disabled`: a real drive that tells nothing is not taken for one that is disabled."""

from __future__ import annotations

from made_evidence import evidence, judged, standing

from drivetwin.emulator.drive.state_machine import State
from drivetwin.hil_tests.evidence import StateChange

ENABLED = StateChange(0.5, "rotate", State.SWITCHED_ON, State.OPERATION_ENABLED)
DISABLED = StateChange(1.0, "rotate", State.OPERATION_ENABLED, State.SWITCH_ON_DISABLED)


def said(told: frozenset[str] | None, *states: StateChange) -> list[tuple[str | None, str]]:
    finding = judged("tells_disabled", evidence(standing(2.0), states=states, told=told))
    return [(failure.axis, failure.message) for failure in finding.failures]


def test_a_real_drive_has_to_tell_its_state() -> None:
    assert said(frozenset(("lift", "rotate", "stretch")), ENABLED, DISABLED) == []
    assert said(frozenset(("rotate", "stretch")), ENABLED, DISABLED) == [
        ("lift", "no frame told the state of node 1 since it booted")
    ]


def test_virtual_drives_are_asked_from_within() -> None:
    assert said(None) == []


def test_a_drive_that_stays_enabled_is_told() -> None:
    everyone = frozenset(("lift", "rotate", "stretch"))
    assert said(everyone, ENABLED) == [("rotate", "the controller has gone, and the drive tells operation enabled")]
