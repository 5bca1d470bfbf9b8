"""Neither their names nor their order changes what is said of axes: two columns whose torque is a formula."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from plain_bench import COGGING, COULOMB, GEAR, INERTIA, RESOLUTION, VISCOUS, Machine
from repeats import repeated

from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.report.result import Diagnosis
from drivetwin.diagnosis.settings import Settings
from drivetwin.recording.recording import Recording, RecordingInfo

SECONDS = 7.5
BOTH = ("turn", "tilt")


def model(axes: Sequence[str]) -> str:
    """The columns side by side, in an order; none knows of Stribeck level or cogging."""
    bodies = "".join(
        f'<body><joint name="{axis}" axis="0 0 1" frictionloss="{COULOMB}" damping="{VISCOUS}"/>'
        f'<inertial pos="0 0 0" mass="1" diaginertia="{INERTIA} {INERTIA} {INERTIA}"/></body>'
        for axis in axes
    )
    motors = "".join(f'<motor name="{axis}" joint="{axis}"/>' for axis in axes)
    return f'<mujoco><option gravity="0 0 0"/><worldbody>{bodies}</worldbody><actuator>{motors}</actuator></mujoco>'


def recording(seed: int, axes: Sequence[str], begin: float) -> Recording:
    """Both columns at once; the first of `BOTH`, whatever it is called, swings by `seed`, the second by another."""
    each = [Machine().recording(seed + 10 * k, SECONDS, f"of {seed}", begin) for k in range(2)]
    known = {"torque_resolution": RESOLUTION, "position_resolution": 1e-7, "gear_ratio": GEAR}
    told = {"schema": "recording/1", "machine": "columns", "sample_period": each[0].info.sample_period}
    info = RecordingInfo.model_validate(told | {"axes": {axis: {"joint": axis, **known} for axis in axes}})
    return replace(each[0], info=info, columns={axis: one.columns["turn"] for axis, one in zip(axes, each, strict=True)})


def reversed_axes(one: Recording) -> Recording:
    """The same with the second axis first."""
    info = one.info.model_copy(update={"axes": dict(reversed(one.info.axes.items()))})
    return replace(one, info=info, columns=dict(reversed(one.columns.items())))


def diagnosed(named: Sequence[str], in_model: Sequence[str], told: Callable[[Recording], Recording]) -> Diagnosis:
    """`named`: the first and the second column; `in_model`: the same names in the model's order; `told`: by the recordings."""
    fitted, held = [recording(1, named, 0.0), recording(2, named, SECONDS)], recording(3, named, 2.0 * SECONDS)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "columns.xml"
        path.write_text(model(in_model), encoding="utf-8")
        return diagnose(path, list(map(told, fitted)), [told(held)], Settings(), lambda _stage, _share: None)


@cache
def usual() -> Diagnosis:
    return diagnosed(BOTH, BOTH, lambda one: one)


def selected(found: Diagnosis, named: Sequence[str]) -> list[tuple[str, int]]:
    """Names of the selected effects, with the number of the column."""
    return sorted((one.effect.name, named.index(one.axis)) for one in found.selected)


def test_the_columns_have_what_their_model_lacks() -> None:
    assert selected(usual(), BOTH) == [("stribeck", 0), ("stribeck", 1), ("torque_ripple", 0), ("torque_ripple", 1)]
    found = [one.effect for one in usual().selected if one.effect.name == "torque_ripple"]
    assert [vars(each)["amplitude"] for each in found] == pytest.approx([COGGING, COGGING], rel=0.05)


@pytest.mark.parametrize(
    ("named", "in_model"),
    repeated((("z 1", "a.x"), ("a.x", "z 1")), (BOTH, BOTH[::-1]), (("b", "a"), ("b", "a"))),
    ids=str,
)
def test_axes_in_another_order_and_with_other_names(named: Sequence[str], in_model: Sequence[str]) -> None:
    """Both at once; `make test-long` has each alone as well."""
    found = diagnosed(named, in_model, reversed_axes)
    assert found.verdict == usual().verdict
    assert selected(found, named) == selected(usual(), BOTH)
    for one, name in zip(BOTH, named, strict=True):
        assert found.after_rms[name] == pytest.approx(usual().after_rms[one], rel=0.02)


def test_other_names_alone_change_nothing_at_all() -> None:
    """By name "turn" comes after "tilt", and "a" before "b"."""
    found = diagnosed(("a", "b"), ("a", "b"), lambda one: one)
    assert selected(found, ("a", "b")) == selected(usual(), BOTH)
    assert tuple(found.after_rms.values()) == tuple(usual().after_rms.values())
    assert [one.probability for one in found.causes] == [one.probability for one in usual().causes]
