"""Which cases are not run on real drives, and why."""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.expectations.base import Expectation
from drivetwin.hil_tests.expectations.outcome import Outcome
from drivetwin.hil_tests.targets import targets
from drivetwin.hil_tests.task import Task


def why_not_on_real_drives(
    task: Task, faults: Sequence[str], expected: Sequence[type[Expectation]], bench: Bench
) -> str | None:
    """Why a case is not run on real drives; None: it is.

    For its `faults`, that it goes on by itself after one, its targets, or that there is nothing to judge.
    """
    if faults:
        return f"faults strike virtual drives and their plant, and here drives are real: {', '.join(faults)}"
    if task.resume:
        return "resume lets a controller reset a drive's fault and enable it again by itself, and here drives are real"
    if not any(not kind.needs_truth and kind is not Outcome for kind in expected):
        names = ", ".join(kind.name for kind in expected if kind.needs_truth) or "nothing"
        return f"apart from the controller's outcome it judges what only a plant's truth shows; these drives are real: {names}"
    for axis, position in (target for pose in targets(task) for target in pose.items()):
        if axis not in bench.real_limits:
            return f"{axis} is to move, and machine {bench.machine_name} has no such axis"
        low, high = bench.real_limits[axis].travel
        if not low <= position <= high:
            return f"{axis} is to go to {position:g} {bench.units[axis]}, and its limits are {low:g} .. {high:g}"
    return None
