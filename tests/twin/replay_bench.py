"""Recordings of an axis on which MuJoCo alone has run, or a formula: what a replay is held against."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.recording.recording import Recording, RecordingInfo

Array = NDArray[np.float64]

INERTIA, DAMPING, COULOMB = 0.5, 0.8, 0.6
KP, KV, KI = 400.0, 30.0, 900.0
PERIOD, STEP = 1e-3, 125e-6

MODEL = """<mujoco model="turn"><option timestep="{step}" gravity="0 0 0"/><worldbody><body>
<joint name="turn" axis="0 0 1" damping="{damping}" frictionloss="{coulomb}" solreffriction="0.00025 1"
 solimpfriction="0.9999 0.9999 0.001"/>
<inertial pos="0 0 0" mass="1" diaginertia="{inertia} {inertia} {inertia}"/></body></worldbody>
<actuator>{actuator}</actuator></mujoco>"""
MOTOR = '<motor name="turn" joint="turn"/>'
SERVO = f'<position name="turn" joint="turn" kp="{KP}" kv="{KV}"/>'
PID = f'<pid name="turn" joint="turn" input="pos vel ff" kp="{KP}" kv="{KV}" ki="{KI}"/>'


def write_model(folder: Path, actuator: str = MOTOR, **changes: float) -> Path:
    """The axis as MJCF, driven by `actuator`."""
    path = folder / "turn.xml"
    values = {"inertia": INERTIA, "damping": DAMPING, "coulomb": COULOMB} | changes
    path.write_text(MODEL.format(step=STEP, actuator=actuator, **values), encoding="utf-8")
    return path


def demand(count: int, period: float = PERIOD) -> Array:
    """Swings after 40 ms of rest."""
    time = np.maximum(0.0, np.arange(count) * period - 0.04)
    grow = np.minimum(1.0, time / 0.3) ** 2 * (3.0 - 2.0 * np.minimum(1.0, time / 0.3))
    return np.asarray(grow * (0.6 * np.sin(3.0 * time) + 0.15 * np.sin(11.0 * time)))


def by_mujoco(model: Path, count: int, torque_offset: float = 0.0) -> Recording:
    """What MuJoCo makes of the demand with its own actuator, a millisecond a row; the demand is a line between rows."""
    compiled = mujoco.MjModel.from_xml_path(str(model))
    data = mujoco.MjData(compiled)
    rows = round(PERIOD / STEP)
    fine = np.interp(np.arange((count - 1) * rows + 1) / rows, np.arange(count), demand(count))
    slope = np.diff(fine, prepend=fine[0]) / STEP
    position, torque = np.empty((2, count))
    for tick, target in enumerate(fine):
        data.ctrl[:] = (target, slope[tick], torque_offset)[: compiled.nu]
        at = float(data.qpos[0])
        mujoco.mj_step(compiled, data)
        if tick % rows == 0:
            position[tick // rows], torque[tick // rows] = at, float(data.actuator_force[0])
    return recording({"position": position, "torque": torque, "position_demand": demand(count)})


def recording(columns: dict[str, Array], drive: dict[str, Any] | None = None, joint: str = "turn", **info: Any) -> Recording:
    """One axis, `turn`; `drive` as in recording.json."""
    axis = {"joint": joint, "actuator": "turn"} | ({} if drive is None else {"drive": drive})
    told = {"schema": "recording/2", "machine": "turn", "sample_period": PERIOD, "axes": {"turn": axis}} | info
    count = len(next(iter(columns.values())))
    time = np.arange(count, dtype=np.float64) * PERIOD
    return Recording("swings", RecordingInfo.model_validate(told), time, {"turn": columns})
