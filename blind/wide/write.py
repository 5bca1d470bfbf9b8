"""For development: draws cases and writes them with their key beside them in the clear."""

from __future__ import annotations

import sys
import time
from argparse import ArgumentParser
from dataclasses import asdict
from pathlib import Path

from drivetwin.blind.wide.choice import choice
from drivetwin.blind.wide.draw import each_wide
from drivetwin.blind.wide.record import record_wide
from drivetwin.foundation.files import write_json


def main() -> None:
    """Write OUT/case_NNN of every case, and OUT/key.json."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--family", action="append", default=[], help="as of drivetwin blind")
    parser.add_argument("--without", action="append", default=[], help="as of drivetwin blind")
    parser.add_argument("--robots", type=Path, help="a folder of MJCF robot models")
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    allowed, cases = choice(asked.family, asked.without, asked.robots), []
    for case in each_wide(asked.count, asked.seed, allowed, asked.workers):
        begin = time.perf_counter()
        record_wide(case, asked.out / f"case_{case.number:03d}", asked.robots)
        cases.append(asdict(case))
        write_json(asked.out / "key.json", {"schema": "blind-key/1", "seed": asked.seed, "cases": cases})
        causes = ", ".join(f"{cause.effect}@{cause.axis}" for cause in case.causes) or "clean"
        sys.stderr.write(f"{case.number:03d} {case.machine}: {causes}: {time.perf_counter() - begin:.1f} s\n")


if __name__ == "__main__":
    main()
