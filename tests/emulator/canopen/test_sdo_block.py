"""SDO block upload and download: bytes, CRC, repetition, protocol switch (CiA 301, 7.2.4.3.9ff)."""

from __future__ import annotations

from binascii import crc_hqx
from collections.abc import Iterator
from dataclasses import replace
from itertools import chain, repeat

import canopen
import pytest
from canopen_bench import NODE, Bench, Master, foreign_dictionary
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetwin.drive_profiles import Access, DataType, ObjectEntry, load_profile
from drivetwin.emulator.canopen.sdo_block import crc

TEXT = 0x2F00
FILE = 0x2F01
DATA = bytes(range(256)) * 9 + b"the end"


def bench() -> Bench:
    profile = load_profile("cia402-full")
    text = ObjectEntry(TEXT, 0, "Text", DataType.VSTR, Access.RW, False, False, "", False, None, None)
    file = replace(text, index=FILE, name="File", data_type=DataType.DOMAIN)
    return Bench(replace(profile, objects=(*profile.objects, text, file))).boot()


def ask(one: Bench, request: bytes | str) -> list[str]:
    """Answers in hex to one frame of the client."""
    one.device.receive(0x600 + NODE, bytes.fromhex(request) if isinstance(request, str) else request)
    return [data.hex(" ").upper() for cob_id, data in one.take() if cob_id == 0x580 + NODE]


def segment(number: int, data: bytes, last: bool = False) -> bytes:
    return bytes((number | (0x80 if last else 0),)) + data.ljust(7, b"\x00")


def test_crc_of_the_standards_polynomial() -> None:
    """Check value of the CRC with polynomial 1021h and initial value 0."""
    assert crc(b"123456789") == 0x31C3


def test_download_byte_by_byte() -> None:
    one = bench()
    assert ask(one, "C6 00 2F 00 09 00 00 00") == ["A4 00 2F 00 7F 00 00 00"]
    assert ask(one, segment(1, b"1234567")) == []
    assert ask(one, segment(2, b"89", last=True)) == ["A2 02 7F 00 00 00 00 00"]
    assert one.od[TEXT].value == ""
    assert ask(one, "D5 C3 31 00 00 00 00 00") == ["A1 00 00 00 00 00 00 00"]
    assert one.od[TEXT].value == "123456789"


def test_upload_byte_by_byte() -> None:
    one = bench()
    one.od[TEXT].value = "123456789"
    assert ask(one, "A4 00 2F 00 02 00 00 00") == ["C6 00 2F 00 09 00 00 00"]
    assert ask(one, "A3 00 00 00 00 00 00 00") == ["01 31 32 33 34 35 36 37", "82 38 39 00 00 00 00 00"]
    assert ask(one, "A2 02 02 00 00 00 00 00") == ["D5 C3 31 00 00 00 00 00"]
    assert ask(one, "A1 00 00 00 00 00 00 00") == []
    assert ask(one, "A3 00 00 00 00 00 00 00")[0].endswith("01 00 04 05")


def test_without_a_crc_none_is_told_and_none_is_asked() -> None:
    one = bench()
    one.od[TEXT].value = "12345"
    assert ask(one, "A0 00 2F 00 7F 00 00 00") == ["C2 00 2F 00 05 00 00 00"]
    ask(one, "A3 00 00 00 00 00 00 00")
    assert ask(one, "A2 01 7F 00 00 00 00 00") == ["C9 00 00 00 00 00 00 00"]
    ask(one, "A1 00 00 00 00 00 00 00")
    assert ask(one, "C0 00 2F 00 00 00 00 00") == ["A0 00 2F 00 7F 00 00 00"]
    ask(one, segment(1, b"abc", last=True))
    assert ask(one, "D1 FF FF 00 00 00 00 00") == ["A1 00 00 00 00 00 00 00"]
    assert one.od[TEXT].value == "abc"


def test_upload_of_nothing_and_of_a_number() -> None:
    one = bench()
    ask(one, "A4 00 2F 00 7F 00 00 00")
    assert ask(one, "A3 00 00 00 00 00 00 00") == ["81 00 00 00 00 00 00 00"]
    assert ask(one, "A2 01 7F 00 00 00 00 00") == ["DD 00 00 00 00 00 00 00"]
    ask(one, "A1 00 00 00 00 00 00 00")
    assert ask(one, "A4 00 10 00 7F 00 00 00") == ["C6 00 10 00 04 00 00 00"]


