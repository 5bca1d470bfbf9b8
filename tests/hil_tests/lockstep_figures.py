"""A program: what a run in lockstep consists of, in one process; prints a digest of each part.

Processors that choose other instructions give other digests, unless the environment says what they have in common.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable

import can
import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from drivetwin.bus.channel import InprocBus
from drivetwin.controller.bring_up import bring_up, connect
from drivetwin.controller.cycle import Cycle
from drivetwin.controller.excitation import excitation
from drivetwin.controller.link import Link
from drivetwin.controller.machine import load_machine
from drivetwin.controller.motion import enable_streaming, positions_now, stream
from drivetwin.controller.pacing import Lockstep
from drivetwin.controller.trajectory import move, side_by_side
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine as load_plant
from drivetwin.emulator.virtual_machine import VirtualMachine

FAR, SPEED, ACCELERATION = 0.05, 0.4, 4.0
"""Of the move on each axis [rad or m, per second, per second squared]."""


def main() -> None:
    """The SCARA moves all axes over the bus; a motion is planned and a regression solved as an identification does."""
    machine, profile, plant = load_machine("scara"), load_profile("servoone"), load_plant("scara")
    frames = hashlib.sha256()
    made: list[VirtualMachine] = []

    def joined(transmit: Callable[[can.Message], None]) -> VirtualMachine:
        def noted(message: can.Message) -> None:
            frames.update(message.arbitration_id.to_bytes(4, "little") + bytes(message.data))
            transmit(message)

        made.append(VirtualMachine(plant, profile, read_effects(plant.effects_path), SyncClock(), 0, noted))
        made[0].power_on()
        return made[0]

    with Link(InprocBus(joined)) as link:
        drives = connect(link, machine, profile)
        cycle = Cycle(link, drives, Lockstep())
        bring_up(link, drives, cycle.period)
        cycle.start()
        enable_streaming(cycle, drives)
        starts = positions_now(drives)
        stream(cycle, drives, side_by_side([move(at, at + FAR, SPEED, ACCELERATION, cycle.period) for at in starts]))
    planned = [excitation(axis, 0, 1e-3) for axis in machine.axes.values()]
    rows = np.random.default_rng(0).standard_normal((400, 12))
    solved = scipy.linalg.cho_solve(scipy.linalg.cho_factor(rows.T @ rows), rows.T @ np.sin(rows[:, 0]))
    data = made[0].plant.data
    told = {"plant": digest(data.qpos, data.qvel), "plan": digest(*planned), "fit": digest(solved)}
    told["frames"] = frames.hexdigest()
    for name, value in told.items():
        print(name, value)


def digest(*values: NDArray[np.float64]) -> str:
    """Of every bit."""
    return hashlib.sha256(b"".join(np.ascontiguousarray(one).tobytes() for one in values)).hexdigest()


if __name__ == "__main__":
    main()
