"""Recordings of a machine whose torque is a formula of the test's own: a column that turns, and a carriage that it lifts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.prepare.prepared import Prepared, prepared
from drivetwin.diagnosis.prepare.rows import Rows
from drivetwin.diagnosis.report.result import Array, Diagnosis
from drivetwin.diagnosis.settings import Settings
from drivetwin.recording.recording import Recording, RecordingInfo

PERIOD, CUTOFF, GEAR = 2e-3, 48.0, 20.0
COLUMN = 0.8
"""Inertia of the column about its hinge [kg·m²], of which the motor has MOTOR."""
CARRIAGE, ARM = 2.0, 0.3
"""Mass of the carriage [kg], and how far from the hinge it is [m]."""
MOTOR, LIFT_MOTOR = 0.3, 1.5
"""Of the two motors, on the joint side [kg·m², kg]."""
TURNING = COLUMN + CARRIAGE * ARM**2
LIFTING = CARRIAGE + LIFT_MOTOR
GRAVITY = 10.0
COULOMB = {"turn": 1.5, "lift": 6.0}
VISCOUS = {"turn": 0.8, "lift": 12.0}
RESOLUTION = {"turn": 0.004, "lift": 0.02}

MODEL = f"""<mujoco model="column"><compiler angle="radian"/><option gravity="0 0 -{GRAVITY}"/><worldbody>
<body><joint name="turn" axis="0 0 1" armature="{MOTOR}" frictionloss="{COULOMB["turn"]}" damping="{VISCOUS["turn"]}"/>
<inertial pos="0 0 0" mass="5" diaginertia="0.5 0.5 {COLUMN - MOTOR}"/>
<body><joint name="lift" type="slide" axis="0 0 1" armature="{LIFT_MOTOR}"
 frictionloss="{COULOMB["lift"]}" damping="{VISCOUS["lift"]}"/>
<inertial pos="{ARM} 0 0" mass="{CARRIAGE}" diaginertia="1e-6 1e-6 1e-6"/></body></body>
</worldbody><actuator><motor name="turn" joint="turn"/><motor name="lift" joint="lift"/></actuator></mujoco>"""


@dataclass(frozen=True)
class Swing:
    """A motion that is known exactly: position and its derivatives, (n,) each [rad or m]."""

    time: Array
    position: Array
    velocity: Array
    acceleration: Array


Torques = Mapping[str, Callable[[Swing], Array]]
"""What some of the axes cost more than modelled."""


Stroke = Callable[[int, float], tuple[float, float]]
"""From the number of a stroke and where it begins to where it ends, and how long it lasts [s]."""


@cache
def swing(seed: int, seconds: float, travel: float, most: float) -> Swing:
    """Strokes there and back; one of six has a tenth of the acceleration of the others."""
    rng = np.random.default_rng(seed)

    def stroke(number: int, here: float) -> tuple[float, float]:
        there = -np.sign(here or 1.0) * travel * rng.uniform(0.6, 1.0)
        peak = most * rng.uniform(0.7, 1.0) * (0.1 if number % 6 == 5 else 1.0)
        return there, float(np.sqrt(5.77 * abs(there - here) / peak))

    return stroked(seconds, stroke)


def stroked(seconds: float, stroke: Stroke) -> Swing:
    """Strokes one after the other, each a polynomial of fifth degree from rest to rest."""
    time = np.arange(round(seconds / PERIOD), dtype=np.float64) * PERIOD
    position, velocity, acceleration = np.zeros((3, len(time)))
    number, begin, here = 0, 0.0, 0.0
    while begin < seconds:
        there, lasts = stroke(number, here)
        part = (time >= begin) & (time < begin + lasts)
        s, way = (time[part] - begin) / lasts, there - here
        position[part] = here + way * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        velocity[part] = way / lasts * 30.0 * s**2 * (1.0 - s) ** 2
        acceleration[part] = way / lasts**2 * 60.0 * s * (1.0 - 3.0 * s + 2.0 * s**2)
        number, begin, here = number + 1, begin + lasts, there
    return Swing(time, position, velocity, acceleration)


def turn_torque(at: Swing) -> Array:
    """Of the column as modelled: inertia and friction."""
    return TURNING * at.acceleration + COULOMB["turn"] * np.sign(at.velocity) + VISCOUS["turn"] * at.velocity


def lift_torque(at: Swing) -> Array:
    """Of the carriage as modelled: inertia, weight and friction."""
    weight = CARRIAGE * GRAVITY
    return LIFTING * at.acceleration + weight + COULOMB["lift"] * np.sign(at.velocity) + VISCOUS["lift"] * at.velocity


def moved(seed: int, seconds: float) -> dict[str, Swing]:
    """Both axes at once, each at its own."""
    return {"turn": swing(2 * seed, seconds, 0.8, 14.0), "lift": swing(2 * seed + 1, seconds, 0.25, 6.0)}


def recording(
    torques: Mapping[str, Array], seen: Mapping[str, Array], seed: int = 0, name: str = "strokes", noise: float = 15.0
) -> Recording:
    """What a drive would have captured of these torques and read positions: white noise of `noise` quanta, and rounding."""
    rng = np.random.default_rng(seed)
    columns = {}
    for axis, torque in torques.items():
        quantum = RESOLUTION[axis]
        told = np.round(torque / quantum + noise * rng.standard_normal(len(torque))) * quantum
        columns[axis] = {"position": np.round(seen[axis] / 1e-7) * 1e-7, "torque": told}
    time = np.arange(len(seen["turn"]), dtype=np.float64) * PERIOD
    known = {"position_resolution": 1e-7, "gear_ratio": GEAR}
    axes = {axis: {"joint": axis, "actuator": axis, "torque_resolution": RESOLUTION[axis], **known} for axis in torques}
    info = RecordingInfo.model_validate({"schema": "recording/1", "machine": "column", "sample_period": PERIOD, "axes": axes})
    return Recording(name, info, time, columns)


def as_modelled(both: Mapping[str, Swing]) -> dict[str, Array]:
    """True torques (n,) of the machine without any gap."""
    return {"turn": turn_torque(both["turn"]), "lift": lift_torque(both["lift"])}


def strokes(seed: int, seconds: float, more: Torques | None = None, name: str = "strokes", noise: float = 15.0) -> Recording:
    """The machine as modelled, and `more` torque on some of its axes."""
    both = moved(seed, seconds)
    torques = as_modelled(both)
    for axis, torque in (more or {}).items():
        torques[axis] = torques[axis] + torque(both[axis])
    return recording(torques, {axis: at.position for axis, at in both.items()}, seed, name, noise)


def written_model(folder: Path) -> Path:
    """The machine as its user models it."""
    path = folder / "column.xml"
    path.write_text(MODEL, encoding="utf-8")
    return path


def compared(folder: Path, *recordings: Recording) -> Rows:
    """Recordings prepared for a comparison with the model."""
    return ready(folder, *recordings).rows


def ready(folder: Path, *recordings: Recording) -> Prepared:
    """The same with all that is known of them; nothing is held back."""
    return prepared(written_model(folder), recordings, recordings, Settings(cutoff_hz=CUTOFF))


def diagnosed(folder: Path, record: Callable[[int, str], Recording]) -> Diagnosis:
    """What is said of one recording, judged on another."""
    fitted, held = record(1, "fitted"), record(2, "held")
    return diagnose(written_model(folder), [fitted], [held], Settings(), lambda _stage, _share: None)
