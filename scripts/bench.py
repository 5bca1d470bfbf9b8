"""Speed of the lockstep bench beside bare MuJoCo, measured in one run, and how long a master waits for an answer.

Speed is in simulated seconds a second of wall-clock: the controller, three drives at a 1 kHz cycle and the capture on one side;
`mj_step` of the same plant alone on the other. Answers are those of an SDO upload, and of a controlword: until the statusword
is there that tells the state it asks for, on the wall clock and on the simulated one. How long a diagnosis takes is measured by
bench_diagnosis.py.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import can
import mujoco
import numpy as np
from bench_diagnosis import SYSID_IS_THERE, beside_sysid, fits_table, five_minutes, phases_table
from rich.console import Console
from rich.table import Table

from drivetwin.bus.channel import InprocBus
from drivetwin.controller.bring_up import bring_up, connect
from drivetwin.controller.cycle import Cycle
from drivetwin.controller.drive_node import READY_TO_SWITCH_ON, SWITCH_ON_DISABLED, SWITCHED_ON, DriveNode
from drivetwin.controller.excitation import excitation
from drivetwin.controller.link import SYNC_COB_ID, Link
from drivetwin.controller.machine import load_machine
from drivetwin.controller.motion import DISABLE_VOLTAGE, SHUTDOWN, SWITCH_ON, enable_streaming, home, positions_now, stream
from drivetwin.controller.pacing import Lockstep
from drivetwin.controller.trajectory import move, side_by_side
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import Clock, RealtimeClock, SyncClock
from drivetwin.emulator.drive.servo import SERVO_PERIOD
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine as load_virtual_machine
from drivetwin.emulator.plant import Plant
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.foundation.files import provenance, write_json

SECONDS = 4.0
PERIOD = 0.001
"""Communication cycle [s]."""

FITTED_SECONDS = 60.0
"""Of the recording that is fitted beside mujoco.sysid."""

UPLOADS, CHANGES = 3000, 300
"""How often an answer is waited for."""

CHAIN = ((SHUTDOWN, READY_TO_SWITCH_ON), (SWITCH_ON, SWITCHED_ON), (DISABLE_VOLTAGE, SWITCH_ON_DISABLED))
"""Controlwords, one after the other, and the state that each asks for."""

console = Console(width=100)


def main() -> None:
    """Alternate both measurements, print medians and their ratio, write bench.json."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--out", type=Path, default=Path("out/bench"))
    options = parser.parse_args()
    with virtual_bench(SyncClock()) as bench:
        lockstep, bare = lockstep_bench(bench.link), bare_plant()
        lockstep(), bare()  # the first round compiles
        rounds = [(lockstep(), bare()) for _ in range(options.rounds)]
    with virtual_bench(SyncClock()) as bench:
        uploads = sdo_round_trips(bench)
    with virtual_bench(RealtimeClock()) as bench:
        changes = state_changes(bench)
    ours, mujoco_alone = (statistics.median(column) for column in zip(*rounds, strict=True))
    table = Table("what runs", "median, x real time", "least", "most")
    table.add_row("lockstep: controller, bus, 3 drives, plant, capture", f"{ours:.2f}", *extremes([row[0] for row in rounds]))
    table.add_row("bare mj_step of the same plant at 125 us", f"{mujoco_alone:.2f}", *extremes([row[1] for row in rounds]))
    console.print(table)
    console.print(f"share of bare MuJoCo's speed: {ours / mujoco_alone:.2f}; promised: at least 5 x real time", highlight=False)
    waits = {
        "SDO upload in process": uploads,
        "state change, wall clock": [change.wall for change in changes],
        "state change, simulated": [change.simulated for change in changes],
    }
    console.print(waits_table(waits))
    fits = beside_sysid(FITTED_SECONDS, options.rounds) if SYSID_IS_THERE else None
    if fits is None:
        console.print("mujoco.sysid lacks packages of its own: with mujoco[sysid] installed, fits are measured beside it")
    else:
        console.print(fits_table(fits, FITTED_SECONDS))
        console.print(f"times faster than mujoco.sysid, same error: {fits.ratio:.0f}; promised: at least 20", highlight=False)
    phases = five_minutes()
    console.print(phases_table(phases))
    figures = {"lockstep": ours, "bare_mj_step": mujoco_alone, "rounds": [list(row) for row in rounds]}
    diagnosis = {"fits": asdict(fits) if fits else None, "five_minutes": [asdict(phase) for phase in phases]}
    answers = {name: {"median_s": statistics.median(times), "p99_s": p99(times)} for name, times in waits.items()}
    head = {"schema": "bench/1", **provenance(0, [])}
    write_json(options.out / "bench.json", {**head, "times_real_time": figures, "answers": answers, "diagnosis": diagnosis})


