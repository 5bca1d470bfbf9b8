"""The drives' object dictionaries on Modbus: registers, and the CANopen gateway of CiA 309-2.

One thread owns the machine. Ports (TCP, serial line) read frames in threads of their own and put them into a mailbox; the
owner answers them between two CAN frames, so that no drive needs a lock.
"""

from drivetwin.emulator.modbus.ports import serve_modbus
from drivetwin.emulator.modbus.service import ModbusService

__all__ = ["ModbusService", "serve_modbus"]
