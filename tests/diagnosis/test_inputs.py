"""What `drivetwin diagnose` refuses, one line each, and what it takes."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from gap_bench import PERIOD, time_of

from drivetwin.diagnosis.prepare.inputs import Inputs, read_inputs
from drivetwin.diagnosis.prepare.prepared import Prepared, prepared
from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.settings import Settings
from drivetwin.foundation.errors import UserError
from drivetwin.recording.recording import AxisInfo, Recording, RecordingInfo
from drivetwin.recording.writer import write_recording

MODEL = """
<mujoco model="two">
  <worldbody>
    <body name="upper"><joint name="rotate" type="hinge" axis="0 0 1"/><geom size="0.1" mass="1"/>
      <body name="lower"><joint name="stretch" type="slide" axis="1 0 0"/><joint name="idle" type="hinge"/>
        <geom size="0.1" mass="1"/></body></body>
    <body name="ball" pos="1 0 0"><joint name="eye" type="ball"/><geom size="0.1" mass="1"/></body>
    <body name="loose" pos="2 0 0"><freejoint name="loose"/><geom size="0.1" mass="1"/></body>
  </worldbody>
  <actuator><motor name="m1" joint="rotate"/><motor name="m2" joint="stretch"/></actuator>
</mujoco>
"""


def strokes(seconds: float, speed: float = 0.5, still: float = 0.0) -> Array:
    """Position of a swing that rests for `still` [s] first."""
    time = np.maximum(time_of(seconds + still) - still, 0.0)
    return np.asarray(speed / np.pi * (1.0 - np.cos(np.pi * time)) + 0.1 * np.sin(2.3 * time) ** 2)


def recorded(name: str, positions: dict[str, Array], **changes: str) -> Recording:
    """A recording of these positions, with a torque each; `changes` replace joints of axes."""
    count = len(next(iter(positions.values())))
    axes = {axis: AxisInfo(joint=changes.get(axis, axis), position_resolution=1e-6) for axis in positions}
    info = RecordingInfo(machine="two", sample_period=PERIOD, axes=axes)
    columns = {axis: {"torque": np.sin(np.arange(count)), "position": values} for axis, values in positions.items()}
    return Recording(name, info, np.arange(count, dtype=np.float64) * PERIOD, columns)


class Bench:
    """A folder with a model and recordings, and the command's reading of them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.model = folder / "model.xml"
        self.model.write_text(MODEL)

    def add(self, name: str, positions: dict[str, Array], **changes: str) -> Path:
        path = self.folder / name
        write_recording(recorded(path.name, positions, **changes), path)
        return path

    def read(self, training: list[Path], validation: list[Path] | None = None, cutoff_hz: float = 48.0) -> Inputs:
        return read_inputs(self.model, training, validation or [], cutoff_hz=cutoff_hz, allow_gaps=False)

    def refusal(self, training: list[Path], validation: list[Path] | None = None, cutoff_hz: float = 48.0) -> str:
        with pytest.raises(UserError) as refused:
            self.read(training, validation, cutoff_hz)
        assert "\n" not in str(refused.value)
        return str(refused.value)


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


def test_what_is_in_order_is_taken(bench: Bench) -> None:
    bench.add("all/a", {"rotate": strokes(6.0)})
    bench.add("all/b", {"rotate": strokes(5.0)})
    held = bench.add("held", {"rotate": strokes(3.0)})
    inputs = bench.read([bench.folder / "all"], [held])
    assert [each.name for each in inputs.training] == ["a", "b"]
    assert [each.name for each in inputs.validation] == ["held"]
    assert inputs.files == [bench.model] + [
        bench.folder / name / file for name in ("all/a", "all/b", "held") for file in ("recording.json", "signals.parquet")
    ]


def test_a_joint_that_the_model_does_not_have(bench: Bench) -> None:
    refusal = bench.refusal([bench.add("run", {"rotate": strokes(5.0)}, rotate="elbow")])
    assert "axis rotate" in refusal
    assert "joint 'elbow', which the model does not have; its joints: rotate, stretch, idle, eye, loose" in refusal


