"""Fuzz: spoiled files at everything that reads a foreign file, which has to end in a value or in one line.

What does not end within a minute counts as broken, and the process gets 8 GiB. The spoiled file that broke a reader, or ended
this process, lies in `--out`.
"""

from __future__ import annotations

import argparse
import logging
import resource
import shutil
import sys
import time
from collections import Counter
from pathlib import Path
from random import Random

from fuzzing.files import KINDS, BrokenError, Kind, try_spoiled
from rich.console import Console
from rich.progress import track

MEMORY = 8 << 30
SLOW_SHARE = 10
"""So many times fewer cases of a slow kind."""

console = Console(width=126, highlight=False)


def main() -> None:
    """Exit status 1 where a reader broke."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=2000, help="spoiled files of each kind")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kind", choices=KINDS, action="append", help="only this kind; repeatable")
    parser.add_argument("--out", type=Path, default=Path("out/fuzz_files"))
    options = parser.parse_args()
    logging.disable(logging.CRITICAL)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    broken = sum(fuzz(name, KINDS[name], options.cases, options.seed, options.out) for name in options.kind or KINDS)
    sys.exit(1 if broken else 0)


def fuzz(name: str, kind: Kind, cases: int, seed: int, out: Path) -> int:
    """How many of the spoiled files broke the reader; each is kept as out/NAME_CASE."""
    folder = out / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    kind.write(folder)
    sound = (folder / kind.name).read_bytes()
    kind.read(folder / kind.name)
    ended: Counter[str] = Counter()
    began, slowest = time.monotonic(), 0.0
    for case in track(range(max(1, cases // SLOW_SHARE) if kind.slow else cases), name, console=console, transient=True):
        start = time.monotonic()
        try:
            ended[try_spoiled(kind, folder, sound, Random(f"{name} {seed} {case}"))] += 1
        except BrokenError as error:
            ended["broken"] += 1
            shutil.copy(folder / kind.name, out / f"{name}_{case}{Path(kind.name).suffix}")
            console.print(f"{name} case {case}: {error}", markup=False)
        slowest = max(slowest, time.monotonic() - start)
    told = ", ".join(f"{count} {how}" for how, count in ended.most_common())
    console.print(f"{name}: {told}, {time.monotonic() - began:.0f} s, the slowest {slowest:.1f} s")
    return ended["broken"]


if __name__ == "__main__":
    main()
