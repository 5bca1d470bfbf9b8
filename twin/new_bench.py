"""The bench of a machine of one's own: the reference controller, and limits by what its loops and drives can be asked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import mujoco

from drivetwin.emulator.machine import Axis, Machine
from drivetwin.foundation.quantities import short
from drivetwin.twin.new_machine import APART

FILE = "bench.yaml"
CONTROLLER = ("{python}", "-m", "drivetwin.controller", "{task_file}", "--bus", "{bus}", "--clock", "{clock}", "--out", "{out}")
TASKS = ("boot", "enable", "home", "move", "path", "identify", "feed_forward", "soak")
NEEDS = ("boot", "enable", "homing", "moves", "paths", "identification", "faults", "bus", "recovery", "soak")
LAG = 2.0
"""Following error that is allowed, in that of a loop without integral at full acceleration."""
LOAD = 0.3
"""Of the mass of the outermost body: a load that the machine has to carry."""


class Motion(Protocol):
    """What the controller knows of an axis: joint, SI."""

    @property
    def travel(self) -> tuple[float, float]:
        """Lowest and highest position."""

    @property
    def max_speed(self) -> float:
        """Greatest speed."""

    @property
    def max_acceleration(self) -> float:
        """Greatest acceleration."""


def new_bench(
    motion: Mapping[str, Motion],
    edge_speed: Mapping[str, float],
    virtual: Machine,
    model: mujoco.MjModel,
    truth: Mapping[str, Mapping[str, float]],
    cycle: float,
) -> dict[str, Any]:
    """bench/1 of a machine whose folder it stands in, with a communication cycle [s] in which its axes have room.

    `motion` and the speed at the edge of the home switch [m/s or rad/s] by axis are the controller's; `model` is the plant,
    and `truth` its `coulomb` of each axis at the joint; the loops are those of `new_machine`.
    """
    lag = {name: _lag(axis, motion[name], truth[name]) for name, axis in virtual.axes.items()}
    return {
        "format": "bench/1",
        "machine": ".",
        "profile": "servoone",
        "cycle": cycle,
        "controller": {"name": "reference", "command": list(CONTROLLER), "tasks": list(TASKS)},
        "needs": list(NEEDS),
        "pdo": {
            "rpdo 1": {"objects": ["6040:00:16", "60C1:01:32", "60B2:00:16"], "transmission": 1},
            "tpdo 1": {"objects": ["6041:00:16"], "transmission": 255},
            "tpdo 2": {"objects": ["6064:00:32", "21A3:00:32"], "transmission": 1},
        },
        "limits": {
            "travel": {name: _wider(axis.travel) for name, axis in motion.items()},
            "speed": {name: short(1.1 * axis.max_speed) for name, axis in motion.items()},
            "torque": {name: short(1.01 * axis.motor.peak_torque * axis.gear_ratio) for name, axis in virtual.axes.items()},
            "enable_jump": {name: short(0.5 * error) for name, error in lag.items()},
            "homing_error": {name: short(0.01 * speed) for name, speed in edge_speed.items()},
            "tracking_error": {name: short(error) for name, error in lag.items()},
            "settling_band": {name: short(0.05 * error) for name, error in lag.items()},
            "settling_time": 0.4,
            "overshoot": {name: short(0.5 * error) for name, error in lag.items()},
            "apart": 0.01,
            "stop_time": 0.5,
            "stop_speed": {name: short(0.01 * axis.max_speed) for name, axis in motion.items()},
            "disable_time": 1.2,
            "identification_error": 0.03,
            "feed_forward_ratio": dict.fromkeys(motion, 0.8),
            "bus_load": 0.8,
            "sync_jitter": 0.002,
            "heartbeat_period": 0.1,
            **_payload(model, next(iter(virtual.axes.values())).joint),
            "frames_per_cycle": 2 * len(motion),
        },
        "timeouts": {"start": 60, "silence": 60, "simulated": 60 * (2 + len(motion))},
    }


def _lag(axis: Axis, motion: Motion, truth: Mapping[str, float]) -> float:
    """Following error at full acceleration against friction [m or rad], at the largest inertia."""
    width = APART * axis.loops.position_gain
    asked = motion.max_acceleration + truth.get("coulomb", 0.0) * width / axis.loops.velocity_gain
    return LAG * asked / (width * axis.loops.position_gain)


def _wider(travel: tuple[float, float]) -> list[float]:
    """By as much as an axis may swing beyond its travel, which ends well before the switches."""
    room = 0.005 * (travel[1] - travel[0])
    return [short(travel[0] - room), short(travel[1] + room)]


def _payload(model: mujoco.MjModel, joint: str) -> dict[str, float]:
    """A load by the last body with a mass of the chain that a joint moves [kg].

    None where none has: a bench without it skips the cases about a load, and says so.
    """
    first = int(model.joint(joint).bodyid[0])
    masses = [float(model.body_mass[body]) for body in range(model.nbody) if _is_below(model, body, first)]
    heavy = [mass for mass in masses if mass > 0.0]
    return {"payload": short(LOAD * heavy[-1])} if heavy else {}


def _is_below(model: mujoco.MjModel, body: int, above: int) -> bool:
    while body not in (0, above):
        body = int(model.body_parentid[body])
    return body == above
