"""Another machine on the bus than the controller was told: refused before anything moves."""

from __future__ import annotations

import pytest
from virtual_bench import VirtualBench

from controller.motor_check import check_motors
from drivetwin.errors import UserError


@pytest.mark.parametrize("machine", ["scara", "stage", "arm"])
@pytest.mark.parametrize("profile", ["servoone", "cia402-full"])
def test_each_machine_s_own_motors_pass(machine: str, profile: str) -> None:
    bench = VirtualBench(machine, profile).up()
    check_motors(bench.drives, bench.machine)


def test_another_motor_is_refused() -> None:
    bench = VirtualBench("stage").up()
    bench.virtual.drives[0].dictionary[0x21CD].value = 2.8e-5
    with pytest.raises(UserError, match=r"slide \(node 1\) tells a motor inertia of 2.8e-05 .* has 15: is --machine stage"):
        check_motors(bench.drives, bench.machine)


def test_a_drive_that_does_not_know_its_motor_is_not_judged() -> None:
    bench = VirtualBench("stage").up()
    bench.virtual.drives[0].dictionary[0x21CD].value = 0.0
    check_motors(bench.drives, bench.machine)
