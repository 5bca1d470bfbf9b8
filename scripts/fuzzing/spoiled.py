"""Files spoiled as disks, editors and strangers spoil them: bytes and lines moved, numbers and words made absurd."""

from __future__ import annotations

import re
from random import Random

DIGITS = b"9" * 5000
BYTES = (
    *(b"\0", b"\xff", b"\x1b[2J", b"\r", b"\n", b"\xef\xbb\xbf", b"\xc3", b"\xe2\x80\xae", b'"', b"'", b","),
    *(b"[" * 3000, b" " * 5000),
)
NUMBERS = (
    *(b"0", b"-1", b"1e308", b"-1e308", b"1e-320", b"NaN", b"Infinity", b"-inf", b"1e999", b"0x" + b"f" * 5000),
    *(DIGITS, b"-" + DIGITS, b"4294967295", b"-2147483648", b"9223372036854775808", b"0.1", b"1,5", b"1_000"),
    *(b"12:30:00", b"2026-13-45"),
)
WORDS = (
    *(b"null", b"true", b"[]", b"{}", b'""', b"[1]", b'{"a": 1}', b"~", b"&a [*a]", b"!!bool x", b"!!timestamp x"),
    *(b"*a", b"$NODEID", b"x" * 5000, b"\\u0000", b"\\ud800", b"<<: {}", b"? [a]"),
)
_NUMBER = re.compile(rb"(?<![\w.])-?(?:0x[0-9a-fA-F]+|\d[\d.]*(?:[eE][-+]?\d+)?)(?![\w.])")
_HEXADECIMAL = re.compile(rb'"((?:[0-9a-f]{2})+)"')
_WORD = re.compile(rb'"[^"\n]*"|[A-Za-z_][\w./-]*')


def spoiled(data: bytes, dice: Random, *, text: bool) -> bytes:
    """`data` spoiled in one to three ways; what is `text` also by its numbers, words and lines."""
    ways = [_flip, _overwrite, _cut, _repeat, _truncate, _swap]
    ways += [*[_number] * 10, *[_word] * 6, *[_hexadecimal] * 4, _line, _line, _insert, _insert] if text else [_length, _length]
    for _ in range(dice.choice((1, 1, 2, 3))):
        data = dice.choice(ways)(data, dice)
    return data


def _span(data: bytes, dice: Random) -> tuple[int, int]:
    """A stretch, mostly a short one."""
    start = dice.randrange(len(data) + 1)
    return start, min(len(data), start + dice.choice((1, 2, 4, 8, 64, 1000)))


def _flip(data: bytes, dice: Random) -> bytes:
    spoilt = bytearray(data)
    for _ in range(dice.choice((1, 1, 4, 16))):
        if spoilt:
            spoilt[dice.randrange(len(spoilt))] ^= 1 << dice.randrange(8)
    return bytes(spoilt)


def _overwrite(data: bytes, dice: Random) -> bytes:
    start, end = _span(data, dice)
    return data[:start] + dice.choice((b"\0", b"\xff", b"\x7f", b"\x80", b"A"))[:1] * (end - start) + data[end:]


def _length(data: bytes, dice: Random) -> bytes:
    """Four bytes that may be a length or an offset."""
    start = dice.randrange(max(1, len(data) - 4)) & ~3
    number = dice.choice((0, 1, 0x7FFFFFFF, 0xFFFFFFFF, 0x80000000, 0x00100000, len(data), dice.randrange(256)))
    return data[:start] + number.to_bytes(4, dice.choice(("little", "big"))) + data[start + 4 :]


def _cut(data: bytes, dice: Random) -> bytes:
    start, end = _span(data, dice)
    return data[:start] + data[end:]


def _repeat(data: bytes, dice: Random) -> bytes:
    start, end = _span(data, dice)
    return data[:start] + data[start:end] * dice.choice((2, 3, 50)) + data[end:]


def _truncate(data: bytes, dice: Random) -> bytes:
    return data[: dice.randrange(len(data) + 1)]


def _swap(data: bytes, dice: Random) -> bytes:
    (a, b), (c, d) = sorted((_span(data, dice), _span(data, dice)))
    return data if b > c else data[:a] + data[c:d] + data[b:c] + data[a:b] + data[d:]


def _insert(data: bytes, dice: Random) -> bytes:
    place = dice.randrange(len(data) + 1)
    return data[:place] + dice.choice(BYTES) + data[place:]


def _line(data: bytes, dice: Random) -> bytes:
    lines = data.split(b"\n")
    which, other = dice.randrange(len(lines)), dice.randrange(len(lines))
    match dice.randrange(3):
        case 0:
            del lines[which]
        case 1:
            lines.insert(other, lines[which])
        case _:
            lines[which], lines[other] = lines[other], lines[which]
    return b"\n".join(lines)


def _number(data: bytes, dice: Random) -> bytes:
    """Some number made absurd, or another one of any size."""
    other = f"{dice.uniform(-1.0, 1.0) * 10.0 ** dice.randint(-12, 12):g}", str(dice.randrange(-(1 << 31), 1 << 32))
    return _replaced(_NUMBER, data, dice, dice.choice((NUMBERS, tuple(text.encode() for text in other))))


def _word(data: bytes, dice: Random) -> bytes:
    return _replaced(_WORD, data, dice, WORDS + NUMBERS)


def _hexadecimal(data: bytes, dice: Random) -> bytes:
    """A value written in hexadecimal digits, as another of the same length."""
    found = list(_HEXADECIMAL.finditer(data))
    if not found:
        return data
    match = dice.choice(found)
    length = len(match[1]) // 2
    value = dice.choice((bytes(length), b"\xff" * length, b"\xff" * (length - 1) + b"\x7f", dice.randbytes(length)))
    return data[: match.start(1)] + value.hex().encode() + data[match.end(1) :]


def _replaced(pattern: re.Pattern[bytes], data: bytes, dice: Random, values: tuple[bytes, ...]) -> bytes:
    found = list(pattern.finditer(data[:200_000]))
    if not found:
        return data
    match = dice.choice(found)
    return data[: match.start()] + dice.choice(values) + data[match.end() :]
