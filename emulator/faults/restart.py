"""A drive without power for a time: off now, on again after some simulated time."""

from __future__ import annotations

from drivetwin.emulator.faults.parameter import Number
from drivetwin.emulator.virtual_machine import VirtualMachine

OFF = Number("off", "how long it is off, in simulated time; 0: it boots at once", "s", 0.0, 3600.0)


def restart(virtual: VirtualMachine, axis: int, off: float, node_id: int | None = None) -> None:
    """Switch an axis's drive off, and on again `off` seconds later, with another node-ID where one is given.

    Nothing comes of it when the drive is switched off again or on before.
    """
    virtual.switch_off(axis)
    waiting = virtual.drives[axis]

    def boot(_now: float) -> None:
        if virtual.drives[axis] is waiting:
            virtual.switch_on(axis, node_id)

    if off == 0.0:
        boot(virtual.now())
    else:
        virtual.alarms.add(boot).set(virtual.now() + off)
