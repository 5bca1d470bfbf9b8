"""Commands that are killed (SIGKILL) at random moments: nothing half-written, nobody living on, nothing left for good.

Afterwards the same command runs to its end in the same folder, where only its output stands then.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random

import psutil

DRIVETWIN = [sys.executable, "-m", "drivetwin"]

PATIENCE = 60.0
"""For the kernel to end the children of who was killed [s]."""


@dataclass(frozen=True)
class Victim:
    """A command whose output is OUT in a folder of its own: killed, OUT either holds `whole`, or is not there at all.

    `resumes`: OUT grows while the command runs, and the next run goes on with it.
    """

    name: str
    words: Sequence[str]
    whole: Sequence[str]
    resumes: bool = False


@dataclass(frozen=True)
class Kills:
    """How many kills of a command came while it ran, and what they broke."""

    name: str
    kills: int
    running: int
    broken: tuple[str, ...]


def kill_at_random(victim: Victim, kills: int, seed: int, folder: Path) -> Kills:
    """`folder` is new. The first run is not killed, to learn how long it takes; nor is the last, which has to succeed."""
    scratch = folder / "tmp"
    scratch.mkdir(parents=True)
    dice, broken, running = Random(f"{victim.name} {seed}"), [], 0
    began = time.monotonic()
    broken += _ends_well(victim, folder / "first", scratch)
    length = time.monotonic() - began
    place = folder / "place"
    place.mkdir()
    for number in range(kills):
        process = _start(victim, place, scratch)
        try:
            process.wait(dice.uniform(0.0, length))
        except subprocess.TimeoutExpired:
            running += 1
        broken += [f"kill {number}: {what}" for what in _killed(process)]
        broken += [f"kill {number}: {what}" for what in _half(victim, place)]
    broken += _ends_well(victim, place, scratch)
    return Kills(victim.name, kills, running, tuple(broken))


def _start(victim: Victim, place: Path, scratch: Path) -> subprocess.Popen[bytes]:
    place.mkdir(exist_ok=True)
    words = [word.replace("OUT", str(place / "out")) for word in victim.words]
    environment: Mapping[str, str] = {**os.environ, "TMPDIR": str(scratch)}
    with (place.parent / "said.txt").open("wb") as said:
        return subprocess.Popen([*DRIVETWIN, *words], stdout=said, stderr=said, stdin=subprocess.DEVNULL, env=environment)


def _killed(process: subprocess.Popen[bytes]) -> list[str]:
    """Kill it; who of its children lives on."""
    try:
        children = psutil.Process(process.pid).children(recursive=True)
    except psutil.NoSuchProcess:
        children = []
    process.send_signal(signal.SIGKILL)
    process.wait()
    _, living = psutil.wait_procs(children, timeout=PATIENCE)
    return [f"process {one.pid} lives on" for one in living]


def _half(victim: Victim, place: Path) -> list[str]:
    out = place / "out"
    if victim.resumes or not out.exists():
        return []
    return [f"{name} is missing in OUT" for name in victim.whole if not (out / name).exists()]


def _ends_well(victim: Victim, place: Path, scratch: Path) -> list[str]:
    """Run it to its end; what is wrong with that, and what it leaves beside its output."""
    status = _start(victim, place, scratch).wait()
    said = (place.parent / "said.txt").read_text(encoding="utf-8", errors="replace").strip().splitlines()
    wrong = [] if status == 0 else [f"a whole run ended with {status}: {said[-1] if said else 'without a word'}"]
    wrong += [f"{name} is missing after a whole run" for name in victim.whole if not (place / "out" / name).exists()]
    wrong += [f"{one.name} is left beside OUT" for one in place.iterdir() if one.name != "out"]
    return wrong + [f"{one.name} is left in the temporary folder" for one in scratch.iterdir()]
