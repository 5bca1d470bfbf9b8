"""The truth of all cases: sealed before anything moves, its hash told, and opened when every diagnosis is done."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from drivetwin.blind.case import Case
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import new_file

SCHEMA = "blind-key/1"
KEY, COMMITMENT = "key.json", "key.sha256"


@dataclass(frozen=True)
class Key:
    """The truth as the bytes of the future key.json, and their SHA-256 (hex), which commits to them."""

    content: bytes
    commitment: str


def seal(cases: Sequence[Case], seed: int) -> Key:
    """The key of `cases`: canonical JSON (sorted keys, no blanks) with a nonce from `seed`, and the hash that commits to it."""
    nonce = hashlib.sha256(f"drivetwin blind nonce {seed}".encode()).hexdigest()
    truth = {"schema": SCHEMA, "seed": seed, "nonce": nonce, "cases": [asdict(case) for case in cases]}
    text = json.dumps(truth, sort_keys=True, separators=(",", ":"), ensure_ascii=True, allow_nan=False)
    content = f"{text}\n".encode()
    return Key(content, hashlib.sha256(content).hexdigest())


def commit(key: Key, directory: Path) -> None:
    """Write DIRECTORY/key.sha256, as `sha256sum --check` reads it; a key that an earlier run opened there goes."""
    (directory / KEY).unlink(missing_ok=True)
    with new_file(directory / COMMITMENT) as part:
        part.write_text(f"{key.commitment}  {KEY}\n", encoding="ascii")


def open_key(key: Key, directory: Path) -> None:
    """Write DIRECTORY/key.json; raises UserError where it is not what DIRECTORY/key.sha256 committed to."""
    committed = (directory / COMMITMENT).read_text(encoding="ascii").split()[0]
    opened = hashlib.sha256(key.content).hexdigest()
    if opened != committed:
        raise UserError(
            f"{directory / COMMITMENT} commits to {committed}, but the key hashes to {opened}: one of them was changed during "
            "the run; the answers cannot be scored, run again into an empty --out"
        )
    with new_file(directory / KEY) as part:
        part.write_bytes(key.content)
