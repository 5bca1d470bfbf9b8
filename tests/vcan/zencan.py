"""zencan-cli and zencandump (Rust) as the tests use them: what they print."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path

from foreign import installed
from processes import PATIENCE

REPEATS = 5
"""zencan waits 150 ms for an SDO response and 50 ms for an LSS one, whatever the machine is busy with: it may ask again."""


def zencan(command: str) -> str:
    """What `zencan-cli -c COMMAND` prints."""
    for _ in range(REPEATS):
        done = subprocess.run(
            [installed("bin/zencan-cli"), "-c", command, "vcan0"], capture_output=True, text=True, timeout=PATIENCE, check=True
        )
        if "Time" not in done.stdout:
            break
    return done.stdout


def value(node: int, address: str, data_type: str) -> str:
    return zencan(f"read {node} {address} {data_type}").removeprefix("Value: ").removesuffix("\n")


class Dump:
    """zencandump, which prints every message with the meaning that it has in CANopen."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._skip = 0

    def __enter__(self) -> Dump:
        with self._path.open("w") as out:
            self._process = subprocess.Popen([installed("bin/zencandump"), "vcan0"], stdout=out)
        while not self._path.stat().st_size:  # it does not say when it listens
            zencan("read 1 0x1000 0")
            assert self._process.poll() is None
        return self

    def __exit__(self, *exc_info: object) -> None:
        self._process.kill()
        self._process.wait()

    def seen(self) -> str:
        """What it has printed since `forget`."""
        return self._path.read_text()[self._skip :]

    def forget(self) -> None:
        self._skip += len(self.seen())

    def until(self, text: str) -> None:
        deadline = time.monotonic() + PATIENCE
        while text not in self.seen():
            assert time.monotonic() < deadline, f"no {text!r} in:\n{self.seen()}"
            time.sleep(0.01)
