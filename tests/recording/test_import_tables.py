"""Foreign tables: CSV of any layout, MATLAB files, and what a map may say wrongly."""

from __future__ import annotations

import logging
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from drivetwin.foundation.errors import UserError
from drivetwin.recording.formats.csv_table import read_csv_table
from drivetwin.recording.import_map import CsvLayout, ImportMap, read_map
from drivetwin.recording.importer import import_recording, import_recordings, unique_names
from drivetwin.recording.reader import read_recording
from drivetwin.recording.writer import write_recording

MAP: dict[str, Any] = {
    "machine": "bench",
    "time": {"column": "t", "unit": "ms"},
    "axes": {"x": {"columns": {"torque": {"column": "M", "unit": "N·m"}, "velocity": {"column": "n", "unit": "rpm"}}}},
}


def mapped(**changes: Any) -> ImportMap:
    return ImportMap.model_validate(MAP | changes)


def columns(file: Path, layout: CsvLayout | None = None) -> dict[str, list[float]]:
    table = read_csv_table(file, layout or CsvLayout())
    return {column.name: column.read().tolist() for column in table.columns}


LAYOUTS = {
    "comma": "t,M\n0,1.5\n1,-2.5\n",
    "semicolon and decimal comma": "t;M\n0;1,5\n1;-2,5\n",
    "tab and decimal comma": "t\tM\n0\t1,5\n1\t-2,5\n",
    "spaces": " t   M\n 0   1.5\n 1  -2.5\n",
    "bars": "t|M\n0|1.5\n1|-2.5\n",
    "Windows line ends": "t;M\r\n0;1.5\r\n1;-2.5\r\n",
    "exponents": "t;M\n0;1,5E0\n1;-25E-1\n",
    "quotes": '"t";"M"\n"0";"1.5"\n"1";"-2.5"\n',
    "preamble": "Scope;v2\nDate:;2020-07-08 21:28:28\n\nt;M\n0;1.5\n1;-2.5\n",
    "preamble with numbers": "Period:;0.5;;;\nScale:;1;2;3;4\nt;M\n0;1.5\n1;-2.5\n",
}


@pytest.mark.parametrize("name", LAYOUTS)
def test_layout_is_found(name: str, tmp_path: Path) -> None:
    file = tmp_path / "scope.csv"
    file.write_text(LAYOUTS[name], newline="")
    assert columns(file) == {"t": [0.0, 1.0], "M": [1.5, -2.5]}


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_encoding_is_found(encoding: str, tmp_path: Path) -> None:
    file = tmp_path / "scope.csv"
    file.write_bytes("t;Prüfling °\n0;1\n1;2\n".encode(encoding))
    assert list(columns(file)) == ["t", "Prüfling °"]


def test_units_row_and_brackets(tmp_path: Path) -> None:
    file = tmp_path / "scope.csv"
    file.write_text(";Speed;Torque\nms;rpm;%\n0;1;2\n1;3;4\n")
    table = read_csv_table(file, CsvLayout())
    assert [(column.name, column.unit) for column in table.columns] == [("", "ms"), ("Speed", "rpm"), ("Torque", "%")]
    file.write_text("t [ms],Speed (rpm),Text [x]\n0,1,2\n1,3,4\n")
    table = read_csv_table(file, CsvLayout())
    assert [column.unit for column in table.columns] == ["ms", "rpm", None]
    assert table.find("t") is table.columns[0]
    assert table.find(2) is table.columns[1]


def test_rows_that_are_told(tmp_path: Path) -> None:
    file = tmp_path / "scope.csv"
    file.write_text("# 1,2\nt,M\ns,Nm\n9,9\n0,1.5\n# 4,5\n1,-2.5\n")
    layout = CsvLayout(comment="#", header_row=2, units_row=3, first_row=5)
    assert columns(file, layout) == {"t": [0.0, 1.0], "M": [1.5, -2.5]}
    with pytest.raises(UserError, match=r"csv\.first_row is 50, the file ends at row 7"):
        columns(file, CsvLayout(first_row=50))
    with pytest.raises(UserError, match=r"csv\.header_row is 6, which is empty, a comment"):
        columns(file, CsvLayout(comment="#", header_row=6))


