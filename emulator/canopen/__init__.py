"""CiA 301: what makes a drive a device on the bus. One service a file; `Device` puts them together."""

from emulator.canopen.abort_codes import AbortCode, SdoAbort
from emulator.canopen.device import Device
from emulator.canopen.nmt import NmtState
from emulator.canopen.object_dictionary import ObjectDictionary, Variable
from emulator.canopen.parameter_store import ParameterStore

__all__ = ["AbortCode", "Device", "NmtState", "ObjectDictionary", "ParameterStore", "SdoAbort", "Variable"]
