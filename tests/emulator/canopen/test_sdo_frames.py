"""SDO byte by byte, as CiA 301, 7.2.4.3 draws the frames."""

from dataclasses import replace

import pytest
from canopen_bench import NODE, Bench

from drivetwin.drive_profiles import Access, DataType, ObjectEntry, load_profile
from drivetwin.emulator.canopen import AbortCode, SdoAbort

TEXT = 0x2F00
WRITE_ONLY = 0x2F01


def bench() -> Bench:
    profile = load_profile("cia402-full")
    entry = ObjectEntry(TEXT, 0, "Text", DataType.VSTR, Access.RW, False, False, "", False, None, None)
    extra = (
        entry,
        replace(entry, index=WRITE_ONLY, name="Command", data_type=DataType.U8, access=Access.WO, default=0),
    )
    return Bench(replace(profile, objects=(*profile.objects, *extra))).boot()


@pytest.mark.parametrize(
    ("request_", "answer"),
    [
        ("40 00 10 00 00 00 00 00", "43 00 10 00 92 01 02 00"),  # U32
        ("40 17 10 00 00 00 00 00", "4B 17 10 00 00 00 00 00"),  # U16
        ("40 18 10 00 00 00 00 00", "4F 18 10 00 04 00 00 00"),  # U8
        ("40 C2 60 02 00 00 00 00", "4F C2 60 02 FD 00 00 00"),  # I8, -3
        ("40 0A 10 00 00 00 00 00", "4F 0A 10 00 31 00 00 00"),  # one character
        ("2B 17 10 00 64 00 00 00", "60 17 10 00 00 00 00 00"),
        ("2F 60 60 00 07 00 00 00", "60 60 60 00 00 00 00 00"),
        ("23 7A 60 00 78 56 34 12", "60 7A 60 00 00 00 00 00"),
        ("22 7A 60 00 78 56 34 12", "60 7A 60 00 00 00 00 00"),  # size not indicated: the object's
        ("22 17 10 00 64 00 FF FF", "60 17 10 00 00 00 00 00"),
    ],
)
def test_expedited(request_: str, answer: str) -> None:
    assert bench().sdo(request_) == answer


def test_a_downloaded_value_is_there() -> None:
    one = bench()
    one.sdo("22 17 10 00 64 00 FF FF")
    assert one.sdo("40 17 10 00 00 00 00 00") == "4B 17 10 00 64 00 00 00"


def test_segmented_upload() -> None:
    one = bench()
    assert one.sdo("40 08 10 00 00 00 00 00") == "41 08 10 00 11 00 00 00"
    assert one.sdo("60 00 00 00 00 00 00 00") == "00 " + b"drivetw".hex(" ").upper()
    assert one.sdo("70 00 00 00 00 00 00 00") == "10 " + b"in CiA ".hex(" ").upper()
    assert one.sdo("60 00 00 00 00 00 00 00") == "09 " + b"402".hex(" ").upper() + " 00 00 00 00"
    assert one.sdo("70 00 00 00 00 00 00 00") == "80 00 00 00 01 00 04 05"


def test_segmented_upload_of_nothing() -> None:
    one = bench()
    assert one.sdo("40 00 2F 00 00 00 00 00") == "41 00 2F 00 00 00 00 00"
    assert one.sdo("60 00 00 00 00 00 00 00") == "0F 00 00 00 00 00 00 00"


def test_segmented_download() -> None:
    one = bench()
    assert one.sdo("21 00 2F 00 09 00 00 00") == "60 00 2F 00 00 00 00 00"
    assert one.sdo("00 61 62 63 64 65 66 67") == "20 00 00 00 00 00 00 00"
    assert one.od[TEXT].value == ""
    assert one.sdo("1B 68 69 00 00 00 00 00") == "30 00 00 00 00 00 00 00"
    assert one.od[TEXT].value == "abcdefghi"


def test_segmented_download_of_a_number_without_a_size() -> None:
    one = bench()
    assert one.sdo("20 7A 60 00 00 00 00 00") == "60 7A 60 00 00 00 00 00"
    assert one.sdo("07 78 56 34 12 00 00 00") == "20 00 00 00 00 00 00 00"
    assert one.od[0x607A].value == 0x12345678


