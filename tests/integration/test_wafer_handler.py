"""`make wafer-handler` once, from the command to its files: what it claims, some of it computed anew from its recordings.

Every claim of one axis, from a shorter motion of the whole arm; `make test-long` holds them against all three, on which the
same program does the same, at the usual length.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from processes import PATIENCE
from repeats import LONG

from drivetwin.controller.machine import POSITION_UNIT, load_machine
from drivetwin.recording.reader import read_recording
from drivetwin.recording.recording import Samples

AXES = ("lift", "rotate", "stretch") if LONG else ("rotate",)
LENGTH = () if LONG else ("--together", "10")
EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"

PUBLISHED = {
    "settling": {"lift": 0.71, "rotate": 0.50, "stretch": 0.82},
    "deceleration": {"lift": 0.58, "rotate": 0.36, "stretch": 0.47},
}
"""Table 2 of the paper: time with torque feed-forward over time without it."""

STRAIGHT = 1e-4
"""A blade's end effector is taught to 0.1 mm; a wafer's clearance in its slot is some ten times that [m]."""


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What one run has written."""
    folder = tmp_path_factory.mktemp("wafer_handler") / "out"
    asked = ["--out", str(folder), "--seed", "0", *LENGTH, *(f"--axis={axis}" for axis in AXES)]
    done = subprocess.run(
        [sys.executable, "-m", "wafer_handler", *asked],
        env=os.environ | {"PYTHONPATH": str(EXAMPLES), "OMP_NUM_THREADS": "1"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=10.0 * PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert str(folder / "report.html") in done.stdout.replace("\n", "")
    return folder


@pytest.fixture(scope="module")
def found(out: Path) -> dict[str, Any]:
    """wafer-handler.json."""
    read: dict[str, Any] = json.loads((out / "wafer-handler.json").read_text(encoding="utf-8"))
    return read


def starts(demand: Samples) -> int:
    """The first row at which the demand moves by more than its rounding to two position units."""
    return int(np.flatnonzero(np.abs(demand - demand[0]) > 2.0 * POSITION_UNIT)[0])


def difference(out: Path, drives: str, name: str, axis: str) -> Samples:
    """Demand - actual (n,) [m or rad] in a kept recording."""
    (recording,) = read_recording(out / "recordings" / drives / f"{axis}_{name}")
    columns = recording.columns[axis]
    return columns["position_demand"] - columns["position"]


def peak(out: Path, drives: str, name: str, axis: str) -> float:
    """Greatest tracking difference from where the demand begins: two rows before it shows, for j t³ / 6 is small at first."""
    (recording,) = read_recording(out / "recordings" / drives / f"{axis}_{name}")
    demand = recording.columns[axis]["position_demand"]
    return float(np.abs(difference(out, drives, name, axis)[starts(demand) - 2 :]).max())


def test_it_says_what_made_it(found: dict[str, Any]) -> None:
    assert found["schema"] == "wafer-handler/1"
    assert found["seed"] == 0
    assert any(name.endswith("elastic_belts.json") for name in found["inputs"])


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("time", ["settling", "deceleration"])
def test_times_shrink_at_least_as_the_paper_s_do(found: dict[str, Any], time: str, axis: str) -> None:
    told = found[time][axis]
    assert told["without_ms"] > 50.0, "there is something to shorten"
    assert told["ratio"] == pytest.approx(told["with_ms"] / told["without_ms"])
    assert told["ratio"] <= PUBLISHED[time][axis]


@pytest.mark.parametrize("axis", AXES)
def test_peak_errors_fall_by_five_and_learning_by_ten(found: dict[str, Any], axis: str) -> None:
    assert found["peak_error_reduction"][axis] >= 5.0
    assert found["with_eq14"]["peak_error_reduction"][axis] >= 5.0
    assert found["learning_reduction"][axis] >= 10.0


@pytest.mark.parametrize("axis", AXES)
def test_the_factors_are_those_of_the_kept_recordings(out: Path, found: dict[str, Any], axis: str) -> None:
    def of(name: str) -> float:
        return peak(out, "servoone", name, axis)

    assert found["peak_error_reduction"][axis] == pytest.approx(of("velocity") / of("torque"), rel=0.01)
    by_eq14 = of("velocity") / of("torque_eq14")
    assert found["with_eq14"]["peak_error_reduction"][axis] == pytest.approx(by_eq14, rel=0.01)
    assert found["learning_reduction"][axis] == pytest.approx(of("learning_0") / of("learning_5"), rel=0.01)


@pytest.mark.parametrize("axis", AXES)
def test_the_times_are_those_of_the_kept_recordings(out: Path, found: dict[str, Any], axis: str) -> None:
    """The cruise by the seven segments' closed form: a ramp takes v / a and the 50 ms of its jerk, the cruise what is left."""
    limits = load_machine("scara").axes[axis]
    (recording,) = read_recording(out / "recordings" / "servoone" / f"{axis}_velocity")
    period, demand = recording.info.sample_period, recording.columns[axis]["position_demand"]
    ramp = limits.max_speed / limits.max_acceleration + 0.05
    end = abs(float(demand[-1] - demand[0])) / limits.max_speed
    time = (np.arange(len(demand)) - starts(demand)) * period
    before, braking = (time >= 0.0) & (time < end), time >= end
    tail = before & (time >= end - (end - ramp) / 3.0)
    band = 0.05 * peak(out, "servoone", "velocity", axis)
    by_model, by_eq14 = found, found["with_eq14"]
    for name, told, key in (
        ("velocity", by_model, "without_ms"),
        ("torque", by_model, "with_ms"),
        ("torque_eq14", by_eq14, "with_ms"),
    ):
        error = difference(out, "servoone", name, axis)
        unsettled = time[before & (np.abs(error - error[tail].mean()) > band)]
        unstopped = time[braking & (np.abs(error) > band)]
        settled = unsettled[-1] + period if len(unsettled) else 0.0
        stopped = unstopped[-1] + period - end if len(unstopped) else 0.0
        assert told["settling"][axis][key] == pytest.approx(1e3 * settled, abs=3.0)
        assert told["deceleration"][axis][key] == pytest.approx(1e3 * stopped, abs=3.0)


@pytest.mark.parametrize("axis", AXES)
def test_without_feed_forward_the_difference_is_speed_over_position_gain(out: Path, axis: str) -> None:
    """In the cruise of a PI velocity loop; what comes of the recordings is what the loops of the drives do."""
    for drives in ("servoone", "cia402-full"):
        (recording,) = read_recording(out / "recordings" / drives / f"{axis}_none")
        loops = recording.info.axes[axis].drive
        assert loops is not None
        assert loops.position_gain is not None
        demand = recording.columns[axis]["position_demand"]
        speed = np.gradient(demand, recording.info.sample_period).max()
        assert peak(out, drives, "none", axis) == pytest.approx(speed / loops.position_gain, rel=0.05)


@pytest.mark.parametrize("axis", AXES)
def test_offsets_on_the_full_profile_do_as_well(out: Path, axis: str) -> None:
    """60B1h and 60B2h in a cycle of 2 ms: the same bound as of the velocity that a drive feeds forward by itself."""
    (recording,) = read_recording(out / "recordings" / "cia402-full" / f"{axis}_torque")
    assert recording.info.sample_period == 0.002
    assert peak(out, "cia402-full", "velocity", axis) / peak(out, "cia402-full", "torque", axis) >= 5.0


def test_kinematics_dynamics_and_base_parameters_agree(found: dict[str, Any]) -> None:
    assert found["kinematics_max_error_m"] < 1e-9
    assert set(found["dynamics_max_relative_difference"]) == {"mujoco", "pinocchio"}
    assert max(found["dynamics_max_relative_difference"].values()) < 1e-8
    told = found["base_parameters"]
    assert {"moving_mass", "lift_armature", "rotate_inertia", "stretch_inertia"} < set(told)
    worst = max(abs(parameter["value"] / parameter["true"] - 1.0) for parameter in told.values())
    assert worst == pytest.approx(found["base_parameter_max_relative_error"])
    assert worst < 0.01


def test_the_blade_goes_straight_and_the_wafer_stays(found: dict[str, Any]) -> None:
    assert 0.0 < found["blade_straightness_m"] < STRAIGHT
    assert found["wafer_least_slip_margin"] > 1.0


class References(HTMLParser):
    """What a page would fetch, and the text of its headings."""

    FETCHED = frozenset({"src", "href", "srcset", "data", "poster", "action"})

    def __init__(self) -> None:
        super().__init__()
        self.fetched: list[str] = []
        self.headings: list[str] = []
        self._in_heading = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._in_heading = tag in {"h1", "h2", "h3"}
        self.fetched += [value for name, value in attrs if name in self.FETCHED and value is not None]

    def handle_data(self, data: str) -> None:
        if self._in_heading:
            self.headings.append(data)

    def handle_endtag(self, tag: str) -> None:
        self._in_heading = False


def test_the_report_is_one_file_with_every_axis(out: Path) -> None:
    """Nothing on the page is fetched from anywhere."""
    page = References()
    page.feed((out / "report.html").read_text(encoding="utf-8"))
    assert page.fetched == []
    assert [heading for heading in page.headings if heading.startswith("Axis ")] == [f"Axis {axis}" for axis in AXES]
    of_the_axes = {"lift": "Fig. 5", "rotate": "Fig. 6", "stretch": "Fig. 7"}
    for figure in ("Fig. 3", "Fig. 4", *(of_the_axes[axis] for axis in AXES), "Table 2"):
        assert any(figure in heading for heading in page.headings), figure
    assert any("cannot be reproduced" in heading for heading in page.headings)


def test_nothing_else_is_left_behind(out: Path) -> None:
    assert [entry.name for entry in out.parent.iterdir()] == [out.name]
    assert {entry.name for entry in out.iterdir()} >= {"wafer-handler.json", "report.html", "recordings"}
