"""`drivetwin eds`: the file as a whole, and what is said where it cannot be written."""

from __future__ import annotations

from pathlib import Path

import pytest
from processes import drivetwin

from drive_profiles import available_profiles, load_profile
from drive_profiles.eds_writer import eds_text


@pytest.mark.parametrize("name", available_profiles())
def test_the_file_is_that_of_the_profile(name: str, tmp_path: Path) -> None:
    file = tmp_path / "new" / f"{name}.eds"
    done = drivetwin("eds", "--profile", name, "--out", file)
    assert (done.status, done.err) == (0, "")
    assert done.out == f"{file}: EDS of {name}\n"
    assert file.read_text(encoding="ascii") == eds_text(load_profile(name), file.name)
    assert [path.name for path in file.parent.iterdir()] == [file.name]


def test_where_it_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    below = tmp_path / "file" / "x.eds"
    for out, complaint in ((tmp_path, "is a directory; --out names the file"), (below, "cannot be written")):
        done = drivetwin("eds", "--out", out)
        assert (done.status, done.out) == (2, "")
        assert complaint in done.err
        assert len(done.err.splitlines()) == 1


def test_an_unknown_profile() -> None:
    done = drivetwin("eds", "--profile", "nope", "--out", "nope.eds")
    assert done.status == 2
    assert "unknown drive profile 'nope'; known are cia402-full, dryve_d1, servoone" in done.err
