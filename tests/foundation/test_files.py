"""Files and directories appear whole or not at all."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import pickle
import shutil
import tempfile
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import (
    DiskError,
    new_directory,
    new_file,
    provenance,
    refuse_foreign,
    refuse_to_replace,
    write_json,
)


class TroubleError(Exception):
    pass


def test_a_file_replaces_the_old_one_only_when_it_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "a" / "b.txt"
    with new_file(path) as part:
        part.write_text("one")
        assert not path.exists()
    assert path.read_text() == "one"

    def half() -> None:
        with new_file(path) as part:
            part.write_text("tw")
            raise TroubleError

    with pytest.raises(TroubleError):
        half()
    assert path.read_text() == "one"
    assert [entry.name for entry in path.parent.iterdir()] == ["b.txt"]


@pytest.mark.parametrize("trouble", [TroubleError, KeyboardInterrupt, SystemExit])
def test_a_directory_that_failed_leaves_no_trace(tmp_path: Path, trouble: type[BaseException]) -> None:
    path = tmp_path / "out" / "deep" / "run"

    def half() -> None:
        with new_directory(path) as part:
            (part / "half").touch()
            raise trouble

    with pytest.raises(trouble):
        half()
    assert list(tmp_path.iterdir()) == []


def test_a_directory_of_ours_is_replaced_and_kept_when_the_new_one_fails(tmp_path: Path) -> None:
    path = tmp_path / "run"
    with new_directory(path) as part:
        (part / "old").touch()

    def half() -> None:
        with new_directory(path) as part:
            (part / "new").touch()
            raise TroubleError

    with pytest.raises(TroubleError):
        half()
    assert (path / "old").exists()
    with new_directory(path) as part:
        (part / "new").touch()
    assert sorted(entry.name for entry in path.iterdir() if entry.name != ".drivetwin") == ["new"]
    assert [entry.name for entry in tmp_path.iterdir()] == ["run"]


def test_a_folder_is_not_replaced_by_what_is_made_of_it(tmp_path: Path) -> None:
    run = tmp_path / "run"
    with new_directory(run) as staged:
        (staged / "signals.csv").write_text("0")
    (tmp_path / "link").symlink_to(run)
    inputs = [run / "signals.csv"]
    for out in (run, tmp_path, tmp_path / "link"):
        with pytest.raises(UserError, match=r"is read, and --out .* would replace the folder it lies in"):
            refuse_to_replace(out, inputs)
    refuse_to_replace(tmp_path / "run2", inputs)
    refuse_to_replace(run / "fit", inputs)


def test_what_is_not_ours_is_not_touched(tmp_path: Path) -> None:
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter1.tex").write_text("precious")
    (tmp_path / "file").write_text("precious")
    (tmp_path / "empty").mkdir()
    with pytest.raises(UserError, match="did not write; choose an empty or a new directory"):
        refuse_foreign(tmp_path / "thesis")
    with pytest.raises(UserError, match="is a file"):
        refuse_foreign(tmp_path / "file")
    with pytest.raises(UserError, match="cannot be written"):
        refuse_foreign(tmp_path / "file" / "below")
    refuse_foreign(tmp_path / "empty")
    refuse_foreign(tmp_path / "new" / "below")
    assert not (tmp_path / "new").exists()


def test_json_says_what_made_it_and_has_no_nan(tmp_path: Path) -> None:
    source = tmp_path / "input"
    source.write_bytes(b"abc")
    made = provenance(4, [source])
    assert made["inputs"] == {str(source): hashlib.sha256(b"abc").hexdigest()}
    assert made["seed"] == 4
    write_json(tmp_path / "x.json", {"unit": "N·m", **made})
    assert json.loads((tmp_path / "x.json").read_text(encoding="utf-8"))["unit"] == "N·m"
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_json(tmp_path / "y.json", {"value": float("nan")})
    assert not (tmp_path / "y.json").exists()


def test_what_is_no_file_is_not_replaced_by_one(tmp_path: Path) -> None:
    """As root, --out /dev/null would put a file in the place of the device."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(UserError, match=r"pipe is not a regular file: --out names a file to write, choose another"):
        write_json(pipe, {})
    assert pipe.is_fifo()
    assert list(tmp_path.iterdir()) == [pipe]


@pytest.mark.parametrize("writes", [new_file, new_directory])
@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO])
def test_a_disk_that_takes_no_more_is_told_by_the_output(
    writes: Callable[[Path], AbstractContextManager[Path]], number: int, tmp_path: Path
) -> None:
    def half() -> None:
        with writes(tmp_path / "out"):
            raise OSError(number, os.strerror(number))

    with pytest.raises(UserError) as told:
        half()
    assert str(told.value).startswith(f"{tmp_path / 'out'} cannot be written ({os.strerror(number)})")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("writes", [new_file, new_directory])
def test_a_full_disk_elsewhere_is_told_by_what_stands_there(
    writes: Callable[[Path], AbstractContextManager[Path]], tmp_path: Path
) -> None:
    """Also where an output within an output was being written."""

    def half() -> None:
        with new_directory(tmp_path / "outer"), writes(tmp_path / "out"):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "/elsewhere/scratch.bin")

    with pytest.raises(UserError) as told:
        half()
    assert str(told.value) == "/elsewhere/scratch.bin cannot be written (No space left on device): make room there"


def test_where_nobody_says_what_is_full_the_disk_of_temporary_files_is_told_of_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = Path("/dev/shm")
    if not other.is_dir() or other.stat().st_dev == tmp_path.stat().st_dev:
        pytest.skip("there is only one disk here")
    monkeypatch.setattr(tempfile, "tempdir", str(other))

    def half() -> None:
        with new_file(tmp_path / "out"):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(UserError, match=r"out cannot be written .*: make room, there or in /dev/shm, or choose another --out$"):
        half()


@pytest.mark.parametrize("writes", [new_file, new_directory])
def test_an_output_that_vanishes_meanwhile_is_told(
    writes: Callable[[Path], AbstractContextManager[Path]], tmp_path: Path
) -> None:
    folder = tmp_path / "made"

    def late() -> None:
        with writes(folder / "out") as part:
            shutil.rmtree(folder)
            part.joinpath("x").touch() if writes is new_directory else part.write_text("x")

    with pytest.raises(UserError, match=r"made/out cannot be written: its folder was removed meanwhile"):
        late()
    assert list(tmp_path.iterdir()) == []


def test_a_disk_that_is_full_is_told_across_processes(tmp_path: Path) -> None:
    """What one process of several raises is pickled; an error that cannot be read back ends the whole pool."""
    told = DiskError(tmp_path / "out", "(No space left on device): make room there")
    again = pickle.loads(pickle.dumps(told))  # its own bytes
    assert (str(again), again.path, again.reason) == (str(told), told.path, told.reason)
