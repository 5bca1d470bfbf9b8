"""feed_forward: one motion without and with torque offsets, and by how much the tracking error falls."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from drivetwin.controller.feedforward.alignment import loops_of
from drivetwin.controller.feedforward.bench import Bench
from drivetwin.controller.feedforward.rest import with_rest
from drivetwin.controller.feedforward.stage import Stage, feed_velocity
from drivetwin.controller.feedforward.torque_model import ModelTorque, fitted
from drivetwin.controller.joint_path import JointPath, joined, limits_of
from drivetwin.controller.machine import Machine
from drivetwin.controller.motion import positions_now
from drivetwin.controller.session import Session
from drivetwin.controller.synchronised import synchronised
from drivetwin.controller.tasks.base import Task, Work
from drivetwin.foundation.files import provenance, write_json
from drivetwin.motion.inverse_dynamics import load_model
from drivetwin.recording.recording import Recording

FORMAT = "feed_forward/1"

REACH = 0.25
"""How far an axis goes to either side of the middle of its travel, as a share of the travel."""


@dataclass(frozen=True)
class Gain:
    """Tracking error of an axis, rms while the demand moves [m or rad]."""

    without: float
    with_it: float


class FeedForward(Task):
    """No parameters.

    The torque is that of the nominal model for the planned motion, with the friction that the run without an offset showed.
    """

    def run(self, work: Work) -> None:
        session = work.session
        work.do(partial(session.travel, session.machine.beside_the_middle(-REACH)))
        feed_velocity(session, True)
        path = _to_and_fro(session)
        plain = session.run("without feed-forward", path.position)
        model = session.meanwhile(lambda: fitted(load_model(session.machine.model_path), session.drives, path, plain))
        fed = self._fed(session, path, model)
        gains = {name: Gain(_rms(plain, name), _rms(fed, name)) for name in session.axes}
        write_json(work.out / "feed_forward.json", _payload(session.machine, work.seed, gains))

    def _fed(self, session: Session, path: JointPath, model: ModelTorque) -> Recording:
        bench = Bench(session, loops_of(session.drives, session.axes), model)
        return bench.run("with feed-forward", path, Stage.TORQUE)


def _to_and_fro(session: Session) -> JointPath:
    """All axes together to the other side and back, from where they are."""
    limits = [limits_of(axis) for axis in session.machine.axes.values()]
    here = positions_now(session.drives)
    there = list(session.machine.beside_the_middle(REACH).values())
    period = session.cycle.period
    away = with_rest(here, synchronised(here.tolist(), there, limits).sample(period))
    back = with_rest(away.position[-1], synchronised(there, here.tolist(), limits).sample(period))
    return joined([away, back])


def _rms(recording: Recording, axis: str) -> float:
    columns = recording.columns[axis]
    moving = np.gradient(columns["position_demand"]) != 0.0
    error = columns["position_demand"] - columns["position"]
    return float(np.sqrt(np.mean(error[moving] ** 2)))


def _payload(machine: Machine, seed: int, gains: dict[str, Gain]) -> dict[str, Any]:
    return {
        "format": FORMAT,
        **provenance(seed, [machine.model_path, machine.axes_path]),
        "tracking_error_without": {axis: gain.without for axis, gain in gains.items()},
        "tracking_error_with": {axis: gain.with_it for axis, gain in gains.items()},
    }
