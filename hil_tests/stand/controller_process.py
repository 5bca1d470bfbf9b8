"""The controller as a process in a process group of its own: started, watched, and ended with all its children."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from types import TracebackType

from drivetwin.foundation.children import end_with_parent
from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.bench import Bench

GRACE: Mapping[str, float] = {"virtual": 2.0, "real": 10.0}
"""Between asking a controller to end and ending it [s], by what the bench's drives are: whoever still brings real axes to rest
is let do so."""

ORPHANED: Mapping[str, int] = {"virtual": signal.SIGKILL, "real": signal.SIGTERM}
"""What a controller is sent where the stand itself is killed: with real drives it is asked to bring the axes to rest."""

EXITING = 0.5
"""How long the kernel may take to remove the processes of a group that was killed [s]."""

LAST_LINES = 5


class ControllerProcess:
    """A running controller, whose stdout and stderr go to `log`. At the end of the block nothing of its group is left."""

    def __init__(
        self,
        command: list[str],
        folder: Path,
        log: Path,
        grace: float = GRACE["virtual"],
        meanwhile: Callable[[float], None] = time.sleep,
        orphaned: int = ORPHANED["virtual"],
    ) -> None:
        """Start it in `folder`; it has `grace` [s] to end once it is asked to, and `meanwhile` passes seconds until then.

        Where this process is killed it is sent the signal `orphaned`.

        Raises OSError where it cannot be started.
        """
        self._log, self._grace, self._meanwhile = log, grace, meanwhile
        environment = {**os.environ, "OMP_NUM_THREADS": os.environ.get("OMP_NUM_THREADS", "1")}
        with log.open("ab") as stream:
            self._from = stream.tell()
            self._process = subprocess.Popen(
                command,
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=stream,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                preexec_fn=partial(end_with_parent, os.getpid(), orphaned),  # noqa: PLW1509  # one call into C, no lock
                env=environment,
            )

    def __enter__(self) -> ControllerProcess:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None) -> None:
        self.end()

    def status(self) -> int | None:
        """Its exit status, None while it lives; negative where a signal ended it."""
        return self._process.poll()

    def kill(self) -> None:
        """Let it die at once, with all that it started."""
        self._signal(signal.SIGKILL)
        self._process.wait()

    def end(self) -> bool:
        """End what is left of its group, and whether anything was left after it had exited by itself."""
        left = self.status() is not None and self._alive(EXITING)
        if left or self.status() is None:
            self._signal(signal.SIGTERM)
            if self._alive(self._grace):
                self._signal(signal.SIGKILL)
        self._process.wait()
        return left

    def last_words(self) -> str:
        """The last lines that it wrote."""
        with self._log.open("rb") as stream:
            stream.seek(self._from)
            lines = stream.read().decode(errors="replace").strip().splitlines()
        return "\n".join(lines[-LAST_LINES:])

    def _alive(self, seconds: float) -> bool:
        """Whether a process of its group lives on for so long: it, or one that it started and that stops axes in its place."""
        deadline = time.monotonic() + seconds
        while self.status() is None or self._signal(0):
            if time.monotonic() > deadline:
                return True
            self._meanwhile(0.01)
        return False

    def _signal(self, number: int) -> bool:
        """Send a signal to the group; whether there is one."""
        try:
            os.killpg(self._process.pid, number)
        except (ProcessLookupError, PermissionError):
            return False
        return True


def command_line(bench: Bench, places: Mapping[str, str]) -> list[str]:
    """The controller's command with `places` filled in; a program is looked for beside this Python, then on the path.

    Raises UserError for a place that is not known, and for a program that is not there.
    """
    known = {"python": sys.executable, "bench": str(bench.path.parent), **places}
    if bench.limits_path is not None:
        known["limits"] = str(bench.limits_path)
    try:
        filled = [part.format_map(known) for part in bench.controller.command]
    except (KeyError, ValueError, IndexError) as error:
        names = ", ".join(f"{{{name}}}" for name in known)
        raise UserError(f"{bench.path}: controller.command: {error} is nothing to fill in; there are {names}") from None
    search = os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)))
    program = filled[0] if os.sep not in filled[0] else str(bench.path.parent / filled[0])
    found = shutil.which(program, path=search)
    if found is None:
        raise UserError(f"{bench.path}: controller.command: there is no program {filled[0]!r} to start")
    return [found, *filled[1:]]
