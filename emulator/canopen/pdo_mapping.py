"""Which objects a PDO carries: mapping entries, parsed and checked (CiA 301, 7.5.2.36 and 7.5.2.38)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from drivetwin.drive_profiles import DataType
from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.data_types import Layout, layout, size
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary, Variable

MAX_LENGTH = 8
"""Bytes of a PDO, and with whole bytes as the finest step the number of its entries."""

MappingRule = Callable[[Variable], bool]
"""Whether an object may stand in a PDO of one direction."""

_DUMMIES = {data_type: size(data_type) for data_type in DataType if DataType.I8 <= data_type <= DataType.U32}
"""Types that stand for themselves in an RPDO, to skip bytes meant for another node (CiA 301, 7.4.7.1)."""


@dataclass(frozen=True)
class Mapping:
    """Objects of a PDO in their order, and how their values lie in its data (padding where a dummy is mapped)."""

    variables: tuple[Variable, ...]
    layout: Layout


@dataclass(frozen=True)
class _Entry:
    variable: Variable | None
    part: DataType | int


def maps_to_rpdo(variable: Variable) -> bool:
    """Objects that an RPDO may write."""
    return variable.rpdo


def maps_to_tpdo(variable: Variable) -> bool:
    """Objects that a TPDO may carry."""
    return variable.tpdo


def check_entry(od: ObjectDictionary, value: int, rule: MappingRule) -> None:
    """Raise SdoAbort where a mapping entry names nothing that may be mapped; 0 is an unused entry."""
    if value != 0:
        _parse(od, value, rule)


def parse_mapping(od: ObjectDictionary, values: Iterable[int], rule: MappingRule) -> Mapping:
    """The mapping that entries :01.. describe. Raises SdoAbort."""
    entries = [_parse(od, value, rule) for value in values]
    place = layout([entry.part for entry in entries])
    if place.size > MAX_LENGTH:
        raise SdoAbort(AbortCode.PDO_LENGTH)
    return Mapping(tuple(entry.variable for entry in entries if entry.variable is not None), place)


def _parse(od: ObjectDictionary, value: int, rule: MappingRule) -> _Entry:
    """An entry is index, sub-index and length in bits: iiiissll."""
    index, subindex, bits = value >> 16, value >> 8 & 0xFF, value & 0xFF
    if rule is maps_to_rpdo and index in _DUMMIES:
        return _dummy(DataType(index), subindex, bits)
    variable = od.find(index, subindex)
    if not rule(variable) or variable.size is None or bits != 8 * variable.size:
        raise SdoAbort(AbortCode.NOT_MAPPABLE)
    return _Entry(variable, variable.data_type)


def _dummy(data_type: DataType, subindex: int, bits: int) -> _Entry:
    length = _DUMMIES[data_type] or 0
    if subindex or bits != 8 * length:
        raise SdoAbort(AbortCode.NOT_MAPPABLE)
    return _Entry(None, length)
