"""What a report leaves open, and what `drivetwin excite` refuses, in one line that says what to do."""

from __future__ import annotations

from pathlib import Path

import pytest

from diagnosis.excitation.choice import open_question
from diagnosis.excitation.limits import read_limits
from diagnosis.report.schema import GapReport
from drivetwin.errors import UserError

MODEL = """<mujoco><compiler angle="radian"/><worldbody><body><joint name="axis" axis="0 0 1" range="-1 2"/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body><body><joint name="free" axis="0 0 1"/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>"""


def report(*answers: tuple[int, str, float, list[str]]) -> GapReport:
    """A report with these answers on `axis`: step, effect, probability, what it cannot be told from."""
    level = {"torque_rms": 1.0, "gap_rms": 0.5, "noise_rms": 0.01, "standstill_rms": 0.0, "significant": True}
    axis = level | {"test": {"name": "t", "p_value": 0.0}, "where": [], "patterns": []}
    causes = [
        {"step": step, "effect": effect, "axis": None if effect == "none" else "axis", "probability": probability,
         "parameters": {}, "gap_closed": None, "indistinguishable_from": others,
         "tell_apart_by": "slow strokes" if others else ""}
        for step, effect, probability, others in answers
    ]  # fmt: skip
    return GapReport.model_validate(
        {"schema": "gap-report/1", "version": "0", "inputs": {}, "seed": 0, "verdict": "explained",
         "filter": {"cutoff_hz": 48.0, "standstill_velocity": {"axis": 0.01}}, "axes": {"axis": axis}, "causes": causes,
         "selected": [], "after": {"axis": {"gap_rms": 0.1}}}
    )  # fmt: skip


def test_what_cannot_be_told_apart_is_the_question() -> None:
    found = open_question(report((1, "gravity", 0.9, ["spring"]), (1, "unknown", 0.1, [])), "axis")
    assert found.effects == ("gravity", "spring")
    assert found.tell_apart_by == "slow strokes"


def test_an_answer_that_is_likely_as_well_is_part_of_the_question() -> None:
    assert open_question(report((1, "stribeck", 0.7, []), (1, "coulomb", 0.3, [])), "axis").effects == ("stribeck", "coulomb")


def test_a_later_step_is_asked_about_where_the_first_is_settled() -> None:
    found = open_question(report((1, "stribeck", 1.0, []), (2, "delay", 0.8, ["elasticity"]), (2, "none", 0.2, [])), "axis")
    assert found.effects == ("delay", "elasticity")


def test_a_report_that_leaves_nothing_open_is_refused() -> None:
    with pytest.raises(UserError, match="leaves nothing open on axis 'axis'"):
        open_question(report((1, "stribeck", 0.98, []), (1, "unknown", 0.02, [])), "axis")


def test_an_axis_that_the_report_has_not_is_refused() -> None:
    with pytest.raises(UserError, match="no axis 'lift'; it has axis"):
        open_question(report((1, "stribeck", 1.0, [])), "lift")


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
        ("axes: {axis: {speed: 1.0, acceleration: 2.0}}", "axes.axis.jerk: Field required; an axis needs speed"),
        ("axes: {axis: {speed: -1.0, acceleration: 2.0, jerk: 9.0}}", "axes.axis.speed: Input should be greater than 0"),
        ("axes: {free: {speed: 1.0, acceleration: 2.0, jerk: 9.0}}", "axis free has no travel"),
        ("axes: {axis: {travel: [3.0, 4.0], speed: 1.0, acceleration: 2.0, jerk: 9.0}}", "nowhere to move"),
        ("axes: [", "is not YAML"),
    ],
)
def test_limits_that_say_too_little_or_nonsense_are_refused(text: str, told: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=told):
        limits_of(tmp_path, text)
