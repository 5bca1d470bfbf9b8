"""The measured hobby servo by its command and position alone: logs of a public repository, resampled as `bam_xl330` was.

    python scripts/bam_position.py --data ../shared/data --raw RAW --out out/bam_position

RAW is bam/data.bak/raw of github.com/Rhoban/bam at af2260462471 (Apache-2.0): its logs have the goal position, as the case of
../shared/data/measured has not. OUT gets model.xml, the recordings without torque, what the diagnosis answers to them
(without/), and mujoco.sysid beside it (sysid.json).
"""

from __future__ import annotations

import json
import shutil
import sys
from argparse import ArgumentParser
from collections.abc import Mapping
from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from beside_sysid import compared, ratio
from numpy.typing import NDArray
from position_only import asked, position_only

from drivetwin.blind.with_and_without import recordings_of
from drivetwin.foundation.files import write_json
from drivetwin.recording.reader import read_recording
from drivetwin.recording.recording import Recording
from drivetwin.recording.writer import write_recording

Array = NDArray[np.float64]

LOGS = {
    "train_00": "2026-01-15_10h28m10", "train_01": "2026-01-15_10h28m24", "train_02": "2026-01-15_10h28m42",
    "train_03": "2026-01-15_10h28m57", "train_04": "2026-01-15_10h29m04", "validate": "2026-01-15_10h28m32",
}  # fmt: skip
"""The log that each recording of the case was resampled from: their positions are the same to 1e-12 rad."""
DUTY = 4096.0 / (2.0 * pi) / (256.0 * 885.0)
"""PWM duty [1/rad] by the firmware's gain: counts a turn over its divisor and the PWM limit (bam/xl330/actuator.py)."""
TORQUE = 0.7008
"""Of a whole duty [N·m], from the known weight."""


def with_demand(recording: Recording, raw: Path) -> Recording:
    """A recording of the case with the goal position of its log and the servo's gain."""
    log = json.loads((raw / f"{LOGS[recording.name]}.json").read_text(encoding="utf-8"))
    told = {name: np.array([entry[name] for entry in log["entries"]]) for name in ("timestamp", "goal_position")}
    demand = np.interp(recording.time + told["timestamp"][0], told["timestamp"], told["goal_position"])
    drive = {"law": "pd_position_servo", "proportional_gain": TORQUE * DUTY * log["kp"], "derivative_gain": 0.0}
    axis = recording.info.axes["servo"].model_dump() | {"drive": drive | {"servo_period": 0.001}}
    axes: Mapping[str, Any] = {"servo": type(recording.info.axes["servo"]).model_validate(axis)}
    columns = {"servo": {**recording.columns["servo"], "position_demand": demand}}
    return replace(recording, columns=columns, info=recording.info.model_copy(update={"axes": dict(axes)}))


def write(case: Path, raw: Path, out: Path) -> None:
    """OUT/model.xml and the recordings, as a servo logs itself."""
    out.mkdir(parents=True, exist_ok=True)
    shutil.copy(case / "nominal.xml", out / "model.xml")
    for name in LOGS:
        (whole,) = read_recording(case / name)
        folder = out / ("validate_0" if name == "validate" else name)
        shutil.rmtree(folder, ignore_errors=True)
        write_recording(position_only(with_demand(whole, raw)), folder)


def main() -> None:
    """Write the case, ask, and print the causes and the position errors."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    parser.add_argument("--raw", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    write(given.data / "measured" / "bam_xl330", given.raw, given.out)
    train, check = (recordings_of(given.out, kind) for kind in ("train", "validate"))
    told = asked(given.out / "model.xml", train, check, given.out / "without")
    write_json(given.out / "without" / "answer.json", told)
    sys.stdout.write(f"causes: {', '.join(told['causes'])}; {told['cpu_seconds']:.0f} s\n")
    found = compared(given.out)
    write_json(given.out / "sysid.json", found)
    for row in found["rows"]:
        sys.stdout.write(f"{row}\n")
    sys.stdout.write(f"{ratio(found, 'sysid', 'diagnosis'):.2f} times smaller; mujoco.sysid {found['sysid_seconds']:.0f} s\n")


if __name__ == "__main__":
    main()
