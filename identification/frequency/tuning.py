"""Gains that the measured mechanics bears with margins: an autotuner that needs no model."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from drivetwin.identification.frequency.bode import Bode, loops_over
from drivetwin.identification.frequency.cascade import Cascade
from drivetwin.identification.frequency.margins import Margins, decibel, margins
from drivetwin.identification.frequency.phasors import Complex

FACTORS = np.geomspace(0.05, 20.0, 241)
"""Gains that are tried, times the present one; 2.5 % from one to the next."""

INTEGRAL_TIMES = np.geomspace(0.2, 5.0, 13)
"""Integral times that are tried, times the present one."""


@dataclass(frozen=True)
class Goal:
    """Least `phase` margin [degrees] and `gain` margin [dB], greatest `peak` of the sensitivity [dB]."""

    phase: float
    gain: float
    peak: float


VELOCITY_GOAL, POSITION_GOAL = Goal(50.0, 10.0, 6.0), Goal(60.0, 10.0, 4.0)
"""A peak of 6 dB is a sensitivity of 2, one of 4 dB 1.6 (Åström and Hägglund, Advanced PID Control, 2006, 4.7: 1.4 to 2)."""


@dataclass(frozen=True)
class Proposal:
    """`cascade` with the proposed gains, and the margins of both loops with them over the measured mechanics."""

    cascade: Cascade
    velocity: Margins
    position: Margins


def propose(found: Bode) -> Proposal | None:
    """The velocity loop with the greatest integral gain within `VELOCITY_GOAL`, over it the greatest position gain within its.

    Åström, Panagopoulos and Hägglund, Automatica 34(5), 1998; of a P loop the greatest proportional gain. None where no gain
    that was tried keeps the goals. A loop that does not cross -180° within what was measured has to be as far below 0 dB at
    the highest line as its gain margin.
    """
    candidates = [_steepest(found, integral) for integral in _integral_times(found.cascade)]
    sound = [each for each in candidates if each is not None]
    if not sound:
        return None
    velocity = max(sound, key=lambda each: each.velocity_gain / (each.integral_time or 1.0))
    for factor in FACTORS[::-1]:
        tried = replace(velocity, position_gain=found.cascade.position_gain * float(factor))
        open_velocity, open_position = _open(found, tried)
        if _keeps(found, open_position, POSITION_GOAL):
            frequency = found.frequency[found.fair]
            return Proposal(tried, margins(frequency, open_velocity), margins(frequency, open_position))
    return None


def _integral_times(cascade: Cascade) -> Iterator[float | None]:
    if cascade.integral_time is None:
        yield None
    else:
        yield from (cascade.integral_time * float(factor) for factor in INTEGRAL_TIMES)


def _steepest(found: Bode, integral_time: float | None) -> Cascade | None:
    """The greatest velocity gain within the goal at an integral time, None where there is none."""
    for factor in FACTORS[::-1]:
        gain = found.cascade.velocity_gain * float(factor)
        tried = replace(found.cascade, velocity_gain=gain, integral_time=integral_time)
        if _keeps(found, _open(found, tried)[0], VELOCITY_GOAL):
            return tried
    return None


def _open(found: Bode, cascade: Cascade) -> tuple[Complex, Complex]:
    """Open velocity and position loop at the lines that margins are taken from."""
    return loops_over(found.mechanics[found.fair], found.frequency[found.fair], cascade)


def _keeps(found: Bode, loop: Complex, goal: Goal) -> bool:
    margin = margins(found.frequency[found.fair], loop)
    if margin.phase is None or margin.peak > goal.peak or margin.phase < goal.phase:
        return False
    far_below = float(decibel(loop[-1:])[0]) <= -goal.gain
    return far_below if margin.gain is None else margin.gain >= goal.gain and far_below
