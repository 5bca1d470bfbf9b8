"""Fuzz: random and mutated frames at a live emulator, judged after each of them by what CiA 301 and CiA 402 allow.

Three drives on the SCARA's plant live through all frames of a drive type: sessions of real masters bring them into every
state, and in every state they get what no master sends. Afterwards they are brought up, homed and moved. The same for Modbus,
ten thousand frames at its TCP port, is tests/emulator/modbus/test_fuzz_modbus.py, which `--modbus` runs as well.
"""

from __future__ import annotations

import argparse
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from types import FrameType

import can
import numpy as np
from fuzzing.judge import Judge, Violation
from fuzzing.mutation import Mutation
from fuzzing.sessions import SYNC, Sessions, cycle_of, held_reset, record_sessions, rescue, restoring
from fuzzing.target import Event, Target
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from drivetwin.bus.channel import InprocBus
from drivetwin.controller.bring_up import bring_up, connect
from drivetwin.controller.cycle import Cycle
from drivetwin.controller.link import Link
from drivetwin.controller.machine import load_machine
from drivetwin.controller.motion import disable, enable_streaming, home, positions_now, stream
from drivetwin.controller.pacing import Lockstep
from drivetwin.controller.trajectory import move, side_by_side

PROFILES = ("servoone", "cia402-full")
EPISODE = 500
"""Random and mutated frames between two restorations of the drives."""

PATIENCE = 60
"""Wall-clock seconds after which one event counts as a hang; the longest cycle, 10 s of motion, takes some seconds."""

LONG_CYCLE = 0.05
"""Communication cycle [s] at which an episode ends: a spoiled 1006h would spend the time of all others."""

DEAFNESS = 140.0
"""Longest that a node changing its bit rate hears nothing: twice a switch delay of 16 bits [simulated seconds]."""

BURSTS = (0, 10, 100)
"""SYNCs that follow when drives were brought back to operation enabled, so that spoiled set-points become motion."""

COOLING = 100
"""Cycles of 100 ms for the motors to cool down before the drives have to work: a thermal time constant."""

FAULT_CODES = (0x2310, 0x3220, 0x7305, 0x8611)
MODBUS_TEST = Path(__file__).parents[1] / "tests/emulator/modbus/test_fuzz_modbus.py"

console = Console(width=126, highlight=False)


@dataclass
class Tally:
    """What was sent and what came back, by kind: `frames` random and mutated ones, `recorded` intact ones between."""

    frames: int = 0
    recorded: int = 0
    kinds: Counter[str] = field(default_factory=Counter)
    answers: Counter[str] = field(default_factory=Counter)


