"""A user's own EDS or DCF: what vendors ship is read with a warning, what would lie about the drive is refused."""

from __future__ import annotations

import logging
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from drivetwin.drive_profiles import Access, DataType, DriveProfile, ObjectEntry, available_profiles, load_profile
from drivetwin.drive_profiles.eds_profile import profile_from_eds
from drivetwin.drive_profiles.eds_reader import EdsNumber, parse_number, read_eds
from drivetwin.drive_profiles.eds_writer import eds_text
from drivetwin.emulator.canopen.data_types import encode
from drivetwin.foundation.errors import UserError

Change = Callable[[str], str]

ALL_INTEGERS = {0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x10, 0x12, 0x13, 0x14, 0x15, 0x16, 0x18, 0x19, 0x1A, 0x1B}
"""BOOLEAN, INTEGER8..64 and UNSIGNED8..64 by their codes in CiA 301, table 44."""


def written(folder: Path, change: Change = str, name: str = "servoone") -> Path:
    """The EDS of a profile with something done to its text."""
    file = folder / "drive.eds"
    file.write_text(change(eds_text(load_profile(name), file.name)), encoding="latin-1")
    return file


def read(folder: Path, change: Change = str) -> dict[tuple[int, int], ObjectEntry]:
    profile = profile_from_eds(written(folder, change), load_profile("servoone"))
    return {(entry.index, entry.subindex): entry for entry in profile.objects}


def changed(section: str, old: str, new: str) -> Change:
    """Replace a line of one section; it has to be there."""

    def change(text: str) -> str:
        before, header, rest = text.partition(f"[{section}]\n")
        body, end, after = rest.partition("\n\n")
        assert header, section
        assert re.search(old, body), (old, body)
        return before + header + re.sub(old, new, body) + end + after

    return change


def added(text: str) -> Change:
    return lambda eds: eds + text


@pytest.mark.parametrize("name", available_profiles())
def test_a_written_eds_is_read_as_the_same_drive_type(name: str, tmp_path: Path) -> None:
    base = load_profile(name)
    profile = profile_from_eds(written(tmp_path, name=name), base)
    assert sorted(profile.objects, key=lambda entry: (entry.index, entry.subindex)) == sorted(
        base.objects, key=lambda entry: (entry.index, entry.subindex)
    )
    assert (profile.name, profile.roles, profile.modes) == ("drive", base.roles, base.modes)
    assert (profile.vendor_id, profile.product_code) == (base.vendor_id, base.product_code)
    assert profile.device_name == base.device_name


@pytest.mark.parametrize(
    ("text", "value", "relative"),
    [
        ("12", 12, False),
        ("0x1A", 26, False),
        ("0X1a", 26, False),
        ("-5", -5, False),
        ("010", 10, False),
        ("$NODEID+0x180", 0x180, True),
        ("0x180 + $nodeid", 0x180, True),
        ("$NODEID", 0, True),
        (" 7 ", 7, False),
    ],
)
def test_numbers(text: str, value: int, relative: bool) -> None:
    assert parse_number(text) == EdsNumber(value, relative)


