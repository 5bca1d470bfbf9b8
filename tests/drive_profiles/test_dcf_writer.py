"""A DCF that we write says to another library's reader, and to our own, what the drive holds."""

from __future__ import annotations

from pathlib import Path

import canopen
import pytest

from drivetwin.drive_profiles import load_profile
from drivetwin.drive_profiles.eds_reader import read_eds
from drivetwin.drive_profiles.eds_writer import Configured, dcf_text, eds_text

VALUES: dict[tuple[int, int], int | float | str] = {
    (0x1400, 1): 0x203,
    (0x2168, 0): 0.1,
    (0x6098, 0): -3,
    (0x607C, 0): -70_000,
    (0x6091, 1): 5,
    (0x1008, 0): "a name; its #1",
}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "lift-3.dcf"
    path.write_text(dcf_text(load_profile("servoone"), path.name, Configured(3, "lift", VALUES)), encoding="ascii")
    return path


def held(found: canopen.ObjectDictionary, index: int, subindex: int = 0) -> object:
    """What a foreign reader has found in an entry."""
    variable = found.get_variable(index, subindex)
    assert variable is not None
    return variable.value


def test_a_foreign_reader_finds_node_and_values(file: Path) -> None:
    found = canopen.import_od(str(file))
    assert found.node_id == 3
    assert held(found, 0x2168) == 0.1
    assert held(found, 0x6098) == -3
    assert held(found, 0x607C) == -70_000
    assert held(found, 0x6091, 1) == 5
    assert held(found, 0x1400, 1) == 0x203
    assert held(found, 0x6083) is None


def test_our_own_reader_finds_them_too(file: Path) -> None:
    read = read_eds(file)
    values = {(entry.index, entry.subindex): entry.value for entry in read.objects if entry.value}
    assert read.node_id == 3
    assert values == {
        (0x1008, 0): "a name, its no. 1",
        (0x1400, 1): "0x203",
        (0x2168, 0): "0.1",
        (0x6091, 1): "0x5",
        (0x6098, 0): "-3",
        (0x607C, 0): "-70000",
    }


def test_without_its_values_it_is_the_data_sheet(file: Path) -> None:
    sheet = eds_text(load_profile("servoone"), file.name).splitlines()
    written = file.read_text(encoding="ascii").splitlines()
    ours = [line for line in written if not line.startswith(("ParameterValue=", "LastEDS="))]
    start = ours.index("[DeviceComissioning]")
    assert ours[start : start + 5] == ["[DeviceComissioning]", "NodeID=3", "NodeName=lift", "CANopenManager=0", ""]
    assert ours[:start] + ours[start + 5 :] == sheet
