"""Digital inputs 60FDh and outputs 60FEh (CiA 402-2, clauses 'Digital inputs' and 'Digital outputs')."""

from __future__ import annotations

from emulator.drive.axis import Axis
from emulator.drive.hardware import NEVER

NEGATIVE_LIMIT_SWITCH, POSITIVE_LIMIT_SWITCH, HOME_SWITCH = 1 << 0, 1 << 1, 1 << 2
INTERLOCK = 1 << 3
PROBE_1, PROBE_2 = 1 << 16, 1 << 17
"""Bits of 60FDh; those from 16 on are the manufacturer's."""
BRAKE = 1 << 0
"""Bit 0 of 60FEh: set brake."""


def digital_inputs(axis: Axis) -> int:
    """60FDh: limit switches, home switch, interlock (safe torque off is requested), probe inputs."""
    angle, hardware = float(axis.servo.state["position"]), axis.hardware
    levels = {
        NEGATIVE_LIMIT_SWITCH: hardware.switches.negative(angle),
        POSITIVE_LIMIT_SWITCH: hardware.switches.positive(angle),
        HOME_SWITCH: (hardware.home_switch or NEVER).actuated(angle),
        INTERLOCK: hardware.sto,
        PROBE_1: hardware.probes[0].actuated(angle),
        PROBE_2: hardware.probes[1].actuated(angle),
    }
    return sum(bit for bit, level in levels.items() if level)


def digital_outputs(axis: Axis) -> int:
    """The outputs that are on: 60FEh:01, of which only those of the bit mask 60FEh:02 where the drive has one."""
    dictionary = axis.dictionary
    outputs = int(dictionary[0x60FE, 1].value)
    return outputs & int(dictionary[0x60FE, 2].value) if (0x60FE, 2) in dictionary else outputs