@pytest.mark.parametrize("text", ["", "seven", "1.5", "1+2", "0x", "$NODEID+$NODEID", "1 2 x"])
def test_what_is_no_number(text: str) -> None:
    assert parse_number(text) is None


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (changed("60C0", "ParameterName=.*\n", ""), "no ParameterName in 60C0; they are read without"),
        (changed("60C1sub1", "ParameterName=.*\n", ""), "no ParameterName in 60C1sub1; they are read without"),
        (added("\n</html>\nthe end\n"), r"is neither \[section\] nor key=value; skipped"),
        (changed("OptionalObjects", r"SupportedObjects=\d+", "SupportedObjects=3"), r"SupportedObjects of \[OptionalObjects\]"),
        (changed("OptionalObjects", "0x1003", "0x1FFF"), "1FFF is listed and has no section"),
        (changed("OptionalObjects", "0x1003", "0x1FFF"), "1003 is in no list of objects and has a section"),
        (changed("1018", "SubNumber=5", "SubNumber=9"), "SubNumber of 1018 is not the number of its sub-indices"),
        (changed("605A", "LowLimit=0", "LowLimit=9"), "the limits of 605A make no sense"),
        (changed("6072", "DefaultValue=.*", "DefaultValue=0x10000"), "the value of 6072 is not a value of its type"),
        (changed("605A", "DefaultValue=2", "DefaultValue=9"), "the value of 605A is outside its limits"),
        (changed("6041", "AccessType=ro\n", ""), "no AccessType in 6041; they are taken as read-only"),
        (
            changed("6091sub2", "DefaultValue=.*\nPDOMapping=1\n.*\n.*", "DefaultValue=0"),
            "6091h:02 is 0, by which the drive divides",
        ),
        (lambda text: text.replace("[2168]", "[2169]"), "no object of the file is the drive's position gain"),
        (added("[1018sub3]\nDefaultValue=1\n"), r"\[1018sub3\] stands there twice"),
    ],
)
def test_what_vendors_ship_warns_and_goes_on(
    change: Change, complaint: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING):
        assert len(read(tmp_path, change)) >= len(load_profile("servoone").objects) - 1
    assert re.search(complaint, caplog.text)
    assert "drive.eds" in caplog.text


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (changed("6064", "DataType=.*", "DataType=0x0099"), r"\[6064\]: DataType is 0x0099; expected a code of CiA 301"),
        (changed("6064", "DataType=.*\n", ""), r"\[6064\]: DataType is missing; expected"),
        (changed("6064", "DataType=.*", "DataType=0x0009"), r"\[6064\]: DataType is 0x0009; expected 0x0004 for Position"),
        (changed("6064", "AccessType=.*", "AccessType=maybe"), r"\[6064\]: AccessType is 'maybe'; expected ro, const"),
        (lambda _: "hello\n", r"is not an EDS or DCF \(CiA 306\): expected sections such as \[FileInfo\]"),
        (lambda _: "<?xml version='1.0'?>\n<ISO15745ProfileContainer/>", "an XDD has to be exported as EDS"),
        (lambda _: "\x00\x01\x02\xff\xfe", "is not an EDS or DCF"),
        (lambda _: "[FileInfo]\nFileName=x\n", r"has no object: expected a section \[1000\]"),
        (changed("1A01sub2", "DefaultValue=.*", "DefaultValue=0x60610010"), r"\[1A01sub2\]: maps 6061h with 16 bits"),
        (changed("1A01sub2", "DefaultValue=.*", "DefaultValue=0x2FFF0008"), r"\[1A01sub2\]: maps 2FFFh with 8 bits"),
        (changed("1A01sub2", "DefaultValue=.*", "DefaultValue=0x10170010"), r"\[1A01sub2\]: maps 1017h with 16 bits"),
    ],
)
def test_what_lies_is_refused(change: Change, complaint: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"drive\.eds") as error:
        read(tmp_path, change)
    assert re.search(complaint, str(error.value))


@pytest.mark.parametrize(
    ("section", "right", "name"),
    [
        ("1003sub1", 0x0007, "Pre-defined error field"),
        ("1017", 0x0006, "Producer heartbeat time"),
        ("1018sub1", 0x0007, "Identity object"),
        ("1800sub2", 0x0005, "TPDO 1 communication parameter"),
        ("1A00sub0", 0x0005, "TPDO 1 mapping parameter"),
        ("605A", 0x0003, "Quick stop option code"),
        ("6040", 0x0006, "Controlword"),
        ("6060", 0x0002, "Modes of operation"),
        ("6064", 0x0004, "Position actual value"),
        ("6071", 0x0003, "Target torque"),
        ("6072", 0x0006, "Max torque"),
        ("6083", 0x0007, "Profile acceleration"),
        ("6085", 0x0007, "Quick stop deceleration"),
        ("6091sub1", 0x0007, "Gear ratio"),
        ("6098", 0x0002, "Homing method"),
        ("6099sub2", 0x0007, "Homing speeds"),
        ("60C1sub1", 0x0004, "Interpolation data record"),
        ("60FEsub1", 0x0007, "Digital outputs"),
    ],
)
def test_an_object_of_the_standard_has_the_standards_type(section: str, right: int, name: str, tmp_path: Path) -> None:
    """Types as CiA 301, 7.5.2, and CiA 402-2 have them; any other integer, wider, narrower or of the other sign, is a lie."""
    for wrong in ALL_INTEGERS - {right}:
        with pytest.raises(UserError) as error:
            read(tmp_path, changed(section, "DataType=.*", f"DataType=0x{wrong:04X}"))
        said = rf"drive\.eds, \[{section}\]: DataType is 0x{wrong:04X}; expected 0x{right:04X} for {name}"
        assert re.search(said, str(error.value)), error.value


