"""A Modbus request to the drives of a machine: which drive it addresses, what it asks, what is answered.

No sockets and no threads are here: a PDU goes in, a PDU comes out.
"""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin.drive_profiles.modbus_map import load_modbus_map
from drivetwin.emulator.drive.drive import Drive
from drivetwin.emulator.modbus import gateway
from drivetwin.emulator.modbus.arbitration import Arbitration
from drivetwin.emulator.modbus.exception_codes import ExceptionCode, ModbusException, refusal
from drivetwin.emulator.modbus.functions import FUNCTIONS, WRITING
from drivetwin.emulator.modbus.registers import Registers

NOT_SIGNIFICANT = (0x00, 0xFF)
"""Unit identifiers of a client that thinks of a device without units (MODBUS Messaging on TCP/IP V1.0b, 4.4.2.1)."""


class Unit:
    """One drive as Modbus sees it."""

    def __init__(self, drive: Drive) -> None:
        mapped = load_modbus_map(drive.profile.name)
        self._device = drive.device
        self.dictionary = drive.dictionary
        self.arbitration = Arbitration(drive.dictionary, mapped.arbitrated)
        self.registers = Registers(mapped, drive.dictionary, self.arbitration.permit)

    @property
    def node_id(self) -> int:
        """CANopen's node-ID, which is the unit identifier too."""
        return self._device.nmt.node_id


class ModbusService:
    """Answers requests to the drives of one machine. To be called by the thread that owns the machine."""

    def __init__(self, drives: Sequence[Drive]) -> None:
        self._drives = drives
        self._units = [Unit(drive) for drive in drives]

    @property
    def units(self) -> Sequence[Unit]:
        """The drives as they are there now: one that had a power cycle is another."""
        for number, drive in enumerate(self._drives):
            if self._units[number].dictionary is not drive.dictionary:
                self._units[number] = Unit(drive)
        return self._units

    def answer(self, unit_id: int, pdu: bytes) -> bytes:
        """The answer to a request over TCP: always one, if need be an exception response."""
        function = pdu[0]
        try:
            if function == gateway.FUNCTION:
                return self._gateway(unit_id, pdu)
            serve = FUNCTIONS.get(function)
            if serve is None:
                raise ModbusException(ExceptionCode.ILLEGAL_FUNCTION)
            unit = self._unit(unit_id)
            with unit.arbitration.modbus():
                return serve(pdu, unit.registers)
        except ModbusException as refused:
            return refusal(function, refused.code)

    def answer_on_line(self, unit_id: int, pdu: bytes) -> bytes | None:
        """The answer on a serial line: none to other units, and none to a broadcast (Serial Line V1.02, 2.1, 2.2)."""
        if unit_id == 0:
            for unit in self.units if pdu[0] in WRITING else ():
                self.answer(unit.node_id, pdu)
            return None
        present = any(unit.node_id == unit_id for unit in self.units)
        return self.answer(unit_id, pdu) if present else None

    def _gateway(self, unit_id: int, pdu: bytes) -> bytes:
        """Node-ID 0 means the drive that the unit identifier selects (CiA 309-2, 5)."""
        request = gateway.decode(pdu)
        unit = self._unit(request.node_id or unit_id)
        with unit.arbitration.modbus():
            return gateway.answer(request, unit.dictionary)

    def _unit(self, unit_id: int) -> Unit:
        for unit in self.units:
            if unit.node_id == unit_id:
                return unit
        if unit_id in NOT_SIGNIFICANT and len(self.units) == 1:
            return self.units[0]
        raise ModbusException(ExceptionCode.GATEWAY_TARGET_DEVICE_FAILED_TO_RESPOND)
