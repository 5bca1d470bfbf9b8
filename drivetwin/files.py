"""Files appear whole or not at all, and every JSON says what made it."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any

from drivetwin.errors import UserError


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """Yield a temporary sibling of `path` that replaces it when the block ends without an error."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=path.suffix)
    os.close(handle)
    part = Path(name)
    try:
        yield part
        part.chmod(0o644)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


@contextmanager
def new_directory(path: Path) -> Iterator[Path]:
    """Yield an empty sibling directory that takes the place of `path` when the block ends without an error.

    Raises UserError where `path` is a file, or a directory that holds something this product did not write.
    """
    path = path.absolute()
    _refuse_foreign(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = Path(tempfile.mkdtemp(dir=path.parent, prefix=f".{path.name}.", suffix=".part"))
    try:
        yield part
        (part / _MARK).touch()
        part.chmod(0o755)
        if path.exists():
            old = Path(tempfile.mkdtemp(dir=path.parent, prefix=f".{path.name}.", suffix=".old"))
            path.rename(old / path.name)
            part.rename(path)
            shutil.rmtree(old)
        else:
            part.rename(path)
    finally:
        if part.exists():
            shutil.rmtree(part)


_MARK = ".drivetwin"


def _refuse_foreign(path: Path) -> None:
    if path.is_file():
        raise UserError(f"{path} is a file; --out names the directory to write: choose another")
    if path.is_dir() and any(path.iterdir()) and not (path / _MARK).exists():
        raise UserError(f"{path} holds files that drivetwin did not write; choose an empty or a new directory for --out")


def write_json(path: Path, payload: dict[str, Any]) -> None:
    """Write `payload` as indented JSON, whole or not at all."""
    with new_file(path) as part:
        part.write_text(json.dumps(payload, indent=1, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8")


def provenance(seed: int, inputs: Iterable[Path]) -> dict[str, Any]:
    """The keys that every JSON of the product carries: version, seed, and the sha256 of each input file."""
    return {"version": version("drivetwin"), "seed": seed, "inputs": {str(path): sha256(path) for path in inputs}}


def sha256(path: Path) -> str:
    """Hex digest of a file's bytes."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