@pytest.mark.parametrize(
    ("objects", "complaint"),
    [
        ("[6080]\nParameterName=x\nDataType=0x0006\n", r"\[6080\]: DataType is 0x0006; expected 0x0007 for Max motor speed"),
        ("[1016sub0]\nDataType=5\n[1016sub7]\nDataType=0x0006\n", r"\[1016sub7\]: DataType is 0x0006; expected 0x0007"),
        ("[1016]\nDataType=0x0006\nCompactSubObj=2\n", r"\[1016sub1\]: DataType is 0x0006; expected 0x0007"),
    ],
)
def test_an_object_beyond_the_profile_has_the_standards_type_too(objects: str, complaint: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=complaint):
        read(tmp_path, added(objects))


def test_a_text_of_the_standard_may_have_another_text_type(tmp_path: Path) -> None:
    """1008h as OCTET_STRING, which vendors write: no client can tell."""
    change = changed("1008", "DataType=0x0009(\n.*)*", "DataType=0x000A\nAccessType=const\nDefaultValue=")
    assert read(tmp_path, change)[0x1008, 0].data_type is DataType.OSTR


def test_a_mapping_that_is_too_long_is_refused(tmp_path: Path) -> None:
    def change(text: str) -> str:
        text = changed("1A01sub0", "DefaultValue=.*", "DefaultValue=3")(text)
        text = changed("1A01sub2", "DefaultValue=.*", "DefaultValue=0x60640020")(text)
        return changed("1A01sub3", "DefaultValue=.*", "DefaultValue=0x606C0020")(text)

    with pytest.raises(UserError, match=r"\[1A01\]: the mapping is 80 bits long; a PDO carries 64"):
        read(tmp_path, change)


def test_missing_objects_are_named_in_one_error(tmp_path: Path) -> None:
    def change(text: str) -> str:
        for section in ("1001", "6040", "6099", "6099sub0", "6099sub1", "6099sub2"):
            text = re.sub(rf"\[{section}\]\n(.+\n)+\n", "", text)
        return text

    with pytest.raises(UserError) as error:
        read(tmp_path, change)
    needed = "1001h, 6040h"  # homing speeds are optional
    assert f"lacks objects that a drive which behaves as servoone needs: {needed}; add them" in str(error.value)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"none\.eds does not exist"):
        read_eds(tmp_path / "none.eds")


def test_case_and_encoding_do_not_matter(tmp_path: Path) -> None:
    def change(text: str) -> str:
        text = re.sub(r"\[(\w+)\]", lambda found: f"[ {found.group(1).lower()} ]", text)
        text = re.sub(r"(?m)^(\w+)=", lambda found: f"{found.group(1).upper()} = ", text)
        return text.replace("Controlword", "Contr\xf4le").replace("ro\n", "RO\n").replace("\n", "\r\n") + "\x1a"

    base = {(entry.index, entry.subindex): entry for entry in load_profile("servoone").objects}
    found = read(tmp_path, change)
    assert found.keys() == base.keys()
    assert found[0x6040, 0].name == "Contr\xf4le"
    assert found[0x6041, 0].access is Access.RO


def test_a_dcf_sets_values_before_defaults(tmp_path: Path) -> None:
    def change(text: str) -> str:
        text = changed("6083", "DefaultValue=.*", "DefaultValue=5\nParameterValue=0x64")(text)
        text = changed("1800sub1", "$", "\nParameterValue=0x185")(text)
        return text + "[DeviceComissioning]\nNodeID=5\nBaudrate=1000\n"

    found = read(tmp_path, change)
    assert found[0x6083, 0].default == 100
    assert (found[0x1800, 1].default, found[0x1800, 1].default_node_relative) == (0x180, True)


def test_compact_sub_objects(tmp_path: Path) -> None:
    compact = (
        "[2F00]\nParameterName=Table\nObjectType=0x8\nDataType=0x0006\nAccessType=rww\nPDOMapping=1\n"
        "DefaultValue=4\nCompactSubObj=3\n[2F00Name]\nNrOfEntries=1\n2=Middle\n[2F00Value]\nNrOfEntries=1\n3=9\n"
    )
    found = read(tmp_path, added(compact))
    assert [found[0x2F00, sub].name for sub in range(4)] == [
        "Table.Highest sub-index supported",
        "Table.Table 1",
        "Table.Middle",
        "Table.Table 3",
    ]
    assert [found[0x2F00, sub].default for sub in range(4)] == [3, 4, 4, 9]
    assert (found[0x2F00, 1].rpdo, found[0x2F00, 1].tpdo, found[0x2F00, 1].data_type) == (True, False, DataType.U16)