def extremes(values: list[float]) -> tuple[str, str]:
    """Least and greatest, for the table."""
    return f"{min(values):.2f}", f"{max(values):.2f}"


def waits_table(waits: dict[str, list[float]]) -> Table:
    """Median, 99th percentile and most of each kind of answer."""
    table = Table("waiting for", "median, ms", "p99, ms", "most, ms", "of")
    for name, times in waits.items():
        milliseconds = [1e3 * statistics.median(times), 1e3 * p99(times), 1e3 * max(times)]
        table.add_row(name, *(f"{value:.3f}" for value in milliseconds), str(len(times)))
    return table


def p99(times: list[float]) -> float:
    """99th percentile."""
    return float(np.percentile(times, 99.0))


@dataclass(frozen=True)
class Bench:
    """A controller's link to the virtual SCARA, in process, and the machine, for its clock."""

    link: Link
    machine: VirtualMachine

    def __enter__(self) -> Bench:
        self.link.__enter__()
        return self

    def __exit__(self, *error: object) -> None:
        self.link.__exit__(None, None, None)

    def drives(self) -> list[DriveNode]:
        """Its drives, brought up."""
        drives = connect(self.link, load_machine("scara"), load_profile("servoone"))
        bring_up(self.link, drives, PERIOD)
        return drives


def virtual_bench(clock: Clock) -> Bench:
    """A bench that has been powered on."""
    virtual = load_virtual_machine("scara")
    effects = read_effects(virtual.effects_path)
    made: list[VirtualMachine] = []

    def connect_machine(transmit: Callable[[can.Message], None]) -> VirtualMachine:
        made.append(VirtualMachine(virtual, load_profile("servoone"), effects, clock, 0, transmit))
        made[0].power_on()
        return made[0]

    return Bench(Link(InprocBus(connect_machine)), made[0])


def sdo_round_trips(bench: Bench) -> list[float]:
    """Wall-clock seconds of expedited uploads of the statusword, through canopen's client."""
    drive = bench.drives()[0]
    times = []
    for _ in range(UPLOADS):
        began = time.perf_counter()
        drive.read(0x6041)
        times.append(time.perf_counter() - began)
    return times


@dataclass(frozen=True)
class StateChange:
    """Seconds from a controlword's frame to the statusword's, by both clocks."""

    wall: float
    simulated: float


def state_changes(bench: Bench) -> list[StateChange]:
    """The states from switch on disabled to switched on and back, at a SYNC a millisecond of the wall clock."""
    drives = bench.drives()
    changes = []
    for number in range(CHANGES):
        controlword, state = CHAIN[number % len(CHAIN)]
        for _ in range(5):
            sync_cycle(bench.link, drives)
            time.sleep(PERIOD)
        began, at = time.perf_counter(), bench.machine.now()
        drives[0].controlword = controlword
        sync_cycle(bench.link, drives)
        while drives[0].state != state:
            if not bench.link.pump(PERIOD):
                sync_cycle(bench.link, drives)
        changes.append(StateChange(time.perf_counter() - began, bench.machine.now() - at))
    return changes


def sync_cycle(link: Link, drives: Sequence[DriveNode]) -> None:
    """What the drives sent is taken; then a cycle's RPDOs and its SYNC."""
    link.drain()
    for drive in drives:
        drive.send_output()
    link.send(SYNC_COB_ID, b"")


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
