"""Bits of a frame, against a long division and a stuffing by string, can-utils' own count, and the published bounds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.bus.timing.frame_bits import Frame, all_frame_bits, crc, frame_bits

GENERATOR = 0b1100010110011001
"""x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1 (CAN 2.0, part A, 3.1.1)."""

data_frames = st.builds(Frame, st.integers(0, 0x7FF), st.binary(max_size=8))
long_runs = st.lists(st.sampled_from([0x00, 0xFF, 0x0F, 0xF0, 0x1F, 0xE0, 0x3C, 0x87]), max_size=8).map(bytes)
stuffed_frames = st.builds(Frame, st.sampled_from([0x000, 0x078, 0x080, 0x783, 0x7FF]), long_runs)
remote_frames = st.builds(Frame, st.integers(0, 0x7FF), requested=st.integers(0, 8))
frames = st.one_of(data_frames, stuffed_frames, remote_frames)


def remainder(dividend: int) -> int:
    """Of the dividend times x^15, by long division over GF(2)."""
    dividend <<= 15
    while dividend.bit_length() > 15:
        dividend ^= GENERATOR << dividend.bit_length() - 16
    return dividend


def before_crc(frame: Frame) -> str:
    """Start of frame to the last data bit, as a string of 0 and 1."""
    remote = frame.requested is not None
    length = frame.requested if frame.requested is not None else len(frame.data)
    return f"0{frame.identifier:011b}{remote:b}00{length:04b}" + "".join(f"{byte:08b}" for byte in frame.data)


def on_the_wire(frame: Frame) -> str:
    """Every bit from start of frame to intermission."""
    bits = before_crc(frame)
    bits += f"{remainder(int(bits, 2)):015b}"
    sent = ""
    for bit in bits:
        sent += bit
        if sent.endswith("00000"):
            sent += "1"
        elif sent.endswith("11111"):
            sent += "0"
    return sent + "1" + "01" + "1111111" + "111"


def test_the_reference_has_the_published_check_value() -> None:
    assert remainder(int.from_bytes(b"123456789", "big")) == 0x059E  # CRC-15/CAN in the catalogue of parametrised CRCs


@given(frames)
def test_crc_is_the_remainder_of_a_long_division(frame: Frame) -> None:
    assert crc(frame) == remainder(int(before_crc(frame), 2))


@given(frames)
def test_bits_are_those_of_the_frame_written_out(frame: Frame) -> None:
    assert frame_bits(frame) == len(on_the_wire(frame))


def test_bits_of_every_frame_without_data() -> None:
    counts = {identifier: frame_bits(Frame(identifier)) for identifier in range(0x800)}
    assert counts == {identifier: len(on_the_wire(Frame(identifier))) for identifier in range(0x800)}


@pytest.mark.parametrize(
    ("identifier", "data", "bits"),
    [
        (0x080, "", 51),
        (0x7FF, "", 50),
        (0x000, "8201", 69),
        (0x181, "5002", 68),
        (0x701, "00", 59),
        (0x701, "05", 58),
        (0x281, "ffffffff6de2e43b", 119),
        (0x601, "4000100000000000", 124),
        (0x581, "4300100092010200", 120),
        (0x203, "0f001122334455e7", 115),
        (0x555, "5555555555555555", 112),
        (0x000, "0000000000000000", 127),
        (0x7FF, "ffffffffffffffff", 126),
        (0x078, "3c3c3c3c3c3c3c3c", 131),
    ],
)
def test_bits_are_those_that_can_utils_counts(identifier: int, data: str, bits: int) -> None:
    """`can_frame_length(..., CFL_EXACT, ...)` of linux-can/can-utils at 95aae6b, which canbusload -e shows."""
    assert frame_bits(Frame(identifier, bytes.fromhex(data))) == bits


@given(st.one_of(data_frames, stuffed_frames))
def test_bits_lie_between_the_published_best_and_worst_case(frame: Frame) -> None:
    """Davis, Burns, Bril, Lukkien 2007: 55 + 10 s at most, and what is never stuffed alone at least."""
    size = len(frame.data)
    assert 47 + 8 * size <= frame_bits(frame) <= 55 + 10 * size


@given(remote_frames)
def test_a_remote_frame_carries_no_data(frame: Frame) -> None:
    assert 47 <= frame_bits(frame) <= 55


@pytest.mark.parametrize(
    ("identifier", "data", "requested", "expected"),
    [
        (0x800, b"", None, "800h"),
        (-1, b"", None, "-1h"),
        (0x181, bytes(9), None, "181h has more than 8 bytes"),
        (0x181, b"", 9, "181h has more than 8 bytes"),
        (0x181, b"", -1, "181h has more than 8 bytes"),
        (0x701, b"\0", 1, "701h is a remote frame with data"),
    ],
)
def test_what_is_no_classic_frame_is_refused(identifier: int, data: bytes, requested: int | None, expected: str) -> None:
    with pytest.raises(ValueError, match=expected):
        Frame(identifier, data, requested)


@given(st.lists(frames, max_size=20))
def test_many_at_once_have_the_bits_of_each(many: list[Frame]) -> None:
    data = np.zeros((len(many), 8), np.uint8)
    for row, frame in zip(data, many, strict=True):
        row[: len(frame.data)] = list(frame.data)
    bits = all_frame_bits(
        np.array([frame.identifier for frame in many], np.uint32),
        np.array([frame.length_code for frame in many], np.uint8),
        data,
        np.array([frame.requested is not None for frame in many], np.bool_),
    )
    assert bits.tolist() == [len(on_the_wire(frame)) for frame in many]
