"""Position errors on unseen motion beside `mujoco.sysid`, which fits damping, friction and armature to the same logs.

    python scripts/position_only.py ask --way without --out out/position_only
    python scripts/beside_sysid.py --out out/position_only

Each case of `position_only` is fitted by output error in MuJoCo: the same model and gains, as its own PID
actuators, the same recordings. Both are measured on the validation recordings by the rms of simulated less recorded position.
"""

from __future__ import annotations

import json
import sys
import time
from argparse import ArgumentParser
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
from mujoco import sysid
from numpy.typing import NDArray
from position_only import position_only

from drivetwin.blind.with_and_without import recordings_of
from drivetwin.diagnosis.prepare.asked_torque import completed
from drivetwin.diagnosis.prepare.simulation import simulation
from drivetwin.diagnosis.settings import Settings
from drivetwin.foundation.files import write_json
from drivetwin.motion.inverse_dynamics import read_mjcf
from drivetwin.recording.recording import Recording
from drivetwin.twin.comparison import MODEL, WITH_EFFECTS
from drivetwin.twin.course import course_of, curve, grid_of, without_integral
from drivetwin.twin.loops import Loops, loops_of

Array = NDArray[np.float64]

STEP = 0.001
"""Of the simulation that fits and of the one that is measured [s]."""
FITTED = ("damping", "frictionloss", "armature")
MOST = 5.0
"""Times the model's value, up to which one is sought."""
ITERATIONS = 30


@dataclass(frozen=True)
class Log:
    """A recording as mujoco.sysid takes it: what its actuators are told, and where the joints were, (n, axes) each."""

    name: str
    time: Array
    control: Array
    position: Array
    velocity: Array


def pid_gains(loops: Loops) -> dict[str, float]:
    """Of MuJoCo's `pid` actuator: a PI velocity loop in a P position loop is a PID loop beside a known feed-forward."""
    return {
        "kp": loops.velocity_gain * (loops.position_gain + loops.integral_rate) + loops.position_stiffness,
        "ki": loops.velocity_gain * loops.position_gain * loops.integral_rate + loops.position_integral,
        "kv": loops.velocity_gain,
    }


def with_pid(path: Path, joints: list[str], loops: list[Loops]) -> str:
    """The model, its joints moved by PID actuators with these gains, its positions sensed."""
    root = ElementTree.parse(path).getroot()
    for old in root.findall("actuator"):
        root.remove(old)
    option = root.find("option")
    assert option is not None
    option.attrib |= {"timestep": str(STEP), "integrator": "implicitfast"}
    actuators, sensors = ElementTree.SubElement(root, "actuator"), ElementTree.SubElement(root, "sensor")
    for joint, own in zip(joints, loops, strict=True):
        gains = {name: repr(gain) for name, gain in pid_gains(own).items()}
        ElementTree.SubElement(actuators, "pid", {"name": joint, "joint": joint, "input": "pos", **gains})
        ElementTree.SubElement(actuators, "motor", {"name": f"{joint}_ahead", "joint": joint})
        ElementTree.SubElement(sensors, "jointpos", {"name": f"{joint}_position", "joint": joint})
    for joint in root.iter("joint"):
        joint.attrib.pop("range", None)  # no axis reaches its stops
    return ElementTree.tostring(root, encoding="unicode")


def log_of(recording: Recording, path: Path) -> Log:
    """`recording` has the torque that its loops asked for: what they held at its start goes to the feed-forward."""
    grid, rows = grid_of(recording), np.arange(len(recording.time))
    at = grid.rows(len(rows))
    fine = at * recording.info.sample_period
    told, velocities, model = [], [], read_mjcf(path)
    for axis, info in recording.info.axes.items():
        loops = loops_of(axis, info, model)
        course = course_of(axis, recording, axis, loops, grid, curve)
        position, velocity, _, offset = course.demand.T
        gain, rate = loops.velocity_gain, loops.integral_rate
        held = course.torque - without_integral(course) if loops.integrates and course.torque is not None else 0.0
        less = loops.velocity_feedforward - 1.0
        start = position[0] - course.position
        ahead = gain * (loops.velocity_feedforward * velocity + less * rate * (position - position[0]))
        told += [position, ahead - gain * rate * start + held + offset]
        velocities.append(course.velocity)
    steps = np.arange(0.0, fine[-1], STEP)
    control = np.column_stack([np.interp(steps, fine, one) for one in told])
    positions = np.column_stack([own["position"] for own in recording.columns.values()])
    return Log(recording.name, rows * recording.info.sample_period, control, positions, np.array(velocities))


