"""The paper's chain through the bus: identify the arm, feed forward, learn, move the blade straight, carry a wafer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drivetwin.controller.feedforward.alignment import loops_of
from drivetwin.controller.feedforward.bench import Bench
from drivetwin.controller.feedforward.stage import Stage
from drivetwin.controller.joint_path import limits_of
from drivetwin.controller.procedure import FIT, capture_friction
from drivetwin.controller.session import Session
from drivetwin.identification import identify, load_model
from drivetwin.identification.friction_law import FrictionLaw
from drivetwin.recording.recording import Recording
from drivetwin.recording.writer import write_into
from wafer_handler.experiment import repeat_learning, run_stage
from wafer_handler.learning import Learner
from wafer_handler.leg import Leg, leg
from wafer_handler.metrics import Tracking, tracking
from wafer_handler.results import AXES, AxisResult
from wafer_handler.scara.dynamics import mass_matrix
from wafer_handler.scara.excitation import capture_together
from wafer_handler.scara.identification import BaseIdentification, identify_arm
from wafer_handler.scara.torque_model import ArmTorque

REPETITIONS = 5

LEARNED_TO_HZ = {"lift": 60.0, "rotate": 45.0, "stretch": 50.0}
"""Up to where each axis learns: rotate and stretch shake the belts, which the learner's rigid model does not know."""

MOVED_TO = {"lift": 0.28, "rotate": 1.3, "stretch": 1.2}
"""Where each axis's move ends [m, rad, rad]; it starts at the axis's rest. Long enough for a cruise at full speed."""


@dataclass(frozen=True)
class Identified:
    """The arm by its full friction law and by the paper's, eq. 14."""

    full: BaseIdentification
    eq14: BaseIdentification


@dataclass
class Recorder:
    """Keeps recordings below a folder, each with what made it."""

    folder: Path
    seed: int
    inputs: Sequence[Path]

    def keep(self, recording: Recording, name: str) -> None:
        """Write one below the folder as `name`."""
        write_into(recording, self.folder / name, seed=self.seed, inputs=self.inputs)


def identify_through_the_bus(session: Session, recorder: Recorder, seed: int, seconds: float) -> Identified:
    """Strokes, excitation, and for `seconds` about each pose all axes together.

    Friction of each axis, then the arm's base parameters.
    """
    captured = capture_friction(session, seed)
    together = capture_together(session, seed, seconds)
    for recording in (*captured.recordings, *captured.validation, *together):
        recorder.keep(recording, recording.name)
    session.progress.phase("fit", 1.0)
    model = load_model(session.machine.model_path)
    laws = {axis: result.law for axis, result in identify(model, captured.recordings, captured.validation, FIT).axes.items()}
    moved = [*captured.recordings, *together]
    plain = dict.fromkeys(AXES, FrictionLaw())
    return Identified(full=identify_arm(model, moved, laws), eq14=identify_arm(model, moved, plain))


def study_axis(session: Session, axis: str, identified: Identified, recorder: Recorder) -> AxisResult:
    """The stages and the learning of one axis; the arm is at rest before and afterwards."""
    number = list(session.axes).index(axis)
    move = _leg(session, number, axis)
    eq14, full = bench_of(session, identified.eq14), bench_of(session, identified.full)
    inertia = _inertia(identified.full, move)
    learner = Learner(eq14.loops[number], inertia, session.cycle.period, LEARNED_TO_HZ[axis])

    def seen(recording: Recording, name: str) -> Tracking:
        recorder.keep(recording, f"{axis}_{name}")
        return tracking(recording, axis, move, eq14.loops[number].setpoint_delay)

    stages = {stage: seen(run_stage(full, f"{axis}, {stage.value}", move, stage), stage.name.lower()) for stage in Stage}
    by_eq14 = seen(run_stage(eq14, f"{axis}, torque by eq. 14", move, Stage.TORQUE), "torque_eq14")
    learned, further = (
        [
            seen(recording, f"{label}_{count}")
            for count, recording in enumerate(repeat_learning(bench, f"{axis} {label}", move, learner, REPETITIONS))
        ]
        for bench, label in ((eq14, "learning"), (full, "learning_further"))
    )
    return AxisResult(stages, by_eq14, learned, further)


def study_stages(session: Session, axis: str, identified: Identified, recorder: Recorder) -> dict[Stage, Tracking]:
    """The stages alone, on the drives of this session."""
    number = list(session.axes).index(axis)
    move = _leg(session, number, axis)
    bench = bench_of(session, identified.full)
    found = {}
    for stage in Stage:
        recording = run_stage(bench, f"{axis}, {stage.value}", move, stage)
        recorder.keep(recording, f"{axis}_{stage.name.lower()}")
        found[stage] = tracking(recording, axis, move, bench.loops[number].setpoint_delay)
    return found


def bench_of(session: Session, found: BaseIdentification) -> Bench:
    """Feed-forward by what was identified, on the drives of a session."""
    return Bench(session, loops_of(session.drives, session.axes), ArmTorque(found.base, found.laws))


def _leg(session: Session, number: int, axis: str) -> Leg:
    rest = np.array([one.rest for one in session.machine.axes.values()])
    return leg(rest, number, MOVED_TO[axis], limits_of(session.machine.axes[axis]))


def _inertia(found: BaseIdentification, move: Leg) -> float:
    """Inertia of the moving axis in the middle of its way [kg or kg·m²]."""
    middle = move.rest.copy()
    middle[move.axis] = 0.5 * (move.profile.start + move.profile.end)
    return float(mass_matrix(found.base, middle)[move.axis, move.axis])
