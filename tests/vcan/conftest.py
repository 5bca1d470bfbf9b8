"""Tests on a real SocketCAN interface; `make test-vcan` brings one up where the kernel has none."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from all_types import write_eds
from processes import drivetwin


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Without vcan0 these tests cannot run, and say how they can."""
    if not Path("/sys/class/net/vcan0").exists():
        for item in items:
            if Path(__file__).parent in item.path.parents:
                item.add_marker(pytest.mark.skip(reason="no vcan0 here; `make test-vcan` boots a kernel that has one"))


@pytest.fixture(autouse=True)
def _interface_is_up() -> None:
    """A test that finds its interface down would blame the product."""
    state = subprocess.run(["ip", "-br", "link", "show", "vcan0"], capture_output=True, text=True, check=True)
    assert "UP" in state.stdout or "UNKNOWN" in state.stdout, state.stdout


@pytest.fixture(scope="session")
def eds(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The EDS that `drivetwin eds` writes of cia402-full."""
    path = tmp_path_factory.mktemp("eds") / "drive.eds"
    assert drivetwin("eds", "--profile", "cia402-full", "--out", path).status == 0
    return path


@pytest.fixture(scope="session")
def eds_with_text(eds: Path) -> Path:
    """The same drive for `drivetwin emulate --eds`, with 2F00h, a writable text: longer than an expedited transfer takes."""
    listed = re.compile(r"(\[ManufacturerObjects\]\nSupportedObjects=)(\d+)\n((?:\d+=\w+\n)*)")
    added = "\n[2F00]\nParameterName=Note\nObjectType=0x7\nDataType=0x0009\nAccessType=rw\nDefaultValue=none\nPDOMapping=0\n"

    def with_text(found: re.Match[str]) -> str:
        number = int(found[2]) + 1
        return f"{found[1]}{number}\n{found[3]}{number}=0x2F00\n"

    text, changed = listed.subn(with_text, eds.read_text(encoding="utf-8"))
    assert changed == 1
    path = eds.with_name("drive_with_text.eds")
    path.write_text(text + added, encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def eds_with_types(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same drive with an object of every data type of a fixed length."""
    return write_eds(tmp_path_factory.mktemp("eds") / "types.eds")
