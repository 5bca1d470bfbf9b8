"""Which service works in which NMT state (CiA 301, 7.3.2.2.5)."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from canopen_bench import NODE, PRE_OPERATIONAL, START, STOP, Bench

from drivetwin.emulator.canopen import NmtState

HEARTBEAT, EMCY, SDO, TPDO = 0x700 + NODE, 0x80 + NODE, 0x580 + NODE, 0x180 + NODE


def sends(cob_id: int) -> Callable[[Bench], bool]:
    return lambda bench: cob_id in [frame[0] for frame in bench.take()]


def sdo(bench: Bench) -> bool:
    bench.device.receive(0x600 + NODE, bytes.fromhex("40 00 10 00 00 00 00 00"))
    return sends(SDO)(bench)


def rpdo(bench: Bench) -> bool:
    bench.device.receive(0x200 + NODE, b"\x34\x12")
    return bench.od[0x6040].value == 0x1234


def synchronous_tpdo(bench: Bench) -> bool:
    bench.device.sync()
    return sends(TPDO)(bench)


def remote_tpdo(bench: Bench) -> bool:
    bench.device.receive(TPDO, b"", remote=True)
    return sends(TPDO)(bench)


def emergency(bench: Bench) -> bool:
    bench.device.emergency.raise_error(0x1000, 0)
    return sends(EMCY)(bench)


def time_stamp(bench: Bench) -> bool:
    bench.device.receive(0x100, bytes(6))
    return bench.device.time_stamp.time_of_day() is not None


def heartbeat(bench: Bench) -> bool:
    return HEARTBEAT in [cob_id for _, cob_id, _ in bench.run_to(bench.time + 0.1)]


def node_guarding(bench: Bench) -> bool:
    bench.od[0x1017].write(0)
    bench.device.receive(HEARTBEAT, b"", remote=True)
    return sends(HEARTBEAT)(bench)


def heartbeat_consumer(bench: Bench) -> bool:
    bench.device.receive(0x701, b"\x05")
    before = bench.device.emergency.register
    bench.run_to(bench.time + 0.1)
    return bench.device.emergency.register != before


def nmt_command(bench: Bench) -> bool:
    heard: list[NmtState] = []
    bench.device.nmt.on_change.append(heard.append)
    bench.nmt(STOP if bench.device.nmt.state is not NmtState.STOPPED else START)
    return bool(heard)


STATES = {
    "initialising": None,
    "pre-operational": PRE_OPERATIONAL,
    "operational": START,
    "stopped": STOP,
}

TABLE: dict[Callable[[Bench], bool], tuple[str, ...]] = {
    rpdo: ("operational",),
    synchronous_tpdo: ("operational",),
    remote_tpdo: ("operational",),
    sdo: ("pre-operational", "operational"),
    emergency: ("pre-operational", "operational"),
    time_stamp: ("pre-operational", "operational"),
    heartbeat: ("pre-operational", "operational", "stopped"),
    node_guarding: ("pre-operational", "operational", "stopped"),
    heartbeat_consumer: ("pre-operational", "operational", "stopped"),
    nmt_command: ("pre-operational", "operational", "stopped"),
}


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("service", TABLE, ids=lambda service: service.__name__)
def test_permission(service: Callable[[Bench], bool], state: str) -> None:
    assert service(bench_in(state)) == (state in TABLE[service])


def bench_in(state: str) -> Bench:
    bench = Bench()
    command = STATES[state]
    if command is None:
        return bench
    bench.boot()
    bench.map_pdo(0x1800, (0x6041_0010,), 1)
    bench.write(0x1017, 0, 10)
    bench.write(0x1029, 1, 1)
    bench.write(0x1016, 1, 1 << 16 | 20)
    bench.nmt(command)
    bench.take()
    return bench