@pytest.mark.parametrize(("joint", "kind"), [("eye", "ball"), ("loose", "free")])
def test_a_joint_that_neither_turns_nor_slides(bench: Bench, joint: str, kind: str) -> None:
    refusal = bench.refusal([bench.add("run", {"rotate": strokes(5.0)}, rotate=joint)])
    assert f"joint '{joint}', which is a {kind} joint in {bench.model}; an axis is a hinge or a slide" in refusal


def test_a_joint_without_a_motor_is_taken_and_driven(bench: Bench) -> None:
    """As models of arms come: without actuators."""
    run = bench.add("run", {"idle": strokes(8.0)})
    assert prepared_of(bench, run).rows.count("idle") > 0


def test_an_actuator_of_another_joint(bench: Bench) -> None:
    recording = recorded("run", {"rotate": strokes(5.0)})
    axis = recording.info.axes["rotate"].model_copy(update={"actuator": "m2"})
    info = recording.info.model_copy(update={"axes": {"rotate": axis}})
    write_recording(replace(recording, info=info), bench.folder / "run")
    refusal = bench.refusal([bench.folder / "run"])
    assert f"axis rotate names actuator 'm2'; joint 'rotate' of {bench.model} is driven by m1" in refusal


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (None, "no model at"),
        ("rotate: 1", "is not XML"),
        ("<robot name='urdf'/>", "is <robot>, not a MuJoCo model <mujoco>"),
        ("<mujoco><worldbody><body/></worldbody><colour/></mujoco>", "is not a MuJoCo model"),
    ],
)
def test_a_model_that_is_none(bench: Bench, content: str | None, expected: str) -> None:
    run = bench.add("run", {"rotate": strokes(5.0)})
    if content is None:
        bench.model.unlink()
    else:
        bench.model.write_text(content)
    refusal = bench.refusal([run])
    assert expected in refusal
    assert str(bench.model) in refusal


def test_the_same_samples_under_another_name_in_training_and_validation(bench: Bench) -> None:
    one, copy = bench.add("one", {"rotate": strokes(5.0)}), bench.add("copy", {"rotate": strokes(5.0)})
    assert f"{copy} (--validate) has the same samples as {one} (RECORDING)" in bench.refusal([one], [copy])
    assert f"{one} (--validate) has the same samples as {one} (RECORDING)" in bench.refusal([one], [one])
    assert f"{copy} (RECORDING) has the same samples as {one} (RECORDING)" in bench.refusal([one, copy])


def test_the_same_folder_given_twice_over(bench: Bench) -> None:
    one = bench.add("one", {"rotate": strokes(5.0)})
    assert "has the same samples" in bench.refusal([one, one])


def test_recordings_of_other_axes(bench: Bench) -> None:
    one = bench.add("one", {"rotate": strokes(5.0)})
    both = bench.add("both", {"rotate": strokes(4.0), "stretch": strokes(4.0)})
    expected = "expected the axes of recording 'one', rotate, and got rotate, stretch"
    assert expected in bench.refusal([one, both])
    assert expected in bench.refusal([one], [both])
    turned = bench.add("turned", {"rotate": strokes(4.0)}, rotate="stretch")
    assert "and got rotate (joint stretch)" in bench.refusal([one, turned])


def test_two_predictions_of_one_name(bench: Bench) -> None:
    paths = [bench.add(f"{day}/run", {"rotate": strokes(seconds)}) for day, seconds in (("monday", 5.0), ("friday", 6.0))]
    assert "are both named 'run', and so would be prediction/run.parquet: rename one" in bench.refusal(paths)


@pytest.mark.parametrize(
    ("cutoff_hz", "expected"),
    [
        *((value, "of 1 Hz or more") for value in (0.0, -1.0, 0.5, float("nan"), float("inf"))),
        *((value, "below 500 Hz, half the highest sample rate") for value in (500.0, 1e9)),
    ],
)
def test_a_cutoff_that_makes_no_sense(bench: Bench, cutoff_hz: float, expected: str) -> None:
    refusal = bench.refusal([bench.add("run", {"rotate": strokes(5.0)})], cutoff_hz=cutoff_hz)
    assert f"--cutoff {cutoff_hz:g}: expected a frequency {expected}" in refusal


