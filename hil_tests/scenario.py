"""A scenario: a task, what goes wrong meanwhile, and what is expected of bus, plant and time (scenario/1)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, PositiveFloat, PositiveInt

from drivetwin.emulator.faults.base import Fault, LastingFault
from drivetwin.emulator.faults.library import read_fault
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.typed_yaml import Strict, read_yaml, typed
from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.conditions import Condition, read_condition
from drivetwin.hil_tests.expectations.base import Expectation
from drivetwin.hil_tests.expectations.homed import Homed
from drivetwin.hil_tests.expectations.homing_attained import HomingAttained
from drivetwin.hil_tests.expectations.outcome import Outcome
from drivetwin.hil_tests.expectations.reading import expectation_kind, read_expectation
from drivetwin.hil_tests.expectations.torque_limit_kept import TorqueLimitKept
from drivetwin.hil_tests.real_cases import why_not_on_real_drives
from drivetwin.hil_tests.shares import expectation_on, fault_on, task_on, why_no_payload
from drivetwin.hil_tests.task import Task

CONTROLLER_KILLED = "controller_killed"
"""The fault of the one who is tested: its process is killed (SIGKILL)."""


class _File(Strict):
    format: Literal["scenario/1"]
    title: str
    requirement: str
    task: Task
    faults: list[dict[str, Any]] = Field(default_factory=list)
    expect: list[Any] = Field(min_length=1)
    aftermath: PositiveFloat = 0.5
    starts: PositiveInt = 1
    clock: Literal["sync", "realtime"] | None = None
    machine: str | None = None
    silence: PositiveFloat | None = None


@dataclass(frozen=True)
class PlannedFault:
    """A fault: when it strikes, and how long it lasts [s], None: for good. `fault` is None for the death of the controller."""

    text: str
    fault: Fault | None
    when: Condition
    after: float
    lasts: float | None


@dataclass(frozen=True)
class Scenario:
    """A case before it is run.

    `number`, `group` and `name` are those of its file NN_group/name.yaml. `aftermath` [s] is how long the machine is watched
    once the controller has gone; `starts`, how often the controller is started, one after the other; `silence` is None where
    the bench's own holds. Where a case cannot be run on the bench it has no faults and no expectations, and says why.
    `not_judged` are the expectations that it is without where drives are real.
    """

    number: int
    group: str
    name: str
    path: Path
    title: str
    requirement: str
    task: Task
    faults: tuple[PlannedFault, ...]
    expectations: tuple[Expectation, ...]
    aftermath: float
    starts: int
    silence: float | None
    skipped_because: str | None
    not_judged: tuple[str, ...] = ()

    @property
    def identity(self) -> str:
        """04_moves.single"""
        return f"{self.number:02d}_{self.group}.{self.name}"


def read_scenario(path: Path, bench: Bench) -> Scenario:
    """Read and check a scenario for a bench.

    Raises UserError naming the file and the key for what is missing, unknown or wrong: a fault, a condition, an expectation,
    a limit that the bench has not.
    """
    given = typed(_File, read_yaml(path), path)
    number, group = _group(path)
    try:
        kinds = [expectation_kind(one) for one in given.expect]
        because = _why_not_here(given, bench)
        if because is None:
            given = _on_its_machine(given, kinds, bench)
            because = _why_not_real(given, kinds, bench)
        unknown = tuple(kind.name for kind in kinds if bench.drives == "real" and kind.needs_truth) if because is None else ()
        return Scenario(
            number=number,
            group=group,
            name=path.stem,
            path=path,
            title=given.title,
            requirement=given.requirement,
            task=given.task,
            faults=tuple(_fault(fault, bench) for fault in given.faults) if because is None else (),
            expectations=_expectations(given, kinds, bench) if because is None else (),
            aftermath=given.aftermath,
            starts=given.starts,
            silence=given.silence,
            skipped_because=because,
            not_judged=unknown,
        )
    except UserError as error:
        raise UserError(f"{path}: {error}") from None


def _on_its_machine(given: _File, kinds: Sequence[type[Expectation]], bench: Bench) -> _File:
    """The case in names and numbers of the bench's machine."""
    changes = {
        "task": task_on(given.task, bench),
        "faults": [fault_on(fault, bench) for fault in given.faults],
        "expect": [
            expectation_on(one, kind, bench) if bench.drives == "virtual" or not kind.needs_truth else one
            for one, kind in zip(given.expect, kinds, strict=True)
        ],
    }
    return given.model_copy(update=changes)


