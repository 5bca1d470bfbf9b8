"""What commissioning an axis found, as one value and as JSON."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from drivetwin.foundation.errors import UserError
from drivetwin.identification.frequency.bode import Bode, bode
from drivetwin.identification.frequency.cascade import Cascade, cascade_of
from drivetwin.identification.frequency.margins import Margins, decibel, degrees, margins
from drivetwin.identification.frequency.phasors import Complex, Excited, response
from drivetwin.identification.frequency.resonances import Resonances, find_resonances, inertia
from drivetwin.identification.frequency.steps import Stepped, StepResponse, step_response
from drivetwin.identification.frequency.torque_speed import SpeedPoint, torque_speed
from drivetwin.identification.frequency.tuning import Proposal, propose
from drivetwin.identification.result import Units
from drivetwin.recording.recording import Recording, Samples

FEWEST = 5
"""Reliable lines that an axis needs; with fewer, it has no result."""


@dataclass(frozen=True)
class AxisResponse:
    """One axis: frequency response, margins of the loops as they are, resonances, inertia [kg·m² or kg], step response,
    torque-speed curve with rated torque and limit [N·m or N] (None: not told), and gains that would do (None: none keep the
    margins)."""

    axis: str
    units: Units
    bode: Bode
    velocity: Margins
    position: Margins
    resonances: Resonances
    inertia: float
    step: StepResponse
    curve: tuple[SpeedPoint, ...]
    rated_torque: float | None
    torque_limit: float | None
    proposal: Proposal | None

    def to_json(self) -> dict[str, Any]:
        """SI units on the joint's side, frequencies in Hz, gains in dB, phases in degrees; lines that are not reliable too."""
        units = {
            "mechanics": f"dB re 1 {self.units.velocity}/({self.units.torque})",
            "inertia": self.units.inertia,
            "torque": self.units.torque,
            "speed": self.units.velocity,
            "velocity_gain": self.units.viscous,
            "position_gain": "1/s",
        }
        return {
            "units": units,
            "frequency": _numbers(self.bode.frequency),
            "relied_on": [bool(each) for each in self.bode.sure],
            "coherence": _numbers(self.bode.coherence),
            "mechanics": _curve(self.bode.mechanics),
            "velocity_loop": _loop(self.bode.velocity, self.bode.closed_velocity, self.velocity),
            "position_loop": _loop(self.bode.position, self.bode.closed_position, self.position),
            "resonances": list(self.resonances.resonances),
            "antiresonances": list(self.resonances.antiresonances),
            "inertia": self.inertia,
            "current_loop_time_constant": self.bode.cascade.current_lag,
            "step": {
                "time": _numbers(self.step.time), "position": _numbers(self.step.position),
                "rise": self.step.rise, "overshoot": self.step.overshoot, "settling": self.step.settling,
            },
            "torque_speed": [asdict(point) for point in self.curve],
            "rated_torque": self.rated_torque,
            "torque_limit": self.torque_limit,
            "gains": _gains(self.bode.cascade),
            "proposal": None if self.proposal is None else {
                **_gains(self.proposal.cascade),
                "velocity_loop": asdict(self.proposal.velocity),
                "position_loop": asdict(self.proposal.position),
            },
        }  # fmt: skip


def axis_response(excited: Excited, stepped: Stepped, strokes: Recording, units: Units) -> AxisResponse:
    """All that three recordings of an axis tell.

    Raises UserError for a drive that is no cascade or does not tell its gains, and where too few lines are reliable.
    """
    info = excited.recording.info
    told = info.axes[excited.axis]
    found = bode(response(excited), cascade_of(excited.axis, told.drive), info.sample_period)
    sure = int(found.sure.sum())
    if sure < FEWEST:
        raise UserError(
            f"axis {excited.axis}: {sure} of {len(found.sure)} frequencies are reliable, and {FEWEST} are needed: the "
            "noise hides the excited motion, or the axis does not move; is its friction near the torque limit, is it disturbed?"
        )
    frequency, fair = found.frequency[found.fair], found.fair
    shapes = find_resonances(found)
    return AxisResponse(
        excited.axis,
        units,
        found,
        margins(frequency, found.velocity[fair]),
        margins(frequency, found.position[fair]),
        shapes,
        inertia(found, shapes),
        step_response(stepped),
        torque_speed(strokes, excited.axis),
        told.rated_torque,
        None if told.drive is None else told.drive.torque_limit,
        propose(found),
    )


def _gains(cascade: Cascade) -> dict[str, float | None]:
    return {
        "position_gain": cascade.position_gain,
        "velocity_gain": cascade.velocity_gain,
        "integral_time": cascade.integral_time,
    }


def _loop(opened: Complex, closed: Complex, found: Margins) -> dict[str, Any]:
    return {"open": _curve(opened), "closed": _curve(closed), **asdict(found)}


def _curve(values: Complex) -> dict[str, list[float]]:
    return {"gain": _numbers(decibel(values)), "phase": _numbers(degrees(values))}


def _numbers(values: Samples) -> list[float]:
    """Six digits, which is more than any of them has."""
    return [float(f"{value:.6g}") for value in np.asarray(values).tolist()]
