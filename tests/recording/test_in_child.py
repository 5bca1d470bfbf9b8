"""Files that make a library hang, crash or ask for all memory: one line, in bounded time."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from drivetwin.foundation.errors import UserError
from drivetwin.recording import in_child
from drivetwin.recording.import_map import ImportMap
from drivetwin.recording.importer import import_recording
from drivetwin.recording.in_child import UnreadableError, read_in_child

MAP = ImportMap.model_validate(
    {
        "machine": "bench",
        "time": {"column": "t", "unit": "s"},
        "axes": {"x": {"columns": {"torque": {"column": "M", "unit": "N·m"}, "position": {"column": "q", "unit": "rad"}}}},
    }
)
BUS = ImportMap.model_validate(
    {
        "machine": "bench",
        "axes": {
            "x": {
                "node": 1,
                "columns": {"torque": {"object": 0x6077, "unit": "N·m"}, "position": {"object": 0x6064, "unit": "rad"}},
            }
        },
    }
)


def blf(inner: bytes) -> bytes:
    """A Binary Logging File with one compressed container, byte by byte."""
    packed = zlib.compress(inner)
    container = struct.pack("<4sHHLL", b"LOBJ", 16, 1, 32 + len(packed), 10) + struct.pack("<H6xL4x", 2, len(inner)) + packed
    container += bytes(len(packed) % 4)
    return struct.pack("<4sLBBBBBBBBQQLL8H8H", b"LOGG", 144, *[0] * 8, 0, 0, 0, 0, *[0] * 16).ljust(144, b"\0") + container


def frame(size: int) -> bytes:
    """A CAN message object that says it is `size` bytes long; 48 is right."""
    head = struct.pack("<4sHHLL", b"LOBJ", 32, 1, size, 86) + struct.pack("<LHHQ", 2, 0, 0, 1000)
    return head + struct.pack("<HBBL8s", 1, 0, 2, 0x181, b"\1\2" + bytes(6))


def test_frames_of_a_sound_log(tmp_path: Path) -> None:
    (tmp_path / "bus.blf").write_bytes(blf(frame(48) * 3))
    log = read_in_child("bus", tmp_path / "bus.blf")
    assert log["identifier"].tolist() == [0x181] * 3
    assert log["data"].tobytes() == b"\1\2" * 3


def test_a_log_that_never_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An object of no length is read over and over."""
    monkeypatch.setattr(in_child, "SECONDS", 1)
    (tmp_path / "bus.blf").write_bytes(blf(frame(0)))
    with pytest.raises(UserError, match=r"bus\.blf cannot be read as a bus log: (reading it does not end within 1 s|.*memory)"):
        import_recording(tmp_path / "bus.blf", BUS)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (blf(b"no object" * 10), "Could not find next object"),
        (blf(frame(48))[:-20] + bytes(20), "decompress|BLFParseError"),
        (b"LOGG", "requires a buffer"),
        (blf(frame(48)).replace(b"LOBJ", b"XXXX", 1), "BLFParseError"),
    ],
)
def test_broken_logs(data: bytes, message: str, tmp_path: Path) -> None:
    (tmp_path / "bus.blf").write_bytes(data)
    with pytest.raises(UserError, match=rf"cannot be read as a bus log: .*({message})"):
        import_recording(tmp_path / "bus.blf", BUS)


def test_a_matlab_file_that_unpacks_to_more_than_there_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    savemat(tmp_path / "run.mat", {"t": np.zeros(50_000_000, dtype=np.int8)}, do_compression=True)
    monkeypatch.setattr(in_child, "MEMORY", 150 << 20)
    with pytest.raises(UserError, match=r"it asks for more memory than a sound file of its size"):
        import_recording(tmp_path / "run.mat", MAP)


def test_a_library_that_crashes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A stand-in for a reader that ends its process by a segmentation fault."""
    crash = tmp_path / "crash.py"
    crash.write_text("import os, signal\nos.kill(os.getpid(), signal.SIGSEGV)\n")
    monkeypatch.setattr(in_child, "_CHILD", crash)
    with pytest.raises(UnreadableError, match="it crashes the library that reads it"):
        read_in_child("matlab", crash)
