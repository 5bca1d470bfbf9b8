"""What commissioning an axis takes on the machine: an excited slow travel, steps of the position, strokes at many speeds.

Friction is the same in one direction as long as the axis moves: so it is excited while it travels to and fro, and never stops
within a measured period (Ljung, System Identification, 1999, 13.3, on small signals about an operating point).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from drivetwin.controller.excitation import strokes
from drivetwin.controller.machine import Axis
from drivetwin.controller.motion import Offsets, positions_now
from drivetwin.controller.session import Session
from drivetwin.controller.trajectory import Positions
from drivetwin.foundation.errors import UserError
from drivetwin.identification.frequency.phasors import Excited, response
from drivetwin.identification.frequency.result import AxisResponse, axis_response
from drivetwin.identification.frequency.steps import Stepped
from drivetwin.identification.frequency.wave import Lines, Wave, lines_in, multisine
from drivetwin.identification.result import UNITS, Units
from drivetwin.motion.inverse_dynamics import JointKind
from drivetwin.recording.recording import Recording, Samples

LINES = 110
"""Frequencies that are excited, at most."""

PERIOD = 1.0
"""Of the wave [s]; its inverse is the lowest frequency."""

PERIODS, SETTLING = 5, 2
"""Of the wave in a stroke, and the first of them that let the loops settle."""

STROKES = 6
"""To and fro."""

TRAVEL_SPEED = 0.1
"""Of the axis's full speed, at which it travels meanwhile."""

ROOM = 0.6
"""Share of the travel that is used at most."""

PROBE, MOST_TORQUE = 0.01, 0.25
"""Rms of the injected torque as a share of the torque limit: at first, and at most."""

SWING = 0.5
"""Greatest speed of the excited motion as a share of the speed of travel: the axis must not stop."""

RAMP_SHARE = 0.25
"""Of the full acceleration, up to the speed of travel and down."""

STEP_TIME = 0.4
"""From a step of the position to the next [s]."""

STEPS = 8
"""In a stroke."""

STEP_SHARE = 0.2
"""Of the way that the axis makes at full speed in a cycle: the size of a step."""

CURVE_LEVELS = (0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0)
"""Speeds of the torque-speed curve as shares of full speed."""


@dataclass(frozen=True)
class Commissioned:
    """What was measured on one axis, and the units of its joint."""

    excited: Excited
    stepped: Stepped
    strokes: Recording
    units: Units

    @property
    def recordings(self) -> tuple[Recording, Recording, Recording]:
        """In the order in which they were made."""
        return self.excited.recording, self.stepped.recording, self.strokes

    def evaluate(self) -> AxisResponse:
        """What it tells. Raises UserError as `axis_response`."""
        return axis_response(self.excited, self.stepped, self.strokes, self.units)


def commission(session: Session, axis: str, seed: int) -> Commissioned:
    """Measure one axis of a machine that is homed and streams, the others holding; it ends in the middle of its travel.

    Raises UserError where the machine stops it.
    """
    lines = lines_in(round(PERIOD / session.cycle.period), LINES)
    flat = np.full(len(lines), PROBE * _torque_limit(session, axis) * np.sqrt(2.0 / len(lines)))
    probe = _excite(session, axis, f"probe_{axis}", _wave(session, lines, flat, seed), 2)
    sizes = _sizes(session, axis, probe)
    excited = _excite(session, axis, f"frequency_response_{axis}", _wave(session, lines, sizes, seed), STROKES)
    stepped = _step(session, axis)
    session.go_to({axis: _middle(session.machine.axes[axis])})
    known = session.machine.axes[axis]
    path = strokes(known, CURVE_LEVELS, session.cycle.period)
    units = UNITS[JointKind.PRISMATIC if known.prismatic else JointKind.REVOLUTE]
    return Commissioned(excited, stepped, session.capture(f"torque_speed_{axis}", {axis: path}), units)


@dataclass(frozen=True)
class Attempt:
    """An axis that was measured: what that tells, or in one line why it tells nothing."""

    axis: str
    measured: Commissioned
    found: AxisResponse | None
    failure: str


def attempt_each(session: Session, axes: Sequence[str], seed: int) -> Iterator[Attempt]:
    """Measure one axis after the other and evaluate each at once: one that tells nothing takes nothing from the others.

    Raises UserError where the machine stops an axis.
    """
    for axis in axes:
        measured = commission(session, axis, seed)
        yield session.meanwhile(partial(_attempted, axis, measured))


def _attempted(axis: str, measured: Commissioned) -> Attempt:
    try:
        return Attempt(axis, measured, measured.evaluate(), "")
    except UserError as error:
        return Attempt(axis, measured, None, str(error))


# -- excited travel -------------------------------------------------------------------------------------------------------


def _wave(session: Session, lines: Lines, sizes: Samples, seed: int) -> Wave:
    return multisine(round(PERIOD / session.cycle.period), lines, sizes, seed)


