"""A few spoiled files of each kind; `make fuzz-files` reads thousands."""

from __future__ import annotations

import logging
from pathlib import Path
from random import Random

import pytest
from fuzzing.files import KINDS, BrokenError, Kind, try_spoiled

from drivetwin.foundation.errors import UserError


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", KINDS)
def test_spoiled_files_end_in_a_value_or_in_one_line(name: str, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.CRITICAL)
    kind = KINDS[name]
    kind.write(tmp_path)
    sound = (tmp_path / kind.name).read_bytes()
    kind.read(tmp_path / kind.name)
    for case in range(3 if kind.slow else 25):
        try_spoiled(kind, tmp_path, sound, Random(f"{name} 0 {case}"))


def _fails_with(error: Exception) -> Kind:
    def read(_file: Path) -> object:
        raise error

    return Kind("file", True, lambda _folder: None, read)


@pytest.mark.parametrize("error", [KeyError("x"), UserError("x" * 10), MemoryError()])
def test_the_fuzz_sees_what_is_no_line(error: Exception, tmp_path: Path) -> None:
    """It can fail: any other error than the project's own counts."""
    if isinstance(error, UserError):
        assert try_spoiled(_fails_with(error), tmp_path, b"sound", Random(0)) == "refused"
    else:
        with pytest.raises(BrokenError, match=type(error).__name__):
            try_spoiled(_fails_with(error), tmp_path, b"sound", Random(0))