def test_text_columns_are_no_obstacle(tmp_path: Path) -> None:
    file = tmp_path / "scope.csv"
    file.write_text("t,state,M\n0,RUN,1.5\n1,STOP,-2.5\n2,RUN,3\n")
    table = read_csv_table(file, CsvLayout())
    assert table.column("M", "torque").read().tolist() == [1.5, -2.5, 3.0]
    with pytest.raises(UserError, match="column 'state' row 2: 'RUN' is not a number"):
        table.column("state", "torque").read()


@settings(max_examples=60, deadline=None)
@given(
    values=st.lists(st.tuples(*[st.floats(-1e6, 1e6).map(lambda value: round(value, 6))] * 3), min_size=3, max_size=20),
    separators=st.sampled_from([(";", "."), (";", ","), ("\t", ","), ("\t", "."), (",", "."), ("|", ",")]),
    preamble=st.sampled_from(["", "Recorder 3\n", "Recorder;3\nRate;1 kHz;fast\n"]),
)
def test_any_numbers_come_back(
    values: list[tuple[float, ...]],
    separators: tuple[str, str],
    preamble: str,
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    delimiter, decimal = separators
    rows = [delimiter.join(repr(cell).replace(".", decimal) for cell in row) for row in values]
    file = tmp_path_factory.mktemp("any") / "scope.csv"
    file.write_text(preamble + "\n".join([delimiter.join(["a", "b", "c"]), *rows]) + "\n")
    assert [*columns(file).values()] == [list(column) for column in zip(*values, strict=True)]


def test_import_converts_and_integrates(tmp_path: Path) -> None:
    file = tmp_path / "scope.csv"
    file.write_text("t;M;n\n0;1;60\n1;2;60\n2;3;60\n")
    recording = import_recording(file, mapped(about={"bench": 3}))
    assert recording.name == "scope"
    assert recording.info.sample_period == 0.001
    assert recording.info.derived == ["x.position"]
    assert recording.extra() == {"about": {"bench": 3}}
    np.testing.assert_allclose(recording.time, [0, 0.001, 0.002])
    np.testing.assert_allclose(recording.columns["x"]["velocity"], 2 * np.pi)
    np.testing.assert_allclose(recording.columns["x"]["position"], 2 * np.pi * recording.time)


def test_period_where_there_is_no_time(tmp_path: Path) -> None:
    file = tmp_path / "scope.csv"
    file.write_text("M;n\n1;60\n2;60\n3;60\n")
    recording = import_recording(file, mapped(time={"period": "2 ms"}))
    np.testing.assert_allclose(recording.time, [0, 0.002, 0.004])


def test_jitter_is_refused_and_resampled_on_demand(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    file = tmp_path / "scope.csv"
    stamps = [0, 1, 2.1, 3, 4, 5]
    file.write_text("t;M;n\n" + "\n".join(f"{stamp};{10 * stamp};6" for stamp in stamps) + "\n")
    with pytest.raises(UserError, match=r"scope\.csv: column time steps by 0\.0011 s at row 3 .*resample"):
        import_recording(file, mapped())
    recording = import_recording(file, mapped(resample=0.0005))
    np.testing.assert_allclose(recording.columns["x"]["torque"], 10 * recording.time * 1e3)
    with caplog.at_level(logging.WARNING):
        import_recording(file, mapped(resample=0.002))
    assert "aliased" in caplog.text


def test_gap_is_refused_and_kept_on_demand(tmp_path: Path) -> None:
    file = tmp_path / "scope.csv"
    stamps = [0, 1, 2, 3, 10, 11, 12]
    file.write_text("t;M;q\n" + "\n".join(f"{stamp};1;6" for stamp in stamps) + "\n")
    axes = {
        "x": {
            "columns": {"torque": {"column": "M", "unit": "N"}, "position": {"column": "q", "unit": "mm"}},
            "joint_type": "slide",
        }
    }
    with pytest.raises(UserError, match=r"gap of 0\.007 s before row 5 .*gaps: keep"):
        import_recording(file, mapped(axes=axes))
    assert len(import_recording(file, mapped(axes=axes, gaps="keep")).time) == 7
    with pytest.raises(UserError, match=r"gap of 0\.007 s before row 5 \(time 0\.01 s\).* not invent .*gaps: keep"):
        import_recording(file, mapped(axes=axes, resample=0.001))


IN_SEGMENTS = {
    "x": {
        "columns": {"torque": {"column": "M", "unit": "N"}, "position": {"column": "q", "unit": "m"}},
        "joint_type": "slide",
    }
}


def in_segments(folder: Path, stamps: list[float]) -> Path:
    """A text table at uneven times [ms]: the torque rises with time, the position falls twice as fast."""
    file = folder / "scope.csv"
    file.write_text("t;M;q\n" + "\n".join(f"{stamp};{stamp / 1e3};{-stamp / 5e2}" for stamp in stamps) + "\n")
    return file


def test_segments_between_kept_gaps_are_resampled_each_on_its_own(tmp_path: Path) -> None:
    """All segments share the grid that starts at the file's first sample; none of its times is within 30.6 to 30.7 ms."""
    file = in_segments(tmp_path, [0.5, 1.4, 2.5, 3.5, 4.6, 12.6, 13.5, 14.4, 15.7, 30.6, 30.7, 40.5, 41.5])
    recording = import_recording(file, mapped(axes=IN_SEGMENTS, resample=0.001, gaps="keep"))
    expected = [0.5, 1.5, 2.5, 3.5, 4.5, 13.5, 14.5, 15.5, 40.5, 41.5]
    np.testing.assert_allclose(recording.time, np.array(expected) / 1e3)
    np.testing.assert_allclose(recording.columns["x"]["torque"], recording.time, atol=1e-12)
    np.testing.assert_allclose(recording.columns["x"]["position"], -2.0 * recording.time, atol=1e-12)
    write_recording(recording, tmp_path / "scope")
    with pytest.raises(UserError, match=r"gap of 0\.009 s before row 6"):
        read_recording(tmp_path / "scope")
    split = read_recording(tmp_path / "scope", allow_gaps=True)
    assert [len(segment.time) for segment in split] == [5, 3, 2]
    assert {segment.info.sample_period for segment in split} == {0.001}


@pytest.mark.parametrize("resample", [None, 0.001])
def test_a_kept_gap_does_not_stretch_the_sample_period(resample: float | None, tmp_path: Path) -> None:
    """Of 6000 steps one is 5 ms: the mean of all is 1.0007 ms."""
    file = in_segments(tmp_path, [float(stamp) for stamp in range(6005) if not 1000 < stamp < 1005])
    recording = import_recording(file, mapped(axes=IN_SEGMENTS, resample=resample, gaps="keep"))
    assert recording.info.sample_period == 0.001


def test_segments_too_short_to_resample_are_refused(tmp_path: Path) -> None:
    file = in_segments(tmp_path, [0, 1, 2, 100, 101, 102, 200, 201, 202])
    with pytest.raises(UserError, match=r"resample: 0\.02 s is longer than each segment between gaps, at most 0\.002 s"):
        import_recording(file, mapped(axes=IN_SEGMENTS, resample=0.02, gaps="keep"))


def test_missing_column_says_which_and_what_there_is(tmp_path: Path) -> None:
    file = tmp_path / "scope.csv"
    file.write_text("t;Moment;n\n0;1;60\n1;2;60\n")
    with pytest.raises(
        UserError, match=r"scope\.csv: no column 'M' for x\.torque; the columns are: t, Moment, n;"
    ) as refused:
        import_recording(file, mapped())
    assert "\n" not in str(refused.value)


def test_nan_is_refused_by_column_and_row(tmp_path: Path) -> None:
    file = tmp_path / "scope.csv"
    file.write_text("t;M;n\n0;1;60\n1;;60\n2;2;60\n")
    with pytest.raises(UserError, match=r"scope\.csv: column x\.torque is nan at row 2"):
        import_recording(file, mapped())


def test_optional_columns(tmp_path: Path) -> None:
    torque = {"column": "M", "unit": "N·m"}
    speed = {"column": "n", "unit": "rpm"}
    optional = {"column": "T", "unit": "K", "optional": True}
    axes = {"x": {"columns": {"torque": torque, "velocity": speed, "temperature": optional}}}
    file = tmp_path / "scope.csv"
    file.write_text("t;M;n\n0;1;60\n1;1;60\n")
    assert "temperature" not in import_recording(file, mapped(axes=axes)).columns["x"]
    file.write_text("t;M;n;T\n0;1;60;300\n1;1;60;300\n")
    np.testing.assert_allclose(import_recording(file, mapped(axes=axes)).columns["x"]["temperature"], 26.85)


def test_matlab_vectors_structs_and_matrices(tmp_path: Path) -> None:
    file = tmp_path / "run.mat"
    time = np.arange(5) * 0.01
    savemat(
        file,
        {"t": time[:, None], "run": {"M": time + 1}, "X": np.stack([time, 2 * time, 3 * time], axis=1), "gain": 3.0},
    )
    axes = {
        "x": {
            "columns": {
                "torque": {"column": "run.M", "unit": "N·m"},
                "position": {"column": "X(:,2)", "unit": "rad"},
            }
        }
    }
    recording = import_recording(file, mapped(axes=axes, time={"column": "t", "unit": "s"}))
    np.testing.assert_allclose(recording.columns["x"]["position"], 2 * time)
    np.testing.assert_allclose(recording.columns["x"]["torque"], time + 1)
    with pytest.raises(UserError, match=r"no column 'M' for x\.torque; the columns are: t, run\.M, X\(:,1\)"):
        import_recording(file, mapped(time={"column": "t", "unit": "s"}))


def test_matlab_73_says_what_to_do(tmp_path: Path) -> None:
    file = tmp_path / "run.mat"
    file.write_bytes(
        b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM" + b"\x89HDF\r\n\x1a\n".ljust(600)
    )
    with pytest.raises(UserError, match=r"v7\.3 .*-v7"):
        import_recording(file, mapped())
    file.write_bytes(b"no matlab file at all, but long enough to look at" * 10)
    with pytest.raises(UserError, match="cannot be read as a MATLAB file"):
        import_recording(file, mapped())


def test_names(tmp_path: Path) -> None:
    assert unique_names([Path("a/one.csv"), Path("b/two.csv")]) == ["one", "two"]
    assert unique_names([Path("a/one.csv"), Path("b/one.csv"), Path("two.csv")]) == ["a_one", "b_one", "two"]
    assert unique_names([Path("a/c/one.csv"), Path("b/c/one.csv")]) == ["a_c_one", "b_c_one"]
    assert unique_names([Path("one.csv"), Path("one.mat")]) == ["one_csv", "one_mat"]
    with pytest.raises(UserError, match="given twice"):
        unique_names([tmp_path / "one.csv", tmp_path / "one.csv"])


def test_several_files_are_reported_as_they_are_done(tmp_path: Path) -> None:
    files = [tmp_path / name for name in ("a.csv", "b.csv")]
    for file in files:
        file.write_text("t;M;n\n0;1;60\n1;2;60\n")
    through: list[Path] = []
    recordings = import_recordings(files, mapped(), done=through.append)
    assert [recording.name for recording in recordings] == ["a", "b"]
    assert through == files


def _axis(**column: Any) -> dict[str, Any]:
    return {
        "axes": {"x": {"columns": {"torque": {"column": "M", "unit": "N·m"}, "velocity": {"column": "n"} | column}}}
    }


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"machine": None}, r"machine: "),
        ({"axis": {}}, r"axis: unknown key; did you mean axes\? known keys here: machine"),
        ({"axes": {}}, r"axes: "),
        (_axis(unit="furlong"), r"axes\.x\.columns: 'furlong' is not a unit for velocity; one of: m/s"),
        (_axis(unit="Nm"), r"'Nm' is not a unit for velocity"),
        (_axis(sing=-1), r"axes\.x\.columns\.velocity\.sing: unknown key; did you mean sign\?"),
        (_axis(sign=2), r"axes\.x\.columns\.velocity\.sign: "),
        (_axis(object="0x6064"), r"give one of `column`"),
        ({"axes": {"x": {"columns": {"torque": {"column": "M"}}}}}, r"an axis needs torque, and position or velocity"),
        ({"axes": {"x": {"columns": {"torqe": {"column": "M"}}}}}, r"'torqe' is not a column .*did you mean torque\?"),
        ({"time": {"column": "t", "period": 1}}, r"time: give one of"),
        ({"time": {"column": "t", "unit": "rad"}}, r"'rad' is not a unit for time"),
        ({"resample": "3 kg"}, r"resample: 'kg' in '3 kg' is not a unit allowed here; one of: s, ms"),
        ({"path": "x"}, r"path: unknown key"),
        ({"machine": ""}, r"machine: String should have at least 1 character"),
        ({"time": {"period": float("inf")}}, r"time\.period: Input should be a finite number"),
        (_axis(scale=0), r"columns\.velocity: `scale` is 0, with which every value would be"),
        (_axis(offset=float("nan")), r"columns\.velocity\.offset: Input should be a finite number"),
    ],
)
def test_a_wrong_map_is_told_by_key(change: dict[str, Any], message: str, tmp_path: Path) -> None:
    file = tmp_path / "map.yaml"
    file.write_text(yaml.safe_dump({key: value for key, value in (MAP | change).items() if value is not None}))
    with pytest.raises(UserError, match=message) as refused:
        read_map(file)
    assert str(refused.value).startswith(str(file))


