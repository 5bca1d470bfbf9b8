"""How a diagnosing process is asked: requests come as JSON lines on stdin, answers go as JSON lines to stdout."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import sys
import threading
import traceback
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol, TextIO

from drivetwin.blind.sight import restrict_sight


class Diagnosis(Protocol):
    """What is tested. Paths are relative to the case's folder, which is the working directory."""

    def diagnose(self, model: Path, training: Sequence[Path], validation: Sequence[Path], out: Path) -> None:
        """Write OUT/report.json and OUT/prediction/NAME.parquet (contract gap-report/1)."""

    def predict(self, model: Path, report: Path, recording: Path, out: Path) -> None:
        """Write OUT/NAME.parquet: what the model predicts for a recording, without and with the report's first cause."""


@dataclass(frozen=True)
class DiagnoseRequest:
    """`drivetwin diagnose MODEL TRAINING... --validate VALIDATION... --out OUT` in the folder `directory`."""

    directory: str
    model: str
    training: tuple[str, ...]
    validation: tuple[str, ...]
    out: str
    do: Literal["diagnose"] = "diagnose"


@dataclass(frozen=True)
class PredictRequest:
    """What `model` with the first cause of `report` predicts for `recording`, in the folder `directory`."""

    directory: str
    model: str
    report: str
    recording: str
    out: str
    do: Literal["predict"] = "predict"


def serve(diagnosis: Diagnosis, requests: TextIO, answers: TextIO) -> None:
    """Answer {"failed": null} or {"failed": "why"} to each request; the process ends at once where `requests` ends.

    What a diagnosis prints goes to stderr, so that stdout holds answers only.
    """
    waiting: queue.Queue[str] = queue.Queue()
    threading.Thread(target=_receive, args=(requests, waiting), daemon=True).start()
    restrict_sight()
    while True:
        with contextlib.redirect_stdout(sys.stderr):
            failed = _answer(diagnosis, waiting.get())
        print(json.dumps({"failed": failed}), file=answers, flush=True)


def _receive(requests: TextIO, waiting: queue.Queue[str]) -> None:
    """Hand on each line; whoever asked is gone where there are no more, so that nothing is left to do."""
    for line in requests:
        waiting.put(line)
    os._exit(0)


def _answer(diagnosis: Diagnosis, line: str) -> str | None:
    request = json.loads(line)
    try:
        os.chdir(request["directory"])
        if request["do"] == "predict":
            parsed = PredictRequest(**request)
            diagnosis.predict(Path(parsed.model), Path(parsed.report), Path(parsed.recording), Path(parsed.out))
        else:
            asked = DiagnoseRequest(**request)
            training, validation = [Path(name) for name in asked.training], [Path(name) for name in asked.validation]
            diagnosis.diagnose(Path(asked.model), training, validation, Path(asked.out))
    except Exception as error:  # noqa: BLE001 (whatever a diagnosis raises is its answer to this case, and counts against it)
        traceback.print_exc()
        return f"{type(error).__name__}: {error}"
    return None
