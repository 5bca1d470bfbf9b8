"""oze-canopen (Rust) as the tests use it: tests/interoperability/rust/src/bin/oze.rs, which `install-foreign` builds."""

from __future__ import annotations

import subprocess

from foreign import installed
from processes import PATIENCE

REPEATS = 5
"""It waits 20 ms for an SDO response and asks three times, whatever the machine is busy with: it may be asked again."""


def oze(node: int, *words: object) -> str:
    """What a command to a node printed."""
    told = [installed("rust/debug/oze"), "vcan0", f"{node:x}", *words]
    for _ in range(REPEATS):
        command = [str(word) for word in told]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=True)
        answer = done.stdout.splitlines()[-1]
        if "Timeout" not in answer and "Retry" not in answer:
            break
    return answer


def read(node: int, index: int, subindex: int = 0) -> bytes:
    return bytes.fromhex(oze(node, "read", f"{index:x}", f"{subindex:x}"))


def write(node: int, index: int, data: bytes, subindex: int = 0) -> str:
    return oze(node, "write", f"{index:x}", f"{subindex:x}", data.hex())
