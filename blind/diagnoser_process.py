"""A worker's diagnosing process: started with an environment and a folder that tell nothing, asked in JSON lines."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import tempfile
import threading
from dataclasses import asdict
from functools import cache
from pathlib import Path

from drivetwin.blind.serving import DiagnoseRequest, PredictRequest
from drivetwin.foundation.errors import UserError

DIAGNOSER = (sys.executable, "-P", "-m", "drivetwin.blind.diagnoser")

PATIENCE = 1800.0
"""Longest that an answer may take [s]: a diagnosis without an end must not stop the others."""

_PASSED_ON = ("PATH", "HOME", "LANG", "LC_ALL", "TMPDIR")
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
_LAST_WORDS = 2000
"""Characters of a dead process's stderr that are passed on."""


def refuse_other_code(installed: Path) -> None:
    """Raises UserError where the diagnosing process would import another drivetwin than the one at `installed`, whose code is
    hashed: a command that is started in a checkout runs from there, the process from what is installed.
    """
    asked = (sys.executable, "-P", "-c", "from drivetwin.foundation.files import INSTALLED; print(INSTALLED)")
    told = subprocess.run(asked, cwd=os.sep, env=_environment(), capture_output=True, text=True, check=True)
    other = Path(told.stdout.strip())
    if other != installed:
        raise UserError(
            f"this command runs from {installed}, its diagnosing process would run from {other}: install the first (pip "
            "install --editable), or start the command outside the checkout"
        )


class DiagnoserProcess:
    """One diagnosing process, started when it is first asked, and again where it died; `patience` [s] with an answer."""

    def __init__(self, command: tuple[str, ...], patience: float = PATIENCE) -> None:
        self._command, self._patience = command, patience
        self._process: subprocess.Popen[str] | None = None
        self._turn = threading.Lock()
        self._stderr = tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115 (lives as long as this)

    def ask(self, request: DiagnoseRequest | PredictRequest) -> str | None:
        """Wait for the answer: None where the request was done, else why not."""
        with self._turn:
            process = self._running()
            assert process.stdin is not None
            assert process.stdout is not None
            with contextlib.suppress(BrokenPipeError):  # it died before it read: the missing answer says so
                process.stdin.write(json.dumps(asdict(request)) + "\n")
                process.stdin.flush()
            alarm = threading.Timer(self._patience, process.kill)
            alarm.start()
            answer = process.stdout.readline()
            alarm.cancel()
            if not answer:
                return self._death(process)
            failed: str | None = json.loads(answer)["failed"]
            return failed

    def _running(self) -> subprocess.Popen[str]:
        if self._process is None:
            self._process = subprocess.Popen(
                self._command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._stderr,
                cwd=os.sep,
                env={**_environment(), **_ONE_THREAD},
                text=True,
            )
        return self._process

    def _death(self, process: subprocess.Popen[str]) -> str:
        """What to say of a process that ended without an answer; the next request starts another."""
        for pipe in (process.stdin, process.stdout):
            assert pipe is not None
            with contextlib.suppress(BrokenPipeError):
                pipe.close()
        status = process.wait()
        self._process = None
        self._stderr.seek(0)
        words = self._stderr.read()[-_LAST_WORDS:].strip()
        return f"the diagnosing process ended with status {status} without an answer; its last words: {words or 'none'}"


def _environment() -> dict[str, str]:
    """What the process knows of this one's environment."""
    return {name: os.environ[name] for name in _PASSED_ON if name in os.environ}


@cache
def diagnoser_process(command: tuple[str, ...]) -> DiagnoserProcess:
    """The one diagnosing process of this worker for `command`; it ends when the worker does."""
    return DiagnoserProcess(command)

