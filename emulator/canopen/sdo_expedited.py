"""Values of up to four bytes, in one exchange: expedited SDO transfers (CiA 301, 7.2.4.3.3 and 7.2.4.3.6).

All but the value follows from the first four bytes of the request, the command and the multiplexer: it is worked out once for
each of them, and what is left to do is a function of the frame.
"""

from __future__ import annotations

import struct
from collections.abc import Callable

from drivetwin.drive_profiles import DataType
from drivetwin.emulator.canopen.data_types import FORMATS, encode_nearest
from drivetwin.emulator.canopen.object_dictionary import Variable
from drivetwin.emulator.canopen.sdo_frame import download_initiated, expedited_command, upload_expedited

Answer = Callable[[bytes], bytes]
"""The answer to a request. Raises SdoAbort where the object refuses."""

EXPEDITED = 0x02
SIZE_INDICATED = 0x01

MOST = 4
"""Bytes in one exchange."""


def is_expedited(variable: Variable) -> bool:
    """Whether every value of it goes in one exchange."""
    return variable.size is not None and variable.size <= MOST


def expedited_upload(variable: Variable) -> Answer:
    """The answer to a request for a readable variable whose values all go in one exchange."""
    index, subindex, data_type = variable.index, variable.subindex, variable.data_type
    if data_type not in FORMATS or data_type is DataType.BOOL:  # of 24 bits, or whose packing takes anything for a value
        return lambda _frame: upload_expedited(index, subindex, variable.encode())
    layout = struct.Struct(f"<BHB{FORMATS[data_type]}")
    pack, unused = layout.pack, bytes(8 - layout.size)
    command = expedited_command(layout.size - 4)

    def answer(_frame: bytes) -> bytes:
        read = variable.on_read
        value = variable.value if read is None else read()
        try:
            return pack(command, index, subindex, value) + unused
        except (struct.error, OverflowError):
            return upload_expedited(index, subindex, encode_nearest(data_type, value))

    return answer


def expedited_download(variable: Variable, command: int) -> Answer:
    """The answer to the requests that write a writable variable and begin with `command`.

    A client that does not say the size means the object's own.
    """
    length = MOST - (command >> 2 & 0x03) if command & SIZE_INDICATED else min(variable.size or MOST, MOST)
    end = 4 + length
    write, done = variable.decode_and_write, download_initiated(variable.index, variable.subindex)

    def answer(frame: bytes) -> bytes:
        write(frame[4:end])
        return done

    return answer
