"""A truth that no servo period can follow ends in one line: a plant that MuJoCo had to set back is no machine."""

from __future__ import annotations

import json
from pathlib import Path

import can
import mujoco
import pytest

from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.foundation.errors import UserError

SYNC = can.Message(arbitration_id=0x80, data=b"", is_extended_id=False)

EFFECTS = {
    "spring": {"stiffness": {"value": 1e12, "unit": "N/m"}, "rest": {"value": 1.0, "unit": "m"}},
    "torque_offset": {"offset": {"value": 1e300, "unit": "N"}},
}


@pytest.mark.parametrize("effect", EFFECTS)
def test_what_cannot_be_simulated_is_told(effect: str, tmp_path: Path) -> None:
    mujoco.set_mju_user_warning(lambda _message: None)  # it has to warn
    truth = tmp_path / "truth.json"
    entry = {"effect": effect, "axis": "slide", "parameters": EFFECTS[effect]}
    truth.write_text(json.dumps({"schema": "effects/1", "effects": [entry]}), encoding="utf-8")
    effects = read_effects(truth)
    virtual = VirtualMachine(load_machine("stage"), load_profile("servoone"), effects, SyncClock(), 0, lambda _frame: None)
    virtual.power_on()
    with pytest.raises(UserError, match=r"the simulation of the machine is unstable \(mjWARN_BAD(QACC|CTRL).*give a --truth"):
        run(virtual, 100)


def run(virtual: VirtualMachine, cycles: int) -> None:
    for _ in range(cycles):
        virtual.receive(SYNC)
        virtual.poll()