def test_pieces_too_short_for_the_filter_are_left_out(bench: Bench, caplog: pytest.LogCaptureFixture) -> None:
    run = bench.add("run", {"rotate": strokes(6.0)})
    rows = pq.read_table(run / "signals.parquet")
    number = np.arange(rows.num_rows)
    pq.write_table(rows.filter(((number > 200) & (number < 5990) & (number != 5800)) | (number < 150)), run / "signals.parquet")
    taken = read_inputs(bench.model, [run], [], cutoff_hz=48.0, allow_gaps=True)
    assert [(each.name, len(each.time)) for each in taken.training] == [("run-2", 5599)]
    assert "2 short pieces between gaps are left out" in caplog.text
    pq.write_table(rows.filter(number % 100 != 0), run / "signals.parquet")
    with pytest.raises(UserError, match="none of its 60 pieces between gaps is long enough"):
        read_inputs(bench.model, [run], [], cutoff_hz=48.0, allow_gaps=True)


def test_nan_is_named_by_row(bench: Bench) -> None:
    position = strokes(5.0)
    position[1233] = np.nan
    refusal = bench.refusal([bench.add("run", {"rotate": position})])
    assert "column rotate.position is nan at row 1234" in refusal


def test_a_schema_of_another_time(bench: Bench) -> None:
    run = bench.add("run", {"rotate": strokes(5.0)})
    payload = json.loads((run / "recording.json").read_text()) | {"schema": "recording/3"}
    (run / "recording.json").write_text(json.dumps(payload))
    assert "schema is 'recording/3'" in bench.refusal([run])


def prepared_of(bench: Bench, *folders: Path) -> Prepared:
    inputs = bench.read(list(folders))
    return prepared(inputs.model, inputs.training, inputs.validation, Settings())


def test_motion_that_nothing_can_be_asked_of_is_refused_in_one_line(bench: Bench) -> None:
    """Encoder noise at rest is no motion."""
    trembling = 1e-6 * np.random.default_rng(0).integers(-1, 2, 6000)
    run = bench.add("run", {"rotate": np.asarray(trembling, dtype=np.float64)})
    with pytest.raises(UserError, match="run: no axis moves faster than its position's noise") as refused:
        prepared_of(bench, run)
    assert "\n" not in str(refused.value)


def test_an_axis_that_never_moves_is_taken_beside_one_that_does(bench: Bench) -> None:
    found = prepared_of(bench, bench.add("run", {"rotate": strokes(8.0), "stretch": np.full(8000, 0.2)}))
    assert found.rows.count("rotate") > 0
    assert found.rows.count("stretch") == 0


@pytest.mark.parametrize(
    "position",
    [0.3 * time_of(8.0), 0.05 * time_of(8.0) ** 2, strokes(1.5, still=15.0)[::-1]],
    ids=["one speed one way", "several speeds one way", "a little motion before much rest"],
)
def test_motion_that_tells_little_is_taken_and_asked_less(bench: Bench, position: Array) -> None:
    found = prepared_of(bench, bench.add("run", {"rotate": position}), bench.add("held", {"rotate": 0.9 * position}))
    assert found.rows.count("rotate") > 0
    assert found.testable["rotate"].kinds
    assert found.testable["rotate"].not_testable


def test_motion_at_the_end_of_a_recording_is_fitted_too(bench: Bench) -> None:
    found = prepared_of(bench, bench.add("run", {"rotate": strokes(3.5, still=15.0)}))
    assert found.rows.count("rotate") > 0


@pytest.mark.parametrize("seconds", [0.001, 0.004, 0.01, 0.02, 0.04, 0.1, 0.3])
def test_a_recording_that_is_too_short_ends_in_one_line_or_is_taken(bench: Bench, seconds: float) -> None:
    line = "run"
    try:
        rows = prepared_of(bench, bench.add("run", {"rotate": strokes(seconds)})).rows.count("rotate")
    except UserError as refused:
        rows, line = 1, str(refused)
    assert rows > 0
    assert "\n" not in line
    assert "run" in line


def test_a_recording_of_no_axis(bench: Bench) -> None:
    run = bench.add("run", {"rotate": strokes(5.0)})
    told = json.loads((run / "recording.json").read_text())
    (run / "recording.json").write_text(json.dumps(told | {"axes": {}}))
    assert "axes" in bench.refusal([run])