def main() -> None:
    """Fuzz each drive type with its share of the frames; exit status 1, and a log of the last frames, where a rule broke."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("out/fuzz"))
    parser.add_argument("--modbus", action="store_true", help="fuzz the Modbus ports as well")
    options = parser.parse_args()
    share = options.frames // len(PROFILES)
    if not all(fuzz(profile, share, options.seed, options.out) for profile in PROFILES):
        sys.exit(1)
    if options.modbus:
        sys.exit(subprocess.run([sys.executable, "-m", "pytest", str(MODBUS_TEST)], check=False).returncode)


def fuzz(profile: str, frames: int, seed: int, out: Path) -> bool:
    """`frames` random and mutated frames at three drives of a type; whether nothing broke."""
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as store:
        run = Run(profile, seed, Path(store))
        try:
            with Progress(console=console) as progress, watched():
                task = progress.add_task(profile, total=frames)
                for done in run.episodes(frames):
                    progress.update(task, completed=done)
                run.still_works()
        except Exception as error:  # noqa: BLE001  # whatever it is, it is what the fuzz looks for
            path = out / f"{profile}_seed{seed}.log"
            run.target.write_log(path)
            console.print(f"{profile}: after {run.tally.frames} frames: {type(error).__name__}: {error}; last frames in {path}")
            console.print_exception(max_frames=12)
            return False
        report(profile, run, time.monotonic() - began)
    return True


@contextmanager
def watched() -> Iterator[None]:
    """Raise Violation out of an event that does not end."""

    def hang(_number: int, _frame: FrameType | None) -> None:
        raise Violation(f"an event did not end within {PATIENCE} s")

    former = signal.signal(signal.SIGALRM, hang)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, former)


class Run:
    """One machine's life under fire."""

    def __init__(self, profile: str, seed: int, store: Path) -> None:
        self.tally = Tally()
        self.target = Target(profile, seed, store)
        self.judge = Judge(self.target.virtual)
        self._dice = Random(f"{profile} {seed}")
        self._mutation = Mutation(self.target.profile, self._dice)
        self._sessions: Sessions = record_sessions(profile)
        self._rescue = rescue()
        self._restoring = restoring(self.target.virtual.drives, self.target.profile)

    def episodes(self, frames: int) -> Iterator[int]:
        """Bring the drives into some state and fire, again and again; yields how many frames were fired so far."""
        while self.tally.frames < frames:
            self._restore()
            self._set_the_scene()
            self._fire(min(frames, self.tally.frames + EPISODE))
            self.judge.check_values()
            yield self.tally.frames

    def still_works(self) -> None:
        """A controller brings the drives up, homes them, moves them, and they get where they are told to."""
        self._restore()
        self._play([*cycle_of(100_000), *[None] * COOLING])
        self._restore()
        bus = InprocBus(lambda transmit: Peer(self._give, transmit))
        known = load_machine("scara")
        with Link(bus) as link:
            drives = connect(link, known, self.target.profile)
            cycle = Cycle(link, drives, Lockstep())
            bring_up(link, drives, cycle.period)
            cycle.start()
            home(cycle, drives)
            enable_streaming(cycle, drives)
            axes = known.axes.values()
            middles = [0.5 * sum(axis.travel) for axis in axes]
            ways = [
                move(start, middle, 0.5 * axis.max_speed, 0.5 * axis.max_acceleration, cycle.period)
                for start, middle, axis in zip(positions_now(drives), middles, axes, strict=True)
            ]
            stream(cycle, drives, side_by_side(ways))
            cycle.run_for(0.3)
            reached = self.target.virtual.plant.joint_positions()
            disable(cycle, drives)
        if not np.allclose(reached, middles, atol=1e-3):
            raise Violation(f"told to go to {middles}, the joints are at {reached}")

    # -- an episode ---------------------------------------------------------------------------------------------------

    def _restore(self) -> None:
        """Undo what was stored and configured, as a master would, and mend the hardware."""
        for drive in self.target.virtual.drives:
            hardware = drive.hardware
            hardware.sto, hardware.encoder_alive, hardware.dc_link_voltage = False, True, hardware.nominal_voltage
        deadline = self.target.virtual.now() + DEAFNESS
        while not self._all_boot(self._play(self._restoring)):
            if self.target.virtual.now() > deadline:
                raise Violation("drives do not come back from LSS, 1011h and a reset")
            self._play([None] * 500)

    def _all_boot(self, answers: list[can.Message]) -> bool:
        return {answer.arbitration_id for answer in answers if bytes(answer.data) == b"\0"} == {0x701, 0x702, 0x703}

    def _set_the_scene(self) -> None:
        """Operational or not, enabled or not, some with a fault, of the hardware or by name."""
        dice, drives = self._dice, self.target.virtual.drives
        scene = dice.random()
        if scene < 0.05:
            return
        self._play(self._sessions.bring_up)
        if scene < 0.15:
            return
        self._play(self._sessions.enable)
        if scene < 0.7:
            return
        drive = dice.choice(drives)
        if dice.random() < 0.5:
            self._play(held_reset())
        if scene < 0.8:
            drive.fault(dice.choice(FAULT_CODES))
        elif scene < 0.87:
            drive.hardware.sto = True
        elif scene < 0.94:
            drive.hardware.encoder_alive = False
        else:
            drive.hardware.dc_link_voltage = dice.choice((0.0, 100.0, 500.0))
        self._play((SYNC, SYNC))

    def _fire(self, until: int) -> None:
        """Frames of recorded sessions, some spoiled, with random ones between."""
        dice, tally = self._dice, self.tally
        names = list(self._sessions.by_name)
        while tally.frames < until and self.target.virtual.cycle() < LONG_CYCLE:
            if dice.random() < 0.4:
                self._play(self._rescue)
                self._play([SYNC] * dice.choice(BURSTS))
            events = self._sessions.by_name[dice.choice(names)]
            start = dice.randrange(len(events))
            for event in events[start : start + dice.randint(5, 80)]:
                if tally.frames >= until or self.target.virtual.cycle() >= LONG_CYCLE:
                    break
                self._fire_at(event)

    def _fire_at(self, event: Event) -> None:
        chance = self._dice.random()
        if chance < 0.3:
            self._count(*self._mutation.random_event())
        if 0.3 <= chance < 0.55 and event is not None:
            self._count(*self._mutation.mutated(event))
        elif 0.55 <= chance < 0.6 and event is not None:
            self._count("mutated: twice", event)
            self._give(event)
        elif chance < 0.97:  # else it is lost
            self.tally.recorded += 1
            self._give(event)

    def _count(self, kind: str, event: Event) -> None:
        self.tally.frames += event is not None
        self.tally.kinds[kind] += 1
        self._give(event)

    def _play(self, events: Sequence[Event]) -> list[can.Message]:
        """Intact events; what the last one brought."""
        self.tally.recorded += len(events)
        answers: list[can.Message] = []
        for event in events:
            answers = self._give(event)
        return answers

    def _give(self, event: Event) -> list[can.Message]:
        signal.alarm(PATIENCE)
        self.judge.before()
        answers = self.target.give(event)
        self.judge.after(event, answers)
        for answer in answers:
            self.tally.answers[kind_of(answer)] += 1
        return answers