@pytest.mark.parametrize(("threshold", "answer"), [(17, "41 08 10 00 11 00 00 00"), (16, "C6 08 10 00 11 00 00 00")])
def test_protocol_switch_at_the_threshold(threshold: int, answer: str) -> None:
    """1008h has 17 characters: a threshold of as many asks for the segmented protocol."""
    assert ask(bench(), f"A4 08 10 00 7F {threshold:02X} 00 00") == [answer]


def test_protocol_switch_to_expedited() -> None:
    assert ask(bench(), "A4 00 10 00 7F 04 00 00") == ["43 00 10 00 92 01 02 00"]


def test_the_server_repeats_what_the_client_missed() -> None:
    one = bench()
    one.od[FILE].value = DATA.decode("latin-1")
    ask(one, f"A4 {FILE & 0xFF:02X} 2F 00 05 00 00 00")
    first = ask(one, "A3 00 00 00 00 00 00 00")
    assert len(first) == 5
    again = ask(one, "A2 03 04 00 00 00 00 00")  # three came, and four are wanted next
    assert [frame[:2] for frame in again] == ["01", "02", "03", "04"]
    assert [frame[2:] for frame in again[:2]] == [frame[2:] for frame in first[3:]]


def test_the_server_asks_again_for_what_it_missed() -> None:
    one = bench()
    ask(one, "C2 00 2F 00 1C 00 00 00")
    ask(one, segment(1, b"aaaaaaa"))
    ask(one, segment(3, b"ccccccc"))
    assert ask(one, segment(4, b"ddddddd", last=True)) == ["A2 01 7F 00 00 00 00 00"]
    ask(one, segment(1, b"bbbbbbb"))
    ask(one, segment(2, b"ccccccc"))
    assert ask(one, segment(3, b"ddddddd", last=True)) == ["A2 03 7F 00 00 00 00 00"]
    assert ask(one, "C1 00 00 00 00 00 00 00") == ["A1 00 00 00 00 00 00 00"]
    assert one.od[TEXT].value == "aaaaaaabbbbbbbcccccccddddddd"


def test_sequence_numbers_with_bits_of_an_abort_are_segments() -> None:
    """81h..9Fh is the last segment of a block; only 80h is an abort."""
    one = bench()
    ask(one, "C2 00 2F 00 07 00 00 00")
    assert ask(one, segment(1, b"abcdefg", last=True)) == ["A2 01 7F 00 00 00 00 00"]


def test_the_clients_abort_ends_a_block() -> None:
    one = bench()
    ask(one, "C2 00 2F 00 07 00 00 00")
    assert ask(one, "80 00 2F 00 00 00 00 08") == []
    assert ask(one, "40 00 10 00 00 00 00 00") == ["43 00 10 00 92 01 02 00"]


ABORTS = [
    (("A4 00 2F 00 00 00 00 00",), "02 00 04 05"),
    (("A4 00 2F 00 80 00 00 00",), "02 00 04 05"),
    (("A4 00 2F 00 7F 00 00 00", "A3" + 7 * " 00", "A2 02 7F 00 00 00 00 00"), "03 00 04 05"),
    (("A4 00 2F 00 7F 00 00 00", "A3" + 7 * " 00", "A2 01 00 00 00 00 00 00"), "02 00 04 05"),
    (("A4 00 2F 00 7F 00 00 00", "A1" + 7 * " 00"), "01 00 04 05"),
    (("C6 00 2F 00 03 00 00 00", "00 61 62 63 00 00 00 00"), "03 00 04 05"),
    (("C6 00 2F 00 03 00 00 00", "81 61 62 63 00 00 00 00", "D1 00 00 00 00 00 00 00"), "04 00 04 05"),
    (("C2 00 2F 00 04 00 00 00", "81 61 62 63 00 00 00 00", "D1 00 00 00 00 00 00 00"), "13 00 07 06"),
    (("C2 00 2F 00 03 00 00 00", "01 61 62 63 00 00 00 00", "02 61 62 63 00 00 00 00"), "12 00 07 06"),
    (("C2 00 2F 00 00 00 00 10",), "05 00 04 05"),
]


@pytest.mark.parametrize(("requests", "code"), ABORTS)
def test_abort(requests: tuple[str, ...], code: str) -> None:
    one = bench()
    for request in requests[:-1]:
        ask(one, request)
    assert ask(one, requests[-1]) == [f"80 00 2F 00 {code}"]
    assert one.od[TEXT].value == ""


