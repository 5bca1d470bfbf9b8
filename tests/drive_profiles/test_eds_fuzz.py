"""Whatever is done to an EDS: it is refused by a UserError, or the drive that comes of it powers on and runs.

Fifty files of each drive type; `make test-long` has three times as many.
"""

from __future__ import annotations

import logging
import random
from pathlib import Path

import can
import pytest
from repeats import LONG

from drivetwin.drive_profiles import load_profile
from drivetwin.drive_profiles.eds_profile import profile_from_eds
from drivetwin.drive_profiles.eds_writer import eds_text
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.foundation.errors import UserError

NUMBERS = ("0", "-1", "0x", "0xFFFFFFFF", "0xFFFFFFFFFFFFFFFFFF", "1e999", "nan", "$NODEID", "$NODEID+0x7FFFFFFF")
VALUES = (*NUMBERS, "", "7;7", "\xe9")
MUTATIONS_OF_A_FILE = 4
FILES = 150 if LONG else 50


def mutated(text: str, chance: random.Random) -> str:
    lines = text.splitlines()
    for _ in range(chance.randint(1, MUTATIONS_OF_A_FILE)):
        at = chance.randrange(len(lines))
        key, equals, _ = lines[at].partition("=")
        choice = chance.randrange(6)
        if choice == 0:
            del lines[at]
        elif choice == 1:
            lines.insert(at, lines[chance.randrange(len(lines))])
        elif choice == 2:
            lines[at] = "".join(chance.sample(lines[at], len(lines[at])))
        elif equals:
            lines[at] = key + equals + chance.choice(VALUES)
    return "\n".join(lines)


def run(name: str, seed: int, folder: Path) -> bool:
    """Whether the mutated file was taken."""
    file = folder / "drive.eds"
    file.write_text(mutated(eds_text(load_profile(name), file.name), random.Random(seed)), encoding="latin-1")
    try:
        profile = profile_from_eds(file, load_profile(name))
    except UserError:
        return False
    virtual = VirtualMachine(load_machine("stage"), profile, (), SyncClock(), 0, lambda _: None)
    virtual.power_on()
    for controlword in (0x06, 0x07, 0x0F):
        virtual.drives[0].dictionary[0x6040].write(controlword)
        virtual.receive(can.Message(arbitration_id=0x80, is_extended_id=False))
    return True


@pytest.mark.parametrize("name", ["servoone", "cia402-full", "dryve_d1"])
def test_a_mutated_eds_is_refused_or_works(name: str, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.CRITICAL)
    taken = [run(name, seed, tmp_path) for seed in range(FILES)]
    assert 0.3 * FILES < sum(taken) < FILES
