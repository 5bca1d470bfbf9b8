"""Another machine on the bus than the controller was told: refused before anything moves."""

from __future__ import annotations

import pytest
from virtual_bench import VirtualBench

from drivetwin.controller.machine import load_machine
from drivetwin.controller.motor_check import check_motors
from drivetwin.foundation.errors import UserError
from drivetwin.motion.inverse_dynamics import read_mjcf


@pytest.mark.parametrize("machine", ["scara", "stage", "arm"])
@pytest.mark.parametrize("profile", ["servoone", "cia402-full"])
def test_each_machine_s_own_motors_pass(machine: str, profile: str) -> None:
    bench = VirtualBench(machine, profile).up()
    check_motors(bench.drives, bench.machine)


@pytest.mark.parametrize("machine", ["scara", "stage", "arm"])
def test_description_and_nominal_model_have_the_same_motors(machine: str) -> None:
    described = load_machine(machine)
    model = read_mjcf(described.model_path)
    for axis in described.axes.values():
        assert axis.motor_inertia is not None
        assert axis.motor_inertia * axis.gear_ratio**2 == pytest.approx(float(model.joint(axis.joint).armature[0]), rel=1e-3)


def test_another_motor_is_refused() -> None:
    bench = VirtualBench("stage").up()
    bench.virtual.drives[0].dictionary[0x21CD].value = 2.8e-5
    with pytest.raises(UserError, match=r"slide \(node 1\) tells a motor inertia of 2.8e-05 .* has 3.8e-05: is --machine"):
        check_motors(bench.drives, bench.machine)


def test_a_drive_that_does_not_know_its_motor_is_not_judged() -> None:
    bench = VirtualBench("stage").up()
    bench.virtual.drives[0].dictionary[0x21CD].value = 0.0
    check_motors(bench.drives, bench.machine)
