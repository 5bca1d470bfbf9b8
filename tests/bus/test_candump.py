"""Lines of the bus log, read back by python-can's reader."""

from __future__ import annotations

from pathlib import Path

import can
import pytest

from drivetwin.bus.candump import candump_line


@pytest.mark.parametrize(
    ("told", "read"),
    [
        ((0x181, b"\x01\xab", None), can.Message(arbitration_id=0x181, data=b"\x01\xab", is_extended_id=False)),
        ((0x080, b"", None), can.Message(arbitration_id=0x080, is_extended_id=False)),
        ((0x701, b"", 1), can.Message(arbitration_id=0x701, dlc=1, is_remote_frame=True, is_extended_id=False)),
        ((0x200, b"", 8), can.Message(arbitration_id=0x200, dlc=8, is_remote_frame=True, is_extended_id=False)),
        ((0x181, b"", 0), can.Message(arbitration_id=0x181, is_remote_frame=True, is_extended_id=False)),
        ((0x800, b"\x07", None), can.Message(arbitration_id=0x800, data=b"\x07", is_extended_id=True)),
        ((0x123, b"", 2, True), can.Message(arbitration_id=0x123, dlc=2, is_remote_frame=True, is_extended_id=True)),
    ],
    ids=lambda value: str(value) if isinstance(value, tuple) else "",
)
def test_a_foreign_reader_reads_what_was_logged(told: tuple[int, bytes, int | None], read: can.Message, tmp_path: Path) -> None:
    log = tmp_path / "bus.log"
    log.write_text(candump_line(1.25, "can0", *told), encoding="ascii")
    (message,) = can.CanutilsLogReader(log)
    assert message.equals(read, check_channel=False, check_direction=False, timestamp_delta=None)
    assert (message.timestamp, message.channel) == (1.25, "can0")
