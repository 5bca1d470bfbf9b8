"""Digital inputs 60FDh and outputs 60FEh (CiA 402-2, clauses 'Digital inputs' and 'Digital outputs')."""

from __future__ import annotations

from drivetwin.emulator.drive.axis import Axis
from drivetwin.emulator.drive.hardware import NEVER
from drivetwin.emulator.drive.objects import optional

NEGATIVE_LIMIT_SWITCH, POSITIVE_LIMIT_SWITCH, HOME_SWITCH = 1 << 0, 1 << 1, 1 << 2
INTERLOCK = 1 << 3
PROBE_1, PROBE_2 = 1 << 16, 1 << 17
"""Bits of 60FDh; those from 16 on are the manufacturer's."""
BRAKE = 1 << 0
"""Bit 0 of 60FEh: set brake."""


def digital_inputs(axis: Axis) -> int:
    """60FDh: limit switches, home switch, interlock (safe torque off is requested), probe inputs.

    The negative limit switch is that towards negative positions, by 607Eh, as homing methods and faults have it.
    """
    angle, hardware = float(axis.servo.state["position"]), axis.hardware
    levels = {
        NEGATIVE_LIMIT_SWITCH: axis.limit_switch(-1, angle),
        POSITIVE_LIMIT_SWITCH: axis.limit_switch(1, angle),
        HOME_SWITCH: (hardware.home_switch or NEVER).actuated(angle),
        INTERLOCK: hardware.sto,
        PROBE_1: hardware.probes[0].actuated(angle),
        PROBE_2: hardware.probes[1].actuated(angle),
    }
    return sum(bit for bit, level in levels.items() if level)


class DigitalOutputs:
    """The outputs that are on: 60FEh:01, of which only those of the bit mask 60FEh:02 where the drive has one."""

    def __init__(self, axis: Axis) -> None:
        self._written, self._mask = (optional(axis.dictionary, 0x60FE, subindex) for subindex in (1, 2))

    def on(self) -> int:
        """Bits of 60FEh."""
        written = 0 if self._written is None else int(self._written.value)
        return written if self._mask is None else written & int(self._mask.value)

    def sets_brake(self) -> bool:
        """Whether a master engages the holding brake: bit 0, 1 = brake activated."""
        written = self._written
        return written is not None and written.value != 0 and bool(self.on() & BRAKE)
