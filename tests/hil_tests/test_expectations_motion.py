"""Expectations of the plant: a motion that is known to be sound passes; of one that is not, axis, time and amount are told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_evidence import LIFT, PERIOD, ROTATE, STRETCH, evidence, found, judged, measured, moved, standing, struck

from drivetwin.emulator.drive.state_machine import State
from drivetwin.hil_tests.evidence import StateChange, Truth
from drivetwin.hil_tests.moves import moves
from drivetwin.hil_tests.task import Task


@pytest.fixture
def truth() -> Truth:
    return standing(4.0)


def at(truth: Truth, time: float) -> int:
    return int(np.searchsorted(truth.time, time))


def test_moves_are_those_of_the_demand(truth: Truth) -> None:
    ends = [moved(truth, ROTATE, 0.5, 0.8), moved(truth, ROTATE, 2.0, -0.1)]
    made = moves(truth, ROTATE)
    assert [round(float(truth.time[move.last]), 3) for move in made] == pytest.approx(ends, abs=2 * PERIOD)
    assert [float(truth.demand[move.first, ROTATE]) for move in made] == pytest.approx([0.2, 0.8], abs=1e-9)
    assert moves(truth, LIFT) == []


def test_tracking_error_is_the_greatest_distance_from_the_demand(truth: Truth) -> None:
    moved(truth, ROTATE, 0.5, 0.8)
    truth.position[at(truth, 0.7), ROTATE] -= 0.0035
    assert measured("tracking_error", evidence(truth), "rotate") == pytest.approx(0.0035)
    assert found("tracking_error", evidence(truth)) == []
    truth.position[at(truth, 0.9), ROTATE] += 0.0055
    assert found("tracking_error", evidence(truth)) == [("rotate", 0.9)]


def test_settling_is_from_the_end_of_the_demand_to_the_last_time_outside_the_band(truth: Truth) -> None:
    end = moved(truth, ROTATE, 0.5, 0.8)
    ringing = slice(at(truth, end), at(truth, end + 0.15))
    truth.position[ringing, ROTATE] += 0.0005
    assert measured("settling", evidence(truth), "rotate") == pytest.approx(0.15, abs=2 * PERIOD)
    assert found("settling", evidence(truth)) == []
    truth.position[at(truth, end) :, ROTATE] = 0.8005
    assert [axis for axis, _ in found("settling", evidence(truth))] == ["rotate"]
    assert measured("settling", evidence(truth), "rotate") == np.inf


def test_what_is_let_go_too_soon_to_tell_has_no_settling_time(truth: Truth) -> None:
    end = moved(truth, ROTATE, 0.5, 0.8)
    truth.position[at(truth, end) :, ROTATE] += 0.0005
    truth.enabled[at(truth, end + 0.1) :] = False
    assert judged("settling", evidence(truth)).measured == ()


def test_overshoot_is_beyond_the_target_in_the_direction_of_the_move(truth: Truth) -> None:
    end = moved(truth, ROTATE, 0.5, -0.4)
    truth.position[at(truth, end) - 1, ROTATE] -= 0.0015
    truth.position[at(truth, end) - 5, ROTATE] += 0.1  # short of the target: no overshoot
    assert measured("overshoot", evidence(truth), "rotate") == pytest.approx(0.0015, abs=1e-5)
    truth.position[at(truth, end + 0.1), ROTATE] -= 0.003
    assert [axis for axis, _ in found("overshoot", evidence(truth))] == ["rotate"]


def test_limits_are_those_of_the_plant(truth: Truth) -> None:
    assert found("limits", evidence(truth)) == []
    truth.position[at(truth, 1.0), STRETCH] = 1.395
    truth.velocity[at(truth, 2.0), LIFT] = -0.3
    truth.torque[at(truth, 3.0), ROTATE] = 41.0
    assert sorted(found("limits", evidence(truth)), key=str) == [("lift", 2.0), ("rotate", 3.0), ("stretch", 1.0)]


def test_an_axis_that_homing_leaves_outside_may_come_in_but_not_leave_again(truth: Truth) -> None:
    truth.mode[: at(truth, 1.0), ROTATE] = 6
    truth.position[: at(truth, 1.5), ROTATE] = -2.9
    assert found("limits", evidence(truth)) == []
    truth.position[at(truth, 2.0), ROTATE] = -2.9
    assert found("limits", evidence(truth)) == [("rotate", 2.0)]


def test_a_demand_that_leaps_is_found_in_its_cycle(truth: Truth) -> None:
    moved(truth, ROTATE, 0.5, 0.8)
    assert found("no_jump", evidence(truth)) == []
    truth.demand[at(truth, 2.0) :, ROTATE] += 0.02
    assert found("no_jump", evidence(truth)) == [("rotate", 2.0)]


def test_a_demand_that_is_not_where_the_axis_stands_when_it_is_enabled_is_a_leap(truth: Truth) -> None:
    truth.enabled[: at(truth, 1.0)] = truth.positioning[: at(truth, 1.0)] = False
    truth.demand[: at(truth, 1.0), ROTATE] = 0.0  # what a drive without loops has there counts for nothing
    assert found("no_jump", evidence(truth)) == []
    truth.demand[at(truth, 1.0) :, ROTATE] = 0.25
    assert found("no_jump", evidence(truth))[0] == ("rotate", 1.0)


def test_an_axis_that_leaves_its_demand_after_an_enabling_jumps(truth: Truth) -> None:
    change = StateChange(1.0, "lift", State.SWITCHED_ON, State.OPERATION_ENABLED)
    truth.position[at(truth, 1.05), LIFT] -= 0.0015
    assert found("no_jump", evidence(truth, states=(change,))) == [("lift", 1.0)]
    truth.position[at(truth, 1.05), LIFT] += 0.001
    assert measured("no_jump", evidence(truth, states=(change,)), "lift") == pytest.approx(0.0005)
    assert found("no_jump", evidence(truth, states=(change,))) == []


def test_homed_is_where_the_drives_zero_truly_lies_when_the_controller_ends(truth: Truth) -> None:
    truth.zero[:, ROTATE] = -2.6
    truth.zero[at(truth, 3.4) :, ROTATE] = 0.0004
    assert found("homed", evidence(truth)) == []
    truth.zero[at(truth, 3.4) :, LIFT] = -0.0002
    assert found("homed", evidence(truth)) == [("lift", 3.5)]


def test_stopped_counts_from_the_fault_to_the_last_motion(truth: Truth) -> None:
    truth.velocity[at(truth, 1.0) : at(truth, 1.4), ROTATE] = 0.5
    assert measured("stopped", evidence(truth, **struck(1.0)), "rotate") == pytest.approx(0.4, abs=2 * PERIOD)
    assert found("stopped", evidence(truth, **struck(1.0))) == []
    truth.velocity[at(truth, 3.8), LIFT] = 0.003
    assert found("stopped", evidence(truth, **struck(1.0))) == [("lift", 3.8)]
    assert found({"stopped": {"during": 1.0}}, evidence(truth, **struck(1.0))) == []
    assert found({"stopped": {"except_for": ["lift"]}}, evidence(truth, **struck(1.0))) == []


def test_drives_are_not_enabled_after_a_fault_nor_after_the_end(truth: Truth) -> None:
    truth.enabled[at(truth, 1.5) :] = False
    assert found("stays_disabled", evidence(truth, **struck(1.0))) == []
    assert found("disabled_at_end", evidence(truth)) == []
    truth.enabled[at(truth, 3.7) :, STRETCH] = True
    assert found("stays_disabled", evidence(truth, **struck(1.0))) == [("stretch", 3.7)]
    assert found("disabled_at_end", evidence(truth)) == [("stretch", 3.7)]


def test_a_watch_that_ends_too_soon_to_tell_is_judged_by_how_it_leaves_the_axes(truth: Truth) -> None:
    """It ends at 4 s, 0.3 s after the fault: rest has 0.5 s, disabling 1.2 s."""
    early = evidence(truth, **struck(3.7))
    (first, *_) = judged("stays_disabled", early).failures
    assert (first.axis, first.time) == ("lift", 4.0)
    assert first.message == "the watch ended 0.3 s after the fault, before 1.2 s were over, and the drive was still enabled"
    truth.enabled[at(truth, 3.9) :] = False
    assert found("stays_disabled", early) == []
    assert found("stopped", early) == []
    truth.velocity[at(truth, 3.8) :, ROTATE] = 0.5
    (failure,) = judged("stopped", early).failures
    assert (failure.axis, failure.time) == ("rotate", 4.0)
    assert failure.message == "the watch ended 0.3 s after the fault, before 0.5 s were over, and the axis still moved"
    assert found({"stopped": {"except_for": ["rotate"]}}, early) == []


def test_an_axis_that_moves_once_the_controller_has_gone(truth: Truth) -> None:
    truth.enabled[at(truth, 3.5) :] = False
    truth.velocity[at(truth, 3.8), LIFT] = -0.01
    assert found("disabled_at_end", evidence(truth)) == [("lift", 3.8)]


def test_targets_are_reached_in_their_order(truth: Truth) -> None:
    moved(truth, ROTATE, 0.3, 0.8)
    moved(truth, ROTATE, 1.5, 0.5)
    to = [{"axis": "rotate", "to": 0.8}, {"axis": "rotate", "to": 0.5}]
    there = Task(task="move", parameters={"moves": to})
    assert found("final_position", evidence(truth, task=there)) == []
    back = Task(task="move", parameters={"moves": to[::-1]})
    failed = judged("final_position", evidence(truth, task=back)).failures
    assert [failure.axis for failure in failed] == ["rotate"]
    assert failed[0].measured == pytest.approx(0.3, abs=1e-3)
    twice = Task(task="move", parameters={"moves": to, "repeat": 2})
    assert len(found("final_position", evidence(truth, task=twice))) == 1


def test_a_target_that_is_only_passed_is_told_by_the_band_in_which_the_axis_stood(truth: Truth) -> None:
    """It passes the target on its way, and stands 0.5 mrad beyond it; the band is 0.2 mrad."""
    moved(truth, ROTATE, 0.3, 0.8005)
    there = Task(task="move", parameters={"moves": [{"axis": "rotate", "to": 0.8}]})
    (failure,) = judged("final_position", evidence(truth, task=there)).failures
    assert failure.message == "the machine never stood at rotate 0.8 rad for 50 ms, as the task says, after what came before it"
    assert failure.axis == "rotate"
    assert failure.measured == pytest.approx(0.0005)
    assert failure.measured is not None
    assert failure.limit is not None
    assert failure.measured > failure.limit


def test_what_stood_too_shortly_at_a_target_is_told_by_a_band_beyond_its_limit(truth: Truth) -> None:
    truth.position[at(truth, 1.0) : at(truth, 1.03), ROTATE] = 0.8
    truth.position[at(truth, 1.03) : at(truth, 1.06), ROTATE] = 0.8003
    there = Task(task="move", parameters={"moves": [{"axis": "rotate", "to": 0.8}]})
    (failure,) = judged("final_position", evidence(truth, task=there)).failures
    assert failure.measured == pytest.approx(0.0003)


def test_of_a_pose_the_axis_is_told_that_keeps_all_from_standing_at_once(truth: Truth) -> None:
    """Each axis stands where it should, but one after the other."""
    task = Task(task="path", parameters={"poses": [{"lift": 0.3, "rotate": 0.8}]})
    moved(truth, ROTATE, 0.3, 0.8)
    moved(truth, ROTATE, 1.5, 0.7)
    moved(truth, LIFT, 2.6, 0.3)
    (failure,) = judged("final_position", evidence(truth, task=task)).failures
    assert failure.axis == "rotate"
    assert failure.measured == pytest.approx(0.1)


def test_where_too_little_is_left_for_a_dwell_no_figure_is_told(truth: Truth) -> None:
    end = moved(truth, ROTATE, 0.3, 0.8)
    kept = at(truth, end + 0.052) + 1
    short = Truth(**{name: value[:kept] for name, value in vars(truth).items()})
    moves_twice = [{"axis": "rotate", "to": 0.8}, {"axis": "rotate", "to": 0.5}]
    (failure,) = judged("final_position", evidence(short, task=Task(task="move", parameters={"moves": moves_twice}))).failures
    assert (failure.measured, failure.limit) == (None, None)


def test_a_pose_is_reached_by_all_axes_at_the_same_time(truth: Truth) -> None:
    task = Task(task="path", parameters={"poses": [{"lift": 0.3, "rotate": 0.8}]})
    moved(truth, ROTATE, 0.3, 0.8)
    moved(truth, ROTATE, 1.5, 0.2)
    moved(truth, LIFT, 2.6, 0.3)
    assert len(found("final_position", evidence(truth, task=task))) == 1
    moved(truth, ROTATE, 2.6, 0.8)
    assert found("final_position", evidence(truth, task=task)) == []


def test_an_axis_that_the_band_leaves_out_is_not_judged_by_it(truth: Truth) -> None:
    moved(truth, ROTATE, 0.3, 0.8)
    both = evidence(truth, task=Task(task="path", parameters={"poses": [{"lift": 0.3, "rotate": 0.8}, {"lift": 0.1}]}))
    assert found({"final_position": {"band": {"rotate": 0.0002}}}, both) == []
    truth.position[:, ROTATE] += 0.001
    assert [axis for axis, _ in found({"final_position": {"band": {"rotate": 0.0002}}}, both)] == ["rotate"]


def test_axes_that_move_together_are_compared_by_the_share_of_their_way(truth: Truth) -> None:
    task = Task(task="path", parameters={"poses": [{"lift": 0.3, "rotate": 0.4}]})
    moved(truth, LIFT, 0.5, 0.3)
    moved(truth, ROTATE, 0.5, 0.4)
    assert measured("synchronised", evidence(truth, task=task), None) == pytest.approx(0.0, abs=1e-9)
    late = np.roll(truth.position[:, ROTATE], 1)
    beside = replace(truth, position=np.column_stack([truth.position[:, LIFT], late, truth.position[:, STRETCH]]))
    speed = np.abs(np.diff(truth.demand[:, ROTATE])).max()
    assert measured("synchronised", evidence(beside, task=task), None) == pytest.approx(speed / 0.2, rel=1e-6)
    assert found("synchronised", evidence(beside, task=task)) != []


def test_two_axes_one_after_the_other_did_not_move_together(truth: Truth) -> None:
    task = Task(task="path", parameters={"poses": [{"lift": 0.3, "rotate": 0.4}]})
    moved(truth, LIFT, 0.5, 0.3)
    moved(truth, ROTATE, 2.0, 0.4)
    assert "no two axes moved together" in judged("synchronised", evidence(truth, task=task)).failures[0].message


def test_feed_forward_compares_one_motion_without_and_with_an_offset(truth: Truth) -> None:
    for begin, to, error in ((0.3, 0.8, 0.002), (1.3, 0.2, 0.0), (2.3, 0.8, 0.001)):
        end = moved(truth, ROTATE, begin, to)
        truth.position[at(truth, begin) : at(truth, end) + 1, ROTATE] -= error
    truth.offset[at(truth, 2.3) :, ROTATE] = 30.0
    expected = {"feed_forward": {"ratio": {"rotate": 0.6}}}
    assert measured(expected, evidence(truth), "rotate") == pytest.approx(0.5, rel=0.02)
    assert found(expected, evidence(truth)) == []
    assert [axis for axis, _ in found({"feed_forward": {"ratio": {"rotate": 0.4}}}, evidence(truth))] == ["rotate"]
    truth.offset[:] = 0.0
    assert "no motion that was made without and with" in judged(expected, evidence(truth)).failures[0].message


def test_holding_is_of_all_drives_at_once(truth: Truth) -> None:
    truth.enabled[: at(truth, 1.0), LIFT] = False
    truth.enabled[at(truth, 2.5) :, ROTATE] = False
    assert found({"holds": 1.4}, evidence(truth)) == []
    failure = judged({"holds": 1.6}, evidence(truth)).failures[0]
    assert failure.measured == pytest.approx(1.5, abs=2 * PERIOD)


def test_work_that_pauses_or_ends_too_soon(truth: Truth) -> None:
    for axis in (LIFT, ROTATE, STRETCH):
        for begin, to in ((0.2, 0.25), (1.0, 0.15), (1.9, 0.25), (2.8, 0.15)):
            moved(truth, axis, begin, to)
    assert found({"keeps_moving": 2.5}, evidence(truth)) == []
    assert {axis for axis, _ in found({"keeps_moving": 3.5}, evidence(truth))} == {"lift", "rotate", "stretch"}
    truth.demand[at(truth, 1.0) : at(truth, 2.8), LIFT] = 0.25
    assert [axis for axis, _ in found({"keeps_moving": 2.5}, evidence(truth))] == ["lift"]
