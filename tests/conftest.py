"""What tests of any folder share: MuJoCo warns of nothing, added effects go, models and commands run in this process."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import mujoco
import pytest
from hypothesis import settings
from in_process import Command, exit_status
from processes import Ended, drivetwin
from shared import once

from drivetwin.motion import compilation
from drivetwin.motion.mjcf_fault import fault

_wrong_with = compilation._wrong_with

LONGEST = [
    Path(__file__).parent / name
    for name in (
        "integration/test_wafer_handler.py",
        "hil_tests/test_arithmetic.py",
        "diagnosis/test_measured_gaps.py",
        "panel/test_commissioning_view.py",
        "integration/test_effect_of_ones_own.py",
        "emulator/canopen/test_fuzz_frames.py",
        "diagnosis/excitation/test_distinguished.py",
        "controller/test_write_friction_table.py",
        "twin/test_emps_replay.py",
        "blind/wide/test_wide_draw.py",
    )
]
"""Files with a test or a fixture of more than 10 s."""

settings.register_profile("patient", deadline=None)
settings.load_profile("patient")  # a busy computer makes no property wrong


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest first: one that begins last keeps one process busy while the others have nothing left to do."""
    assert all(path.is_file() for path in LONGEST)
    items.sort(key=lambda item: LONGEST.index(item.path) if item.path in LONGEST else len(LONGEST))


@pytest.fixture(autouse=True)
def mujoco_warns_of_nothing() -> Iterator[None]:
    """MuJoCo writes its warnings to MUJOCO_LOG.TXT, where the tests run, unless someone takes them."""
    warnings: list[str] = []
    mujoco.set_mju_user_warning(warnings.append)
    yield
    mujoco.set_mju_user_warning(None)
    assert warnings == []


@pytest.fixture(scope="session", autouse=True)
def models_compile_here() -> Iterator[None]:
    """What is wrong with a model is asked in this process: the start of another one takes longer than most tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compilation, "_wrong_with", lambda path, _changed: " ".join(fault(str(path)).split()))
        yield


@pytest.fixture(scope="session")
def identified_stage(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What `drivetwin identify --machine stage` writes; to be read only."""

    def identify(out: Path) -> None:
        done = drivetwin("identify", "--machine", "stage", "--out", out)
        assert (done.status, done.err) == (0, "")

    return once(tmp_path_factory, "identified_stage", identify)


@pytest.fixture
def models_compile_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    """As the product asks it, in a process of its own: for tests of that process, and of models that may end it."""
    monkeypatch.setattr(compilation, "_wrong_with", _wrong_with)


@pytest.fixture
def library_as_it_was() -> Iterator[None]:
    """Effects that a test adds, or a command that it runs in this process, are gone afterwards."""
    module = import_module("drivetwin.emulator.effects.library")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "_added", [])
        yield
    module.library.cache_clear()


@pytest.fixture
def command(capfd: pytest.CaptureFixture[str]) -> Command:
    """Run a command line of `drivetwin` in this process; returns its exit status and what it wrote meanwhile."""

    def run(*lines: object) -> Ended:
        capfd.readouterr()
        return Ended(exit_status(*lines), *capfd.readouterr())

    return run
