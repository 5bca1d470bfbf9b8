"""Bus logs: frames that the test puts on the bus, and the columns that come out."""

from __future__ import annotations

import logging
import struct
from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest

from drivetwin.foundation.errors import UserError
from drivetwin.recording.import_map import ImportMap
from drivetwin.recording.importer import import_recording

NODE = 3
CYCLES = 40

EDS = """[FileInfo]
FileName=drive.eds
[DeviceInfo]
VendorName=test
[1006]
ParameterName=communication cycle period
DataType=0x0007
AccessType=rw
DefaultValue=1000
{pdos}
[6062]
DataType=0x0004
AccessType=ro
[6064]
ParameterName=position actual value
ObjectType=0x7
DataType=0x0004
AccessType=ro
PDOMapping=1
[6077]
ParameterName=torque actual value
DataType=0x0003
AccessType=ro
[21A3]
ParameterName=CON_SCON_ActTorque
DataType=0x0008
AccessType=ro
"""


def _record(index: int, subs: list[tuple[int, str]]) -> str:
    """An EDS record of (data type, default)."""
    text = f"[{index:04X}]\nParameterName=record\nObjectType=0x9\nSubNumber={len(subs)}\n"
    for sub, (type_, default) in enumerate(subs):
        text += (
            f"[{index:04X}sub{sub}]\nParameterName=sub\nDataType=0x{type_:04X}\nAccessType=rw\nDefaultValue={default}\n"
        )
    return text


TPDO1 = _record(0x1800, [(5, "2"), (7, "$NODEID+0x180"), (5, "1")]) + _record(
    0x1A00, [(5, "2"), (7, "0x60640020"), (7, "0x60770010")]
)
RPDO1 = _record(0x1400, [(5, "2"), (7, "$NODEID+0x200"), (5, "1")]) + _record(0x1600, [(5, "1"), (7, "0x607A0020")])


def axes(**changes: Any) -> dict[str, Any]:
    axis = {
        "node": NODE,
        "gear_ratio": 10.0,
        "encoder_increments": 1000,
        "motor_rated_torque": 2.0,
        "columns": {
            "position": {"object": "6064h", "unit": "inc"},
            "torque": {"object": 0x6077, "unit": "permille"},
            "position_demand": {"object": "0x607A", "unit": "inc", "optional": True},
        },
    }
    return {"elbow": axis | changes}


def import_map(folder: Path, eds: str | None, bus: dict[str, Any] | None = None, **axis: Any) -> ImportMap:
    layout = dict(bus or {})
    if eds is not None:
        (folder / "drive.eds").write_text(eds)
        layout["eds"] = "drive.eds"
    return ImportMap.model_validate(
        {"machine": "bench", "bus": layout, "axes": axes(**axis), "path": folder / "map.yaml"}
    )


def frame(time: float, identifier: int, data: bytes = b"") -> can.Message:
    return can.Message(timestamp=time, arbitration_id=identifier, data=data, is_extended_id=False, channel=0)


def sdo_write(time: float, index: int, sub: int, value: int, size: int, *, confirmed: bool = True) -> list[can.Message]:
    command = 0x23 | (4 - size) << 2
    key = struct.pack("<HB", index, sub)
    answer = b"\x60" + key + bytes(4) if confirmed else b"\x80" + key + struct.pack("<I", 0x06040041)
    request = bytes([command]) + key + struct.pack("<I", value)
    return [frame(time, 0x600 + NODE, request), frame(time + 1e-5, 0x580 + NODE, answer)]


def motion(*, start: float = 1.0, period: float = 0.001, lost: int | None = None) -> list[can.Message]:
    """SYNC k, then the TPDO with position 100 k and torque k per mille, then the set-point 100 (k + 1)."""
    messages = []
    for k in range(CYCLES):
        at = start + k * period + (1e-5 if k % 3 else 0.0)
        messages.append(frame(at, 0x80))
        if k != lost:
            messages.append(frame(at + 1e-4, 0x180 + NODE, struct.pack("<ih", 100 * k, k)))
        messages.append(frame(at + 2e-4, 0x200 + NODE, struct.pack("<i", 100 * (k + 1))))
    return messages