@pytest.mark.parametrize(
    ("period", "message"),
    [
        (1e-12, r"resample: 1e-12 s is less than 1/1000 of the file's step, 0\.001 s"),
        (5.0, r"resample: 5 s is longer than the file, 0\.009 s"),
    ],
)
def test_resampling_that_makes_no_recording(period: float, message: str, tmp_path: Path) -> None:
    """A period in another unit than s; the first asked for 10 TB."""
    file = tmp_path / "scope.csv"
    file.write_text("t;M;n\n" + "\n".join(f"{row};1;2" for row in range(10)) + "\n")
    with pytest.raises(UserError, match=message):
        import_recording(file, mapped(resample=period))


def test_a_map_that_is_no_map(tmp_path: Path) -> None:
    file = tmp_path / "map.yaml"
    with pytest.raises(UserError, match="does not exist"):
        read_map(file)
    file.write_text("machine: [\n")
    with pytest.raises(UserError, match=r"line 2 column 1: not YAML"):
        read_map(file)
    file.write_text("hello\n")
    with pytest.raises(UserError, match="expected the keys machine, time and axes"):
        read_map(file)


def test_a_table_without_torque_and_with_a_sensor_at_the_joint(tmp_path: Path) -> None:
    file = tmp_path / "scope.csv"
    file.write_text("t,q,w,s\n0,1,2,90\n1,2,3,180\n2,3,4,270\n")
    table = {"position": {"column": "q", "unit": "rad"}, "position_demand": {"column": "w", "unit": "rad"}}
    table["joint_position"] = {"column": "s", "unit": "deg"}
    axis = {"columns": table, "position_relative": True, "torque_delay": "0.5 ms"}
    recording = import_recording(file, mapped(axes={"x": axis}, start_time="2026-11-23T08:15:00Z"))
    assert list(recording.columns["x"]) == ["position", "position_demand", "joint_position"]
    np.testing.assert_allclose(recording.columns["x"]["joint_position"], np.pi / 2 * np.array([1.0, 2.0, 3.0]))
    assert recording.info.axes["x"].position_relative
    assert recording.info.axes["x"].torque_delay == 0.0005
    assert recording.info.start_time is not None
    del table["position_demand"]
    with pytest.raises(ValueError, match="without torque it needs position and position_demand"):
        mapped(axes={"x": {"columns": table}})


