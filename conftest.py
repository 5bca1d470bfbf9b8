"""What tests of any folder share: MuJoCo's warnings fail a test, effects that it adds go, a command runs in this process."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module

import mujoco
import pytest
from in_process import Command, exit_status
from processes import Ended


@pytest.fixture(autouse=True)
def mujoco_warns_of_nothing() -> Iterator[None]:
    """MuJoCo writes its warnings to MUJOCO_LOG.TXT, where the tests run, unless someone takes them."""
    warnings: list[str] = []
    mujoco.set_mju_user_warning(warnings.append)
    yield
    mujoco.set_mju_user_warning(None)
    assert warnings == []


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