def write(file: Path, messages: list[can.Message]) -> Path:
    with can.Logger(str(file)) as log:
        for message in messages:
            log(message)
    return file


INC = 2 * np.pi / 1000 / 10


@pytest.mark.parametrize("suffix", [".log", ".asc", ".blf"])
def test_eds_gives_the_mapping(suffix: str, tmp_path: Path) -> None:
    file = write(tmp_path / f"bus{suffix}", motion())
    recording = import_recording(file, import_map(tmp_path, EDS.format(pdos=TPDO1 + RPDO1)))
    elbow = recording.columns["elbow"]
    assert recording.info.sample_period == 0.001
    # The first set-point acts with the second SYNC, so the first row has none.
    k = np.arange(len(recording.time))
    np.testing.assert_allclose(recording.time, 0.001 * k, atol=1e-12)
    np.testing.assert_allclose(elbow["position"], 100 * k * INC)
    np.testing.assert_allclose(elbow["torque"], k * 1e-3 * 20.0)
    assert np.isnan(elbow["position_demand"][0])
    np.testing.assert_allclose(elbow["position_demand"][1:], 100 * k[1:] * INC)
    assert recording.info.axes["elbow"].rated_torque == 20.0
    assert tmp_path / "drive.eds" in recording.files


def test_mapping_and_factors_from_the_logs_own_sdo(tmp_path: Path) -> None:
    """No EDS at all: torque as float32 in TPDO 2, position in user units, everything written on the bus."""
    writes = [
        (0x1801, 1, 0x80000000 | 0x280 + NODE, 4),
        (0x1A01, 0, 0, 1),
        (0x1A01, 1, 0x60640020, 4),
        (0x1A01, 2, 0x21A30020, 4),
        (0x1A01, 0, 2, 1),
        (0x1801, 2, 1, 1),
        (0x1801, 1, 0x345, 4),
        (0x608F, 1, 4096, 4),
        (0x608F, 2, 1, 4),
        (0x6091, 1, 100, 4),
        (0x6091, 2, 2, 4),
        (0x6092, 1, 36000, 4),
        (0x6092, 2, 1, 4),
        (0x6076, 0, 500, 4),
    ]
    messages = [message for n, write_ in enumerate(writes) for message in sdo_write(0.1 + 0.001 * n, *write_)]
    messages += sdo_write(0.2, 0x6076, 0, 999, 4, confirmed=False)
    for k in range(CYCLES):
        messages.append(frame(1 + 0.002 * k, 0x80))
        messages.append(frame(1.0001 + 0.002 * k, 0x345, struct.pack("<if", 10 * k, 0.25 * k)))
    columns = {
        "position": {"object": "6064h", "unit": "user"},
        "torque": {"object": "0x21A3", "type": "float32", "unit": "N·m", "side": "motor"},
    }
    known: dict[str, Any] = {"gear_ratio": None, "encoder_increments": None, "motor_rated_torque": None}
    recording = import_recording(
        write(tmp_path / "bus.log", messages), import_map(tmp_path, None, columns=columns, **known)
    )
    cycle = np.arange(CYCLES)
    assert recording.info.sample_period == 0.002
    info = recording.info.axes["elbow"]
    assert (info.gear_ratio, info.rated_torque) == (50.0, 25.0)
    np.testing.assert_allclose(recording.columns["elbow"]["position"], 10 * cycle * 2 * np.pi / 36000)
    np.testing.assert_allclose(recording.columns["elbow"]["torque"], 0.25 * cycle * 50)


def test_a_lost_frame_is_a_gap(tmp_path: Path) -> None:
    file = write(tmp_path / "bus.log", motion(lost=12))
    read = import_map(tmp_path, EDS.format(pdos=TPDO1 + RPDO1))
    with pytest.raises(UserError, match=r"gap of 0\.002 s before row 13"):
        import_recording(file, read)
    kept = import_recording(file, read.model_copy(update={"gaps": "keep"}))
    assert len(kept.time) == CYCLES - 1


