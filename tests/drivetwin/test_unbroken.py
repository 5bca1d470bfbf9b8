"""A small share of `make unbroken`: an episode of the soak, a killed command, disks that are too small."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
import unbroken.soak as soaking
from unbroken import __main__ as program
from unbroken import kills
from unbroken.disks import Refusal, can_mount, on_a_small_disk
from unbroken.kills import Victim, kill_at_random
from unbroken.soak import soak

EDS = Victim("eds", ["eds", "--profile", "cia402-full", "--out", "OUT"], ())

LEAVES_HALF = """
import sys
from pathlib import Path
out = Path(sys.argv[1])
out.mkdir(exist_ok=True)
(out / "first").touch()
(out.parent / "litter").touch()
"""


def test_a_life_with_faults_goes_on() -> None:
    lived = soak(1.0, 3)
    assert lived.broken == ()
    assert lived.episodes == 1
    assert sum(lived.struck.values()) in (1, 2)


def test_a_soak_sees_an_axis_that_does_not_come_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody can be within less than nothing of where it was told to go."""
    monkeypatch.setattr(soaking, "_check_moves", never_there)
    (told,) = soak(1.0, 3).broken
    assert "AssertionError: the axes stand elsewhere" in told


def test_memory_that_grows_ends_a_soak_as_broken(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a process that keeps a megabyte an episode, and of one that fills its caches first."""
    assert soaking.growth([float(episode) for episode in range(80)]) == 20.0
    assert soaking.growth([min(float(episode), 30.0) for episode in range(80)]) == 0.0
    assert soaking.growth([0.0] * (soaking.JUDGED - 1)) is None
    monkeypatch.setattr(soaking, "growth", lambda _memory: 2.0 * soaking.FLAT)
    assert "the process's memory grew by 8.0 MB where 4 MB are allowed" in soak(1.0, 3).broken


def never_there(*_: object) -> None:
    raise AssertionError("the axes stand elsewhere")


def test_a_command_that_is_killed_leaves_nothing_half_written(tmp_path: Path) -> None:
    found = kill_at_random(EDS, 3, 0, tmp_path / "place")
    assert found.kills == 3
    assert found.broken == ()


def test_kills_see_what_is_half_written_and_what_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kills, "DRIVETWIN", [sys.executable, "-c", LEAVES_HALF])
    found = kill_at_random(Victim("half", ["OUT"], ("first", "second")), 2, 0, tmp_path / "place")
    assert "second is missing after a whole run" in found.broken
    assert "litter is left beside OUT" in found.broken


RECORDS = """
import sys
from pathlib import Path
assert sys.argv[1] == "identify"
for name in ("strokes_slide", "excitation_slide", "validation_slide"):
    Path(sys.argv[-1], "recordings", name).mkdir(parents=True)
"""


def test_a_diagnosis_on_a_small_disk_has_its_recordings_where_nothing_is_killed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    inputs: list[Path] = []

    def noted(victim: Victim, _options: str, _folder: Path) -> Refusal:
        inputs.extend(Path(word) for word in victim.words if word.endswith("_slide"))
        assert all(path.is_dir() for path in inputs)
        return Refusal(0, "", ())

    monkeypatch.setattr(program, "can_mount", lambda: True)
    monkeypatch.setattr(program, "on_a_small_disk", noted)
    monkeypatch.setattr(program, "DRIVETWIN", [sys.executable, "-c", RECORDS], raising=False)
    monkeypatch.setattr(sys, "argv", ["unbroken", "--soak", "0", "--kills", "0", "--only", "diagnose", "--out", str(tmp_path)])
    assert program.main() == 0
    assert len(inputs) == 3 * len(program.DISKS)


@pytest.mark.parametrize(("options", "said"), [("size=4k", "(No space left on device): make"), ("ro", "not a writable")])
def test_a_disk_that_takes_no_more_ends_in_one_line(options: str, said: str, tmp_path: Path) -> None:
    if not can_mount():
        pytest.skip("this user cannot mount a small disk (unshare -rm mount)")
    disk = tmp_path / "disk"
    disk.mkdir()
    end = on_a_small_disk(EDS, options, disk)
    assert (end.status, end.left, end.broken()) == (2, (), None)
    assert said in end.said
    assert on_a_small_disk(EDS, "size=1m", disk).left == ("out",)


ACCEPT = ["accept", "--bench", "hil_tests/benches/scara.yaml", "--select", "01_boot.node_missing", "--quiet", "--out", "OUT"]


@pytest.mark.parametrize("options", ["size=4k", "size=64k"])
def test_an_acceptance_on_a_full_disk_names_the_disk(options: str, tmp_path: Path) -> None:
    if not can_mount():
        pytest.skip("this user cannot mount a small disk (unshare -rm mount)")
    disk = tmp_path / "disk"
    disk.mkdir()
    end = on_a_small_disk(Victim("accept", ACCEPT, (), resumes=True), options, disk)
    assert (end.status, end.broken()) == (2, None)
    assert f"{disk}/out" in end.said
    assert "(No space left on device): make room" in end.said