@pytest.mark.parametrize("delimiter", ["ab", "", "\n", '"', "1", ".", "\0"])
def test_what_is_no_delimiter(delimiter: str) -> None:
    with pytest.raises(ValueError, match="is not a delimiter; give one character"):
        CsvLayout(delimiter=delimiter)


@pytest.mark.parametrize("name", ["[" * 100_000, "M [" + " " * 100_000 + "x", "(" * 50_000 + "rpm]"])
def test_a_heading_of_brackets(name: str, tmp_path: Path) -> None:
    file = tmp_path / "scope.csv"
    file.write_text(f"t;{name}\n0;1\n1;2\n")
    assert [column.unit for column in read_csv_table(file, CsvLayout()).columns] in ([None, None], [None, "rpm"])


def test_dates_and_times(tmp_path: Path) -> None:
    file = tmp_path / "scope.csv"
    rows = [f"2026-11-23 08:14:59.{998 + k};{k};{k}" for k in range(2)]
    rows += [f"2026-11-23T08:15:00,00{k};{k};{k}" for k in range(3)]
    file.write_text("\n".join(["t;M;n", *rows]) + "\n")
    recording = import_recording(file, mapped(time={"column": "t", "unit": "iso"}))
    np.testing.assert_allclose(recording.time, 1e-3 * np.arange(5), atol=1e-9)
    assert recording.info.sample_period == 0.001
    assert recording.info.start_time == datetime(2026, 11, 23, 8, 14, 59, 998000)
    told = import_recording(file, mapped(time={"column": "t", "unit": "iso"}, start_time=12.0))
    assert told.info.start_time == 12.0


