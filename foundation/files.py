"""Files are written completely or not at all, and every JSON says what made it."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.scratch import held_directory

FULL = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO})
"""What an operating system says of a disk that takes no more; of a file that it was writing, it names none."""


class DiskError(UserError):
    """An output that cannot be written for `reason`; nothing of it is left."""

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(f"{path} cannot be written {reason}")
        self.path, self.reason = path, reason

    def __reduce__(self) -> tuple[type[DiskError], tuple[Path, str]]:
        """For the process that waits for the one that wrote."""
        return DiskError, (self.path, self.reason)


@contextmanager
def told_of(path: Path) -> Iterator[None]:
    """What keeps the block from writing is told as being about `path`, unless it names something else. Raises DiskError.

    For a folder that grows while its command runs; one that appears whole is a `new_directory`.
    """
    folder = path.parent
    try:
        yield
    except DiskError as error:
        if not _is_below(folder, error.path):
            raise
        raise DiskError(path, error.reason) from None  # of a file in the folder that is being written
    except OSError as error:
        if error.errno in FULL:
            raise _disk_error(path, error) from None
        if error.errno == errno.ENOENT and not folder.exists():
            raise UserError(f"{path} cannot be written: its folder was removed meanwhile; run this again") from None
        raise


def _disk_error(path: Path, error: OSError) -> DiskError:
    """About the file that is named, or else about `path`, and temporary files on another disk, which may be the full one."""
    said = f"({os.strerror(error.errno or 0)}): make room"
    if error.filename is not None and not _is_below(path.parent, Path(os.fsdecode(error.filename))):
        return DiskError(Path(os.fsdecode(error.filename)), f"{said} there")
    temporary = Path(tempfile.gettempdir())
    others = "" if _same_disk(path.parent, temporary) else f", there or in {temporary}"
    return DiskError(path, f"{said}{others}, or choose another --out")


def _is_below(folder: Path, path: Path) -> bool:
    return path.absolute().is_relative_to(folder.absolute())


def _same_disk(one: Path, other: Path) -> bool:
    try:
        return one.stat().st_dev == other.stat().st_dev
    except OSError:  # a folder that is gone tells nothing
        return True


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """Yield a temporary sibling of `path` that replaces it when the block ends without an error.

    Raises UserError where `path` is not a regular file, such as a device, and DiskError where the disk takes no more.
    """
    if path.exists() and not path.is_file():
        raise UserError(f"{path} is not a regular file: --out names a file to write, choose another")
    path.parent.mkdir(parents=True, exist_ok=True)
    with told_of(path):
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
    """Yield an empty sibling directory that replaces `path` when the block ends without an error.

    Raises UserError if `path` is a file, or a directory that contains files of other origin, and DiskError where the disk takes
    no more.
    """
    path = path.absolute()
    refuse_foreign(path)
    missing = [parent for parent in path.parents if not parent.exists()]
    path.parent.mkdir(parents=True, exist_ok=True)
    with told_of(path), held_directory(path.parent, f".{path.name}.", ".part") as part:
        try:
            yield part
            (part / _MARK).touch()
            part.chmod(0o755)
            _take_the_place(part, path)
        finally:
            if part.exists():
                shutil.rmtree(part)
                for parent in missing:
                    with suppress(OSError):  # another has put something there meanwhile
                        parent.rmdir()


def _take_the_place(part: Path, path: Path) -> None:
    """Rename `part` to `path`; what stood there goes, or stays where the renaming fails."""
    if not path.exists():
        part.rename(path)
        return
    old = Path(tempfile.mkdtemp(dir=path.parent, prefix=f".{path.name}.", suffix=".old"))
    path.rename(old / path.name)
    try:
        part.rename(path)
    except OSError:
        (old / path.name).rename(path)
        raise
    finally:
        shutil.rmtree(old)


_MARK = ".drivetwin"

INSTALLED = Path(__file__).resolve().parent.parent
"""Where the rooms and their data stand: the checkout, or the installed package."""


def refuse_foreign(path: Path) -> None:
    """Raise UserError if `new_directory` could not write `path`; call it before long work, and before a machine moves."""
    path = path.absolute()
    if path.exists() and not path.is_dir():
        raise UserError(f"{path} is a file; --out names the directory to write: choose another")
    if path.is_dir() and any(path.iterdir()) and not (path / _MARK).exists():
        raise UserError(f"{path} holds files that drivetwin did not write; choose an empty or a new directory for --out")
    refuse_unwritable(path)


def refuse_unwritable(path: Path) -> None:
    """Raise UserError if nothing can be made at `path`, for the folder that is there."""
    existing = next(parent for parent in path.absolute().parents if parent.exists())
    if not existing.is_dir() or not os.access(existing, os.W_OK):
        raise UserError(f"{path} cannot be written: {existing} is not a writable directory; choose another --out")


def refuse_to_replace(path: Path, inputs: Iterable[Path]) -> None:
    """Raise UserError if an input file lies in `path`, which `new_directory` replaces with all its contents."""
    whole = path.resolve()
    for file in inputs:
        if file.resolve().is_relative_to(whole):
            raise UserError(f"{file} is read, and --out {path} would replace the folder it lies in: choose another --out")


def own_directory(path: Path) -> None:
    """Make `path` a directory that this product may write to repeatedly; its contents stay.

    Raises UserError as `refuse_foreign`.
    """
    refuse_foreign(path)
    with told_of(path):
        path.mkdir(parents=True, exist_ok=True)
        (path / _MARK).touch()


def write_json(path: Path, payload: dict[str, Any]) -> None:
    """Write `payload` as indented JSON, completely or not at all."""
    with new_file(path) as part:
        part.write_text(json.dumps(payload, indent=1, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8")


def provenance(seed: int, inputs: Iterable[Path], root: Path | None = None) -> dict[str, Any]:
    """The keys that every JSON of the product carries: version, seed, and the sha256 of each input file.

    Inputs below `root`, the directory that is being written, are named relative to it, and the product's own data relative to
    where it is installed.
    """
    return {
        "version": version("drivetwin"),
        "seed": seed,
        "inputs": {_name(path, root): sha256(path) for path in inputs},
    }


def _name(path: Path, root: Path | None) -> str:
    for base in (root, INSTALLED):
        if base is not None and path.resolve().is_relative_to(base.resolve()):
            return str(path.resolve().relative_to(base.resolve()))
    return str(path)


def sha256(path: Path) -> str:
    """Hex digest of a file's bytes."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
