"""Expectations of bus, configuration and results: sound ones pass, each defect is told with its node and time."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_evidence import ROTATE, evidence, found, frame, judged, measured, moved, ordered, standing, struck

from drivetwin.bus.timing.frame_bits import Frame, frame_bits
from drivetwin.emulator.drive.state_machine import State
from drivetwin.hil_tests.evidence import BusFrame, Configuration, Ending, Evidence, Run, StateChange

AXES = {"lift": 1, "rotate": 2, "stretch": 3}


def configured(**changes: Configuration) -> Evidence:
    nodes = {axis: ordered(node) for axis, node in AXES.items()}
    return evidence(standing(1.0), configured={**nodes, **changes})


def test_a_mapping_as_ordered() -> None:
    assert found("pdo_mapping", configured()) == []


@pytest.mark.parametrize(
    ("pdo", "has", "said"),
    [
        ("rpdo 1", (0x202, 1, (0x60C10120, 0x60400010, 0x60B20010)), "maps 60C1:01:32, 6040:00:16, 60B2:00:16, ordered was"),
        ("rpdo 1", (0x202, 255, (0x60400010, 0x60C10120, 0x60B20010)), "has transmission type 255, ordered was 1"),
        ("tpdo 2", (0x80000282, 1, (0x60640020, 0x21A30020)), "does not exist (bit 31 of its COB-ID), and was ordered"),
        ("tpdo 2", (0x285, 1, (0x60640020, 0x21A30020)), "has COB-ID 285h, ordered was the predefined 282h"),
        ("tpdo 3", (0x382, 255, ()), "exists with COB-ID 382h, and none was ordered"),
    ],
)
def test_a_mapping_otherwise(pdo: str, has: tuple[int, int, tuple[int, ...]], said: str) -> None:
    sound = ordered(2)
    (failure,) = judged("pdo_mapping", configured(rotate=replace(sound, pdos={**sound.pdos, pdo: has}))).failures
    assert failure.axis == "rotate"
    assert f"node 2, {pdo}: {said}" in failure.message


def test_a_mapping_that_nobody_knows_is_not_taken_for_right() -> None:
    (failure,) = judged("pdo_mapping", configured(stretch=replace(ordered(3), unknown_pdos=("rpdo 2",)))).failures
    assert failure.axis == "stretch"
    assert "node 3, rpdo 2: the controller neither wrote it nor read it back" in failure.message


def test_a_drive_that_tells_that_it_is_enabled_when_the_controller_has_gone() -> None:
    """The controller ends at 0.5 s: enabled before and not disabled, disabled too late, enabled again later."""
    on, off = (State.SWITCHED_ON, State.OPERATION_ENABLED), (State.OPERATION_ENABLED, State.SWITCH_ON_DISABLED)

    def states(*changes: tuple[float, tuple[State, State]]) -> Evidence:
        return evidence(standing(1.0), states=tuple(StateChange(time, "rotate", *change) for time, change in changes))

    assert found("tells_disabled", states()) == []
    assert found("tells_disabled", states((0.1, on), (0.4, off))) == []
    assert found("tells_disabled", states((0.1, on))) == [("rotate", 0.1)]
    assert found("tells_disabled", states((0.1, on), (0.6, off))) == [("rotate", 0.1)]
    assert found("tells_disabled", states((0.1, on), (0.4, off), (0.7, on), (0.8, off))) == [("rotate", 0.7)]


def test_nodes_that_never_became_operational_have_no_mapping_and_no_heartbeat() -> None:
    nothing = evidence(standing(1.0), operational=frozenset(("lift",)))
    for told in ("pdo_mapping", "heartbeat"):
        assert [axis for axis, _ in found(told, nothing)] == ["lift", "rotate", "stretch"]
    assert [axis for axis, _ in found("operational", nothing)] == ["rotate", "stretch"]


def test_heartbeats_and_the_supervision_of_the_master() -> None:
    assert measured("heartbeat", configured(), "lift") == 0.1
    for changes, said in (
        ({"heartbeat": 0.0}, "produces no heartbeat"),
        ({"heartbeat": 0.5}, "too seldom"),
        ({"supervises": ()}, "does not notice when its master has gone"),
    ):
        (failure,) = judged("heartbeat", configured(rotate=replace(ordered(2), **changes))).failures
        assert failure.axis == "rotate"
        assert said in failure.message


def sdo(node: int, request: bytes, answer: bytes, time: float = 0.0) -> list[BusFrame]:
    return [frame(time, 0x600 + node, request.ljust(8, b"\0")), frame(time, 0x580 + node, answer.ljust(8, b"\0"), False)]


WRITE = bytes.fromhex("2B401600")
TAKEN = bytes.fromhex("60401600")
REFUSED = bytes.fromhex("80401600 11000906")
ENABLED = StateChange(0.5, "rotate", State.SWITCHED_ON, State.OPERATION_ENABLED)


def test_an_abort_that_is_ignored() -> None:
    frames = tuple(sdo(2, WRITE, REFUSED, 0.1))
    (failure,) = judged("no_ignored_abort", evidence(standing(1.0), frames=frames, states=(ENABLED,))).failures
    assert (failure.axis, failure.time) == ("rotate", 0.1)
    assert "1640h:00 (abort 06090011h)" in failure.message


def test_aborts_that_are_heeded() -> None:
    refused, taken = sdo(2, WRITE, REFUSED, 0.1), sdo(2, WRITE, TAKEN, 0.2)
    read = sdo(2, bytes.fromhex("40401600"), REFUSED, 0.1)
    assert found("no_ignored_abort", evidence(standing(1.0), frames=(*refused, *taken), states=(ENABLED,))) == []
    assert found("no_ignored_abort", evidence(standing(1.0), frames=tuple(refused))) == []
    assert found("no_ignored_abort", evidence(standing(1.0), frames=tuple(read), states=(ENABLED,))) == []


STEPS = (State.SWITCH_ON_DISABLED, State.READY_TO_SWITCH_ON, State.SWITCHED_ON, State.OPERATION_ENABLED)


def walk(*states: State, axes: tuple[str, ...] = tuple(AXES)) -> tuple[StateChange, ...]:
    return tuple(
        StateChange(0.1 * place, axis, before, after)
        for axis in axes
        for place, (before, after) in enumerate(pairwise(states))
    )


def test_states_step_by_step() -> None:
    quick = (*STEPS, State.QUICK_STOP_ACTIVE, State.SWITCH_ON_DISABLED)
    assert found("state_sequence", evidence(standing(1.0), states=walk(*quick))) == []
    leap = (State.SWITCH_ON_DISABLED, State.READY_TO_SWITCH_ON, State.OPERATION_ENABLED)
    mixed = (*walk(*STEPS, axes=("lift", "stretch")), *walk(*leap, axes=("rotate",)))
    assert found("state_sequence", evidence(standing(1.0), states=mixed)) == [("rotate", 0.1)]
    assert [axis for axis, _ in found("state_sequence", evidence(standing(1.0)))] == list(AXES)


def test_a_fault_that_nobody_injected() -> None:
    fault = (*STEPS, State.FAULT_REACTION_ACTIVE, State.FAULT)
    assert found("state_sequence", evidence(standing(1.0), states=walk(*fault))) == [(axis, 0.4) for axis in AXES]
    assert found("state_sequence", evidence(standing(1.0), states=walk(*fault), **struck(0.3))) == []


def test_where_a_drive_begins_is_no_step() -> None:
    """Real drives may have kept a fault, or be switched on or enabled already; this enables none."""
    for state in (State.FAULT, State.SWITCHED_ON, State.OPERATION_ENABLED):
        begins = tuple(StateChange(0.0, axis, None, state) for axis in AXES)
        assert found({"state_sequence": {"times": 1}}, evidence(standing(1.0), states=begins + walk(*STEPS))) == []
        assert [axis for axis, _ in found("state_sequence", evidence(standing(1.0), states=begins))] == list(AXES)


def test_how_often_drives_are_enabled() -> None:
    assert found({"state_sequence": {"times": 1}}, evidence(standing(1.0), states=walk(*STEPS))) == []
    assert len(found({"state_sequence": {"times": 2}}, evidence(standing(1.0), states=walk(*STEPS)))) == 3


def streamed(cycles: int, period: float = 0.002) -> list[BusFrame]:
    """RPDO 1 of each node, SYNC, TPDO 2 of each node, every cycle."""
    return [
        one
        for cycle in range(cycles)
        for one in (
            *(frame(cycle * period, 0x200 + node, bytes(8)) for node in AXES.values()),
            frame(cycle * period, 0x80),
            *(frame(cycle * period, 0x280 + node, bytes(8), False) for node in AXES.values()),
        )
    ]


def test_the_bus_load_is_that_of_truly_stuffed_bits() -> None:
    pdos = [Frame(base + node, bytes(8)) for base in (0x200, 0x280) for node in AXES.values()]
    bits = sum(frame_bits(one) for one in (Frame(0x80), *pdos))
    load = measured("bus_load", evidence(standing(1.0), frames=tuple(streamed(400))), None)
    assert load == pytest.approx(50 * bits / 100_000, rel=1e-6)  # 50 cycles in 100 ms of 1 Mbit/s
    assert found("bus_load", evidence(standing(1.0), frames=tuple(streamed(400)))) == []


def test_a_bus_that_is_too_full_and_one_that_is_so_by_sdo_alone() -> None:
    full = evidence(standing(1.0), frames=tuple(streamed(400, period=0.0008)))
    assert [axis for axis, _ in found("bus_load", full)] == [None]
    burst = [one for _ in range(300) for one in sdo(2, WRITE, TAKEN, 0.4)]
    mixed = evidence(standing(1.0), frames=tuple(sorted([*streamed(400), *burst], key=lambda one: one.time)))
    assert found("bus_load", mixed) != []
    assert found({"bus_load": {"waiting": False}}, mixed) == []


def test_frames_between_two_syncs() -> None:
    sound = streamed(100)
    assert measured("no_flood", evidence(standing(1.0), frames=tuple(sound)), None) == 3.0
    twice = [*sound[:350], frame(0.1, 0x202, bytes(8)), *sound[350:]]
    (failure,) = judged("no_flood", evidence(standing(1.0), frames=tuple(twice))).failures
    assert (failure.time, "202h was sent twice" in failure.message) == (0.1, True)
    heard = [*sound[:350], *(frame(0.1, 0x77F, b"\5") for _ in range(9)), *sound[350:]]
    assert "too many frames" in judged("no_flood", evidence(standing(1.0), frames=tuple(heard))).failures[0].message


def moving() -> Evidence:
    truth = standing(2.0)
    moved(truth, ROTATE, 0.5, 0.8)
    return evidence(truth, frames=tuple(streamed(1000)))


def test_sdo_between_set_points() -> None:
    assert found("no_sdo_while_streaming", moving()) == []
    for time, expected in ((0.7, [(None, 0.7)]), (1.8, [])):
        frames = sorted([*moving().frames, *sdo(2, WRITE, TAKEN, time)], key=lambda one: one.time)
        assert found("no_sdo_while_streaming", replace(moving(), frames=tuple(frames))) == expected


def test_a_cycle_without_a_set_point() -> None:
    assert found("setpoints_every_cycle", moving()) == []
    for time, expected in ((0.7, [("rotate", 0.7)]), (1.8, [])):
        frames = [one for one in moving().frames if not (one.identifier == 0x202 and abs(one.time - time) < 1e-6)]
        assert found("setpoints_every_cycle", replace(moving(), frames=tuple(frames))) == expected


def test_syncs_in_lockstep_are_a_cycle_apart() -> None:
    assert found("sync_period", evidence(standing(1.0), frames=tuple(streamed(100)))) == []
    slow = evidence(standing(1.0), frames=tuple(streamed(100, period=0.003)))
    assert judged("sync_period", slow).failures[0].measured == pytest.approx(0.003)


def test_syncs_in_real_time_are_judged_by_the_wall_clock() -> None:
    heard = np.cumsum(np.full(1000, 0.002))
    heard[500:] += 0.004  # one is late, which 99 % do not see
    syncs = tuple(BusFrame(0.0, 0x80, b"", True, None, float(time)) for time in heard)
    assert found("sync_period", evidence(standing(1.0), frames=syncs, timed=True)) == []
    uneven = tuple(one._replace(heard=one.heard + 0.004 * (place % 2)) for place, one in enumerate(syncs))
    limit = {"sync_period": {"jitter": 0.001}}
    assert judged(limit, evidence(standing(1.0), frames=uneven, timed=True)).failures[0].measured == pytest.approx(0.004)


def test_emergencies_while_the_controller_is_there() -> None:
    emergency = frame(0.3, 0x82, bytes.fromhex("1023010000000000"), False)
    gone = frame(0.3, 0x82, bytes(8), False)
    late = emergency._replace(time=0.9)
    assert found("no_emergency", evidence(standing(1.0), frames=(gone, late))) == []
    assert found("no_emergency", evidence(standing(1.0), frames=(emergency,))) == [("rotate", 0.3)]


def wrote(folder: Path, name: str, content: Any) -> Evidence:
    (folder / name).write_text(json.dumps(content))
    run = Run(Ending.DONE, 0, 0.0, 0.5, "", folder)
    friction = {axis: {"coulomb": 2.0, "viscous": 1.0} for axis in AXES}
    return evidence(standing(1.0), runs=(run,), friction=friction)


def test_friction_within_three_percent_of_the_truth(tmp_path: Path) -> None:
    parameters = {"coulomb": {"value": 2.05}, "viscous": {"value": 0.98}}
    sound = {axis: {"parameters": parameters} for axis in AXES}
    assert found("identification", wrote(tmp_path, "identified.json", {"axes": sound})) == []
    wrong = {**sound, "rotate": {"parameters": {"coulomb": {"value": 2.07}}}}
    failures = judged("identification", wrote(tmp_path, "identified.json", {"axes": wrong})).failures
    assert [failure.axis for failure in failures] == ["rotate", "rotate"]
    assert failures[0].measured == pytest.approx(0.035)
    assert "says no viscous" in failures[1].message


def test_a_parameter_whose_true_value_nobody_knows_is_not_met(tmp_path: Path) -> None:
    said = wrote(tmp_path, "identified.json", {"axes": {axis: {"parameters": {"viscos": {"value": 1.0}}} for axis in AXES}})
    (failure,) = judged({"identification": {"parameters": ["viscos"]}}, said).failures
    assert (failure.axis, failure.message) == (
        None,
        "the plant's truth has no viscos that the identified one could be held against; it has coulomb, viscous",
    )


def test_the_exponent_of_stribeck_friction_is_judged_where_an_axis_has_it(tmp_path: Path) -> None:
    """The plant's truth calls it otherwise than identified/1."""
    axes = {axis: {"parameters": {"stribeck_exponent": {"value": 2.1}}} for axis in AXES}
    said = wrote(tmp_path, "identified.json", {"axes": axes})
    said = replace(said, friction={"lift": {}, "rotate": {"exponent": 2.0}, "stretch": {"exponent": 0.0}})
    (failure,) = judged({"identification": {"parameters": ["stribeck_exponent"]}}, said).failures
    assert failure.axis == "rotate"
    assert failure.measured == pytest.approx(0.05)


def test_results_that_are_missing_or_none(tmp_path: Path) -> None:
    for told in ("identification", {"names_fault": 2}):
        assert len(found(told, evidence(standing(1.0)))) == 1
    contents: tuple[object, ...] = ([], {"axes": 3}, {"axes": {"lift": None}})
    for content in contents:
        assert found("identification", wrote(tmp_path, "identified.json", content)) != []


def test_the_controller_names_the_node(tmp_path: Path) -> None:
    said = {"outcome": "stopped", "reason": "EMCY 2310h", "node": 2}
    assert found({"names_fault": 2}, wrote(tmp_path, "controller.json", said)) == []
    (failure,) = judged({"names_fault": 3}, wrote(tmp_path, "controller.json", said)).failures
    assert (failure.axis, "it was node 3" in failure.message) == ("stretch", True)
