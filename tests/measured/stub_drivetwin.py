"""Stands for `drivetwin`: imports anything as a short recording, and diagnoses as a file beside the model says."""

from __future__ import annotations

import json
import sys
import time as clock
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
from measured_bench import cause, report, swing, write_prediction, write_recording

ASKED = "asked.txt"
"""In OUT/..: a line a diagnosis."""


def main(words: list[str]) -> int:
    """`words` as a user types them."""
    return _import(words[1:]) if words[0] == "import" else _diagnose(words[1:])


def _import(words: list[str]) -> int:
    files, out = [Path(word) for word in words[: words.index("--map")]], Path(words[-1])
    for file in files:
        folder = out if len(files) == 1 else out / file.stem
        if not folder.exists():
            time, position, velocity, _ = (each[::4] for each in swing(2.0))
            write_recording(folder, time, position, np.sign(velocity))
    return 0


def _diagnose(words: list[str]) -> int:
    at = words.index("--validate")
    model, training, validation, out = Path(words[0]), words[1:at], [Path(word) for word in words[at + 1 : -2]], Path(words[-1])
    assert words[-2] == "--out"
    with (out.parent / ASKED).open("a", encoding="utf-8") as asked:
        asked.write(f"{len(training)} {len(validation)}\n")
    told = model.parent / "behaviour.txt"
    behaviour = told.read_text(encoding="utf-8") if told.is_file() else "answer"
    if behaviour == "refuse":
        print("drivetwin: one direction only: record the other", file=sys.stderr)
        return 2
    if behaviour == "hang":
        clock.sleep(600.0)
    if behaviour == "crash":
        raise ValueError("a bug\nof two lines")
    for recording in validation:
        zero = np.zeros(pq.read_metadata(recording / "signals.parquet").num_rows)
        file = out / "prediction" / f"{recording.name}.parquet"
        write_prediction(file, zero, zero + 0.5, zero + 1.0, np.ones(len(zero), dtype=np.bool_))
    effect = "inertia" if behaviour == "answer" else behaviour
    (out / "report.json").write_text(json.dumps(report([cause(effect)], selected=[effect])), encoding="utf-8")
    (out / "report.html").write_text("<html></html>", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
