"""`make unbroken`: a soak with random faults, commands killed at random moments, outputs that fail; fixed seeds.

Example: python -m unbroken --soak 3600 --kills 20 --out out/unbroken

Prints what was tried and what broke, writes OUT/unbroken.json, and ends with 1 where anything broke.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

from fuzzing.files import KINDS
from rich.console import Console

from drivetwin.foundation.files import write_json
from unbroken.disks import can_mount, on_a_small_disk
from unbroken.kills import DRIVETWIN, Victim, kill_at_random
from unbroken.soak import soak

DISKS = ("size=4k", "size=16k", "size=64k", "size=256k", "size=1m", "ro")
"""Mount options: the first ones are smaller than what is written, the last takes nothing."""

RECORDING = ("recording.json", "signals.parquet")
RECORDED = "identified"


def main() -> int:
    """All parts that are asked for; 0 asks for none of a part."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--soak", type=float, default=3600.0, metavar="SECONDS", help="simulated, with random faults (3600)")
    parser.add_argument("--kills", type=int, default=20, help="of each command (20)")
    parser.add_argument("--only", action="append", help="only these commands are killed or get a small disk; repeatable")
    parser.add_argument("--no-disks", action="store_true", help="leave out the disks that fail")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("out/unbroken"))
    told = parser.parse_args()
    console, parts, broken = Console(width=128, highlight=False), {}, []
    for name, figures, wrong in _all(told):
        parts[name] = figures
        broken += [f"{name}: {one}" for one in wrong]
        console.print(f"{name}: {figures}", markup=False)
    for one in broken:
        console.print(f"broken: {one}", markup=False)
    write_json(told.out / "unbroken.json", {"schema": "unbroken/1", "seed": told.seed, "parts": parts, "broken": broken})
    return 1 if broken else 0


def _all(told: argparse.Namespace) -> Iterator[tuple[str, dict[str, object], list[str]]]:
    """Each part: its name, its figures, what broke."""
    if told.soak:
        began = time.monotonic()
        lived = soak(told.soak, told.seed)
        yield "soak", {**asdict(lived), "wall": round(time.monotonic() - began)}, list(lived.broken)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        chosen = [one for one in victims(folder) if not told.only or one.name in told.only]
        if any(one.name == "diagnose" for one in chosen):
            record(folder)
        for victim in chosen if told.kills else ():
            killed = kill_at_random(victim, told.kills, told.seed, folder / f"killed {victim.name}")
            yield f"killed: {victim.name}", {"kills": killed.kills, "while it ran": killed.running}, list(killed.broken)
        if not told.no_disks:
            yield from _disks(chosen, folder)


def _disks(chosen: list[Victim], folder: Path) -> Iterator[tuple[str, dict[str, object], list[str]]]:
    if not can_mount():
        yield "disks", {"skipped": "this user cannot mount a small disk (unshare -rm mount)"}, []
        return
    disk = folder / "disk"
    disk.mkdir()
    for victim in chosen:
        ends = {options: on_a_small_disk(victim, options, disk) for options in DISKS}
        refused = [options for options, end in ends.items() if end.status != 0]
        wrong = [f"{options}: {end.broken()}" for options, end in ends.items() if end.broken() is not None]
        yield f"small disk: {victim.name}", {"disks": len(ends), "refused": refused}, wrong


def victims(folder: Path) -> list[Victim]:
    """The commands that write, on inputs that are written to `folder`; what diagnose takes is written by `record`."""
    table, recording = folder / "table", folder / "recording"
    for place, kind in ((table, "csv"), (recording, "recording.json")):
        place.mkdir()
        KINDS[kind].write(place)
    recorded = folder / RECORDED / "recordings"
    motion = [str(recorded / f"{kind}_slide") for kind in ("strokes", "excitation")]
    gap = ["diagnose", "emulator/machines/stage/stage.xml", *motion, "--validate", str(recorded / "validation_slide")]
    boot = ["--bench", "hil_tests/benches/scara.yaml", "--select", "01", "--jobs", "2"]
    return [
        Victim("eds", ["eds", "--profile", "cia402-full", "--out", "OUT"], ()),
        Victim("import", ["import", str(table / "scope.csv"), "--map", str(table / "map.yaml"), "--out", "OUT"], RECORDING),
        Victim("identify", ["identify", "--machine", "stage", "--quiet", "--out", "OUT"], ("identified.json", "report.html")),
        Victim("diagnose", [*gap, "--quiet", "--out", "OUT"], ("report.json", "report.html", "patched.xml")),
        Victim("accept", ["accept", *boot, "--quiet", "--out", "OUT"], ("results.json", "report.html"), resumes=True),
    ]


def record(folder: Path) -> None:
    """What an identification records, below `folder`."""
    asked = ["identify", "--machine", "stage", "--quiet", "--out", str(folder / RECORDED)]
    subprocess.run([*DRIVETWIN, *asked], stdin=subprocess.DEVNULL, check=True)


if __name__ == "__main__":
    sys.exit(main())
