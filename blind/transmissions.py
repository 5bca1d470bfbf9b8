"""For development: cases of one effect of the transmission each, whose joints have an encoder of their own.

    python -m drivetwin.blind.transmissions write --count 40 --seed 1 --out out/transmissions
    python -m drivetwin.blind.transmissions ask --out out/transmissions

The second asks the diagnosis with the second encoder and without it, and prints how often the first cause is right.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from drivetwin.blind.wide.case import WideCase
from drivetwin.blind.wide.choice import choice
from drivetwin.blind.wide.draw import drawn_case
from drivetwin.blind.wide.record import record_wide
from drivetwin.blind.with_and_without import first_cause, no_progress, recordings_of, write_or_ask
from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.settings import Settings
from drivetwin.foundation.files import write_json
from drivetwin.recording.recording import Recording

EFFECTS = ("elasticity", "backlash", "transmission_error")


def cases(count: int, seed: int, families: Sequence[str] = ()) -> Iterator[WideCase]:
    """Single causes, each effect as often as any other, sized and beset with nuisances as those of the wide generator."""
    seeds = np.random.default_rng([seed, 12]).choice(2**31, size=count, replace=False)
    allowed = choice((*families, *EFFECTS))
    for number, own in enumerate(seeds):
        yield drawn_case(number, int(own), "single", (EFFECTS[number % len(EFFECTS)],), allowed)


def without_joints(recording: Recording) -> Recording:
    """As a machine without the second encoder records it."""
    columns = {
        axis: {name: values for name, values in own.items() if name != "joint_position"}
        for axis, own in recording.columns.items()
    }
    return replace(recording, columns=columns)


def write(count: int, seed: int, families: Sequence[str], out: Path) -> None:
    """OUT/case_NNN of every case, and OUT/key.json."""
    key: list[dict[str, Any]] = []
    for case in cases(count, seed, families):
        record_wide(case, out / f"case_{case.number:03d}", second_encoder=True)
        key.append(asdict(case))
        write_json(out / "key.json", {"schema": "blind-key/1", "seed": seed, "cases": key})


def ask(out: Path, ways: Sequence[str]) -> None:
    """One line a case: the truth, the first cause with the second encoder or without it, and how many were right so far."""
    right = dict.fromkeys(ways, 0)
    for done, case in enumerate(json.loads((out / "key.json").read_text(encoding="utf-8"))["cases"], start=1):
        folder, (cause, *_) = out / f"case_{case['number']:03d}", case["causes"]
        truth = f"{cause['effect']}@{cause['axis']}"
        train, check = recordings_of(folder, "train"), recordings_of(folder, "validate")
        line = f"{case['number']:03d} {case['machine']} {truth}, {cause['size']:.3f} of the torque:"
        for name in ways:
            kept = WAYS[name]
            begin = time.perf_counter()
            answer = first_cause(diagnose(folder / "model.xml", kept(train), kept(check), Settings(), no_progress))
            right[name] += answer == truth
            line += f" {name} {answer} ({right[name]}/{done}, {time.perf_counter() - begin:.0f} s)"
        sys.stdout.write(line + "\n")
        sys.stdout.flush()


def _without_joints(recordings: Sequence[Recording]) -> list[Recording]:
    return [without_joints(one) for one in recordings]


WAYS: dict[str, Callable[[Sequence[Recording]], list[Recording]]] = {"with": list, "without": _without_joints}
"""What the diagnosis is told of the second encoder."""


def main() -> None:
    """Write the cases, or ask for those that are written."""
    asked = write_or_ask(__doc__, WAYS).parse_args()
    if asked.what == "write":
        write(asked.count, asked.seed, asked.family, asked.out)
    else:
        ask(asked.out, asked.way or tuple(WAYS))


if __name__ == "__main__":
    main()