def test_a_lost_sync_is_a_gap(tmp_path: Path) -> None:
    messages = [message for message in motion() if not 1.0195 < message.timestamp < 1.0215]
    file = write(tmp_path / "bus.log", messages)
    with pytest.raises(UserError, match=r"gap of 0\.003 s before row 21 .*about 2 samples"):
        import_recording(file, import_map(tmp_path, EDS.format(pdos=TPDO1 + RPDO1)))


def test_lockstep_counts_the_syncs(tmp_path: Path) -> None:
    messages = motion(period=0.00037)
    file = write(tmp_path / "bus.log", messages)
    eds = EDS.format(pdos=TPDO1 + RPDO1)
    with pytest.raises(
        UserError, match=r"do not go with a period of 0\.001 s; give bus\.sync_period, or `bus\.grid: count`"
    ):
        import_recording(file, import_map(tmp_path, eds))
    recording = import_recording(file, import_map(tmp_path, eds, {"grid": "count"}))
    np.testing.assert_allclose(recording.time, 0.001 * np.arange(CYCLES), atol=1e-12)


def test_a_vendors_nameless_object_is_tolerated(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        import_recording(write(tmp_path / "bus.log", motion()), import_map(tmp_path, EDS.format(pdos=TPDO1)))
    assert "no ParameterName in 6062" in caplog.text


@pytest.mark.parametrize(
    ("messages", "pdos", "message"),
    [
        ([], TPDO1, "0 SYNC frames"),
        (motion(), "", r"no object 6064h of node 3 for elbow\.position; the PDOs of that node carry: nothing that"),
        (motion(), RPDO1, r"the PDOs of that node carry: 607Ah"),
        (motion(lost=None)[::3], TPDO1, r"no object 6064h of node 3"),
    ],
)
def test_what_the_log_lacks_is_said(messages: list[can.Message], pdos: str, message: str, tmp_path: Path) -> None:
    file = write(tmp_path / "bus.log", messages)
    with pytest.raises(UserError, match=message):
        import_recording(file, import_map(tmp_path, EDS.format(pdos=pdos)))


def test_what_is_no_log_is_said(tmp_path: Path) -> None:
    file = tmp_path / "bus.log"
    file.write_text("can0  183   [6]  00 00 00 00 00 00\n")
    with pytest.raises(UserError, match="candump -L"):
        import_recording(file, import_map(tmp_path, EDS.format(pdos=TPDO1)))


def test_an_unknown_type_asks_for_the_eds(tmp_path: Path) -> None:
    columns = {"position": {"object": "6064h", "unit": "inc"}, "torque": {"object": "0x21A3", "unit": "N·m"}}
    with pytest.raises(UserError, match=r"type of object 21A3h is not known; give its EDS .*or `type: int32`"):
        import_recording(write(tmp_path / "bus.log", motion()), import_map(tmp_path, None, columns=columns))


def test_missing_eds_and_node(tmp_path: Path) -> None:
    file = write(tmp_path / "bus.log", motion())
    with pytest.raises(UserError, match=r"drive\.eds does not exist"):
        import_recording(file, import_map(tmp_path, None, {"eds": "drive.eds"}))
    with pytest.raises(UserError, match=r"axes\.elbow\.node is missing"):
        import_recording(file, import_map(tmp_path, None, node=None))


def test_decimal_index_is_refused() -> None:
    with pytest.raises(ValueError, match="6064 is read as decimal; write 0x6064"):
        ImportMap.model_validate({"machine": "m", "axes": axes(columns={"position": {"object": 6064}})})


FACTORS = (
    _record(0x608F, [(5, "2"), (7, "4096"), (7, "1")])
    + _record(0x6091, [(5, "2"), (7, "1"), (7, "1")])
    + _record(0x6092, [(5, "2"), (7, "36000"), (7, "1")])
    + "[6076]\nParameterName=rated\nDataType=0x0007\nAccessType=rw\nDefaultValue=800\n"
)
UNKNOWN = {"gear_ratio": None, "encoder_increments": None, "motor_rated_torque": None}


def columns_in(position: str, torque: str) -> dict[str, Any]:
    return {"position": {"object": "6064h", "unit": position}, "torque": {"object": 0x6077, "unit": torque}}


@pytest.mark.parametrize(
    ("position", "known", "objects"),
    [
        ("user", {"motor_rated_torque": 2.0, "gear_ratio": 10.0}, "6091h, 6092h"),
        ("user", {"motor_rated_torque": 2.0, "user_units_per_motor_turn": 36000}, "6091h"),
        ("inc", {"motor_rated_torque": 2.0, "gear_ratio": 10.0}, "608Fh"),
        ("rad", {"gear_ratio": 10.0}, "6076h"),
    ],
)
def test_a_default_of_the_eds_is_no_scale(position: str, known: dict[str, Any], objects: str, tmp_path: Path) -> None:
    """What a drive was shipped with is not what the commissioning engineer left in it."""
    file = write(tmp_path / "bus.log", motion())
    read = import_map(tmp_path, EDS.format(pdos=TPDO1 + FACTORS), columns=columns_in(position, "permille"), **UNKNOWN | known)
    with pytest.raises(UserError, match=rf"map lacks.*default.* of .*{objects}.* the log does not confirm.*give"):
        import_recording(file, read)


def test_a_default_that_the_log_confirms_is_a_scale(tmp_path: Path) -> None:
    reads = [(0x608F, 1, 4096), (0x608F, 2, 1), (0x6091, 1, 100), (0x6091, 2, 2), (0x6092, 1, 36000), (0x6092, 2, 1)]
    reads.append((0x6076, 0, 500))
    told = [message for n, read in enumerate(reads) for message in sdo_write(0.1 + 1e-3 * n, *read, 4)]
    read = import_map(tmp_path, EDS.format(pdos=TPDO1 + FACTORS), columns=columns_in("user", "permille"), **UNKNOWN)
    recording = import_recording(write(tmp_path / "bus.log", told + motion()), read)
    k = np.arange(CYCLES)
    np.testing.assert_allclose(recording.columns["elbow"]["position"], 100 * k * 2 * np.pi / 36000)
    np.testing.assert_allclose(recording.columns["elbow"]["torque"], k * 1e-3 * 0.5 * 50.0)
    assert recording.info.axes["elbow"].gear_ratio == 50.0


def test_a_value_of_the_dcf_is_a_scale(tmp_path: Path) -> None:
    """A ParameterValue is what was configured."""
    eds = EDS.format(pdos=TPDO1 + FACTORS.replace("DefaultValue=800", "DefaultValue=800\nParameterValue=500"))
    known: dict[str, Any] = UNKNOWN | {"gear_ratio": 10.0}
    read = import_map(tmp_path, eds, columns=columns_in("rad", "permille"), **known)
    recording = import_recording(write(tmp_path / "bus.log", motion()), read)
    assert recording.info.axes["elbow"].rated_torque == 5.0


def test_half_a_factor_is_no_scale(tmp_path: Path) -> None:
    """The numerator alone leaves the denominator to a default."""
    told = sdo_write(0.1, 0x6091, 1, 100, 4)
    known: dict[str, Any] = UNKNOWN | {"motor_rated_torque": 2.0}
    read = import_map(tmp_path, EDS.format(pdos=TPDO1 + FACTORS), columns=columns_in("rad", "permille"), **known)
    recording = import_recording(write(tmp_path / "bus.log", told + motion()), read)
    assert recording.info.axes["elbow"].gear_ratio is None


def test_time_stamps_that_leap(tmp_path: Path) -> None:
    """The rows between would be more than any memory holds."""
    messages = [*motion(), *motion(start=1e9)]
    with pytest.raises(UserError, match=r"time stamps of the SYNCs go from 1 to 1e\+09 s .*cut the log where they jump"):
        import_recording(write(tmp_path / "bus.log", messages), import_map(tmp_path, EDS.format(pdos=TPDO1 + RPDO1)))
