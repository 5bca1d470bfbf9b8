"""A machine that is on a bus compiles nothing any more: for as long as it did, no frame was answered."""

from __future__ import annotations

import subprocess
import sys

PATIENCE = 300.0

RUN = """
import gc

import can
from numba.core.dispatcher import Dispatcher

from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.drive.modes import modes
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.virtual_machine import VirtualMachine


def compiled():
    return {one.py_func.__qualname__: len(one.signatures) for one in gc.get_objects() if isinstance(one, Dispatcher)}


def sync(cycles):
    for _ in range(cycles):
        virtual.receive(can.Message(arbitration_id=0x80, is_extended_id=False))


def write(index, value, subindex=0):
    for drive in virtual.drives:
        drive.dictionary[index, subindex].write(value)


virtual = VirtualMachine(load_machine(MACHINE), load_profile("cia402-full"), (), SyncClock(), 0, lambda _: None)
virtual.power_on()
before = compiled()
write(0x6098, 17)
for interpolation in (0, -1):
    write(0x60C0, interpolation)
    for mode in virtual.drives[0].profile.modes:
        for word in (0x00, 0x06, 0x07):
            write(0x6040, word)
            sync(2)
        write(0x6060, mode)
        write(0x6040, 0x0F)
        sync(2)
        assert virtual.drives[0].dictionary[0x6041].read() & 0x6F == 0x27, mode
        for index, value in ((0x6042, 10), (0x6071, 10), (0x607A, 1000), (0x60FF, 1000)):
            write(index, value)
        for word in (0x1F, 0x7F, 0x11F, 0x0F, 0x02):  # moved, halted, stopped
            write(0x6040, word)
            sync(3)
after = compiled()
print(sorted(name for name in after if after[name] != before[name]))
"""


def compiled_late(machine: str) -> str:
    """Functions that were compiled once the machine was on a bus and used in every mode, in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", f"MACHINE = {machine!r}\n{RUN}"], capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_several_axes_compile_nothing_on_the_bus() -> None:
    assert compiled_late("scara") == "[]"


def test_one_axis_compiles_nothing_on_the_bus() -> None:
    """Its demand lies in memory without gaps, which is another type to the compiler."""
    assert compiled_late("stage") == "[]"
