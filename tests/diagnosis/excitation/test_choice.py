"""What a report leaves open, and what `drivetwin excite` refuses, in one line that says what to do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from drivetwin.diagnosis.excitation.choice import EXCITATIONS, by_poses, chosen, open_question
from drivetwin.diagnosis.excitation.limits import read_limits
from drivetwin.diagnosis.prepare.testable import WHY, NotTestable
from drivetwin.diagnosis.report.schema import GapReport
from drivetwin.emulator.effects import Exciting, Need
from drivetwin.foundation.errors import UserError

MODEL = """<mujoco><compiler angle="radian"/><worldbody><body><joint name="axis" axis="0 0 1" range="-1 2"/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body><body><joint name="free" axis="0 0 1"/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>"""


def report(*causes: tuple[str, float, list[str]], not_testable: Sequence[NotTestable] = ()) -> GapReport:
    """A report with these causes on `axis`: effect, probability, what it cannot be distinguished from."""
    levels = dict.fromkeys(("torque_rms", "gap_rms", "noise_rms", "model_error_rms", "standstill_rms"), 0.5)
    nothing: dict[str, Any] = {"shares": [], "where": [], "where_after": [], "patterns": []}
    axis = {
        "cutoff_hz": 48.0, "standstill_velocity": 0.01, "significant": bool(causes), "test": {"name": "t", "p_value": 0.0},
        "unknown": {"share": 0.1, "goes_with": [], "correlation_time": 0.1},
        "not_testable": [asdict(one) for one in not_testable],
    }  # fmt: skip
    found: list[dict[str, Any]] = [
        {"effect": effect, "axis": "axis", "probability": probability, "share": 0.02 * 0.9**rank / probability,
         "parameters": {}, "gap_closed": None, "indistinguishable_from": others,
         "tell_apart_by": "slow strokes" if others else "",
         "or_by_sensor": ""}
        for rank, (effect, probability, others) in enumerate(causes)
    ]  # fmt: skip
    return GapReport.model_validate(
        {"schema": "gap-report/2", "version": "0", "inputs": {}, "seed": 0, "settings": {}, "verdict": "explained",
         "axes": {"axis": axis | levels | nothing}, "causes": found, "selected": [], "after": {"axis": {"gap_rms": 0.1}}}
    )  # fmt: skip


ONE_WAY = WHY[Need.BOTH_DIRECTIONS]
RELATIVE = WHY[Need.ABSOLUTE_POSITION]


def test_what_cannot_be_distinguished_is_the_question() -> None:
    found = open_question(report(("gravity", 0.9, ["spring"]), ("unknown", 0.1, [])), "axis")
    assert found.effects == ("gravity", "spring")
    assert found.tell_apart_by == "slow strokes"


def test_whatever_is_likely_is_part_of_the_question() -> None:
    found = open_question(report(("stribeck", 0.7, []), ("coulomb", 0.3, []), ("delay", 0.04, ["elasticity"])), "axis")
    assert found.effects == ("stribeck", "coulomb")


def test_a_later_cause_brings_those_that_it_is_not_distinguished_from() -> None:
    found = open_question(report(("stribeck", 1.0, []), ("delay", 0.8, ["elasticity"])), "axis")
    assert found.effects == ("stribeck", "delay", "elasticity")


def test_one_cause_that_is_not_sure_is_a_question_of_its_own() -> None:
    assert open_question(report(("stribeck", 0.6, []), ("unknown", 0.9, [])), "axis").effects == ("stribeck",)


def test_causes_that_stand_alone_leave_nothing_open() -> None:
    settled = report(("stribeck", 0.98, []), ("torque_ripple", 0.97, []), ("unknown", 0.4, []))
    with pytest.raises(UserError, match="leaves nothing open on axis 'axis'"):
        open_question(settled, "axis")


def test_where_only_the_unknown_is_left_what_another_motion_makes_testable_is_the_question() -> None:
    untested = (
        NotTestable("coulomb_asymmetry", *ONE_WAY),
        NotTestable("torque_ripple", *RELATIVE),
        NotTestable("viscous_asymmetry", *ONE_WAY),
    )
    found = open_question(report(("unknown", 0.95, []), ("delay", 0.03, []), not_testable=untested), "axis")
    assert found.effects == ("coulomb_asymmetry", "viscous_asymmetry"), "no motion makes a position absolute"
    assert found.tell_apart_by == ONE_WAY[1]
    assert open_question(report(not_testable=untested), "axis") == found, "nor has the axis to have a gap"


def test_what_no_motion_makes_testable_is_said() -> None:
    with pytest.raises(UserError, match=f"that a motion settles; it could not test torque_ripple, which needs {RELATIVE[1]}"):
        open_question(report(("unknown", 0.95, []), not_testable=[NotTestable("torque_ripple", *RELATIVE)]), "axis")
    with pytest.raises(UserError, match=r"on axis 'axis' that a motion settles$"):
        open_question(report(("unknown", 0.95, [])), "axis")


def test_an_axis_that_the_report_has_not_is_refused() -> None:
    with pytest.raises(UserError, match="no axis 'lift'; it has axis"):
        open_question(report(("stribeck", 1.0, [])), "lift")


def test_every_motion_that_an_effect_may_name_is_made() -> None:
    assert [one.name for one in EXCITATIONS] == list(Exciting)


def test_an_effect_shows_in_the_motions_that_it_names() -> None:
    assert [one.name for one in chosen(["stribeck", "temperature_drift"])] == ["warm_up", "slow_strokes"]
    assert by_poses(["stribeck", "payload"])
    assert not by_poses(["stribeck"])


def test_an_effect_that_the_library_has_not_is_refused() -> None:
    with pytest.raises(UserError, match="names effect 'squeak', which the library has not; give its --effects-from"):
        chosen(["squeak"])


def limits_of(folder: Path, text: str) -> tuple[float, float]:
    (folder / "model.xml").write_text(MODEL, encoding="utf-8")
    (folder / "limits.yaml").write_text(text, encoding="utf-8")
    return next(iter(read_limits(folder / "limits.yaml", folder / "model.xml").values())).travel


def test_travel_is_the_lesser_of_file_and_joint_less_a_margin(tmp_path: Path) -> None:
    most = "speed: 1.0, acceleration: 2.0, jerk: 9.0"
    assert limits_of(tmp_path, f"axes: {{axis: {{{most}}}}}") == pytest.approx((-0.85, 1.85))
    assert limits_of(tmp_path, f"axes: {{axis: {{travel: [-3.0, 1.0], {most}}}}}") == pytest.approx((-0.9, 0.9))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("axes: {axis: {speed: 1.0, acceleration: 2.0}}", "axes.axis.jerk: Field required"),
        ("axes: {axis: {speed: -1.0, acceleration: 2.0, jerk: 9.0}}", "axes.axis.speed: Input should be greater than 0"),
        ("axes: {free: {speed: 1.0, acceleration: 2.0, jerk: 9.0}}", "axis free has no travel"),
        ("axes: {axis: {travel: [3.0, 4.0], speed: 1.0, acceleration: 2.0, jerk: 9.0}}", "nowhere to move"),
        ("axes: [", "is not YAML"),
    ],
)
def test_limits_that_say_too_little_or_nonsense_are_refused(text: str, told: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=told):
        limits_of(tmp_path, text)
