"""What will move on a real machine, and how far, stated before anything starts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.scenario import Scenario
from drivetwin.hil_tests.targets import targets
from drivetwin.hil_tests.task import Task, TaskName

_MOVES: Mapping[TaskName, str] = {
    "boot": "nothing moves",
    "enable": "every axis is enabled and holds where it stands",
    "home": "every axis goes to its switch, and from there into its limits",
    "identify": "every axis goes to its switch, then to and fro within its limits",
    "feed_forward": "every axis goes to its switch, then to and fro within its limits",
    "soak": "every axis goes to its switch, then to and fro within its limits",
}


def what_moves(scenarios: Sequence[Scenario], bench: Bench) -> Iterator[str]:
    """Lines for whoever stands beside the machine: the limits of every axis, then case by case in their order."""
    for axis, bounds in bench.real_limits.items():
        unit = bench.units[axis]
        low, high = bounds.travel
        torque = "N" if unit == "m" else "N·m"
        yield f"{axis}: {low:g} .. {high:g} {unit}, at most {bounds.speed:g} {unit}/s and {bounds.torque:g} {torque}"
    yield "Homing leaves this travel: it ends at the switch."
    for scenario in scenarios:
        if scenario.skipped_because is None:
            yield f"{scenario.identity}: {_said(scenario.task, bench)}"


def _said(task: Task, bench: Bench) -> str:
    if task.task in _MOVES:
        return _MOVES[task.task]
    ways: dict[str, list[float]] = {}
    for pose in targets(task):
        for axis, position in pose.items():
            ways.setdefault(axis, []).append(position)
    told = (f"{axis} {min(way):g} .. {max(way):g} {bench.units[axis]}" for axis, way in ways.items())
    return f"every axis goes to its switch, then {', '.join(told)}"
