"""What a worker does with one case: record it, have it diagnosed where the truth is not, hand back what was answered."""

from __future__ import annotations

import io
import json
import shutil
import tarfile
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from distributed import get_worker

from drivetwin.blind.alike import Material, alike_payload, checked, untried
from drivetwin.blind.answer import FAILED, FRESH, REPORT
from drivetwin.blind.case import Case
from drivetwin.blind.claims import Claim
from drivetwin.blind.diagnoser_process import DIAGNOSER, DiagnoserProcess, diagnoser_process
from drivetwin.blind.duration import Seconds, write_seconds
from drivetwin.blind.record import record_case
from drivetwin.blind.serving import DiagnoseRequest, PredictRequest
from drivetwin.emulator.effects import EffectFile, add_effects
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import write_json

Recorder = Callable[[Case, Path], None]
"""Writes model.xml, model_off.xml and the recordings of a case into a folder, and nothing of its truth."""

MODELS = {"exact": "model.xml", "off": "model_off.xml"}
SECONDS = "seconds.json"


@dataclass(frozen=True)
class Layout:
    """Where the recordings of a case stand in its folder, as patterns; `fresh` is kept back while it is diagnosed."""

    training: str = "training/*"
    validation: str = "validation/*"
    fresh: str | None = FRESH


@dataclass(frozen=True)
class Procedure:
    """How cases are examined, by code of which `code` is the hash; tests put others in the place of the slow parts.

    `effects`: what others have added to the library, which worker and diagnosing process add as well.
    """

    code: str
    keep_recordings: bool = False
    record: Recorder = record_case
    layout: Layout = Layout()
    diagnoser: tuple[str, ...] = DIAGNOSER
    effects: tuple[EffectFile, ...] = ()


@dataclass(frozen=True)
class Outcome:
    """The folder that one diagnosis left, as a tar archive."""

    nominal: str
    content: bytes


@dataclass(frozen=True)
class Examined:
    """Everything that came of one case; `recordings` is a tar archive where they are kept."""

    number: int
    outcomes: tuple[Outcome, ...]
    recordings: bytes | None


def examine(case: Case, nominals: tuple[str, ...], procedure: Procedure) -> Examined:
    """Record `case` and diagnose it with each nominal; what fails is an outcome too, and counts against the diagnosis."""
    add_effects(procedure.effects)
    with tempfile.TemporaryDirectory(dir=get_worker().local_directory) as scratch:  # Dask clears it where a worker dies
        folder, fresh = Path(scratch, "case"), Path(scratch, FRESH)
        started = time.perf_counter()
        procedure.record(case, folder)
        seconds = time.perf_counter() - started
        recordings = pack(folder) if procedure.keep_recordings else None
        if procedure.layout.fresh is not None:
            shutil.move(folder / procedure.layout.fresh, fresh)  # out of the diagnosis' sight until it has answered
        process = diagnoser_process((*procedure.diagnoser, *_effects_here(procedure.effects)))
        outcomes = tuple(
            Outcome(nominal, _diagnose(process, folder, procedure.layout, nominal, fresh, seconds)) for nominal in nominals
        )
    return Examined(case.number, outcomes, recordings)


def _effects_here(files: Sequence[EffectFile]) -> list[str]:
    """The files written where this worker stands, as arguments of its diagnosing process."""
    folder = Path(get_worker().local_directory).absolute() / "effects"
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{file.module}.py" for file in files]
    for path, file in zip(paths, files, strict=True):
        path.write_text(file.text, encoding="utf-8")
    return [str(path) for path in paths]


def _diagnose(
    process: DiagnoserProcess, folder: Path, layout: Layout, nominal: str, fresh: Path, record_seconds: float
) -> bytes:
    """The outcome's folder, packed."""
    out = folder.parent / nominal
    started = time.perf_counter()
    request = DiagnoseRequest(
        directory=str(folder),
        model=MODELS[nominal],
        training=_recordings(folder, layout.training),
        validation=_recordings(folder, layout.validation),
        out=f"../{nominal}",
    )
    failed = process.ask(request)
    seconds = time.perf_counter() - started
    failed = failed or _predict_fresh(process, folder, nominal, fresh)
    out.mkdir(exist_ok=True)
    if failed:
        write_json(out / FAILED, {"failed": failed})
    write_seconds(out / SECONDS, Seconds(record_seconds, seconds))
    return pack(out)


def try_claims(case: Case, nominal: str, asked: Sequence[Claim], answer: bytes, procedure: Procedure) -> str:
    """What alike.json says of claims of an answer, `answer` its folder by `pack`: the case is recorded again, the same way."""
    add_effects(procedure.effects)
    with tempfile.TemporaryDirectory(dir=get_worker().local_directory) as scratch:
        folder, told = Path(scratch, "case"), Path(scratch, nominal)
        procedure.record(case, folder)
        unpack(answer, told)
        training, validation = (
            [folder / name for name in _recordings(folder, pattern)]
            for pattern in (procedure.layout.training, procedure.layout.validation)
        )
        material = Material(told / "patched.xml", training, validation, told / "effects.json", told / REPORT)
        try:
            found = checked(case, asked, material)
        except (UserError, OSError, KeyError, ValueError) as error:  # a foreign diagnosis may have written anything
            found = untried(asked, f"{type(error).__name__}: {error}")
        return json.dumps(alike_payload(found), indent=2) + "\n"


def _recordings(folder: Path, pattern: str) -> tuple[str, ...]:
    return tuple(str(path.relative_to(folder)) for path in sorted(folder.glob(pattern)) if path.is_dir())


def _predict_fresh(process: DiagnoserProcess, folder: Path, nominal: str, fresh: Path) -> str | None:
    """Have the first cause, as it was fitted, predict the motion that the diagnosis has not seen; None where that went well."""
    for recording in sorted(path for path in fresh.glob("*") if path.is_dir()):
        request = PredictRequest(
            directory=str(folder),
            model=MODELS[nominal],
            report=f"../{nominal}/{REPORT}",
            recording=f"../{FRESH}/{recording.name}",
            out=f"../{nominal}/{FRESH}",
        )
        failed = process.ask(request)
        if failed:
            return failed
    return None


def pack(folder: Path) -> bytes:
    """The files of `folder` as a tar archive, without pages: each holds a drawing library of 5 MB."""
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w:gz") as archive:
        for path in sorted(folder.rglob("*")):
            if path.is_file() and path.suffix != ".html":
                archive.add(path, arcname=str(path.relative_to(folder)))
    return stream.getvalue()


def unpack(content: bytes, folder: Path) -> None:
    """Write the files of an archive by `pack` into `folder`."""
    with tarfile.open(fileobj=io.BytesIO(content), mode="r:gz") as archive:
        archive.extractall(folder, filter="data")
