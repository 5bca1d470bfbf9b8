"""Records a case over the bus: the controller moves the withheld machine, and what a user would have is written."""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
from argparse import ArgumentParser
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import can
import numpy as np

from drivetwin.blind.case import Case
from drivetwin.blind.draw import draw_cases
from drivetwin.blind.machines import CURRENT_LOOP, MODEL, DrawnMachine, controller_machine, draw_machine, off, virtual_machine
from drivetwin.blind.motions import PERIOD, Plan, draw_plans
from drivetwin.blind.plants import plant_of
from drivetwin.bus.channel import InprocBus
from drivetwin.controller.pacing import Lockstep
from drivetwin.controller.progress import Progress
from drivetwin.controller.session import Session, Streaming, session_on
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.recording.recording import Recording
from drivetwin.recording.writer import write_recording

MODEL_OFF = "model_off.xml"

LATE = 0.3
"""Following error that a drive may have while it is recorded, as time at the axis's full speed [s]."""


def record_case(case: Case, directory: Path) -> None:
    """Move the machine of a case and write what a user of the diagnosis has, and nothing of the truth.

    `directory` gets model.xml (the nominal machine, exactly), model_off.xml (the same, some per cent off), training/NAME and
    validation/NAME (recordings of one power-on, on one time), and fresh/NAME, which no diagnosis is given.
    """
    machine = draw_machine(case.machine, case.seed)
    directory.mkdir(parents=True, exist_ok=True)
    (directory / MODEL).write_text(machine.model, encoding="utf-8")
    (directory / MODEL_OFF).write_text(off(machine.model, case.seed), encoding="utf-8")
    pacing = Lockstep()
    with tempfile.TemporaryDirectory() as hidden:
        bus = _bus(case, machine, Path(hidden))
        known = controller_machine(machine, directory)
        profile = load_profile("servoone")
        with session_on(bus, known, profile, pacing, None, Progress(), Path(os.devnull), Streaming(PERIOD)) as session:
            _let_err(session, machine)
            for folder, plan in draw_plans(machine, case.seed):
                write_recording(_recorded(session, pacing, plan), directory / folder / plan.name)


def _bus(case: Case, machine: DrawnMachine, hidden: Path) -> InprocBus:
    """A bus with the withheld machine on its other end; `hidden` holds its files."""

    def connect(transmit: Callable[[can.Message], None]) -> VirtualMachine:
        virtual = virtual_machine(machine, hidden)
        plant = plant_of(case, machine, virtual)
        machine_on_bus = VirtualMachine(virtual, load_profile("servoone"), (), SyncClock(), case.seed, transmit, plant=plant)
        machine_on_bus.power_on()
        return machine_on_bus

    return InprocBus(connect)


def _let_err(session: Session, machine: DrawnMachine) -> None:
    """Whoever looks for a fault lets the axes do what it makes them do: up to the limit switches, and late by `LATE`."""
    for drive, axis in zip(session.drives, machine.axes.values(), strict=True):
        drive.limit_following_error(LATE * axis.max_speed)
        drive.stay_within(*axis.limit_switches)


def _recorded(session: Session, pacing: Lockstep, plan: Plan) -> Recording:
    """One recording, whose time counts from power-on; the current loop's lag, which no drive tells, is as commissioned."""
    session.go_to(plan.start)
    begin = pacing.time()
    recording = session.capture(plan.name, plan.paths)
    for axis in recording.info.axes.values():
        axis.drive = axis.drive and axis.drive.model_copy(update={"current_loop_time_constant": CURRENT_LOOP})
    return replace(recording, time=np.asarray(begin + np.arange(len(recording.time)) * PERIOD, dtype=np.float64))


def main() -> None:
    """For development only: draws and records cases and writes their key beside them in the clear."""
    parser = ArgumentParser(description=main.__doc__)
    parser.add_argument("--count", type=int, default=5)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--formulation", help="in place of the drawn ones: library is the emulator's own plant")
    parser.add_argument("--only", type=int, nargs="*", help="numbers of the cases to record")
    asked = parser.parse_args()
    cases = draw_cases(asked.count, asked.seed)
    if asked.formulation:
        cases = tuple(replace(case, formulation=asked.formulation) for case in cases)
    asked.out.mkdir(parents=True, exist_ok=True)
    (asked.out / "keys.json").write_text(json.dumps([asdict(case) for case in cases], indent=1), encoding="utf-8")
    for case in cases:
        if asked.only and case.number not in asked.only:
            continue
        begin = time.perf_counter()
        record_case(case, asked.out / f"{case.number:03d}")
        causes = ", ".join(f"{cause.effect}@{cause.axis}" for cause in case.causes) or "clean"
        took = time.perf_counter() - begin
        sys.stderr.write(f"{case.number:03d} {case.machine} {case.formulation}: {causes}: {took:.1f} s\n")


if __name__ == "__main__":
    main()
