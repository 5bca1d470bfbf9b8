"""For development: cases of one effect each, of which position and demand are all that is recorded, as of a hobby servo.

    python scripts/position_only.py write --count 40 --seed 1 --out out/position_only
    python scripts/position_only.py ask --out out/position_only

The second asks the diagnosis with the recorded torque and without it, and prints how often the first cause is right.
"""

from __future__ import annotations

import json
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, replace
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from drivetwin.blind.alike import Material, checked
from drivetwin.blind.case import Cause
from drivetwin.blind.claims import claims
from drivetwin.blind.told import read_told
from drivetwin.blind.wide.case import WideCase
from drivetwin.blind.wide.choice import choice
from drivetwin.blind.wide.draw import drawn_case, world_of
from drivetwin.blind.wide.effects import DRIVE
from drivetwin.blind.wide.record import record_wide
from drivetwin.blind.wide.weighing import Recorded
from drivetwin.blind.with_and_without import first_cause, no_progress, recordings_of, write_or_ask
from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.report.closed_loop import in_closed_loop
from drivetwin.diagnosis.report.write import write_diagnosis
from drivetwin.diagnosis.settings import Settings
from drivetwin.foundation.files import write_json
from drivetwin.recording.recording import TORQUE, Recording
from drivetwin.recording.writer import write_recording

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
    """One line a case: the truth, the first cause with the recorded torque or without, and how many were right so far.

    A first cause that names the true one among what it cannot be distinguished from is right where the fit says so as well.
    What was answered is kept as OUT/case_NNN/WAY, with answer.json and the diagnosis, and not asked again.
    """
    right, alike = dict.fromkeys(ways, 0), dict.fromkeys(ways, 0)
    key = json.loads((out / "key.json").read_text(encoding="utf-8"))
    for done, drawn in enumerate(key["cases"], start=1):
        case = TypeAdapter(WideCase).validate_python(drawn)
        folder, (cause, *_) = out / f"case_{case.number:03d}", case.causes
        truth = f"{cause.effect}@{cause.axis}"
        line = f"{case.number:03d} {case.machine} {case.drive} {truth}, {drawn['causes'][0]['size']:.3f} of the torque:"
        for name in ways:
            kept = folder / name / "answer.json"
            if not kept.is_file():
                write_json(kept, answer(folder, name, case))
            told = json.loads(kept.read_text(encoding="utf-8"))
            right[name] += told["first"] == truth
            alike[name] += told["alike"]
            first = f"{told['first']}, the true one as well" if told["alike"] else told["first"]
            line += f" {name} {first} ({right[name]} and {alike[name]} of {done}; {told['cpu_seconds']:.0f} s)"
        sys.stdout.write(line + "\n")
        sys.stdout.flush()


def answer(folder: Path, name: str, case: WideCase) -> dict[str, Any]:
    """What `asked` tells of a case, and whether the first cause is not the true one but alike."""
    train, check = ([WAYS[name](one) for one in recordings_of(folder, kind)] for kind in ("train", "validate"))
    told = asked(folder / "model.xml", train, check, folder / name)
    return {**told, "alike": _alike(case, folder / name)}


def asked(model: Path, train: Sequence[Recording], check: Sequence[Recording], out: Path) -> dict[str, Any]:
    """First cause, all causes, processor time [s], and by validation recording and axis the rms error of the replayed position
    without and with the effects [rad or m]. `out` gets the diagnosis and the recordings as they were told.
    """
    begin = time.process_time()
    found = diagnose(model, train, check, Settings(), no_progress)
    seconds = time.process_time() - begin
    shutil.rmtree(out, ignore_errors=True)  # of an answer that was broken off
    out.mkdir()
    for one in (*train, *check):
        write_recording(one, out / one.name)
    write_diagnosis(found, [], out, html=False)
    errors = {
        one.recording: {
            axis: {which: float(run.apart["position"].rms) for which, run in own.runs.items()} for axis, own in one.axes.items()
        }
        for one in in_closed_loop(found, model).closed_loop
    }
    return {
        "first": first_cause(found),
        "causes": [f"{one.effect}@{one.axis}" for one in found.causes],
        "cpu_seconds": seconds,
        "position_errors": errors,
    }


def _alike(case: WideCase, out: Path) -> bool:
    """Whether a first cause that is not the true one says that it may be that, and fits as well (as of `drivetwin blind`)."""
    report = read_told(out / "report.json")
    first = report.first
    causes = {(one.effect, one.axis) for one in case.causes}
    claimed = [
        one
        for one in claims(case, report)
        if first is not None and (one.effect, one.axis) == (first.effect, first.axis) and (one.truth, one.axis) in causes
    ]
    train, check = (sorted(out.glob(f"{kind}_*")) for kind in ("train", "validate"))
    material = Material(out / "patched.xml", train, check, out / "effects.json", out / "report.json")
    return bool(claimed) and any(one.holds for one in checked(case, claimed, material))


WAYS: dict[str, Callable[[Recording], Recording]] = {"with": lambda recording: recording, "without": position_only}
"""What the diagnosis is told of the torque."""


def main() -> None:
    """Write the cases, or ask for those that are written."""
    parser = write_or_ask(__doc__, WAYS)
    parser.add_argument("--without", action="append", default=[], help="as of drivetwin blind")
    told = parser.parse_args()
    if told.what == "write":
        write(cases(told.count, told.seed, told.family, told.without), told.seed, told.out)
    else:
        ask(told.out, told.way or tuple(WAYS))


if __name__ == "__main__":
    main()