@pytest.mark.parametrize(
    ("request_", "code"),
    [
        ("C2 00 10 00 04 00 00 00", "02 00 01 06"),
        ("C2 17 10 00 04 00 00 00", "12 00 07 06"),
        ("A4 99 29 00 7F 00 00 00", "00 00 02 06"),
        ("A4 18 10 09 7F 00 00 00", "11 00 09 06"),
    ],
)
def test_an_initiation_is_refused_as_any_access(request_: str, code: str) -> None:
    assert ask(bench(), request_) == [f"80 {request_[3:11]} {code}"]


def test_what_a_number_refuses_is_told_at_the_end_of_the_block() -> None:
    one = bench()
    ask(one, "C2 5A 60 00 02 00 00 00")
    ask(one, segment(1, b"\x09\x00", last=True))
    assert ask(one, "D5 00 00 00 00 00 00 00") == ["80 5A 60 00 31 00 09 06"]


@pytest.mark.parametrize(
    ("requests", "address"),
    [
        (("21 00 2F 00 09 00 00 00", "00 61 62 63 64 65 66 67"), "00 2F 00"),
        (("40 08 10 00 00 00 00 00",), "08 10 00"),
        (("C2 00 2F 00 09 00 00 00", "01 61 62 63 64 65 66 67"), "00 2F 00"),
        (("A4 08 10 00 7F 00 00 00", "A3 00 00 00 00 00 00 00"), "08 10 00"),
    ],
)
def test_a_transfer_that_the_client_leaves_times_out(requests: tuple[str, ...], address: str) -> None:
    one = bench()
    for request in requests:
        ask(one, request)
    assert one.run_to(0.999) == []
    assert one.run_to(2.0) == [(1.0, 0x580 + NODE, bytes.fromhex(f"80 {address} 00 00 04 05"))]


def test_each_frame_of_a_transfer_begins_its_time_anew() -> None:
    one = bench()
    ask(one, "40 08 10 00 00 00 00 00")
    one.run_to(0.9)
    ask(one, "60 00 00 00 00 00 00 00")
    assert one.run_to(1.8) == []
    ask(one, "70 00 00 00 00 00 00 00")
    ask(one, "60 00 00 00 00 00 00 00")
    assert one.run_to(5.0) == []


# -- the client of another implementation -----------------------------------------------------------------------------


def client(drop: tuple[int, ...] = (), spoil: int | None = None) -> tuple[Bench, canopen.RemoteNode]:
    """`canopen` on a wire that loses the frames of the client with these numbers, or changes a bit of one."""
    one = bench()
    master = LossyMaster(one, drop, spoil)
    node = master.add_node(NODE, foreign_dictionary(one.profile))
    node.sdo.RESPONSE_TIMEOUT = 0.02
    return one, node


class LossyMaster(Master):
    def __init__(self, one: Bench, drop: tuple[int, ...], spoil: int | None) -> None:
        super().__init__(one)
        self._drop, self._spoil, self.count = drop, spoil, 0

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        self.count += 1
        if self.count in self._drop:
            return
        if self.count == self._spoil:
            data = bytes(data[:3]) + bytes((data[3] ^ 0x10,)) + bytes(data[4:])
        super().send_message(can_id, data, remote)


@pytest.mark.parametrize("size", [1, 6, 7, 8, 127 * 7 - 1, 127 * 7, 127 * 7 + 1, len(DATA), 60000])
@pytest.mark.parametrize("checked", [True, False])
def test_foreign_client_both_ways(size: int, checked: bool) -> None:
    one, node = client()
    data = (DATA * 30)[:size]
    with node.sdo.open(FILE, 0, "wb", size=size, block_transfer=True, request_crc_support=checked) as stream:
        stream.write(data)
    assert one.od[FILE].encode() == data
    with node.sdo.open(FILE, 0, "rb", block_transfer=True, request_crc_support=checked) as stream:
        assert stream.read() == data


@pytest.mark.parametrize("lost", [(5,), (40, 41), (60,), (128, 129)])
def test_foreign_client_sends_again_what_was_lost(lost: tuple[int, ...]) -> None:
    """Frames of the client: 1 opens the transfer, 2..128 are the first sub-block, whose last is 128."""
    one, node = client(drop=tuple(number for number in lost if number != 128))
    with node.sdo.open(FILE, 0, "wb", size=len(DATA), block_transfer=True) as stream:
        stream.write(DATA)
    assert one.od[FILE].encode() == DATA


