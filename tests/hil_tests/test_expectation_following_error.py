"""The expectation `following_error_limited`: a drive whose own limit is off is told; a type that has none is not."""

from __future__ import annotations

from dataclasses import replace

import pytest
from made_evidence import evidence, found, ordered, standing

from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.hil_tests.stand.observer import configuration_of


@pytest.mark.parametrize(("limited", "failures"), [(True, []), (None, []), (False, [("rotate", 0.0)])])
def test_a_limit_that_is_off_is_told(limited: bool | None, failures: list[tuple[str, float]]) -> None:
    nodes = {"lift": ordered(1), "rotate": replace(ordered(2), limits_following_error=limited), "stretch": ordered(3)}
    assert found("following_error_limited", evidence(standing(1.0), configured=nodes)) == failures


@pytest.mark.parametrize(("profile", "off"), [("servoone", 0), ("cia402-full", 0xFFFF_FFFF)])
def test_it_is_the_drive_that_tells(profile: str, off: int) -> None:
    machine = load_machine("scara")
    effects = read_effects(machine.effects_path)
    virtual = VirtualMachine(machine, load_profile(profile), effects, SyncClock(), 0, lambda _message: None)
    virtual.power_on()
    drive = virtual.drives[0]
    limit = drive.axis.role("following_error_limit")
    assert limit is not None
    for raw, limited in ((off, False), (1000, True)):
        limit.write(raw)
        assert configuration_of(drive, 0.0).limits_following_error is limited
