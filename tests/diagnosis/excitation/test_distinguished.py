"""`drivetwin excite` from report to report: the excited motion distinguishes causes that a first recording leaves open."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import pyarrow.csv as pc
import pytest
from numpy.typing import NDArray
from repeats import repeated
from typer.testing import CliRunner

from drivetwin.cli import app
from drivetwin.diagnosis.report.schema import CausePart, GapReport, read_report
from drivetwin.emulator.assembly import DrivenJoint
from drivetwin.emulator.effects import Effect, PlacedEffect, library
from drivetwin.emulator.mechanism import Mechanism
from drivetwin.motion.jerk_limited import MotionLimits, jerk_limited
from drivetwin.recording.recording import AxisInfo, Recording, RecordingInfo
from drivetwin.recording.writer import write_recording

Array = NDArray[np.float64]

MODEL = """<mujoco model="rig"><compiler angle="radian"/><option timestep="0.00025"/><worldbody>
<body><joint name="axis" type="hinge" axis="0 1 0" range="-1.6 1.6" armature="0.05" frictionloss="0.5" damping="0.4"/>
<inertial pos="0 0 0" mass="1" diaginertia="0.2 0.2 0.2"/></body>
</worldbody><actuator><motor name="axis" joint="axis"/></actuator></mujoco>"""
LIMITS = "axes: {axis: {speed: 2.5, acceleration: 15.0, jerk: 300.0}}\n"
WHOLE, GEAR = 0.25, 50.0
STEP, SAMPLE = 0.00025, 0.001
NOISE, QUANTUM = 0.01, 1e-6
"""Of the torque, rms [N·m], and of the encoder at the joint [rad]."""
SWING = 2.0 * np.pi * 15.0
"""Bandwidth of the velocity loop [rad/s]."""


def small_moves() -> Array:
    """To and fro within a twentieth of the travel: a weight and a spring are one there."""
    return _strokes([(0.05 + 0.06 * share, 0.05 - 0.06 * share, 0.3 + 0.5 * share) for share in np.linspace(0.4, 1.0, 4)])


def fast_moves() -> Array:
    """To and fro at high speeds only: the ramps hardly show what happens at low ones."""
    return _strokes([(-1.2, 1.2, speed) for speed in np.linspace(0.8, 2.4, 4)])


@dataclass(frozen=True)
class Case:
    """The truth, the motion that is recorded first, and what it is mistaken for."""

    effect: Effect
    first: Callable[[], Array]
    mistaken_for: frozenset[str]


CASES = {
    "a weight or a spring": Case(library()["gravity"](moment=1.5, angle=0.4), small_moves, frozenset({"spring"})),  # type: ignore[call-arg]
    "a spring or a weight": Case(library()["spring"](stiffness=1.5, rest=0.3), small_moves, frozenset({"gravity", "payload"})),  # type: ignore[call-arg]
}


@pytest.mark.parametrize("name", repeated(*CASES))
def test_the_excited_motion_distinguishes_causes(name: str, tmp_path: Path) -> None:
    case = CASES[name]
    (tmp_path / "model.xml").write_text(MODEL, encoding="utf-8")
    (tmp_path / "limits.yaml").write_text(LIMITS, encoding="utf-8")
    true = case.effect.name
    before = _diagnosed(tmp_path, "first", _recorded(case.effect, case.first()))
    open_ones = {before.causes[0].effect, *before.causes[0].indistinguishable_from}
    assert true in open_ones
    assert open_ones & case.mistaken_for

    asked = ("--report", tmp_path / "first_gap/report.json", "--axis", "axis", "--limits", tmp_path / "limits.yaml")
    _command("excite", tmp_path / "model.xml", *asked, "--out", tmp_path / "motion")
    path = pc.read_csv(tmp_path / "motion" / "setpoints.csv").column("axis.position").to_numpy()
    after = _diagnosed(tmp_path, "second", _recorded(case.effect, path))
    assert after.causes[0].effect == true
    assert after.causes[0].probability > 0.9
    assert not case.mistaken_for & set(after.causes[0].indistinguishable_from)
    assert max(_probability(after.causes, one) for one in case.mistaken_for) < 0.05


def _probability(causes: list[CausePart], effect: str) -> float:
    return max((one.probability for one in causes if one.effect == effect), default=0.0)


def _diagnosed(folder: Path, name: str, recording: Recording) -> GapReport:
    write_recording(recording, folder / name)
    _command("diagnose", folder / "model.xml", folder / name, "--out", folder / f"{name}_gap", "--no-html")
    return read_report(folder / f"{name}_gap" / "report.json")


def _command(*words: str | Path) -> None:
    CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False, standalone_mode=False)


def _strokes(strokes: list[tuple[float, float, float]]) -> Array:
    """Back and forth by jerk-limited moves: from, to, speed."""
    parts = [np.full(400, strokes[0][0])]
    for start, end, speed in strokes:
        most = MotionLimits(speed, 12.0, 250.0)
        for a, b in ((float(parts[-1][-1]), start), *((start, end), (end, start)) * 2):
            parts += [jerk_limited(a, b, most).sample(SAMPLE).position, np.full(150, b)]
    return np.concatenate([*parts, np.full(400, parts[-1][-1])])


def _recorded(effect: Effect, path: Array) -> Recording:
    """A plant with an effect, moved along set-points by a cascade that reads the encoder; sampled at 1 kHz."""
    drive = DrivenJoint("axis", "axis", GEAR, rotor_inertia=0.0, holding_brake=0.0, position=float(path[0]))
    mechanism = Mechanism(mujoco.MjSpec.from_string(MODEL), {"axis": drive}, (PlacedEffect("axis", effect, {}),))
    every = round(SAMPLE / STEP)
    wanted = np.interp(np.arange(len(path) * every, dtype=np.float64) / every, np.arange(len(path)), path)
    wish = np.gradient(wanted, STEP)
    seen, given = np.empty_like(wanted), np.empty_like(wanted)
    integral, speed, last = 0.0, 0.0, float(wanted[0])
    for k, target in enumerate(wanted):
        mechanism.read()
        position = round(mechanism.motor_position[0] / GEAR / QUANTUM) * QUANTUM
        speed += 0.4 * ((position - last) / STEP - speed)
        last = position
        error = wish[k] - speed + SWING / 4.0 * (target - position)
        integral += SWING / 4.0 * error * STEP
        seen[k], given[k] = position, WHOLE * SWING * (error + integral)
        mechanism.motor_torque[0] = given[k] / GEAR
        mechanism.step()
    torque = given[::every] + NOISE * np.random.default_rng(0).standard_normal(len(path))
    axis = AxisInfo(joint="axis", actuator="axis", gear_ratio=GEAR)
    info = RecordingInfo(machine="rig", sample_period=SAMPLE, axes={"axis": axis})
    time = np.arange(len(path), dtype=np.float64) * SAMPLE
    return Recording("moved", info, time, {"axis": {"torque": torque, "position": seen[::every]}})
