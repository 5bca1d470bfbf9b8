"""Every bus.log below some folders as Wireshark reads it, for `make tshark`: no frame malformed, none lost, each its service.

The function code and node-ID that tshark's CANopen dissector finds have to be those of the identifier in the log
(CiA 301, 7.3.5).
Prints a line a log that is not read so, then how many were; ends with 1 where one was not.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

FIELDS = ("frame.number", "_ws.malformed", "can.id", "canopen.function_code", "canopen.node_id")
SHOWN = 5
"""Frames of a log that are printed."""

LARGEST = 0x7FF
"""Identifier that CANopen has; others, error frames among them, are not read as CANopen."""


@dataclass(frozen=True)
class Read:
    """A log: how many frames it has, and what tshark says otherwise than the log."""

    frames: int
    wrong: tuple[str, ...]


def read(log: Path) -> Read:
    """A candump log as tshark reads it. Raises RuntimeError where it reads none of it."""
    written = [int(line.split()[2].partition("#")[0], 16) for line in log.read_text(encoding="ascii").splitlines()]
    command = ["tshark", "-r", str(log), "-d", "can.subdissector,canopen", "-T", "fields", "-E", "occurrence=f"]
    done = subprocess.run(
        [*command, *(part for name in FIELDS for part in ("-e", name))], capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise RuntimeError(f"{log}: {done.stderr.strip()}")
    return Read(len(written), tuple(_wrong(written, done.stdout.splitlines())))


def _wrong(written: list[int], told: list[str]) -> Iterator[str]:
    if len(told) != len(written):
        yield f"{len(told)} frames, where the log has {len(written)}"
        return
    for identifier, row in zip(written, told, strict=True):
        number, malformed, *numbers = row.split("\t")
        if malformed:
            yield f"frame {number} ({identifier:03X}h) is malformed"
        elif identifier <= LARGEST and (seen := [int(cell, 0) if cell else None for cell in numbers]) != _meant(identifier):
            yield f"frame {number} is {identifier:03X}h, and was read as {seen}"


def _meant(identifier: int) -> list[int | None]:
    """Identifier, function code and node-ID of a frame of CANopen."""
    return [identifier, identifier >> 7, identifier & 0x7F]


def main() -> int:
    """All logs below the folders."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path)
    logs = sorted(log for folder in parser.parse_args().folders for log in folder.rglob("bus.log"))
    if not logs:
        parser.error("no bus.log there")
    found = {log: read(log) for log in logs}
    for log, one in found.items():
        for text in one.wrong[:SHOWN]:
            print(f"{log}: {text}")
        if len(one.wrong) > SHOWN:
            print(f"{log}: {len(one.wrong) - SHOWN} more")
    good = sum(not one.wrong for one in found.values())
    print(f"{good} of {len(logs)} logs, {sum(one.frames for one in found.values())} frames, read as they were meant")
    return 0 if good == len(logs) else 1


if __name__ == "__main__":
    sys.exit(main())
