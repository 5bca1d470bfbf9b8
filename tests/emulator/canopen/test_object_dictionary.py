"""Variables and the dictionary: addresses, ranges, hooks, resets; values as bytes."""

from __future__ import annotations

import pytest
from canopen.objectdictionary import ODVariable
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.drive_profiles import DataType, load_profile
from drivetwin.emulator.canopen import AbortCode, ObjectDictionary, SdoAbort
from drivetwin.emulator.canopen.data_types import decode, encode, type_range


def dictionary() -> ObjectDictionary:
    return ObjectDictionary.from_profile(load_profile("cia402-full"), 7)


def test_addresses_and_node_relative_defaults() -> None:
    od = dictionary()
    assert od[0x6041].name == "Statusword"
    assert od[0x1800, 1].value == 0x187
    assert od[0x1018, 4].value == 7
    assert 0x6041 in od
    assert (0x60C1, 1) in od
    assert (0x60C1, 9) not in od
    assert 0x2999 not in od
    assert len(list(od)) == len(od) == len(load_profile("cia402-full").objects)


def test_a_hook_is_asked_before_the_value_is_stored() -> None:
    variable = dictionary()[0x607A]
    before: list[object] = []
    variable.on_write = lambda _value: before.append(variable.value)
    variable.write(5)
    assert (before, variable.value) == ([0], 5)


def test_the_range_is_checked_before_the_hook() -> None:
    variable = dictionary()[0x605D]
    asked: list[object] = []
    variable.on_write = asked.append
    for value, code in ((0, AbortCode.VALUE_TOO_LOW), (5, AbortCode.VALUE_TOO_HIGH)):
        with pytest.raises(SdoAbort) as refusal:
            variable.write(value)
        assert refusal.value.code is code
    assert asked == []


def test_on_read_gives_the_value() -> None:
    variable = dictionary()[0x6064]
    variable.on_read = lambda: -2
    assert variable.read() == -2
    assert variable.encode() == b"\xfe\xff\xff\xff"


def test_commissioned_values_survive_a_reset() -> None:
    od = dictionary()
    od[0x60FB, 1].commission(12.5)
    od[0x60FB, 1].write(3.0)
    od[0x1006].write(2000)
    od.reset_application()
    assert (od[0x60FB, 1].value, od[0x1006].value) == (12.5, 2000)
    od.reset_communication()
    assert od[0x1006].value == 0


NUMBERS = [data_type for data_type in DataType if data_type.name[0] in "IU" and data_type is not DataType.USTR]


@given(st.sampled_from(NUMBERS), st.data())
def test_integers_as_another_implementation_encodes_them(data_type: DataType, data: st.DataObject) -> None:
    low, high = type_range(data_type)
    value = data.draw(st.integers(int(low), int(high)))
    theirs = ODVariable("x", 0x2000)
    theirs.data_type = int(data_type)
    assert encode(data_type, value) == theirs.encode_raw(value)
    assert decode(data_type, encode(data_type, value)) == value


@given(st.floats(width=32, allow_nan=False))
def test_floats_come_back(value: float) -> None:
    assert decode(DataType.R32, encode(DataType.R32, value)) == value


@given(st.floats(allow_nan=False))
def test_real64_as_another_implementation_encodes_it(value: float) -> None:
    theirs = ODVariable("x", 0x2000)
    theirs.data_type = int(DataType.R64)
    assert encode(DataType.R64, value) == theirs.encode_raw(value)
    assert decode(DataType.R64, encode(DataType.R64, value)) == value


def test_revision_counts_changes_of_parameters_however_they_come() -> None:
    od = dictionary()
    seen = od.revision.number
    od[0x607A].write(1000)
    assert od.revision.number == seen
    od[0x6072].write(1234)
    assert od.revision.number == seen + 1
    od[0x6072].write(1234)
    assert od.revision.number == seen + 1
    od.reset_application()
    assert od.revision.number > seen + 1
