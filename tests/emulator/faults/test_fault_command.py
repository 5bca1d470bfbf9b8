"""`drivetwin fault` beside an emulator that is a process of its own, and a foreign master that sees what happens."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import canopen
import pytest
from in_process import Command
from processes import PATIENCE, emulator

from drivetwin.emulator.faults.library import library

INTERLOCK = 1 << 3
LOOKS = 5000
"""More looks at an object than any of the changes here takes; each is an SDO of its own."""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "control"


@pytest.fixture
def node(path: Path) -> Iterator[canopen.RemoteNode]:
    """Node 2 of a running emulator, by the foreign stack `canopen`."""
    with emulator("--profile", "cia402-full", "--control", path) as bus:
        network = canopen.Network()
        network.connect(interface="remote", channel=bus)
        try:
            dictionary = canopen.ObjectDictionary()
            remote = network.add_node(2, dictionary)
            remote.sdo.RESPONSE_TIMEOUT = PATIENCE  # a loaded host takes longer than its 0.3 s
            yield remote
        finally:
            network.disconnect()
    assert not path.exists()


def inputs(node: canopen.RemoteNode) -> int:
    """60FDh."""
    return int.from_bytes(node.sdo.upload(0x60FD, 0), "little")


def comes(holds: Callable[[], bool]) -> bool:
    return any(holds() for _ in range(LOOKS))


def test_sto_for_a_time(command: Command, node: canopen.RemoteNode, path: Path) -> None:
    assert not inputs(node) & INTERLOCK
    struck = command("fault", "sto", "--node", "rotate", "--on", path)
    assert (struck.status, struck.err) == (0, "")
    assert struck.out.startswith("sto struck at ")
    assert inputs(node) & INTERLOCK
    ended = command("fault", "sto", "--node", "rotate", "--end", "--on", path)
    assert (ended.status, ended.err) == (0, "")
    assert ended.out.startswith("sto ended at ")
    assert not inputs(node) & INTERLOCK
    assert command("fault", "sto", "--node", 2, "--for", "0.2", "--on", path).status == 0
    assert comes(lambda: not inputs(node) & INTERLOCK)


def test_parameters_of_a_fault_are_options(command: Command, node: canopen.RemoteNode, path: Path) -> None:
    struck = command("fault", "drive_fault", "--node=2", "--code", "0x4210", "--on", path)
    assert (struck.status, struck.err) == (0, "")
    assert node.sdo.upload(0x603F, 0) == b"\x10\x42"
    assert command("fault", "encoder_glitch", "--node", 2, "--increments", "-5000", "--on", path).status == 0
    refused = command("fault", "sto", "--node", 9, "--on", path)
    assert (refused.status, refused.out) == (2, "")
    assert refused.err == "drivetwin: sto: scara has no node 9; it has 1 (lift), 2 (rotate), 3 (stretch), or say all\n"


def test_the_list_has_every_fault_and_parameter(command: Command) -> None:
    listed = command("fault", "--list")
    assert (listed.status, listed.err) == (0, "")
    blocks = listed.out.strip().split("\n\n")
    assert [block.split()[0] for block in blocks] == list(library())
    for block, kind in zip(blocks, library().values(), strict=True):
        told = [line.split()[0].rstrip(":") for line in block.splitlines()[2:]]
        assert told == [f"--{parameter.name.replace('_', '-')}" for parameter in kind.parameters]


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("", "say which fault, and on which emulator: drivetwin fault sto --node 2 --on PATH; or --list"),
        ("sto --node 2", "say which fault, and on which emulator"),
        ("sto --node 2 --on nowhere", "no emulator answers at nowhere (No such file or directory); start one with"),
        ("fire --on nowhere", "unknown fault 'fire'; there are bus_off"),
        ("sto --node 2 --code 3 --on nowhere", "sto has no parameter 'code'; it has node"),
        ("payload --node 2 --mass", "say which fault"),
        ("payload --node 2 --on nowhere --mass", "'--mass' is not a parameter with a value; write for example --code 0x2310"),
        ("payload 5 --node 2 --on nowhere", "'5' is not a parameter with a value"),
        ("sto --node 2 --end --for 3 --on nowhere", "--for is how long a fault lasts that is struck; leave it out with --end"),
    ],
)
def test_what_is_told_wrongly_is_one_line(command: Command, words: str, expected: str) -> None:
    refused = command("fault", *words.split())
    assert (refused.status, refused.out) == (2, "")
    assert refused.err.count("\n") == 1
    assert expected in refused.err
