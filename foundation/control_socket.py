"""A client's request to an emulator's control socket: one JSON object per line (docs/faults.md)."""

from __future__ import annotations

import json
import socket
from pathlib import Path
from typing import Any

from drivetwin.foundation.errors import UserError

PATIENCE = 10.0
"""Longest wait for an answer [s]."""

LONGEST_ANSWER = 1 << 20


def ask_control(path: Path, request: dict[str, object]) -> dict[str, Any]:
    """The emulator's answer. Raises UserError with its reason, or where it does not answer."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
        connection.settimeout(PATIENCE)
        try:
            connection.connect(str(path))
            connection.sendall(json.dumps(request).encode() + b"\n")
            with connection.makefile("rb") as lines:
                line = lines.readline(LONGEST_ANSWER)
        except OSError as error:
            raise UserError(
                f"no emulator answers at {path} ({error.strerror or error}); start one with: drivetwin emulate --control {path}"
            ) from None
    if not line:
        raise UserError(f"the emulator at {path} has gone without an answer")
    answer: dict[str, Any] = json.loads(line)
    if "error" in answer:
        raise UserError(str(answer["error"]))
    return answer
