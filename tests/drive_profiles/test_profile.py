"""Drive types as data: the two that are there, and what a wrong file is told."""

from __future__ import annotations

from math import pi
from pathlib import Path

import pytest

from drivetwin.drive_profiles import Access, Quirk, available_profiles, load_profile
from drivetwin.drive_profiles.profile import PROFILES, TEXT_TYPES, load_profile_from
from drivetwin.foundation.errors import UserError

IDENTIFIED = ("servoone", "cia402-full")
"""Drive types that `drivetwin identify` works with."""

ROLES = {
    "position_setpoint",
    "torque_actual",
    "rated_torque",
    "motor_inertia",
    "position_gain",
    "velocity_gain",
    "integral_time",
    "velocity_feedforward",
    "velocity_filter_time",
    "torque_limit",
    "following_error_limit",
    "servo_period",
    "interpolation_type",
}


def test_known_profiles() -> None:
    assert {"servoone", "cia402-full", "dryve_d1"} <= set(available_profiles())


@pytest.mark.parametrize("name", available_profiles())
def test_roles_are_numbers_that_exist(name: str) -> None:
    profile = load_profile(name)
    objects = {(entry.index, entry.subindex): entry for entry in profile.objects}
    for role in profile.roles.values():
        assert objects[role.index, role.subindex].data_type not in TEXT_TYPES
    setpoint = profile.roles["position_setpoint"]
    assert objects[setpoint.index, setpoint.subindex].rpdo


@pytest.mark.parametrize("name", IDENTIFIED)
def test_roles_that_the_reference_controller_needs(name: str) -> None:
    profile = load_profile(name)
    objects = {(entry.index, entry.subindex): entry for entry in profile.objects}
    assert set(profile.roles) >= ROLES
    torque = profile.roles["torque_actual"]
    assert objects[torque.index, torque.subindex].tpdo


@pytest.mark.parametrize("name", available_profiles())
def test_identity_and_modes_are_in_the_dictionary(name: str) -> None:
    profile = load_profile(name)
    default = {(entry.index, entry.subindex): entry.default for entry in profile.objects}
    assert default[0x1018, 1] == profile.vendor_id
    assert default[0x1018, 2] == profile.product_code
    assert default[0x1008, 0] == profile.device_name
    assert default[0x6502, 0] == sum(1 << (mode - 1) for mode in profile.modes)


@pytest.mark.parametrize("name", available_profiles())
def test_sub_index_0_of_a_record_is_its_highest(name: str) -> None:
    objects = {(entry.index, entry.subindex): entry for entry in load_profile(name).objects}
    for (index, subindex), entry in objects.items():
        if subindex == 0 and entry.name.endswith("Highest sub-index supported"):
            assert entry.default == max(sub for known, sub in objects if known == index)


@pytest.mark.parametrize("name", available_profiles())
def test_names_tell_records_from_variables(name: str) -> None:
    objects = load_profile(name).objects
    records = {entry.index for entry in objects if entry.subindex}
    for entry in objects:
        assert ("." in entry.name) == (entry.index in records)
    for index in records:
        assert len({entry.name.partition(".")[0] for entry in objects if entry.index == index}) == 1


def test_servoone_has_only_what_such_a_drive_has() -> None:
    profile = load_profile("servoone")
    indices = {entry.index for entry in profile.objects}
    absent = {0x603F, 0x6062, *range(0x6065, 0x6069), 0x606D, 0x60F4, 0x6073, 0x6075, 0x6087, 0x60B0, 0x60E0, 0x1016}
    assert not indices & absent
    assert (profile.modes, profile.streaming_mode) == ((1, 3, 6, 7), 7)
    assert profile.roles["velocity_gain"].si_per_unit == pytest.approx(60 / (2 * pi))
    assert profile.roles["position_gain"].si_per_unit == pytest.approx(1 / 60)


def test_full_profile_streams_in_mode_8() -> None:
    profile = load_profile("cia402-full")
    indices = {entry.index for entry in profile.objects}
    assert {0x603F, 0x6062, 0x6065, 0x6066, 0x6067, 0x6068, 0x606B, 0x60F4, 0x1200} <= indices
    assert profile.streaming_mode == 8


