"""Speed of the lockstep bench beside bare MuJoCo, measured in one run: simulated seconds a second of wall-clock.

The controller, three drives at a 1 kHz cycle and the capture on one side; `mj_step` of the same plant alone on the other.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import can
import mujoco
import numpy as np
from rich.console import Console
from rich.table import Table

from controller.bring_up import bring_up, connect
from controller.cycle import Cycle
from controller.excitation import excitation
from controller.link import Link
from controller.machine import load_machine
from controller.motion import enable_streaming, home, positions_now, stream
from controller.pacing import Lockstep
from controller.trajectory import move, side_by_side
from drive_profiles import load_profile
from drivetwin.bus import InprocBus
from drivetwin.files import provenance, write_json
from emulator.clock import SyncClock
from emulator.drive.servo import SERVO_PERIOD
from emulator.effects import read_effects
from emulator.machine import load_machine as load_virtual_machine
from emulator.plant import Plant
from emulator.virtual_machine import VirtualMachine

SECONDS = 4.0
console = Console(width=100)


def main() -> None:
    """Alternate both measurements, print medians and their ratio, write bench.json."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--out", type=Path, default=Path("out/bench"))
    options = parser.parse_args()
    with virtual_link() as link:
        lockstep, bare = lockstep_bench(link), bare_plant()
        lockstep(), bare()  # the first round compiles
        rounds = [(lockstep(), bare()) for _ in range(options.rounds)]
    ours, mujoco_alone = (statistics.median(column) for column in zip(*rounds, strict=True))
    table = Table("what runs", "median, x real time", "least", "most")
    table.add_row("lockstep: controller, bus, 3 drives, plant, capture", f"{ours:.2f}", *extremes([row[0] for row in rounds]))
    table.add_row("bare mj_step of the same plant at 125 us", f"{mujoco_alone:.2f}", *extremes([row[1] for row in rounds]))
    console.print(table)
    console.print(f"share of bare MuJoCo's speed: {ours / mujoco_alone:.2f}; promised: at least 5 x real time", highlight=False)
    figures = {"lockstep": ours, "bare_mj_step": mujoco_alone, "rounds": [list(row) for row in rounds]}
    write_json(options.out / "bench.json", {"schema": "bench/1", **provenance(0, []), "times_real_time": figures})


def extremes(values: list[float]) -> tuple[str, str]:
    """Least and greatest, for the table."""
    return f"{min(values):.2f}", f"{max(values):.2f}"


def virtual_link() -> Link:
    """A controller's link to the virtual SCARA, in process, moved by SYNC."""
    virtual = load_virtual_machine("scara")
    effects = read_effects(virtual.effects_path)

    def connect_machine(transmit: Callable[[can.Message], None]) -> VirtualMachine:
        machine = VirtualMachine(virtual, load_profile("servoone"), effects, SyncClock(), 0, transmit)
        machine.power_on()
        return machine

    return Link(InprocBus(connect_machine))


def lockstep_bench(link: Link) -> Callable[[], float]:
    """A homed and enabled machine; each call streams an exciting move on all axes and returns its speed."""
    known, profile = load_machine("scara"), load_profile("servoone")
    drives = connect(link, known, profile)
    cycle = Cycle(link, drives, Lockstep())
    bring_up(link, drives, cycle.period)
    cycle.start()
    home(cycle, drives)
    enable_streaming(cycle, drives)
    axes = known.axes.values()
    middles = [0.5 * (axis.travel[0] + axis.travel[1]) for axis in axes]
    starts = positions_now(drives)
    stream(
        cycle,
        drives,
        side_by_side([move(start, middle, 0.2, 0.5, cycle.period) for start, middle in zip(starts, middles, strict=True)]),
    )
    moves = side_by_side([excitation(axis, 0, cycle.period) for axis in axes])[: round(SECONDS / cycle.period)]

    def run() -> float:
        began = time.perf_counter()
        stream(cycle, drives, moves)
        return len(moves) * cycle.period / (time.perf_counter() - began)

    return run


def bare_plant() -> Callable[[], float]:
    """The plant alone, under a torque that keeps it moving; each call steps it and returns its speed."""
    machine = load_virtual_machine("scara")
    plant = Plant(machine, read_effects(machine.effects_path))
    steps = round(SECONDS / SERVO_PERIOD)
    torque = np.array([0.28, 0.06, 0.03])

    def run() -> float:
        plant.data.ctrl[:] = torque
        began = time.perf_counter()
        for _ in range(steps):
            mujoco.mj_step(plant.model, plant.data)
        return SECONDS / (time.perf_counter() - began)

    return run


if __name__ == "__main__":
    main()