@pytest.mark.parametrize(
    ("second", "message"),
    [("8 o'clock", r"'t' row 3: .* is not an ISO date and time"), ("2026-11-23T08:15:01Z", "some rows name a time zone")],
)
def test_dates_that_are_none(second: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "scope.csv"
    file.write_text(f"t;M;n\n2026-11-23T08:15:00;1;1\n{second};2;2\n2026-11-23T08:15:02;3;3\n")
    with pytest.raises(UserError, match=message):
        import_recording(file, mapped(time={"column": "t", "unit": "iso"}))


@pytest.mark.parametrize(
    ("thousands", "decimal", "cells"),
    [
        ("'", ".", ["1'234'567.5", "-12'000", "3.25"]),
        (".", ",", ["1.234.567,5", "-12.000", "3,25"]),
        (",", ".", ["1,234,567.5", "-12,000", "3.25"]),
        (" ", ",", ["1 234 567,5", "-12 000", "3,25"]),
    ],
)
def test_groups_of_thousands(thousands: Any, decimal: Any, cells: list[str], tmp_path: Path) -> None:
    file = tmp_path / "scope.csv"
    file.write_text("\n".join(["t;M", *(f"{k};{cell}" for k, cell in enumerate(cells))]) + "\n")
    layout = CsvLayout(thousands=thousands, decimal=decimal, delimiter=";")
    assert columns(file, layout)["M"] == [1234567.5, -12000.0, 3.25]


def test_groups_that_are_none(tmp_path: Path) -> None:
    file = tmp_path / "scope.csv"
    file.write_text("t;M\n0;1'234\n1;12'34\n2;1'234\n")
    with pytest.raises(UserError, match=r"\"12'34\" is not a number"):
        columns(file, CsvLayout(thousands="'", delimiter=";", first_row=2))
    with pytest.raises(UserError, match=r"csv\.decimal is csv\.delimiter or csv\.thousands"):
        columns(file, CsvLayout(thousands=".", decimal="."))
