"""MCAP read by its specification alone (mcap.dev/spec): records behind magic bytes, chunks of records, no library of MCAP."""

from __future__ import annotations

import json
import struct
import zlib
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import zstandard

MAGIC = b"\x89MCAP0\r\n"
SCHEMA, CHANNEL, MESSAGE, CHUNK = 0x03, 0x04, 0x05, 0x06


def messages_of(path: Path) -> dict[str, list[dict[str, Any]]]:
    """The messages of each topic in their order, with their log time [ns] as `log_time`."""
    topics: dict[int, str] = {}
    schemas: dict[int, str] = {}
    found: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for kind, body in _records(_body(path)):
        if kind == SCHEMA:
            schemas[_u16(body, 0)] = _text(body, 2)[0]
        elif kind == CHANNEL:
            topic, rest = _text(body, 4)
            encoding, _ = _text(body, rest)
            assert encoding == "json"
            assert _u16(body, 2) in schemas
            topics[_u16(body, 0)] = topic
        elif kind == MESSAGE:
            channel, _, log_time = struct.unpack_from("<HIQ", body)
            found[topics[channel]].append({"log_time": log_time} | json.loads(body[22:]))
    return found


def _body(path: Path) -> bytes:
    whole = path.read_bytes()
    assert whole.startswith(MAGIC)
    assert whole.endswith(MAGIC)
    return whole[len(MAGIC) : -len(MAGIC)]


def _records(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Opcode and content of each record, those of a chunk in its place."""
    at = 0
    while at < len(data):
        kind, length = struct.unpack_from("<BQ", data, at)
        body = data[at + 9 : at + 9 + length]
        at += 9 + length
        if kind == CHUNK:
            yield from _records(_unpacked(body))
        else:
            yield kind, body


def _unpacked(chunk: bytes) -> bytes:
    _, _, size, checksum = struct.unpack_from("<QQQI", chunk)
    compression, at = _text(chunk, 28)
    packed = chunk[at + 8 :]
    plain = zstandard.ZstdDecompressor().decompress(packed, size) if compression == "zstd" else packed
    assert len(plain) == size
    assert zlib.crc32(plain) == checksum
    return plain


def _u16(data: bytes, at: int) -> int:
    return int.from_bytes(data[at : at + 2], "little")


def _text(data: bytes, at: int) -> tuple[str, int]:
    length = int.from_bytes(data[at : at + 4], "little")
    return data[at + 4 : at + 4 + length].decode(), at + 4 + length
