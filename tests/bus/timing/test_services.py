"""Services by identifier, against the function codes of the predefined connection set (CiA 301, 7.3.3)."""

from __future__ import annotations

import pytest

from drivetwin.bus.timing.services import OTHER, service

FUNCTION_CODES = {
    "EMCY": 0b0001,
    "TPDO 1": 0b0011,
    "RPDO 1": 0b0100,
    "TPDO 2": 0b0101,
    "RPDO 2": 0b0110,
    "TPDO 3": 0b0111,
    "RPDO 3": 0b1000,
    "TPDO 4": 0b1001,
    "RPDO 4": 0b1010,
    "SDO answer": 0b1011,
    "SDO request": 0b1100,
    "heartbeat": 0b1110,
}
"""An identifier is function code x 128 + node-ID."""

BROADCAST = {0x000: "NMT", 0x080: "SYNC", 0x100: "TIME", 0x7E4: "LSS", 0x7E5: "LSS"}


@pytest.mark.parametrize(("name", "code"), FUNCTION_CODES.items())
def test_each_node_has_its_own_identifier_of_a_service(name: str, code: int) -> None:
    assert {service((code << 7) + node) for node in range(1, 128)} == {name}


@pytest.mark.parametrize(("identifier", "name"), BROADCAST.items())
def test_services_that_are_for_all(identifier: int, name: str) -> None:
    assert service(identifier) == name


def test_all_other_identifiers_are_of_no_service() -> None:
    taken = {(code << 7) + node for code in FUNCTION_CODES.values() for node in range(1, 128)} | set(BROADCAST)
    assert {service(identifier) for identifier in set(range(0x800)) - taken} == {OTHER}