def _why_not_here(given: _File, bench: Bench) -> str | None:
    """Why a case is not for this bench; None: it is."""
    if given.machine not in (None, bench.machine_name):
        return f"the case is about machine {given.machine}, and this bench has {bench.machine_name}"
    if given.clock not in (None, bench.clock):
        return f"the case is about clock {given.clock}, and this bench has clock {bench.clock}"
    if given.task.task not in bench.controller.tasks:
        return f"the controller {bench.controller.name!r} does no task {given.task.task!r} (tasks in {bench.path.name})"
    return why_no_payload(given.faults, bench) if bench.drives == "virtual" else None


def _why_not_real(given: _File, kinds: Sequence[type[Expectation]], bench: Bench) -> str | None:
    """Why a case is not run on this bench's drives, where they are real."""
    if bench.drives == "virtual":
        return None
    return why_not_on_real_drives(given.task, [str(fault.get("fault")) for fault in given.faults], kinds, bench)


def _group(path: Path) -> tuple[int, str]:
    number, _, group = path.parent.name.partition("_")
    if not number.isdecimal() or not group:
        raise UserError(f"{path}: a case stands in a folder NN_group, for example 04_moves/{path.name}")
    return int(number), group


def _fault(given: dict[str, Any], bench: Bench) -> PlannedFault:
    nodes = {name: axis.node_id for name, axis in bench.virtual.axes.items()}
    told = {key: value for key, value in given.items() if key not in ("when", "after", "for")}
    name = told.get("fault")
    if "when" not in given:
        raise UserError(f"faults: {name}: says no `when`; write for example when: {{time: 1.0}}")
    lasts = _seconds("for", given.get("for"))
    fault = None if name == CONTROLLER_KILLED else _known(told, nodes, bench)
    if lasts is not None and not isinstance(fault, LastingFault):
        raise UserError(f"faults: {name} strikes once and has no end; leave out how long it lasts (for)")
    return PlannedFault(
        text=" ".join(f"{value}" if key == "fault" else f"{key} {value}" for key, value in told.items()),
        fault=fault,
        when=read_condition(given["when"], nodes),
        after=_seconds("after", given.get("after")) or 0.0,
        lasts=lasts,
    )


def _known(told: dict[str, Any], nodes: dict[str, int], bench: Bench) -> Fault:
    fault = read_fault(told)
    if fault.node not in ("all", *nodes, *nodes.values()):
        choice = ", ".join(f"{node} ({axis})" for axis, node in nodes.items())
        raise UserError(f"faults: {fault.name}: {bench.machine_name} has no node {fault.node!r}; it has {choice}, or say all")
    return fault


def _seconds(key: str, value: object) -> float | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or value < 0:
        raise UserError(f"faults: {key}: expected seconds from 0 on, not {value!r}")
    return float(value)


def _expectations(given: _File, kinds: Sequence[type[Expectation]], bench: Bench) -> tuple[Expectation, ...]:
    """Those that the bench's drives let be judged, read with its limits, and what real drives are asked beside."""
    judged = [one for one, kind in zip(given.expect, kinds, strict=True) if bench.drives == "virtual" or not kind.needs_truth]
    read = tuple(read_expectation(one, bench) for one in judged)
    for one in read:
        _check(one, given, bench)
    if Outcome not in kinds:
        raise UserError("expect: says nothing of how the controller ends; add for example: - outcome: done")
    return read if bench.drives == "virtual" else read + tuple(_of_real_drives(kinds))


def _check(expectation: Expectation, given: _File, bench: Bench) -> None:
    try:
        expectation.check(bench, given.task, given.starts)
    except UserError as error:
        raise UserError(f"expect: {expectation.name}: {error}") from None


def _of_real_drives(kinds: Sequence[type[Expectation]]) -> Iterator[Expectation]:
    """A torque limit in every case, and that axes have homed in the place of where their zero truly is."""
    if TorqueLimitKept not in kinds:
        yield TorqueLimitKept()
    if Homed in kinds and HomingAttained not in kinds:
        yield HomingAttained()
