"""Position errors on unseen motion beside `mujoco.sysid`, which fits damping, friction and armature to the same logs.

    python scripts/position_only.py ask --way without --out out/position_only
    python scripts/beside_sysid.py --out out/position_only

Each case of `position_only` is fitted by the optimiser of mujoco.sysid to the position errors of `drivetwin replay`: the same
model, recordings and drive's loops that the diagnosis has. MuJoCo's own PID actuators have no filter of the velocity, and what
they leave out is more than most causes are. What is found is measured by the same replay of the validation recordings.
"""

from __future__ import annotations

import json
import sys
import time
from argparse import ArgumentParser
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from mujoco import sysid
from numpy.typing import NDArray
from position_only import position_only

from drivetwin.blind.with_and_without import recordings_of
from drivetwin.diagnosis.prepare.asked_torque import completed
from drivetwin.diagnosis.prepare.simulation import simulation
from drivetwin.diagnosis.settings import Settings
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import write_json
from drivetwin.foundation.scratch import scratch
from drivetwin.motion.inverse_dynamics import read_mjcf
from drivetwin.recording.recording import Recording
from drivetwin.twin.comparison import MODEL, WITH_EFFECTS
from drivetwin.twin.comparison import compared as replayed
from drivetwin.twin.replay import replay

Array = NDArray[np.float64]

FITTED = {"damping": "dof_damping", "frictionloss": "dof_frictionloss", "armature": "dof_armature"}
"""Attributes of a joint, and what MuJoCo calls them in a model."""
MOST = 5.0
"""Times the model's value, up to which one is sought; the optimiser moves such multiples."""
ITERATIONS = 30
STEP = 1e-3
"""Of the model's value, for differences: friction switches at samples, and a smaller one sees only that."""
LEAST, UNSTABLE = 1e-9, 100.0
"""Position error of a model that is exact [rad or m], and errors of one that is unstable, in those of the model."""


def with_values(path: Path, values: Mapping[str, Mapping[str, float]], out: Path) -> Path:
    """The model of a file with these damping, friction and armature of its joints, as a file `out`."""
    root = ElementTree.parse(path).getroot()
    for joint in root.iter("joint"):
        joint.attrib |= {name: repr(value) for name, value in values.get(joint.get("name", ""), {}).items()}
    ElementTree.ElementTree(root).write(out, encoding="unicode")
    return out


def fitted(path: Path, training: Sequence[Recording], scene: Path) -> dict[str, dict[str, float]]:
    """Damping, friction and armature of every joint by mujoco.sysid.

    `training` has the torque that its loops asked for. Positions are weighed by how far the model is off before. `scene`: a
    folder for models.
    """
    model = read_mjcf(path)
    joints = [info.joint for info in training[0].info.axes.values()]
    parameters, values = sysid.ParameterDict(), list[float]()
    for joint in joints:
        (dof,) = model.joint(joint).dofadr
        for name, own in FITTED.items():
            parameters.add(sysid.Parameter(f"{joint} {name}", 1.0, 0.0, MOST))
            values.append(float(getattr(model, own)[dof]))

    def told(multiples: Array) -> dict[str, dict[str, float]]:
        shaped = (multiples * values).reshape(len(joints), len(FITTED))
        return {joint: dict(zip(FITTED, map(float, own), strict=True)) for joint, own in zip(joints, shaped, strict=True)}

    def left(multiples: Array) -> list[Array]:
        changed = with_values(path, told(multiples), scene / "fitted.xml")
        return [
            run.position - recording.columns[axis]["position"]
            for recording in training
            for axis, run in replay(changed, recording, ()).items()
        ]

    before = left(parameters.as_vector())
    sizes = [max(float(np.sqrt(np.mean(one**2))), LEAST) for one in before]

    def weighed(multiples: Array) -> Array:
        try:
            return np.concatenate([one / size for one, size in zip(left(multiples), sizes, strict=True)])
        except UserError:  # unstable with these values
            return np.full(sum(map(len, before)), UNSTABLE)

    def residual(multiples: Array, _: Any) -> tuple[list[Array], None, None]:
        if multiples.ndim == 1:
            return [weighed(multiples)], None, None
        return [np.column_stack([weighed(own) for own in multiples.T])], None, None

    found, _ = sysid.optimize(parameters, residual, verbose=False, max_iters=ITERATIONS, eps=STEP)
    return told(np.asarray(found.as_vector()))


def compared(folder: Path) -> dict[str, Any]:
    """Position errors of one case: as the model stands, by mujoco.sysid, and by the diagnosis, and what each took [s]."""
    told = json.loads((folder / "without" / "answer.json").read_text(encoding="utf-8"))
    report = json.loads((folder / "without" / "report.json").read_text(encoding="utf-8"))
    cutoff_hz = max(own["cutoff_hz"] for own in report["axes"].values())
    path = folder / "model.xml"
    train, check = ([position_only(one) for one in recordings_of(folder, kind)] for kind in ("train", "validate"))
    whole = completed(path, simulation(path, train[0].info.axes), train, check, Settings())
    used = [one for one in whole.training if not any(info.position_relative for info in one.info.axes.values())]
    with scratch() as scene:
        begin = time.process_time()
        values = fitted(path, used or whole.training[:1], scene)
        seconds = time.process_time() - begin
        changed = with_values(path, values, scene / "sysid.xml")
        kept = [one for one in whole.validation if one.name in told["position_errors"]]
        moved = {one.name: replayed(changed, one, None, cutoff_hz).axes for one in kept}
    rows = [
        {
            "recording": name, "axis": axis, "model": ours[MODEL], "diagnosis": ours[WITH_EFFECTS],
            "sysid": moved[name][axis].runs[MODEL].apart["position"].rms,
        }
        for name, axes in told["position_errors"].items() for axis, ours in axes.items()
    ]  # fmt: skip
    return {"rows": rows, "sysid_seconds": seconds, "diagnosis_seconds": told["cpu_seconds"], "values": values}


def ratio(case: dict[str, Any], above: str, below: str) -> float:
    """Of the geometric means over recordings and axes."""
    return float(np.exp(np.mean([np.log(row[above] / row[below]) for row in case["rows"]])))


def main() -> None:
    """One line a case, and the medians."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of the cases and their answers")
    out = parser.parse_args().out
    found = []
    for folder in sorted(out.glob("case_*")):
        if not (folder / "without" / "answer.json").is_file():
            continue
        kept = folder / "beside_sysid.json"
        if not kept.is_file():
            write_json(kept, compared(folder))
        case = json.loads(kept.read_text(encoding="utf-8"))
        if case["rows"]:
            found.append((ratio(case, "sysid", "diagnosis"), case["diagnosis_seconds"], case["sysid_seconds"]))
            line = f"{folder.name}: sysid {ratio(case, 'sysid', 'model'):.3f} of the model's error, diagnosis"
            line += f" {ratio(case, 'diagnosis', 'model'):.3f}; {found[-1][0]:.2f} times smaller;"
            sys.stdout.write(f"{line} {found[-1][1]:.0f} s, sysid {found[-1][2]:.0f} s\n")
            sys.stdout.flush()
    if found:
        smaller, ours, theirs = np.median(np.array(found), axis=0)
        sys.stdout.write(f"median of {len(found)}: {smaller:.2f} times smaller, {ours:.0f} s, mujoco.sysid {theirs:.0f} s\n")


if __name__ == "__main__":
    main()
