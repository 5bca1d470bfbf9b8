"""A DOMAIN of more than a megabyte, by blocks and by segments (CiA 301, 7.2.4.3)."""

from __future__ import annotations

from random import Random

import canopen
import pytest
from canopen_bench import NODE, Bench, Master, foreign_dictionary
from test_sdo_block import FILE, TEXT
from test_sdo_block import bench as with_file

DATA = Random(1).randbytes(1_100_000)


@pytest.fixture
def node() -> canopen.RemoteNode:
    bench = with_file()
    return Master(bench).add_node(canopen.RemoteNode(NODE, foreign_dictionary(bench.profile)))


def test_foreign_client_by_blocks(node: canopen.RemoteNode) -> None:
    with node.sdo[FILE].open("wb", size=len(DATA), block_transfer=True, buffering=8192) as file:
        file.write(DATA)
    with node.sdo[FILE].open("rb", block_transfer=True, buffering=8192) as file:
        assert file.read() == DATA


def test_foreign_client_by_segments(node: canopen.RemoteNode) -> None:
    node.sdo.download(FILE, 0, DATA)
    assert node.sdo.upload(FILE, 0) == DATA


@pytest.mark.parametrize(("index", "most"), [(FILE, 16 * 1024 * 1024), (TEXT, 65536)])
@pytest.mark.parametrize("command", ["21", "C6"])
def test_what_is_larger_is_out_of_memory_at_once(index: int, most: int, command: str) -> None:
    bench: Bench = with_file()
    where = index.to_bytes(2, "little").hex() + "00"
    assert bench.sdo(command + where + most.to_bytes(4, "little").hex())[:2] in {"60", "A4"}
    bench.device.sdo.reset()
    assert bench.sdo(command + where + (most + 1).to_bytes(4, "little").hex()).endswith("05 00 04 05")
