"""The excerpt of a bus log: what each service says, and which frames are shown."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import canopen
import pytest
from accept_bench import BENCH, FAULT, with_files
from canopen.sdo.client import SdoClient

from drivetwin.hil_tests.bench import OrderedPdo
from drivetwin.hil_tests.results.bus_excerpt import AFTER, BEFORE, MOST_TELLING, excerpt, words
from drivetwin.hil_tests.results.pdo_words import ordered_pdos, pdo_words


@pytest.fixture
def log(tmp_path: Path) -> Path:
    folder = with_files(FAULT, tmp_path).folder
    assert folder is not None
    return folder / "bus.log"


def test_every_frame_is_named_and_decoded(log: Path) -> None:
    shown = [(frame.service, frame.node, frame.words) for frame in excerpt(log, 0.75, {})]
    assert shown == [
        ("NMT", None, "reset node, all nodes"),
        ("heartbeat", 2, "boot-up"),
        ("SDO request", 2, "write 6040h:00 = 0006h"),
        ("SDO answer", 2, "written 6040h:00"),
        ("SDO request", 2, "read 6041h:00"),
        ("SDO answer", 2, "answer 6041h:00 = 0231h"),
        ("SDO request", 2, "write 1640h:01 = 00000001h"),
        ("SDO answer", 2, "abort 1640h:01: Object does not exist in the object dictionary, 06020000h"),
        ("NMT", None, "start, all nodes"),
        ("SYNC", None, ""),
        ("TPDO 1", 2, ""),
        ("EMCY", 2, "error 2310h"),
        ("heartbeat", 2, "operational"),
        ("EMCY", 2, "error reset"),
        ("RPDO 1", 2, ""),
        ("heartbeat", 1, "requested"),
    ]


@pytest.mark.parametrize("size", [1, 2, 3, 4])
def test_expedited_values_are_what_a_foreign_client_sends(size: int) -> None:
    sent: list[bytes] = []

    class Wire:
        def send_message(self, _identifier: int, data: bytes, _remote: bool = False) -> None:
            sent.append(bytes(data))
            client.on_response(0x582, bytearray([0x60, *data[1:4], 0, 0, 0, 0]), 0.0)

    client: Any = SdoClient(0x602, 0x582, canopen.ObjectDictionary())
    client.network = Wire()
    client.download(0x1A02, 3, (0x0A0B0C0D).to_bytes(4, "little")[:size])
    value = (0x0A0B0C0D & (1 << 8 * size) - 1).to_bytes(size, "big").hex().upper()
    assert [words("SDO request", data) for data in sent] == [f"write 1A02h:03 = {value}h"]


@pytest.mark.parametrize("data", [b"", b"\x81", bytes(3), bytes(7)])
@pytest.mark.parametrize("name", ["NMT", "EMCY", "heartbeat", "SDO request", "SDO answer"])
def test_a_frame_of_the_wrong_length_says_nothing_that_it_does_not_hold(name: str, data: bytes) -> None:
    if name != "heartbeat" or len(data) != 1:
        assert words(name, data) == ""


def test_pdos_say_what_the_bench_orders() -> None:
    ordered = {
        "rpdo 1": OrderedPdo(objects=["6040:00:16", "60C1:01:32", "60B2:00:16"], transmission=1),
        "tpdo 2": OrderedPdo(objects=["6064:00:32", "21A3:00:32"], transmission=1),
    }
    pdos = ordered_pdos(BENCH.model_copy(update={"pdo": ordered}))
    demand = struct.pack("<Hih", 0x001F, -3200, -5)
    assert pdo_words(pdos["RPDO 1"], demand) == "6040h = 001Fh, 60C1h:01 = -3200, 60B2h = -5"
    actual = struct.pack("<if", 12, 0.5)
    assert pdo_words(pdos["TPDO 2"], actual) == "6064h = 12, 21A3h = 0.5"
    assert pdo_words(pdos["TPDO 2"], actual[:4]) == "4 bytes, 8 are ordered"


def busy(folder: Path) -> Path:
    """Ten seconds of one SYNC and one TPDO a millisecond; SDO each 10 ms."""
    log = folder / "bus.log"
    lines = []
    for cycle in range(10000):
        stamp = f"({cycle * 1e-3:.6f}) bus0"
        lines += [f"{stamp} 080#", f"{stamp} 181#0011"]
        lines += [f"{stamp} 601#4041600000000000"] if cycle % 10 == 0 else []
    log.write_text("\n".join(lines) + "\n", encoding="ascii")
    return log


def test_of_a_long_log_the_frames_next_to_the_instant_and_the_telling_ones_around(tmp_path: Path) -> None:
    shown = excerpt(busy(tmp_path), 5.0005, {})
    times = [frame.time for frame in shown]
    assert times == sorted(times)
    telling = [frame for frame in shown if frame.service == "SDO request"]
    assert len(telling) == MOST_TELLING
    assert all(abs(frame.time - 5.0) < 0.25 for frame in telling)
    others = [frame.time for frame in shown if frame.service != "SDO request"]
    assert BEFORE + AFTER - 3 <= len(others) <= BEFORE + AFTER
    assert others[0] > 4.98
    assert others[-1] < 5.01
    assert 5.0 in others
    assert 5.001 in others


def test_without_an_instant_the_end_of_the_log_is_shown(tmp_path: Path) -> None:
    assert excerpt(busy(tmp_path), None, {})[-1].time == 9.999


def test_an_empty_log_has_nothing_to_show(tmp_path: Path) -> None:
    (tmp_path / "bus.log").touch()
    assert excerpt(tmp_path / "bus.log", 1.0, {}) == ()
    assert excerpt(tmp_path / "bus.log", None, {}) == ()
