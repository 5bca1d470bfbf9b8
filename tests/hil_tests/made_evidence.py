"""Evidence made by hand, whose every figure is known: three axes that stand, and what a test changes of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from drivetwin.hil_tests.bench import Bench, read_bench
from drivetwin.hil_tests.evidence import BusFrame, Configuration, Ending, Evidence, Run, Struck, Truth
from drivetwin.hil_tests.expectations.base import Expectation, Finding
from drivetwin.hil_tests.expectations.reading import read_expectation
from drivetwin.hil_tests.task import Task
from drivetwin.motion.jerk_limited import MotionLimits, jerk_limited

PERIOD = 0.002
STREAMING = 7

BENCH: Bench = read_bench(Path("hil_tests/benches/scara.yaml"))

LIFT, ROTATE, STRETCH = range(3)


def standing(seconds: float) -> Truth:
    """Axes at 0.1, 0.2, 0.3, enabled and held in the streaming mode."""
    count = round(seconds / PERIOD)
    rows = np.ones((count, 1))
    place = rows * np.array([[0.1, 0.2, 0.3]])
    nothing = np.zeros((count, 3))
    return Truth(
        time=PERIOD * np.arange(1, count + 1, dtype=np.float64),
        position=place.copy(),
        velocity=nothing.copy(),
        torque=nothing.copy(),
        demand=place.copy(),
        zero=nothing.copy(),
        offset=nothing.copy(),
        enabled=np.ones((count, 3), dtype=np.bool_),
        positioning=np.ones((count, 3), dtype=np.bool_),
        mode=np.full((count, 3), STREAMING),
    )


def moved(truth: Truth, axis: int, begin: float, to: float) -> float:
    """Let the demand of an axis go to a place from `begin` [s] on, and the axis with it; when it is there [s]."""
    first = int(np.searchsorted(truth.time, begin))
    limits = MotionLimits(speed=1.0, acceleration=5.0, jerk=100.0)
    way = jerk_limited(float(truth.demand[first, axis]), to, limits).sample(PERIOD)
    last = first + len(way.position)
    truth.demand[first:last, axis] = way.position
    truth.demand[last:, axis] = to
    truth.position[first:, axis] = truth.demand[first:, axis]
    truth.velocity[first:last, axis] = way.velocity
    return float(truth.time[last - 1])


def evidence(truth: Truth, **changes: Any) -> Evidence:
    """Of a controller that ended as done half a second before the truth's end."""
    end = float(truth.time[-1]) - 0.5
    made = Evidence(
        bench=BENCH,
        task=Task(task="home"),
        axes=("lift", "rotate", "stretch"),
        nodes=(1, 2, 3),
        units=("m", "rad", "rad"),
        gears=(628.3, 50.0, 50.0),
        frames=(),
        truth=truth,
        states=(),
        struck=(),
        runs=(Run(Ending.DONE, 0, 0.0, end, "", Path("nowhere")),),
        configured={},
        operational=frozenset(("lift", "rotate", "stretch")),
        friction={},
        left_behind=(),
        timed=False,
    )
    return replace(made, **changes)


def struck(time: float) -> dict[str, Any]:
    """The change of an evidence: a fault at that time [s]."""
    return {"struck": (Struck("drive_fault node 2", time),)}


def ordered(node: int) -> Configuration:
    """A node configured as the bench orders it."""
    invalid = 1 << 31
    pdos = {}
    for direction, base in (("rpdo", 0x200), ("tpdo", 0x180)):
        for number in range(1, 5):
            order = BENCH.pdo.get(f"{direction} {number}")
            cob_id = base + 0x100 * (number - 1) + node
            kind, entries = (order.transmission, order.entries) if order is not None else (255, ())
            pdos[f"{direction} {number}"] = (cob_id if order is not None else cob_id | invalid, kind, entries)
    return Configuration(time=0.0, pdos=pdos, heartbeat=0.1, supervises=("SYNC time-out",))


def frame(time: float, identifier: int, data: bytes = b"", by_controller: bool = True) -> BusFrame:
    """A data frame."""
    return BusFrame(time, identifier, data, by_controller, None, 0.0)


def expectation(told: object) -> Expectation:
    """As a scenario of the bench says it."""
    return read_expectation(told, BENCH)


def found(told: object, of: Evidence) -> list[tuple[str | None, float | None]]:
    """(axis, time) of each failure, times to the millisecond."""
    return [
        (failure.axis, None if failure.time is None else round(float(failure.time), 3)) for failure in judged(told, of).failures
    ]


def judged(told: object, of: Evidence) -> Finding:
    """What an expectation says."""
    return expectation(told).judge(of)


def measured(told: object, of: Evidence, axis: str | None) -> float:
    """The one quantity that an expectation measures on an axis."""
    (value,) = [one.value for one in judged(told, of).measured if one.axis == axis]
    return value


