"""For development: cases of one effect each, of which position and demand are all that is recorded, as of a hobby servo.

    python scripts/position_only.py write --count 40 --seed 1 --out out/position_only
    python scripts/position_only.py ask --out out/position_only

The second asks the diagnosis with the recorded torque and without it, and prints how often the first cause is right.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, replace
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

from drivetwin.blind.case import Cause
from drivetwin.blind.wide.case import WideCase
from drivetwin.blind.wide.choice import choice
from drivetwin.blind.wide.draw import drawn_case, world_of
from drivetwin.blind.wide.effects import DRIVE
from drivetwin.blind.wide.record import record_wide
from drivetwin.blind.wide.weighing import Recorded
from drivetwin.blind.with_and_without import first_cause, no_progress, recordings_of, write_or_ask
from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.report.closed_loop import in_closed_loop
from drivetwin.diagnosis.settings import Settings
from drivetwin.foundation.files import write_json
from drivetwin.recording.recording import TORQUE, Recording

LAWS = ("cascade", "pi_p", "pid")
"""Of drives that move by a demand of the position and whose gains are told."""
FASTEST = 500.0
"""Rows a second that such a log has at most."""
KEPT = ("position", "position_demand", "velocity_offset", "torque_offset")
"""Columns that such a log may have: what was counted, and what was sent."""


def cases(count: int, seed: int, only: Sequence[str] = (), without: Sequence[str] = ()) -> Iterator[WideCase]:
    """Single causes, each effect as often as any other, sized and beset with nuisances as those of the wide generator.

    Effects between the torque that a drive asks for and the one that it gives are none: only a recorded torque tells them. Nor
    is one where such a log shows more of a nuisance. `only` and `without` name families and effects, as of `drivetwin blind`.
    """
    draw = np.random.default_rng([seed, 13])
    seeds = iter(draw.choice(2**31, size=20 * count, replace=False))
    allowed = choice(only, without)
    effects = [name for name in draw.permutation(list(allowed.effects)) if name not in DRIVE]
    for number in range(count):
        drawn = (drawn_case(number, int(own), "single", (str(effects[number % len(effects)]),), allowed) for own in seeds)
        case = next((case for case in drawn if case.drive in LAWS and shows_most_of_its_cause(case)), None)
        if case is None:
            raise SystemExit(f"of {20 * count} machines too few are told and show most of their cause: draw another --seed")
        yield case


def shows_most_of_its_cause(case: WideCase) -> bool:
    """Whether nothing else costs its axis more on validation motion, less a recording's mean where an integral hides that."""
    world = world_of(case, None)
    checks = [
        Recorded.of(world, case.items, world.moved(case.items, plan), plan)
        for plan in world.plans
        if plan.name.startswith("validate")
    ]

    def energy(item: Cause) -> float:
        costs = [one.cost(world, item, case.items) for one in checks]
        hides = world.drives[world.names.index(item.axis)].integral > 0.0
        return sum(float(np.sum((cost - hides * np.mean(cost)) ** 2)) for cost in costs)

    cause, *others = case.items
    return energy(cause) > max((energy(item) for item in others if item.axis == cause.axis), default=0.0)


def position_only(recording: Recording) -> Recording:
    """As a robot logs itself that measures no torque: at most 500 rows a second of position and of what it was sent."""
    step = ceil(1.0 / (recording.info.sample_period * FASTEST) - 1e-9)
    columns = {
        axis: {name: values[::step] for name, values in own.items() if name in KEPT} for axis, own in recording.columns.items()
    }
    quiet: dict[str, Any] = {"torque_resolution": None, "torque_bandwidth_hz": None, "torque_delay": None}
    axes = {axis: info.model_copy(update=quiet) for axis, info in recording.info.axes.items()}
    info = recording.info.model_copy(update={"sample_period": step * recording.info.sample_period, "axes": axes})
    assert all(TORQUE not in own for own in columns.values())
    return replace(recording, info=info, time=recording.time[::step], columns=columns)


def write(drawn: Iterator[WideCase], seed: int, out: Path) -> None:
    """OUT/case_NNN of every case, with its torque, and OUT/key.json."""
    key: list[dict[str, Any]] = []
    for case in drawn:
        record_wide(case, out / f"case_{case.number:03d}")
        key.append(asdict(case))
        write_json(out / "key.json", {"schema": "blind-key/1", "seed": seed, "cases": key})


def ask(out: Path, ways: Sequence[str]) -> None:
    """One line a case: the truth, the first cause with the recorded torque or without, and how many were right so far: the true
    one itself, and with those that the first cause says it may be as well.

    What was answered is kept as OUT/case_NNN/WAY.json, with the position errors of the replays of validation recordings, and
    not asked again.
    """
    right, listed = dict.fromkeys(ways, 0), dict.fromkeys(ways, 0)
    for done, case in enumerate(json.loads((out / "key.json").read_text(encoding="utf-8"))["cases"], start=1):
        folder, (cause, *_) = out / f"case_{case['number']:03d}", case["causes"]
        truth = f"{cause['effect']}@{cause['axis']}"
        line = f"{case['number']:03d} {case['machine']} {case['drive']} {truth}, {cause['size']:.3f} of the torque:"
        for name in ways:
            kept = folder / f"{name}.json"
            if not kept.is_file():
                write_json(kept, answer(folder, WAYS[name]))
            told = json.loads(kept.read_text(encoding="utf-8"))
            right[name] += told["first"] == truth
            listed[name] += told["first"] == truth or truth in told.get("as_well", ())
            line += f" {name} {told['first']} ({right[name]}, {listed[name]} of {done}; {told['cpu_seconds']:.0f} s)"
        sys.stdout.write(line + "\n")
        sys.stdout.flush()


def answer(folder: Path, way: Callable[[Recording], Recording]) -> dict[str, Any]:
    """First cause, processor time [s], and by validation recording and axis the rms error of the replayed position without and
    with the effects [rad or m]."""
    train, check = ([way(one) for one in recordings_of(folder, kind)] for kind in ("train", "validate"))
    begin = time.process_time()
    found = diagnose(folder / "model.xml", train, check, Settings(), no_progress)
    seconds = time.process_time() - begin
    replayed = in_closed_loop(found, folder / "model.xml")
    errors = {
        one.recording: {
            axis: {name: float(run.apart["position"].rms) for name, run in own.runs.items()} for axis, own in one.axes.items()
        }
        for one in replayed.closed_loop
    }
    causes = [f"{one.effect}@{one.axis}" for one in found.causes]
    as_well = [f"{name}@{one.axis}" for one in found.causes[:1] for name in one.indistinguishable_from]
    return {
        "first": first_cause(found),
        "as_well": as_well,
        "causes": causes,
        "cpu_seconds": seconds,
        "position_errors": errors,
    }


WAYS: dict[str, Callable[[Recording], Recording]] = {"with": lambda recording: recording, "without": position_only}
"""What the diagnosis is told of the torque."""


def main() -> None:
    """Write the cases, or ask for those that are written."""
    parser = write_or_ask(__doc__, WAYS)
    parser.add_argument("--without", action="append", default=[], help="as of drivetwin blind")
    asked = parser.parse_args()
    if asked.what == "write":
        write(cases(asked.count, asked.seed, asked.family, asked.without), asked.seed, asked.out)
    else:
        ask(asked.out, asked.way or tuple(WAYS))


if __name__ == "__main__":
    main()
