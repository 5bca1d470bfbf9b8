"""CiA 301: what makes a drive a device on the bus. One service a file; `Device` puts them together."""

from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.device import Device
from drivetwin.emulator.canopen.nmt import NmtState
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary, Variable
from drivetwin.emulator.canopen.parameter_store import ParameterStore

__all__ = ["AbortCode", "Device", "NmtState", "ObjectDictionary", "ParameterStore", "SdoAbort", "Variable"]
