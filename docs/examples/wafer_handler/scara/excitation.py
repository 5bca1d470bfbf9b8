"""Motion that identifies the arm's base parameters: all axes at once, at several poses of the arm."""

from __future__ import annotations

import numpy as np

from drivetwin.controller.session import Session
from drivetwin.controller.trajectory import Multisine, exciting
from drivetwin.recording.recording import Recording

POSES = (0.1, 0.9)
"""Where stretch moves about, as shares of its travel: folded and stretched, where the arm weighs most apart."""

DURATION = 60.0
"""Usual length of the motion about each pose [s]."""

WAVE = Multisine(frequencies=(0.7, 1.1, 1.6, 2.1, 2.6), fade=0.05, draws=100)
"""Slow: belts that ring at f_0 make what hangs on them seem heavier by (f / f_0)²."""

SHORT_WAVE = Multisine(frequencies=(1.6, 1.9, 2.2, 2.6), fade=0.05, draws=100)
"""Of stretch, which has little room about either pose: nothing slow, or it would hardly accelerate."""


def capture_together(session: Session, seed: int, seconds: float = DURATION) -> list[Recording]:
    """Multisines of lift, rotate and stretch at the same time, about each of `POSES`; the arm is at rest afterwards."""
    seeds = [seed + number * len(session.axes) for number in range(len(POSES))]
    return [_capture_about(session, number, pose, seeds[number], seconds) for number, pose in enumerate(POSES)]


def _capture_about(session: Session, number: int, pose: float, seed: int, seconds: float) -> Recording:
    """One pose; each axis has phases of its own."""
    axes = session.machine.axes
    centers = {name: 0.5 * (axis.travel[0] + axis.travel[1]) for name, axis in axes.items()}
    low, high = axes["stretch"].travel
    centers["stretch"] = low + pose * (high - low)
    session.go_to(centers)
    paths = {
        name: exciting(
            centers[name],
            axis.travel,
            axis.max_speed,
            axis.max_acceleration,
            seconds,
            session.cycle.period,
            seed + offset,
            SHORT_WAVE if name == "stretch" else WAVE,
        )
        for offset, (name, axis) in enumerate(axes.items())
    }
    recording = session.capture(f"together_{number}", {name: np.asarray(path) for name, path in paths.items()})
    session.go_to({name: axis.rest for name, axis in axes.items()})
    return recording
