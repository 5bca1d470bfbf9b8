"""Drives as they are drawn and commissioned: gains by what hangs on them, and what a recording tells of them."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetwin.blind.wide.machines import Draw, Machine
from drivetwin.blind.wide.simulator import TICK
from drivetwin.blind.wide.truth import CASCADE, DRIVES, PI_P, PID, TORQUE, Axes

LAWS = {"cascade": 0.35, "pi_p": 0.2, "pid": 0.15, "torque": 0.15, "untold": 0.15}
"""How often each is drawn; `untold` is one of the first three of which the recording does not say which."""


@dataclass(frozen=True)
class Drive:
    """The drive of an axis: its law (a number of `truth`), whether it is told; bandwidth [Hz] and the loops by it."""

    law: int
    told: bool
    bandwidth: float
    position_share: float
    integral: float
    velocity_feedforward: float
    inertia_feedforward: float
    velocity_lag: float
    current_lag: float

    @property
    def demand_is_recorded(self) -> bool:
        """Whether a recording has the demand, from which the torque that was asked for follows; in torque mode it has none."""
        return self.told and self.law != TORQUE


def draw_drive(draw: Draw, name: str) -> Drive:
    """One drive; velocity loops of 15 to 45 Hz, a fourth to an eighth of that for the position, as servo handbooks have it."""
    told = name != "untold"
    law = DRIVES.index(name if told else str(draw.choice(["cascade", "pi_p", "pid"])))
    ahead = law in (CASCADE, TORQUE)
    return Drive(
        law=law,
        told=told,
        bandwidth=draw.uniform(15.0, 45.0),
        position_share=1.0 / draw.uniform(4.0, 8.0),
        integral=0.0 if law == CASCADE and draw.random() < 0.15 else 1.0 / draw.uniform(3.0, 8.0),
        velocity_feedforward=float(draw.uniform(0.8, 1.0)) if law == CASCADE else float(law != PI_P),
        inertia_feedforward=float(draw.uniform(0.7, 1.0)) if ahead and draw.random() < 0.5 else 0.0,
        velocity_lag=draw.uniform(0.1, 0.8) * 1e-3,
        current_lag=draw.uniform(0.1, 0.5) * 1e-3,
    )


def commission(axes: Axes, drives: tuple[Drive, ...], machine: Machine, links: NDArray[np.float64], slower: float) -> None:
    """Write the gains of `drives` into the records, for `links` (n,) of inertia beside the rotors; `slower` divides bandwidths.

    A bandwidth stays below a third of what a spring lets swing, and of what delay and current loop leave as phase.
    """
    for k, drive in enumerate(drives):
        axis, inertia = axes[k], float(links[k] + machine.nominal[k].rotor)
        width = 2.0 * pi * min(drive.bandwidth / slower, _stable(axis, float(links[k])))
        gain = inertia * width
        axis["drive"] = drive.law
        axis["velocity_gain"] = gain
        axis["position_gain"] = width * drive.position_share * (gain if drive.law in (PID, TORQUE) else 1.0)
        axis["integral_gain"] = gain * width * drive.integral * (width * drive.position_share if drive.law == PID else 1.0)
        if drive.law == TORQUE:
            axis["integral_gain"] = 0.5 * axis["position_gain"]
        axis["velocity_feedforward"] = drive.velocity_feedforward
        axis["inertia_feedforward"] = drive.inertia_feedforward * inertia
        axis["velocity_lag"] = drive.velocity_lag
        if axis["current_lag"] == 0.0:
            axis["current_lag"] = drive.current_lag
        axis["drive_limit"] = 3.0 * machine.nominal[k].rated_torque


def _stable(axis: Any, links: float) -> float:
    """Highest bandwidth [Hz]."""
    late = float(axis["delay"] + axis["current_lag"])
    most = 0.3 / (2.0 * pi * late) if late > 0.0 else 1e3
    soft = [float(axis[name]) for name in ("elasticity", "flank") if axis[name] > 0.0]
    if soft:
        between = links * axis["rotor"] / (links + axis["rotor"])
        most = min(most, 0.3 * float(np.sqrt(min(soft) / between)) / (2.0 * pi))
    return most


def told(axis: Any, drive: Drive) -> dict[str, Any]:
    """`drive` of an axis in recording.json."""
    if not drive.told:
        return {"law": "unknown"}
    known = {"torque_limit": float(axis["drive_limit"]), "servo_period": TICK}
    if drive.law == TORQUE:
        return {"law": "torque", **known}
    lags = {"velocity_filter_hz": 1.0 / (2.0 * pi * drive.velocity_lag), "current_loop_time_constant": drive.current_lag}
    if drive.law == PID:
        names = {"proportional_gain": "position_gain", "integral_gain": "integral_gain", "derivative_gain": "velocity_gain"}
        return {"law": "pid", **{name: float(axis[field]) for name, field in names.items()}, **known, **lags}
    integral = float(axis["integral_gain"])
    return {
        "law": "cascade",
        "position_gain": float(axis["position_gain"]),
        "velocity_gain": float(axis["velocity_gain"]),
        "integral_time": float(axis["velocity_gain"]) / integral if integral > 0.0 else None,
        "velocity_feedforward": drive.velocity_feedforward,
        **known,
        **lags,
    }
