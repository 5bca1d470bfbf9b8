"""A DOMAIN of more than a megabyte on vcan0 as `canopen` of Python reads it: what a drive holds after a client has written."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import can
import canopen
from all_types import DOMAIN, FIRST
from canopen.sdo.client import SdoClient
from processes import PATIENCE

BUFFER = 8192


@contextmanager
def client(node: int) -> Iterator[SdoClient]:
    """The SDO client of a node, that hears nothing else."""
    answers = [can.typechecking.CanFilter(can_id=0x580 + node, can_mask=0x7FF)]
    with can.Bus("vcan0", interface="socketcan", can_filters=answers) as bus:
        network = canopen.Network(bus)
        network.connect()
        sdo = network.add_node(node, canopen.ObjectDictionary()).sdo
        sdo.RESPONSE_TIMEOUT = PATIENCE
        yield sdo
        assert network.notifier is not None
        network.notifier.stop()


def read(node: int) -> bytes:
    """What the drive holds, by blocks."""
    with client(node) as sdo, sdo.open(FIRST + DOMAIN, 0, "rb", block_transfer=True, buffering=BUFFER) as file:
        data: bytes = file.read()
    return data
