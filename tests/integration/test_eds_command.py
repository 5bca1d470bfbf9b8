"""`drivetwin eds`: the file as a whole, and what is said where it cannot be written."""

from __future__ import annotations

from pathlib import Path

import canopen
import pytest
from canopen.objectdictionary import ODVariable, import_od
from processes import drivetwin

from drivetwin.drive_profiles import available_profiles, load_profile
from drivetwin.drive_profiles.eds_writer import eds_text
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.drive.power_on import undecided
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.virtual_machine import VirtualMachine


@pytest.mark.parametrize("name", available_profiles())
def test_the_file_is_that_of_the_profile(name: str, tmp_path: Path) -> None:
    file = tmp_path / "new" / f"{name}.eds"
    done = drivetwin("eds", "--profile", name, "--out", file)
    assert (done.status, done.err) == (0, "")
    assert done.out == f"{file}: EDS of {name}\n"
    assert file.read_text(encoding="ascii") == eds_text(undecided(load_profile(name)), file.name)
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


def power_on_values(dictionary: canopen.ObjectDictionary) -> dict[tuple[int, int], object]:
    """DefaultValue of every entry that has one, as canopen reads it."""
    found = {}
    for index in dictionary:
        entry = dictionary[index]
        variables = [entry] if isinstance(entry, ODVariable) else list(entry.values())
        found.update({(index, variable.subindex): variable.default for variable in variables if variable.default is not None})
    return found


@pytest.mark.parametrize(("machine", "axis"), [("stage", None), ("scara", "lift"), (None, None)])
@pytest.mark.parametrize("name", available_profiles())
def test_a_default_value_is_that_of_power_on(name: str, machine: str | None, axis: str | None, tmp_path: Path) -> None:
    """CiA 306-1, 'DefaultValue': against each virtual drive itself; without a machine, against those of all machines."""
    motion = {(0x6072, 0), (0x6076, 0), (0x608F, 1), (0x6092, 1)}
    file = tmp_path / "drive.eds"
    options = [*(("--machine", machine) if machine else ()), *(("--axis", axis) if axis else ())]
    assert drivetwin("eds", "--profile", name, *options, "--out", file).status == 0
    for virtual in [machine] if machine else ["stage", "scara", "arm"]:
        drives = VirtualMachine(load_machine(virtual), load_profile(name), (), SyncClock(), 0, lambda _: None).drives
        names = list(load_machine(virtual).axes)
        for number, drive in enumerate(drives):
            if axis is not None and names[number] != axis:
                continue
            said = power_on_values(import_od(str(file), drive.device.node_id))
            held = {place: drive.dictionary[place].default for place in said if place in drive.dictionary}
            assert held == {place: said[place] for place in held}
            assert len(held) > 100
            read = {place: drive.dictionary[place].read() for place in (motion | {(0x6075, 0)}) & held.keys()}
            assert read == {place: said[place] for place in read}
    assert (motion <= said.keys()) is (machine is not None)


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("--axis", "lift"), "give --machine"),
        (("--machine", "scara"), "lift, rotate, stretch; say which by --axis"),
        (("--machine", "scara", "--axis", "nope"), "machine scara has no axis 'nope'; it has lift, rotate, stretch"),
    ],
)
def test_an_axis_that_is_not_told(options: tuple[str, ...], expected: str, tmp_path: Path) -> None:
    done = drivetwin("eds", *options, "--out", tmp_path / "drive.eds")
    assert done.status == 2
    assert expected in done.err