def test_signed_hexadecimal_and_real(tmp_path: Path) -> None:
    objects = (
        "[2F00]\nParameterName=a\nDataType=0x0003\nAccessType=rw\nDefaultValue=0xFFFE\nLowLimit=0x8000\nHighLimit=0x7FFF\n"
        "[2F01]\nParameterName=b\nDataType=8\nAccessType=rw\nDefaultValue=0x3F800000\n"
        "[2F02]\nParameterName=c\nDataType=8\nAccessType=rw\nDefaultValue=2.5\n"
        "[2F03]\nParameterName=d\nDataType=0x000A\nAccessType=ro\nDefaultValue=01 fF\n"
    )
    found = read(tmp_path, added(objects))
    assert (found[0x2F00, 0].default, found[0x2F00, 0].low, found[0x2F00, 0].high) == (-2, -32768, 32767)
    assert [found[index, 0].default for index in (0x2F01, 0x2F02, 0x2F03)] == [1.0, 2.5, "\x01\xff"]


def test_values_that_the_file_leaves_open_are_those_of_the_profile(tmp_path: Path) -> None:
    found = read(tmp_path, lambda text: re.sub(r"DefaultValue=.*", "DefaultValue=", text))
    base: DriveProfile = load_profile("servoone")
    assert {(e.index, e.subindex): e.default for e in base.objects} == {key: entry.default for key, entry in found.items()}


def test_a_type_of_canfestivals_editor(tmp_path: Path) -> None:
    objects = (
        "[A0]\nParameterName=x\n[A0sub1]\nParameterName=x\nDataType=0x0007\nAccessType=ro\nDefaultValue=0x05\n"
        "[2F00]\nParameterName=a\nDataType=0x00A0\nAccessType=rw\nDefaultValue=3\n"
    )
    assert read(tmp_path, added(objects))[0x2F00, 0].data_type is DataType.U8


TEXTS = """
[3000]
ParameterName=Visible
ObjectType=0x7
DataType=0x{kind:04X}
AccessType=ro
DefaultValue={text}
PDOMapping=0
"""


@pytest.mark.parametrize(
    ("kind", "text", "on_the_bus", "complaint"),
    [
        (DataType.VSTR, "Grüße", "Grüße".encode("latin-1"), False),
        (DataType.VSTR, "Ω drive 電", b"? drive ?", True),
        (DataType.USTR, "Ω drive 電", "Ω drive 電".encode("utf-16-le"), False),
    ],
)
def test_text_beyond_latin_1(
    kind: DataType, text: str, on_the_bus: bytes, complaint: bool, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """CiA 301, 7.1.6: a VISIBLE_STRING has a byte a character, a UNICODE_STRING 16 bits."""
    written_text = eds_text(load_profile("cia402-full"), "drive.eds")
    listed = re.search(r"\[ManufacturerObjects\]\nSupportedObjects=(\d+)\n", written_text)
    assert listed is not None
    count = int(listed[1])
    head = f"[ManufacturerObjects]\nSupportedObjects={count + 1}\n{count + 1}=0x3000\n"
    file = tmp_path / "drive.eds"
    file.write_text(written_text.replace(listed[0], head) + TEXTS.format(kind=int(kind), text=text), encoding="utf-8")
    with caplog.at_level(logging.WARNING):
        profile = profile_from_eds(file, load_profile("cia402-full"))
    default = next(entry.default for entry in profile.objects if entry.index == 0x3000)
    assert isinstance(default, str)
    assert encode(kind, default) == on_the_bus
    assert ("the text of" in caplog.text) is complaint
    assert ("3000" in caplog.text) is complaint


@pytest.mark.parametrize("number", ["9" * 5000, "0x" + "f" * 5000, "$NODEID+" + "1" * 5000])
def test_a_number_that_no_device_has_is_none(number: str) -> None:
    assert parse_number(number) is None


def test_a_section_name_that_never_ends(tmp_path: Path) -> None:
    file = tmp_path / "drive.eds"
    file.write_text("[FileInfo]\n[" + " " * 100_000 + "x\n[ 1000 ]\nDataType=7\n")
    assert [entry.index for entry in read_eds(file).objects] == [0x1000]
