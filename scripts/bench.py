"""Speed of the lockstep bench beside bare MuJoCo, measured in one run, and how long a master waits for an answer.

Speed is in simulated seconds a second of processor time, as other work may share the machine: the controller, three drives at a
1 kHz cycle and the capture on one side; `mj_step` of the same plant alone on the other. Answers are those of an SDO upload, and
of a controlword: until the statusword is there that tells the state it asks for, on the wall clock and on the simulated one.
bench_targets.py measures what else has a target, bench_diagnosis.py how long a diagnosis takes.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from bench_diagnosis import SYSID_IS_THERE, beside_sysid, fits_table, five_minutes, phases_table
from bench_lockstep import PERIOD, Bench, bare_plant, lockstep_bench, scara_bench
from bench_targets import targets, targets_table
from rich.console import Console
from rich.table import Table

from drivetwin.controller.drive_node import READY_TO_SWITCH_ON, SWITCH_ON_DISABLED, SWITCHED_ON, DriveNode
from drivetwin.controller.link import SYNC_COB_ID, Link
from drivetwin.controller.machine import load_machine
from drivetwin.controller.motion import DISABLE_VOLTAGE, SHUTDOWN, SWITCH_ON
from drivetwin.emulator.clock import RealtimeClock, SyncClock
from drivetwin.foundation.files import provenance, write_json

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
    parser.add_argument("--without-diagnosis", action="store_true", help="leave out the fits and the five minutes")
    options = parser.parse_args()
    with scara_bench(SyncClock()) as bench:
        lockstep, bare = lockstep_bench(bench.link, load_machine("scara")), bare_plant()
        lockstep(), bare()  # the first round compiles
        rounds = [(lockstep(), bare()) for _ in range(options.rounds)]
    with scara_bench(SyncClock()) as bench:
        uploads = sdo_round_trips(bench)
    with scara_bench(RealtimeClock()) as bench:
        changes = state_changes(bench)
    ours, mujoco_alone = (statistics.median(column) for column in zip(*rounds, strict=True))
    table = Table("what runs", "median, x real time", "least", "most")
    table.add_row("lockstep: controller, bus, 3 drives, plant, capture", f"{ours:.2f}", *extremes([row[0] for row in rounds]))
    table.add_row("bare mj_step of the same plant at 125 us", f"{mujoco_alone:.2f}", *extremes([row[1] for row in rounds]))
    console.print(table)
    waits = {
        "SDO upload in process": uploads,
        "state change, wall clock": [change.wall for change in changes],
        "state change, simulated": [change.simulated for change in changes],
    }
    console.print(waits_table(waits))
    reached = targets(ours, statistics.median(one / alone for one, alone in rounds), options.rounds)
    console.print(targets_table(reached))
    figures = {"lockstep": ours, "bare_mj_step": mujoco_alone, "rounds": [list(row) for row in rounds]}
    answers = {name: {"median_s": statistics.median(times), "p99_s": p99(times)} for name, times in waits.items()}
    told = [{**asdict(figure), "reached": figure.reached} for figure in reached]
    head = {"schema": "bench/1", **provenance(0, [])}
    written = {**head, "times_real_time": figures, "answers": answers, "targets": told}
    write_json(options.out / "bench.json", written)
    if not options.without_diagnosis:
        write_json(options.out / "bench.json", {**written, "diagnosis": of_the_diagnosis(options.rounds)})


def of_the_diagnosis(rounds: int) -> dict[str, object]:
    """How long a diagnosis takes: printed, and as bench.json has it."""
    fits = beside_sysid(FITTED_SECONDS, rounds) if SYSID_IS_THERE else None
    if fits is None:
        console.print("mujoco.sysid lacks packages of its own: with mujoco[sysid] installed, fits are measured beside it")
    else:
        console.print(fits_table(fits, FITTED_SECONDS))
        console.print(f"times faster than mujoco.sysid, same error: {fits.ratio:.0f}; promised: at least 20", highlight=False)
    phases = five_minutes()
    console.print(phases_table(phases))
    return {"fits": asdict(fits) if fits else None, "five_minutes": [asdict(phase) for phase in phases]}


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


if __name__ == "__main__":
    main()