def test_foreign_client_is_told_of_a_spoilt_segment() -> None:
    one, node = client(spoil=9)
    stream = node.sdo.open(FILE, 0, "wb", size=len(DATA), block_transfer=True)
    stream.write(DATA)
    with pytest.raises(canopen.SdoAbortedError) as abort:
        stream.close()
    assert abort.value.code == 0x05040004
    assert one.od[FILE].value == ""


def test_foreign_client_asks_again_for_what_it_missed() -> None:
    """The 20th segment of the server is lost on the wire."""
    one, node = client()
    one.od[FILE].value = DATA.decode("latin-1")
    assert one.master is not None
    deliver = one.master.notify
    sent: list[bytearray] = []

    def lossy(can_id: int, data: bytearray, timestamp: float) -> None:
        sent.append(data)
        if len(sent) != 21:
            deliver(can_id, data, timestamp)

    one.master.notify = lossy  # type: ignore[method-assign]
    with node.sdo.open(FILE, 0, "rb", block_transfer=True) as stream:
        assert stream.read() == DATA


# -- any data, any blocks, any losses -----------------------------------------------------------------------------------

LOSSES = st.lists(st.booleans(), max_size=60)
"""Which segments are lost, in the order in which they are sent; after these none is."""


def segments(data: bytes) -> list[bytes]:
    """Of seven bytes, the last of as many as are left; one that is empty for no data."""
    return [data[at : at + 7] for at in range(0, len(data), 7)] or [b""]


def end_of(data: bytes) -> bytes:
    """The frame that ends a block transfer: bytes of the last segment that are no data, and the CRC of all."""
    unused = 7 - len(segments(data)[-1])
    return bytes((0xC1 | unused << 2,)) + crc_hqx(data, 0).to_bytes(2, "little") + bytes(5)


@settings(deadline=None)
@given(data=st.binary(min_size=1, max_size=3000), losses=LOSSES)
def test_any_data_are_downloaded_whatever_is_lost(data: bytes, losses: list[bool]) -> None:
    """A client by the standard: after each sub-block it goes on behind what the server has in order (ackseq)."""
    one, lost = bench(), chain(losses, repeat(False))
    (answer,) = ask(one, bytes.fromhex("C6 01 2F 00") + len(data).to_bytes(4, "little"))
    size, left = bytes.fromhex(answer)[4], segments(data)
    while left:
        block = left[:size]
        for number, part in enumerate(block, start=1):
            ends_the_block = number == len(block)  # its loss would have to be noticed by time
            if ends_the_block or not next(lost):
                answers = ask(one, segment(number, part, last=ends_the_block and len(block) == len(left)))
        (answer,) = answers
        told = bytes.fromhex(answer)
        assert told[0] == 0xA2
        left, size = left[told[1] :], told[2]
    assert ask(one, end_of(data)) == ["A1 00 00 00 00 00 00 00"]
    assert one.od[FILE].encode() == data


@settings(deadline=None)
@given(data=st.binary(max_size=3000), losses=LOSSES, sizes=st.lists(st.integers(1, 127), min_size=1, max_size=10))
def test_any_data_are_uploaded_whatever_is_lost(data: bytes, losses: list[bool], sizes: list[int]) -> None:
    """A client that asks for another size of each sub-block, and confirms what it has in order."""
    one, lost, blocks = bench(), chain(losses, repeat(False)), chain(sizes, repeat(sizes[-1]))
    one.od[FILE].value = data.decode("latin-1")
    ask(one, bytes.fromhex("A4 01 2F 00") + bytes((next(blocks), 0, 0, 0)))
    answers, received = ask(one, "A3 00 00 00 00 00 00 00"), b""
    while True:
        in_order, ended = _in_order(answers, lost)
        received += b"".join(in_order)
        answers = ask(one, bytes((0xA2, len(in_order), next(blocks))) + bytes(5))
        if ended:
            break
    assert answers == [end_of(data).hex(" ").upper()]
    assert received[: len(data)] == data
    assert len(received) == 7 * len(segments(data))
    assert ask(one, "A1 00 00 00 00 00 00 00") == []


def _in_order(answers: list[str], lost: Iterator[bool]) -> tuple[list[bytes], bool]:
    """The segments of a sub-block up to the first that is lost, and whether the last of all is among them."""
    kept: list[bytes] = []
    for number, answer in enumerate(answers, start=1):
        frame = bytes.fromhex(answer)
        assert frame[0] & 0x7F == number
        if next(lost):
            return kept, False
        kept.append(frame[1:])
        if frame[0] & 0x80:
            return kept, True
    return kept, False
