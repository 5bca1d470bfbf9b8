"""A small acceptance made by hand: one case of each outcome, with the figures that a release would have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from drivetwin.emulator.drive.state_machine import State
from drivetwin.hil_tests.bench import Bench, ControllerCommand
from drivetwin.hil_tests.evidence import BusFrame, Ending, Evidence, Run, StateChange, Struck, Truth
from drivetwin.hil_tests.folder import write_case
from drivetwin.hil_tests.results.acceptance import Acceptance
from drivetwin.hil_tests.task import Task
from drivetwin.hil_tests.verdict import CaseResult, Failure, Measured, Outcome

BENCH = Bench(
    format="bench/1",
    machine="scara",
    profile="servoone",
    controller=ControllerCommand(name="reference & <co>", command=["control", "{task_file}"], tasks=["boot", "move"]),
    limits={"stop_time": 0.2, "tracking_error": {"lift": 5e-4, "rotate": 1e-3}, "travel": {"lift": (0.0, 0.3)}},
    path=Path("bench.yaml"),
)

BOOT = CaseResult(
    number=1,
    group="boot",
    name="configuration",
    title="The drives are configured as ordered",
    requirement="PDO mapping and heartbeat are set before the nodes become operational.",
    outcome=Outcome.ACCEPTED,
    failures=(),
    measured=(Measured("bus load", 0.42, "1", limit=0.8, noise=0.0),),
    skipped_because="",
    simulated=0.25,
    wall=1.5,
    folder=None,
)
MOVE = replace(
    BOOT,
    number=4,
    group="moves",
    name="single",
    title="Single moves",
    requirement="Every axis follows within tracking_error.",
    measured=(
        Measured("tracking error", 3.1e-4, "m", "lift", limit=5e-4, noise=1e-6),
        Measured("tracking error", 8.0e-4, "rad", "rotate", limit=1e-3, noise=2e-6),
    ),
    simulated=6.125,
)
FAULT = replace(
    BOOT,
    number=8,
    group="faults",
    name="drive_faults",
    title="A drive that faults stops every axis",
    requirement="Every axis is at rest within stop_time of the fault.",
    outcome=Outcome.REJECTED,
    failures=(
        Failure("stopped", "still moves <0.3 s> after the fault", "rotate", 1.0625, 0.3, 0.2, "s"),
        Failure("outcome", "the controller went on as if nothing had happened: \x1b[31mpanic\x00"),
    ),
    measured=(Measured("time to rest", 0.3, "s", "rotate", limit=0.2, noise=1e-3),),
    simulated=2.5,
)
FEED_FORWARD = replace(
    BOOT,
    number=7,
    group="feed_forward",
    name="gain",
    title="Feed-forward pays",
    measured=(Measured("tracking error with to without", 0.17, "1", "rotate", limit=0.5, noise=3e-3),),
    simulated=9.0,
)
SOAK = replace(
    BOOT,
    number=11,
    group="soak",
    name="to_and_fro",
    title="Ten minutes",
    outcome=Outcome.SKIPPED,
    measured=(),
    skipped_because="the controller has no task soak",
    simulated=0.0,
)


def acceptance_of(*cases: CaseResult) -> Acceptance:
    """An acceptance of these cases, of all five where none is given."""
    return Acceptance(BENCH, cases or (BOOT, MOVE, FEED_FORWARD, FAULT, SOAK), digest="ab" * 32)


def with_value(case: CaseResult, value: float, noise: float | None, at: int = 0) -> CaseResult:
    """The case with another value and noise of one quantity."""
    measured: Sequence[Measured] = case.measured
    changed = replace(measured[at], value=value, noise=noise)
    return replace(case, measured=(*measured[:at], changed, *measured[at + 1 :]))


def evidence_of(folder: Path, seconds: float = 2.5) -> Evidence:
    """Three axes that swing; `rotate` faults at 0.75 s, of a fault struck then, and lags by a peak of one sample at 1.06 s."""
    time = np.arange(1, round(1000 * seconds) + 1, dtype=np.float64) * 1e-3
    axes = ("lift", "rotate", "stretch")
    demand = np.stack([0.05 * (1.0 - np.cos(2.0 * np.pi * rate * time)) for rate in (0.5, 1.0, 2.0)], axis=1)
    position = demand - 2e-4 * np.sin(7.0 * time)[:, None]
    position[1061, 1] -= 5e-3
    rest = np.zeros_like(demand)
    truth = Truth(
        time=time, position=position, velocity=np.gradient(position, time, axis=0), torque=20.0 * demand, demand=demand,
        zero=rest, offset=rest, enabled=np.broadcast_to(time[:, None] > 0.2, demand.shape),
        positioning=np.ones_like(demand, dtype=bool), mode=np.full(demand.shape, 7),
    )  # fmt: skip
    ready, enabled, fault = State.READY_TO_SWITCH_ON, State.OPERATION_ENABLED, State.FAULT
    states = (
        *(StateChange(0.1, axis, State.SWITCH_ON_DISABLED, ready) for axis in axes),
        *(StateChange(0.2, axis, ready, enabled) for axis in axes),
        StateChange(0.75, "rotate", enabled, State.FAULT_REACTION_ACTIVE),
        StateChange(0.8, "rotate", State.FAULT_REACTION_ACTIVE, fault),
    )
    return Evidence(
        bench=BENCH, task=Task(task="move"), axes=axes, nodes=(1, 2, 3), units=("m", "rad", "rad"), gears=(1.0, 1.0, 1.0),
        frames=frames(), truth=truth, states=states, struck=(Struck("drive_fault node 2", 0.75), Struck("never", None)),
        runs=(Run(Ending.DONE, 0, 0.0, 2.0, "", folder),), configured={}, operational=frozenset(axes), friction={},
        left_behind=(), timed=False,
    )  # fmt: skip


FRAMES = (
    (0.0, "000#8100"), (0.001, "702#00"),
    (0.002, "602#2B40600006000000"), (0.002, "582#6040600000000000"),
    (0.003, "602#4041600000000000"), (0.003, "582#4B41600031020000"),
    (0.004, "602#2340160101000000"), (0.004, "582#8040160100000206"),
    (0.005, "000#0100"), (0.75, "080#"), (0.75, "182#0000803F"), (0.75, "082#1023020000000000"),
    (0.751, "702#05"), (0.9, "082#0000000000000000"), (1.062, "202#0F00112233445566"), (1.063, "701#R1"),
)  # fmt: skip
"""NMT reset, boot-up, three SDO transfers of which the last is refused, start, a cycle, a drive's fault and its end."""


def frames() -> tuple[BusFrame, ...]:
    """The same as the stand notes them."""
    parts = [(time, *text.partition("#")) for time, text in FRAMES]
    return tuple(
        BusFrame(time, int(identifier, 16), *_content(content), heard=0.0) for time, identifier, _, content in parts
    )


def _content(text: str) -> tuple[bytes, bool, int | None]:
    """Data, not of the controller, length asked for."""
    return (b"", False, int(text[1:])) if text.startswith("R") else (bytes.fromhex(text), False, None)


def with_files(case: CaseResult, folder: Path) -> CaseResult:
    """The case with what the stand leaves of one in a folder of its own."""
    own = folder / f"{case.number:02d}_{case.group}.{case.name}"
    own.mkdir(parents=True)
    write_case(case, evidence_of(own), own)
    (own / "controller.log").write_text("homing\nTraceback <most recent call last>\n", encoding="utf-8")
    return replace(case, folder=own)
