"""Runs the acceptance suite many times in lockstep and compares the digests, then once in real time."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path

DRIVETWIN = [sys.executable, "-c", "from drivetwin.cli import main; main()"]


@dataclass(frozen=True)
class Repeat:
    """One run of the suite; `wall` in seconds, `digest` over all that its cases left."""

    clock: str
    accepted: bool
    digest: str
    wall: float


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bench", type=Path, default=Path("hil_tests/benches/scara.yaml"))
    parser.add_argument("--repeats", type=int, default=20, help="runs in lockstep (20)")
    parser.add_argument("--in-real-time", type=int, default=1, help="runs in real time after them (1)")
    parser.add_argument("--out", type=Path, default=Path("out/accept_repeats"))
    told = parser.parse_args()
    repeats = [_run(told.bench, told.out, number, "sync") for number in range(1, told.repeats + 1)]
    later = range(told.repeats + 1, told.repeats + 1 + told.in_real_time)
    repeats += [_run(told.bench, told.out, number, "realtime") for number in later]
    digests = {one.digest for one in repeats if one.clock == "sync"}
    (told.out / "repeats.json").write_text(json.dumps([asdict(one) for one in repeats], indent=2) + "\n")
    accepted = sum(one.accepted for one in repeats)
    print(f"{told.repeats} runs in lockstep: {len(digests)} digest(s); {accepted} of {len(repeats)} runs accepted")
    return 0 if len(digests) == 1 and all(one.accepted for one in repeats) else 1


def _run(bench: Path, out: Path, number: int, clock: str) -> Repeat:
    folder = out / f"{number:02d}_{clock}"
    began = time.monotonic()
    command = [*DRIVETWIN, "accept", "--bench", str(bench), "--clock", clock, "--out", str(folder)]
    status = subprocess.run(command, stdout=subprocess.DEVNULL, check=False).returncode
    results = json.loads((folder / "results.json").read_text())
    one = Repeat(clock, status == 0, results["digest"], time.monotonic() - began)
    print(f"{number:2d} {clock}: {'accepted' if one.accepted else 'REJECTED'}, {one.digest[:16]}, {one.wall:.0f} s", flush=True)
    return one


if __name__ == "__main__":
    sys.exit(main())
