"""Objects of the drives by another way than the bus, as a real drive's service port (USB, Ethernet) tells its own tool.

A drive has one default SDO channel, for one client (CiA 301, 7.2.4): whoever asks here takes no answer from the master.
"""

from __future__ import annotations

from drivetwin.emulator.canopen.abort_codes import SdoAbort
from drivetwin.emulator.canopen.nmt import NmtState
from drivetwin.emulator.canopen.object_dictionary import Variable
from drivetwin.emulator.canopen.sdo_server import check_writable, readable_data
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.foundation.errors import UserError

EXPECTED = 'expected {"node": 2, "index": 24641, "subindex": 0}, to write with "data": HEXADECIMAL BYTES'


def read_object(virtual: VirtualMachine, told: dict[str, object]) -> dict[str, object]:
    """{"data": hexadecimal bytes}, or {"refused": why} by CiA 301's abort codes. Raises UserError for no such node."""
    try:
        return {"data": readable_data(_variable(virtual, told)).hex()}
    except SdoAbort as refusal:
        return {"refused": str(refusal)}


def write_object(virtual: VirtualMachine, told: dict[str, object]) -> dict[str, object]:
    """{"data": the bytes written}, else as `read_object`."""
    data = told.get("data")
    try:
        raw = bytes.fromhex(data if isinstance(data, str) else "?")
    except ValueError:
        raise UserError(f"data is {data!r}; {EXPECTED}") from None
    try:
        variable = _variable(virtual, {key: value for key, value in told.items() if key != "data"})
        check_writable(variable)
        variable.decode_and_write(raw)
    except SdoAbort as refusal:
        return {"refused": str(refusal)}
    return {"data": raw.hex()}


def _variable(virtual: VirtualMachine, told: dict[str, object]) -> Variable:
    """Raises SdoAbort where a drive has no such object, UserError where no drive with power has that node-ID."""
    match told:
        case {"node": int(node), "index": int(index), "subindex": int(subindex), **rest} if not rest:
            pass
        case _:
            raise UserError(f"{told}: {EXPECTED}")
    for drive in virtual.drives:
        if drive.device.node_id == node and drive.device.nmt.state is not NmtState.INITIALISING:
            return drive.device.od.find(index, subindex)
    raise UserError(f"no drive with power has node-ID {node}")