def fitted(models: list[str], joints: list[str], logs: list[Log]) -> dict[str, dict[str, float]]:
    """Damping, friction and armature of every joint by mujoco.sysid, from logs each of which has a model with its gains.

    Positions are weighed by how far the model is off before, and parameters scaled by what they do: without that it ends before
    its first step, for errors of a micrometre have a small gradient.
    """
    specs = [mujoco.MjSpec.from_string(xml) for xml in models]
    spec, model = specs[0], specs[0].compile()
    parameters = sysid.ParameterDict()
    for joint in joints:
        for name in FITTED:
            value = float(np.ravel(getattr(spec.joint(joint), name))[0])
            parameters.add(sysid.Parameter(f"{joint} {name}", value, 0.0, MOST * value + 1e-6, modifier=_sets(joint, name)))
    control = sysid.TimeSeries.compute_all_control_mapping(model)
    sensors = sysid.TimeSeries.compute_all_sensor_mapping(model)
    sequences = [
        sysid.ModelSequences(
            log.name,
            own,
            log.name,
            sysid.create_initial_state(model, log.position[0], log.velocity),
            sysid.TimeSeries(np.arange(len(log.control)) * STEP, log.control, control),
            sysid.TimeSeries(log.time, log.position, sensors),
        )
        for own, log in zip(specs, logs, strict=True)
    ]
    sizes = np.mean([errors(xml, {}, log) for xml, log in zip(models, logs, strict=True)], axis=0)
    weights = {f"{joint}_position": 1.0 / float(size) for joint, size in zip(joints, sizes, strict=True)}
    residual = sysid.build_residual_fn(models_sequences=sequences, n_threads=1, sensor_weights=weights)
    found, _ = sysid.optimize(parameters, residual, verbose=False, max_iters=ITERATIONS, x_scale="jac")
    return {joint: {name: float(found[f"{joint} {name}"].value[0]) for name in FITTED} for joint in joints}


def _sets(joint: str, name: str) -> Any:
    def modifier(spec: Any, parameter: Any) -> None:
        value = parameter.value[0]
        current = getattr(spec.joint(joint), name)
        setattr(spec.joint(joint), name, value if np.ndim(current) == 0 else np.r_[value, np.ravel(current)[1:]])

    return modifier


def errors(xml: str, values: dict[str, dict[str, float]], log: Log) -> Array:
    """Rms of simulated less recorded position, by axis [rad or m]."""
    spec = mujoco.MjSpec.from_string(xml)
    for joint, own in values.items():
        for name, value in own.items():
            current = getattr(spec.joint(joint), name)
            setattr(spec.joint(joint), name, value if np.ndim(current) == 0 else np.r_[value, np.ravel(current)[1:]])
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = log.position[0], log.velocity
    simulated = np.empty((len(log.control), model.nq))
    for k, control in enumerate(log.control):
        data.ctrl[:] = control
        simulated[k] = data.qpos
        mujoco.mj_step(model, data)
    steps = np.arange(len(log.control)) * STEP
    within = log.time <= steps[-1]
    left = [np.interp(log.time[within], steps, own) for own in simulated.T]
    return np.asarray(np.sqrt(np.mean((np.column_stack(left) - log.position[within]) ** 2, axis=0)))


def compared(folder: Path) -> dict[str, Any]:
    """Position errors of one case: as the model stands, by mujoco.sysid, and by the diagnosis, and what each took [s]."""
    told = json.loads((folder / "without.json").read_text(encoding="utf-8"))
    path = folder / "model.xml"
    train, check = ([position_only(one) for one in recordings_of(folder, kind)] for kind in ("train", "validate"))
    whole = completed(path, simulation(path, train[0].info.axes), train, check, Settings())
    first = whole.training[0]
    joints = [info.joint for info in first.info.axes.values()]
    model = read_mjcf(path)

    def moved(one: Recording) -> str:
        return with_pid(path, joints, [loops_of(axis, info, model) for axis, info in one.info.axes.items()])

    used = [one for one in whole.training if not any(info.position_relative for info in one.info.axes.values())] or [first]
    logs = [log_of(one, path) for one in used]
    begin = time.process_time()
    values = fitted([moved(one) for one in used], joints, logs)
    seconds = time.process_time() - begin
    rows = []
    for one in whole.validation:
        if one.name not in told["position_errors"]:
            continue
        log = log_of(one, path)
        before, after = errors(moved(one), {}, log), errors(moved(one), values, log)
        for k, axis in enumerate(one.info.axes):
            ours = told["position_errors"][one.name][axis]
            rows.append(
                {
                    "recording": one.name, "axis": axis, "model": float(before[k]), "sysid": float(after[k]),
                    "replayed": ours[MODEL], "diagnosis": ours[WITH_EFFECTS],
                }
            )  # fmt: skip
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
        if not (folder / "without.json").is_file():
            continue
        kept = folder / "sysid.json"
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
