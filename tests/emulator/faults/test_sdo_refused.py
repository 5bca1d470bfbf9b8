"""The fault sdo_refused: one object cannot be written, and nothing else is different."""

from __future__ import annotations

from fault_bench import ROTATE, SDO_ANSWER, SDO_REQUEST, STRETCH, FaultBench

WRITE_BEAT = bytes((0x2B, 0x17, 0x10, 0x00, 0x64, 0x00, 0x00, 0x00))
"""SDO download of 100 to 1017h (CiA 301, 7.2.4.3.3)."""


def test_a_write_is_aborted_and_the_value_stays() -> None:
    bench = FaultBench()
    before = bench.read(ROTATE, 0x1017)
    fault = bench.strike("sdo_refused", node=ROTATE, index=0x1017, code=0x0609_0030)
    bench.send(SDO_REQUEST + ROTATE, WRITE_BEAT)
    assert bench.take(SDO_ANSWER + ROTATE) == [bytes.fromhex("80 17 10 00 30 00 09 06")]
    assert bench.read(ROTATE, 0x1017) == before
    bench.end(fault)
    bench.write(ROTATE, 0x1017, 100)
    assert bench.read(ROTATE, 0x1017) == 100


def test_other_objects_and_other_nodes_are_written() -> None:
    bench = FaultBench()
    bench.strike("sdo_refused", node=ROTATE, index=0x1017)
    bench.write(ROTATE, 0x605E, 2)
    bench.write(STRETCH, 0x1017, 100)
    assert (bench.read(ROTATE, 0x605E), bench.read(STRETCH, 0x1017)) == (2, 100)