class Peer:
    """The emulator as the other end of an in-process bus: `give` lets a frame happen and returns what it brought."""

    def __init__(
        self, give: Callable[[can.Message], list[can.Message]], transmit: Callable[[can.Message], None]
    ) -> None:
        self._give = give
        self._transmit = transmit

    def receive(self, message: can.Message) -> None:
        """Take one frame, send the answers."""
        for answer in self._give(message):
            self._transmit(answer)

    def poll(self) -> None:
        """Only SYNC moves time."""

    def wait(self) -> float | None:
        """Nothing to wait for."""
        return None


def kind_of(answer: can.Message) -> str:
    """What a drive's frame is, by its CAN-ID as the predefined connection set has it."""
    cob_id, data = answer.arbitration_id, answer.data
    if 0x580 < cob_id < 0x600:
        if data[0] == 0x80:
            return f"SDO abort {int.from_bytes(data[4:8], 'little'):08X}h"
        return "SDO answer"
    if 0x700 < cob_id < 0x780:
        return "boot-up" if data[0] == 0 else "heartbeat or guarding"
    if 0x080 < cob_id < 0x100:
        return f"EMCY {int.from_bytes(data[:2], 'little'):04X}h"
    return "LSS answer" if cob_id == 0x7E4 else "PDO"


def report(profile: str, run: Run, seconds: float) -> None:
    """Counts by kind, by answer and by state."""
    tally = run.tally
    table = Table("sent", "", "answered", "", "in state", "", title=f"{profile}: {tally.frames} random and mutated frames")
    columns = [counter.most_common() for counter in (tally.kinds, tally.answers, run.judge.seen)]
    for row in range(max(len(column) for column in columns)):
        cells = [column[row] if row < len(column) else ("", "") for column in columns]
        table.add_row(*(str(cell) for pair in cells for cell in pair))
    console.print(table)
    console.print(
        f"{profile}: {tally.frames} random and mutated frames among {tally.recorded} recorded ones, "
        f"{run.target.virtual.now():.0f} s of motion, {seconds:.0f} s: nothing broke; brought up, homed and moved afterwards"
    )


if __name__ == "__main__":
    main()