def _sizes(session: Session, axis: str, probe: Excited) -> Samples:
    """Amplitudes of the injected torque (m,) [N·m or N], by how the axis moved in the probe.

    The loops hold against slow torques: where the axis moves the more the higher the frequency, each line is to give the same
    speed. It falls off again above, and where an elastic load stands in for a brake and itself moves more than the motor.
    Together they stay below `SWING` of the speed of travel, at three times their rms, which a sum of many sines hardly leaves.
    """
    found = response(probe)
    speed = 2.0 * np.pi * found.frequency * np.abs(found.position)
    shape = 1.0 / np.maximum.accumulate(speed)
    swing = 3.0 * float(np.linalg.norm(shape * speed)) / np.sqrt(2.0)
    room = SWING * _travel_speed(session.machine.axes[axis], PERIODS * PERIOD) / swing
    torque = MOST_TORQUE * _torque_limit(session, axis) / (float(np.linalg.norm(shape)) / np.sqrt(2.0))
    return np.asarray(shape * min(room, torque))


def _excite(session: Session, axis: str, name: str, wave: Wave, strokes_of: int) -> Excited:
    length = PERIODS * len(wave.samples)
    way = _stroke(session.machine.axes[axis], length, session.cycle.period)
    path, begins = _to_and_fro(session, axis, way, strokes_of)
    torque = np.zeros(len(path))
    for begin in begins:
        torque[begin + way.ramp :][:length] = np.tile(wave.samples, PERIODS)
    starts = [begin + way.ramp + turn * len(wave.samples) for begin in begins for turn in range(SETTLING, PERIODS)]
    return Excited(_run(session, axis, name, path, torque), axis, wave, starts, 2 * (PERIODS - SETTLING))


def _run(session: Session, axis: str, name: str, path: Positions, torque: Positions) -> Recording:
    """Stream a path and an injected torque of one axis; the others hold. What is recorded is what the drive was sent."""
    at = [drive.name for drive in session.drives].index(axis)
    demand = np.tile(positions_now(session.drives), (len(path), 1))
    demand[:, at] = path
    drive = session.drives[at]
    torques = np.zeros_like(demand)
    torques[:, at] = np.array(drive.torque_offsets(torque)) * drive.joint_torque(drive.rated_torque) / 1000.0
    return session.run(name, demand, Offsets(torques))


def _torque_limit(session: Session, axis: str) -> float:
    """Of the drive, joint side [N·m or N]."""
    drive = next(drive for drive in session.drives if drive.name == axis)
    return drive.joint_torque(min(drive.torque_limit, drive.rated_torque * 3.0))


# -- steps ----------------------------------------------------------------------------------------------------------------


def _step(session: Session, axis: str) -> Stepped:
    """Steps up and down on a stroke forwards and one backwards."""
    period, known = session.cycle.period, session.machine.axes[axis]
    length = round(STEP_TIME / period)
    height = STEP_SHARE * known.max_speed * period
    way = _stroke(known, (STEPS + 1) * length, period)
    path, begins = _to_and_fro(session, axis, way, 2)
    up: list[int] = []
    down: list[int] = []
    for begin in begins:
        for number in range(STEPS):
            first = begin + way.ramp + (number + 1) * length
            (up if number % 2 == 0 else down).append(first)
            if number % 2 == 0:
                path[first : first + length] += height
    recording = _run(session, axis, f"steps_{axis}", path, np.zeros(len(path)))
    return Stepped(recording, axis, height, tuple(up), tuple(down), length)


# -- ways -----------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Way:
    """A stroke from rest to rest (n,) relative to its start; constant speed begins at the sample `ramp`."""

    path: Positions
    ramp: int


def _travel_speed(axis: Axis, seconds: float) -> float:
    """Speed of a stroke at constant speed for so long [rad/s or m/s]."""
    room = ROOM * (axis.travel[1] - axis.travel[0])
    return min(TRAVEL_SPEED * axis.max_speed, room / (1.2 * seconds))


def _stroke(axis: Axis, constant: int, period: float) -> _Way:
    speed = _travel_speed(axis, constant * period)
    ramp = max(1, round(speed / (RAMP_SHARE * axis.max_acceleration) / period))
    share = 0.5 - 0.5 * np.cos(np.pi * (np.arange(ramp) + 0.5) / ramp)
    speeds = speed * np.concatenate([share, np.ones(constant), share[::-1], np.zeros(ramp)])
    return _Way(np.asarray(np.cumsum(speeds) * period), ramp)


def _to_and_fro(session: Session, axis: str, way: _Way, count: int) -> tuple[Positions, list[int]]:
    """Strokes about the middle of the travel, to and fro in turn, and where each begins; the axis goes to the start."""
    start = _middle(session.machine.axes[axis]) - 0.5 * float(way.path[-1])
    session.go_to({axis: start})
    start = float(positions_now(session.drives)[[drive.name for drive in session.drives].index(axis)])
    back = way.path[-1] - way.path
    path = np.concatenate([way.path if number % 2 == 0 else back for number in range(count)]) + start
    return path, [number * len(way.path) for number in range(count)]


def _middle(axis: Axis) -> float:
    return 0.5 * (axis.travel[0] + axis.travel[1])