ABORTS = [
    ("40 99 29 00 00 00 00 00", "06020000"),
    ("40 18 10 09 00 00 00 00", "06090011"),
    ("40 01 2F 00 00 00 00 00", "06010001"),
    ("23 00 10 00 00 00 00 00", "06010002"),
    ("23 18 10 01 00 00 00 00", "06010002"),
    ("2B 41 60 00 00 00 00 00", "06010002"),
    ("23 17 10 00 00 00 00 00", "06070012"),
    ("2F 17 10 00 00 00 00 00", "06070013"),
    ("21 17 10 00 04 00 00 00", "06070012"),
    ("21 7A 60 00 03 00 00 00", "06070013"),
    ("21 00 2F 00 00 00 00 10", "05040005"),
    ("2B 5A 60 00 09 00 00 00", "06090031"),
    ("2B 5A 60 00 FF FF 00 00", "06090032"),
    ("23 F9 60 01 00 00 C0 7F", "06090030"),  # NaN
    ("23 F9 60 01 00 00 80 7F", "06090030"),  # infinity
    ("E0 00 10 00 00 00 00 00", "05040001"),
    ("60 00 10 00 00 00 00 00", "05040001"),  # segment without a transfer
    ("00 00 10 00 00 00 00 00", "05040001"),
    ("23 03 10 00 00 00 00 00", "06070012"),
    ("2F 03 10 00 01 00 00 00", "06090030"),
    ("40 03 10 01 00 00 00 00", "08000024"),
    ("23 05 10 00 80 00 00 40", "06090030"),  # no SYNC producer
    ("23 05 10 00 01 06 00 00", "06090030"),  # CAN-ID of an SDO
    ("23 05 10 00 80 00 00 20", "06090030"),  # extended frame
    ("23 14 10 00 80 01 00 00", "06090030"),
    ("23 14 10 00 90 00 00 00", "08000022"),  # changed while it exists
]


@pytest.mark.parametrize(("request_", "code"), ABORTS)
def test_abort(request_: str, code: str) -> None:
    address = request_[3:11]
    expected = bytes.fromhex(code)[::-1].hex(" ").upper()
    assert bench().sdo(request_) == f"80 {address} {expected}"


def test_toggle_not_alternated_ends_the_upload() -> None:
    one = bench()
    one.sdo("40 08 10 00 00 00 00 00")
    one.sdo("60 00 00 00 00 00 00 00")
    assert one.sdo("60 00 00 00 00 00 00 00") == "80 08 10 00 00 00 03 05"
    assert one.sdo("70 00 00 00 00 00 00 00").endswith("01 00 04 05")


def test_toggle_not_alternated_ends_the_download() -> None:
    one = bench()
    one.sdo("21 00 2F 00 09 00 00 00")
    assert one.sdo("10 61 62 63 64 65 66 67") == "80 00 2F 00 00 00 03 05"
    assert one.od[TEXT].value == ""


@pytest.mark.parametrize(
    ("last", "code"), [("01 68 69 6A 6B 6C 6D 6E", "12 00 07 06"), ("1D 68 00 00 00 00 00 00", "13 00 07 06")]
)
def test_a_download_that_is_not_as_long_as_announced(last: str, code: str) -> None:
    one = bench()
    one.sdo("21 00 2F 00 09 00 00 00")
    one.sdo("00 61 62 63 64 65 66 67")
    toggled = f"{int(last[:2], 16) | 0x10:02X}{last[2:]}"
    assert one.sdo(toggled) == f"80 00 2F 00 {code}"


def test_the_clients_abort_is_not_answered_and_ends_the_transfer() -> None:
    one = bench()
    one.sdo("40 08 10 00 00 00 00 00")
    one.device.receive(0x600 + NODE, bytes.fromhex("80 08 10 00 00 00 04 05"))
    assert one.take() == []
    assert one.sdo("60 00 00 00 00 00 00 00").endswith("01 00 04 05")


def test_an_initiate_in_the_middle_begins_anew() -> None:
    one = bench()
    one.sdo("40 08 10 00 00 00 00 00")
    one.sdo("60 00 00 00 00 00 00 00")
    assert one.sdo("40 00 10 00 00 00 00 00") == "43 00 10 00 92 01 02 00"
    assert one.sdo("70 00 00 00 00 00 00 00").endswith("01 00 04 05")


@pytest.mark.parametrize("length", range(8))
def test_a_short_frame_is_no_sdo(length: int) -> None:
    one = bench()
    one.device.receive(0x600 + NODE, bytes.fromhex("40 00 10 00 00 00 00 00")[:length])
    assert one.take() == []


def test_what_a_hook_refuses_is_told_and_not_stored() -> None:
    one = bench()

    def refuse(_value: object) -> None:
        raise SdoAbort(AbortCode.DEVICE_STATE)

    one.od[0x6060].on_write = refuse
    assert one.sdo("2F 60 60 00 07 00 00 00") == "80 60 60 00 22 00 00 08"
    assert one.od[0x6060].value == 0


def test_the_codes_are_those_of_another_implementation() -> None:
    import canopen  # noqa: PLC0415

    theirs = canopen.SdoAbortedError.CODES
    ours = {int(code) for code in AbortCode}
    assert ours <= set(theirs) | {AbortCode.RESOURCE}