def test_dryve_d1_has_what_its_client_touches() -> None:
    """The objects, types and access that PyPI's dryve-d1 0.3.0 reads and writes (its od/indices.py and motion/)."""
    profile = load_profile("dryve_d1")
    objects = {(entry.index, entry.subindex): entry for entry in profile.objects}
    written = {(0x6040, 0), (0x6060, 0), (0x607A, 0), (0x607B, 1), (0x607B, 2), (0x6081, 0), (0x6083, 0), (0x6084, 0)}
    written |= {(0x6085, 0), (0x6099, 1), (0x6099, 2), (0x609A, 0), (0x60FF, 0)}
    read = {(0x1001, 0), (0x1003, 0), (0x2014, 0), (0x603F, 0), (0x6041, 0), (0x6061, 0), (0x6064, 0), (0x6067, 0), (0x606C, 0)}
    assert {address for address in written if objects[address].access is not Access.RW} == set()
    assert read <= set(objects)
    assert objects[0x6098, 0].access is Access.RO
    assert (0x607D, 0) not in objects
    assert profile.quirks == {Quirk.HOMING_LATCHES_START}
    assert profile.roles["homing_status"].index == 0x2014


def test_an_unknown_name_is_told_the_known_ones() -> None:
    with pytest.raises(UserError, match=r"unknown drive profile 'nope'; known are cia402-full, .*servoone"):
        load_profile("nope")


def copy(folder: Path, yaml_change: tuple[str, str] = ("", ""), row: str = "") -> Path:
    source = PROFILES / "servoone"
    head = (source / "profile.yaml").read_text(encoding="utf-8").replace(*yaml_change)
    (folder / "profile.yaml").write_text(head, encoding="utf-8", errors="surrogateescape")
    rows = (source / "objects.csv").read_text(encoding="utf-8")
    (folder / "objects.csv").write_text(rows + row, encoding="utf-8", errors="surrogateescape")
    return folder


def test_a_copy_is_read_as_a_type_of_its_own(tmp_path: Path) -> None:
    assert load_profile_from(copy(tmp_path)).objects == load_profile("servoone").objects


@pytest.mark.parametrize(
    ("row", "complaint"),
    [
        ("200g,00,Name,U8,rw,,,,", "index '200g' is not upper-case hex"),
        ("2001,0,Name,U8,rw,,,,", "sub '0' is not upper-case hex"),
        ("2001,00,Name,U9,rw,,,,", "type 'U9' is none of BOOL"),
        ("2001,00,Name,U8,rx,,,,", "'rx' is not a valid Access"),
        ("2001,00,Name,U8,rw,x,,,", "pdo 'x' is none of"),
        ("2001,00,Name,U8,rw,,seven,,", "'seven'"),
        ("2001,00,Name,U8,rw,,9,0,8", "default 9 is outside 0..8"),
        ("2001,00,Name,U8,rw,,,9,8", "low 9 is above high 8"),
        ("2001,00,,U8,rw,,,,", "the name is empty"),
        ("6040,00,Controlword,U16,rw,,,,", "6040h:00 stands here twice"),
        ("2001,00,Name,U8", "expected the 9 columns"),
        ("2001,00,Name,U8,rw,,,,,more", "expected the 9 columns"),
    ],
)
def test_a_bad_row_is_named(tmp_path: Path, row: str, complaint: str) -> None:
    last = len(load_profile("servoone").objects) + 2
    with pytest.raises(UserError) as error:
        load_profile_from(copy(tmp_path, row=row + "\n"))
    assert f"objects.csv, row {last}: " in str(error.value)
    assert complaint in str(error.value)


@pytest.mark.parametrize("row", ["2001,00,Weg in \udcb5m,I32,rw,,,,", "2001,00," + "x" * 200_000 + ",I32,rw,,,,"])
def test_objects_that_are_no_table_are_one_line(tmp_path: Path, row: str) -> None:
    """A micro sign in Latin-1; a field that is larger than Python's reader of CSV takes."""
    with pytest.raises(UserError, match=r"objects\.csv"):
        load_profile_from(copy(tmp_path, row=row + "\n"))


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (("vendor_id: 0x16", "vendor_id: -1"), "vendor_id"),
        (("streaming_mode: 7", "streaming_mode: 8"), "streaming_mode: 8 is not one of the modes"),
        (('object: "21A3"', 'object: "21A9"'), "roles.torque_actual: objects.csv has no 21A9"),
        (("torque_actual:", "torque_actaul:"), "roles.torque_actaul.[key]: Input should be 'additive_torque', 'bus_timeout'"),
        (("streaming_mode: 7", "streaming_mode: 7\nquirks: [runs_backwards]"), "quirks.0: Input should be 'homing_latches"),
        (("description:", "descripton:"), "description"),
        (("modes: [1, 3, 6, 7]", "modes: [1, 3, 6, 7"), "is not YAML"),
        (("description:", "# 20 \udcb5m\ndescription:"), "is not YAML: 'utf-8' codec can't decode byte 0xb5"),
    ],
)
def test_a_bad_head_is_named(tmp_path: Path, change: tuple[str, str], complaint: str) -> None:
    with pytest.raises(UserError, match=r"profile\.yaml") as error:
        load_profile_from(copy(tmp_path, yaml_change=change))
    assert complaint in str(error.value)
