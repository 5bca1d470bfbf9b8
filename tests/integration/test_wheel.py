"""The wheel: one top-level name, every file of the rooms, and commands that work outside the checkout."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import numpy as np
import pytest
from processes import PATIENCE

ROOT = Path(__file__).parents[2]
ROOMS = sorted(path.name for path in (ROOT / "drivetwin").iterdir() if path.is_symlink())

OF_THE_PACKAGE = {".py", ".yaml", ".csv", ".xml", ".json", ".js", ".html", ".css", ".svg"}


def run(*command: str | Path, at: Path) -> str:
    """Standard output of a command that knows nothing of the checkout."""
    environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(
        [str(word) for word in command], cwd=at, env=environment, capture_output=True, text=True, check=False,
        timeout=10.0 * PATIENCE, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built from a copy, so that the checkout gets no build folder, and none of an earlier build gets into the wheel."""
    copy, out = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("wheel")
    for name in ("drivetwin", *ROOMS):
        shutil.copytree(ROOT / name, copy / name, symlinks=True, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, copy)
    run(sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--wheel-dir", out, copy, at=out)
    (built,) = out.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The scripts' folder of a fresh environment with the wheel, whose dependencies are those of this environment."""
    folder = tmp_path_factory.mktemp("environment")
    venv.create(folder, with_pip=False)
    scripts = folder / "bin"
    pip = (sys.executable, "-m", "pip", "--python", scripts / "python")
    run(*pip, "install", "--quiet", "--no-deps", "--no-index", wheel, at=folder)
    ask = "import sysconfig; print(sysconfig.get_path('purelib'))"
    own = Path(run(scripts / "python", "-c", ask, at=folder).strip())
    (own / "dependencies.pth").write_text(f"{Path(np.__file__).parents[1]}\n", encoding="utf-8")
    return scripts


def test_it_has_one_top_level_name(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    assert {name.partition("/")[0] for name in names if ".dist-info/" not in name} == {"drivetwin"}


def test_it_has_every_file_of_the_rooms(wheel: Path) -> None:
    packed = set(zipfile.ZipFile(wheel).namelist())
    files = {path for room in ROOMS for path in (ROOT / room).rglob("*") if path.suffix in OF_THE_PACKAGE}
    expected = {f"drivetwin/{path.relative_to(ROOT)}" for path in files if "__pycache__" not in path.parts}
    assert expected - packed == set()


def test_commands_work_outside_the_checkout(installed: Path, tmp_path: Path) -> None:
    assert run(installed / "drivetwin", "--version", at=tmp_path).startswith("drivetwin ")
    run(installed / "drivetwin", "eds", "--profile", "servoone", "--out", tmp_path / "drive.eds", at=tmp_path)
    assert "[DeviceInfo]" in (tmp_path / "drive.eds").read_text(encoding="utf-8")
    assert "task.json" in run(installed / "python", "-m", "drivetwin.controller", "--help", at=tmp_path)


def test_data_come_from_the_wheel(installed: Path, tmp_path: Path) -> None:
    code = (
        "from drivetwin.emulator.machine import load_machine; from drivetwin.controller.machine import load_machine as known; "
        "from drivetwin.hil_tests.suite import CASES; from drivetwin.foundation.html_page import PLOTLY; "
        "print(load_machine('scara').model_path, known('scara').model_path, CASES, PLOTLY, sep='\\n')"
    )
    paths = [Path(line) for line in run(installed / "python", "-c", code, at=tmp_path).splitlines()]
    assert len(paths) == 4
    assert all(path.exists() and path.is_relative_to(installed.parent) for path in paths)
