"""One axis whose torque is a formula: friction, a Stribeck level and cogging, at 250 Hz, without any emulator."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.prepare.prepared import prepared
from drivetwin.diagnosis.report.result import Array, Diagnosis
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.bench import Bench, bench_of
from drivetwin.recording.recording import Recording, RecordingInfo

PERIOD = 0.004
INERTIA, COULOMB, VISCOUS, GEAR = 0.5, 1.0, 0.3, 10.0
STICKS, SLIDES = 1.2, 0.12
"""Of the Stribeck level [N·m] and velocity [rad/s] that the model does not have."""
COGGING, ORDER, PHASE = 0.6, 2.0, 0.4
"""Of the cogging that it does not have either [N·m, waves a motor turn, rad]."""
WARMING = 60.0
"""Time constant of a machine that is cold at first [s]."""
RESOLUTION, NOISE = 1e-3, 0.02


@dataclass(frozen=True)
class Machine:
    """How the same machine is told: its torques in another unit, its axis by another name, its friction not at all."""

    torque_scale: float = 1.0
    axis: str = "turn"
    friction: bool = True
    level: float = COULOMB
    """Coulomb friction of the model [N·m]."""
    cold: float = 0.0
    """Share by which the machine's friction is higher at first, which the model does not have."""
    quadratic: float = 0.0
    """Of its viscous friction [N·m·s²/rad²], which the model does not have."""

    @property
    def model(self) -> str:
        """What its user models: neither Stribeck level nor cogging."""
        k, rubs = self.torque_scale, float(self.friction)
        return f"""<mujoco model="plain"><option gravity="0 0 0"/><worldbody><body>
<joint name="{self.axis}" axis="0 0 1" frictionloss="{self.level * k * rubs}" damping="{VISCOUS * k * rubs}"/>
<inertial pos="0 0 0" mass="{k}" diaginertia="{INERTIA * k} {INERTIA * k} {INERTIA * k}"/></body></worldbody>
<actuator><motor name="{self.axis}" joint="{self.axis}"/></actuator></mujoco>"""

    def recording(self, seed: int, seconds: float, name: str, begin: float = 0.0, resolution: float = RESOLUTION) -> Recording:
        """Swings whose frequencies and phases follow from the seed; torque in steps of `resolution` [N·m]."""
        rng = np.random.default_rng(seed)
        time = np.arange(round(seconds / PERIOD), dtype=np.float64) * PERIOD
        speeds, phases = rng.uniform([0.9, 2.2, 4.0], [1.3, 2.9, 6.0]), rng.uniform(0.0, 6.0, 3)
        swings = list(zip((0.8, 0.35, 0.1), speeds, phases, strict=True))
        position = _sum(a * np.sin(w * time + p) for a, w, p in swings)
        velocity = _sum(a * w * np.cos(w * time + p) for a, w, p in swings)
        acceleration = _sum(-a * w**2 * np.sin(w * time + p) for a, w, p in swings)
        friction = (COULOMB + STICKS * np.exp(-((velocity / SLIDES) ** 2))) * np.sign(velocity)
        friction = friction + (VISCOUS + self.quadratic * np.abs(velocity)) * velocity
        torque = INERTIA * acceleration + friction * (1.0 + self.cold * np.exp(-time / WARMING))
        torque = torque - COGGING * np.sin(ORDER * GEAR * position + PHASE)
        torque = torque + NOISE * rng.standard_normal(len(time))
        quantum = resolution * self.torque_scale
        columns = {self.axis: {"position": position, "torque": np.round(self.torque_scale * torque / quantum) * quantum}}
        known = {"joint": self.axis, "torque_resolution": quantum, "position_resolution": 1e-7, "gear_ratio": GEAR}
        info = RecordingInfo.model_validate(
            {"schema": "recording/1", "machine": "plain", "sample_period": PERIOD, "axes": {self.axis: known}}
        )
        return Recording(name, info, time + begin, columns)

    def diagnosed(self, fitted: Sequence[Recording], held: Sequence[Recording]) -> Diagnosis:
        """What is said of its recordings."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "plain.xml"
            path.write_text(self.model, encoding="utf-8")
            return diagnose(path, fitted, held, Settings(), lambda _stage, _share: None)

    def bench(self, folder: Path, seconds: float = 30.0, resolution: float = RESOLUTION) -> Bench:
        """One recording of it beside the model, on which sets of effects are weighed; another one is not fitted."""
        path = folder / "model.xml"
        path.write_text(self.model, encoding="utf-8")
        one, two = (
            self.recording(seed, length, name, resolution=resolution)
            for seed, length, name in ((1, seconds, "one"), (2, 20.0, "two"))
        )
        ready = prepared(path, [one], [two], Settings())
        return bench_of(ready.rows, Settings(), ready.absolute)


def _sum(terms: object) -> Array:
    return np.sum(list(terms), axis=0)  # type: ignore[call-overload, no-any-return]
