"""Objects of any type, access and limits, written as an EDS and read back, are the same."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin.drive_profiles import Access, DataType, ObjectEntry, load_profile
from drivetwin.drive_profiles.eds_profile import profile_from_eds
from drivetwin.drive_profiles.eds_writer import eds_text

FIRST = 0x2F00
TYPES = [DataType.I8, DataType.I16, DataType.I32, DataType.U8, DataType.U16, DataType.U32]
ACCESS = [
    *((Access.RW, rpdo, tpdo) for rpdo in (False, True) for tpdo in (False, True)),
    *((Access.RO, False, False), (Access.RO, False, True), (Access.WO, False, False), (Access.WO, True, False)),
    (Access.CONST, False, False),
]
"""Who may read and write it, and which PDOs may carry it (CiA 306-1, table 'AccessType')."""

NAMES = st.text(st.sampled_from("abcdefgh ijkl-MNOP 0123456789/()%"), min_size=1, max_size=40).map(str.strip).filter(bool)


@st.composite
def entry(draw: st.DrawFn, index: int) -> ObjectEntry:
    """A variable of integer type with limits about its default."""
    kind = draw(st.sampled_from(TYPES))
    bits = int(kind.name[1:])
    lowest, highest = (-(1 << bits - 1), (1 << bits - 1) - 1) if kind.name[0] == "I" else (0, (1 << bits) - 1)
    low, default, high = sorted(draw(st.integers(lowest, highest)) for _ in range(3))
    access, rpdo, tpdo = draw(st.sampled_from(ACCESS))
    return ObjectEntry(index, 0, draw(NAMES), kind, access, rpdo, tpdo, default, False, low, high)


ENTRIES = st.integers(1, 8).flatmap(lambda count: st.tuples(*(entry(FIRST + number) for number in range(count))))


@settings(deadline=None, max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(profile=st.sampled_from(["servoone", "cia402-full"]), own=ENTRIES)
def test_objects_come_back_as_they_were(tmp_path: Path, profile: str, own: tuple[ObjectEntry, ...]) -> None:
    base = load_profile(profile)
    path = tmp_path / "drive.eds"
    path.write_text(eds_text(replace(base, objects=(*base.objects, *own)), "drive.eds"), encoding="ascii")
    read = {each.index: each for each in profile_from_eds(path, base).objects if each.index >= FIRST and each.index < 0x3000}
    assert [read.get(each.index) for each in own] == list(own)
