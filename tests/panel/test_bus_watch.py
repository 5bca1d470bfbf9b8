"""Load and late cycles as `drivetwin bus-load` computes them from the same frames; every frame has a name."""

from __future__ import annotations

from dataclasses import replace

import pytest
from frame_bench import frames
from test_scope import Bench

from drivetwin.bus.timing.frame_bits import Frame
from drivetwin.bus.timing.load import Load, LoggedFrame
from drivetwin.foundation.errors import UserError
from drivetwin.panel.bus_watch import BusWatch

CYCLES = 50


def watched(pdos: int, bit_rate: int) -> tuple[BusWatch, Load]:
    """The same cycles of 1 ms, with so many PDOs each, in both."""
    bench = Bench()
    bus = BusWatch({1: bench.node})
    bus.set_bit_rate(bit_rate)
    log = []
    for cycle in range(CYCLES + 1):
        sent = [(0x181 + 2 * number, bytes((cycle, number, 0, 0xFF, 7, 7, 7, 7))) for number in range(pdos)]
        log += [LoggedFrame(1000 * (cycle + 1), Frame(identifier, data)) for identifier, data in [(0x80, b""), *sent]]
    for together in (log[:7], log[7:8], log[8:]):  # however they come together
        passed = frames(*((logged.frame.identifier, logged.frame.data) for logged in together))
        bus.take(replace(passed, times=bench.time.of(passed)))
    return bus, Load(log)


@pytest.mark.parametrize(("pdos", "bit_rate"), [(2, 1_000_000), (6, 1_000_000), (9, 1_000_000), (4, 500_000), (6, 500_000)])
def test_load_and_late_cycles_are_those_of_bus_load(pdos: int, bit_rate: int) -> None:
    bus, load = watched(pdos, bit_rate)
    overruns = load.overruns(bit_rate)
    assert overruns is not None
    assert (bus.cycles, bus.late) == (overruns.cycles, overruns.overrun)
    told = bus.told()
    assert told["worst"] == pytest.approx(load.worst(0.001).load(bit_rate))


def test_frames_are_named_with_what_they_carry() -> None:
    bench = Bench()
    bus = BusWatch({1: bench.node})
    names = {0x281: "TPDO of lift", 0x701: "heartbeat of lift", 0x081: "EMCY of lift", 0x000: "NMT"}
    assert {identifier: bus.name(identifier) for identifier in names} == names
    bus.take(frames((0x181, (0x27).to_bytes(2, "little"))))
    told = bus.told()["frames"]
    assert isinstance(told, list)
    assert [frame["values"] for frame in told] == ["Statusword 39"]


def test_a_bit_rate_that_no_bus_has_is_refused() -> None:
    with pytest.raises(UserError, match="no bit rate"):
        BusWatch({}).set_bit_rate(3)
