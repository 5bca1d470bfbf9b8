"""What a file says of a drive's objects, whoever wrote it: EDS, DCF of this node or of another one, snapshot."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import pytest

from drivetwin.drive_profiles import load_profile
from drivetwin.drive_profiles.eds_writer import Configured, dcf_text, eds_text
from drivetwin.drive_profiles.snapshot import Reading, Snapshot, write_snapshot
from drivetwin.foundation.errors import UserError
from drivetwin.panel.parameter_file import is_parameter, read_parameters

PROFILE = load_profile("servoone")
ENTRIES = {(entry.index, entry.subindex): entry for entry in PROFILE.objects}


def dcf(values: dict[tuple[int, int], int | float | str], node_id: int) -> str:
    return dcf_text(PROFILE, "drive.dcf", Configured(node_id, "drive", values))


def test_a_dcf_says_the_bytes_that_stand_on_the_bus() -> None:
    text = dcf({(0x2168, 0): 0.1, (0x607C, 0): -70_000, (0x6098, 0): -3}, 2)
    values = read_parameters("drive.dcf", text, ENTRIES, 2).values
    assert values[0x2168, 0] == struct.pack("<f", 0.1)
    assert values[0x607C, 0] == (-70_000).to_bytes(4, "little", signed=True)
    assert values[0x6098, 0] == b"\xfd"


@pytest.mark.parametrize("written", [2, 5])
def test_identifiers_are_those_of_the_drive_that_it_is_for(written: int) -> None:
    """A DCF says the sum of identifier and node-ID (CiA 306-1, 4.7); for another node it is another sum."""
    values = read_parameters("drive.dcf", dcf({(0x1400, 1): 0x200 + written}, written), ENTRIES, 5).values
    assert values[0x1400, 1] == (0x205).to_bytes(4, "little")


def test_an_eds_says_its_defaults_with_the_node_id() -> None:
    values = read_parameters("drive.eds", eds_text(PROFILE, "drive.eds"), ENTRIES, 7).values
    assert values[0x1014, 0] == (0x87).to_bytes(4, "little")
    assert values[0x1000, 0] == ENTRIES[0x1000, 0].default.to_bytes(4, "little")  # type: ignore[union-attr]


def test_a_snapshot_says_what_was_read(tmp_path: Path) -> None:
    file = tmp_path / "axis.json"
    readings = [
        Reading(0x6083, 0, "Profile acceleration", "U32", "rw", b"\1\2\3\4", 0x04030201, None),
        Reading(0x6084, 0, "Profile deceleration", "U32", "rw", None, None, 0x06020000),
        Reading(0x5FFF, 0, "of another drive", "U8", "rw", b"\1", 1, None),
    ]
    write_snapshot(file, Snapshot("servoone", 1, tuple(readings)), [])
    found = read_parameters("axis.json", file.read_text(encoding="utf-8"), ENTRIES, 1)
    assert (dict(found.values), found.strange) == ({(0x6083, 0): b"\1\2\3\4"}, 1)


def test_a_value_that_its_type_cannot_hold_is_none() -> None:
    text = dcf({(0x6083, 0): 1}, 1).replace("ParameterValue=0x1\n", "ParameterValue=0x123456789\n")
    assert (0x6083, 0) not in read_parameters("drive.dcf", text, ENTRIES, 1).values


@pytest.mark.parametrize(
    "text", ["", "position gain = 12", json.dumps({"schema": "other"}), "[1FF0]\nDataType=0x5\nDefaultValue=1\n"]
)
def test_what_is_no_such_file_is_refused_by_its_name(text: str) -> None:
    with pytest.raises(UserError, match=r"mine\.txt"):
        read_parameters("mine.txt", text, ENTRIES, 1)


@pytest.mark.parametrize(
    ("index", "may"),
    [(0x2168, True), (0x6083, True), (0x6040, False), (0x607A, False), (0x1017, False), (0x6041, False)],
)
def test_a_file_sets_parameters_and_commands_nothing(index: int, may: bool) -> None:
    assert is_parameter(ENTRIES[index, 0]) == may
