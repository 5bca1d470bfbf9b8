"""Temporary folders, removed at the end of the work or, if it was killed, at the next start of the same work."""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_NOT_HELD_YET = ".new"


@contextmanager
def scratch() -> Iterator[Path]:
    """Yield an empty folder for what nobody needs afterwards, where this machine keeps such (TMPDIR, /tmp).

    What earlier processes could not remove, because they were killed, goes first.
    """
    with held_directory(Path(tempfile.gettempdir()), "drivetwin-", "") as folder:
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def held_directory(parent: Path, prefix: str, suffix: str) -> Iterator[Path]:
    """Yield a new folder in `parent`, of such a name, that is held while the block lasts; whoever asked removes or renames it.

    Folders of such names that nobody holds any more are removed first.
    """
    _sweep(parent, prefix, suffix)
    fresh = Path(tempfile.mkdtemp(dir=parent, prefix=prefix, suffix=suffix + _NOT_HELD_YET))
    handle = os.open(fresh, os.O_RDONLY)
    try:
        with suppress(OSError):  # a file system without locks, where nobody can take one to sweep either
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield fresh.rename(fresh.with_name(fresh.name.removesuffix(_NOT_HELD_YET)))
    finally:
        os.close(handle)


def _sweep(parent: Path, prefix: str, suffix: str) -> None:
    """Remove the folders of this user in `parent` with such names that nobody holds."""
    with os.scandir(parent) as entries:
        found = [entry for entry in entries if entry.name.startswith(prefix) and entry.name.endswith(suffix)]
    for entry in found:
        with suppress(OSError):  # another has removed it, or holds it
            if entry.is_dir(follow_symlinks=False) and entry.stat(follow_symlinks=False).st_uid == os.getuid():
                _remove_unless_held(Path(entry.path))


def _remove_unless_held(folder: Path) -> None:
    """Raises BlockingIOError where another holds it."""
    if folder.name.endswith(_NOT_HELD_YET):
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        shutil.rmtree(folder)
    finally:
        os.close(handle)
