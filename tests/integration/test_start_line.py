"""The line with which `drivetwin emulate` says that others can join: on which bus, and which nodes are there."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest
from processes import PATIENCE, start

from drivetwin.emulator.canopen.parameter_store import ParameterStore


def start_line(*options: object) -> str:
    process = start("emulate", "--bus", "ws://127.0.0.1:0", "--clock", "sync", *options)
    assert process.stdout is not None
    line: str = process.stdout.readline()
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=PATIENCE)
    return line


@pytest.mark.parametrize(("stored", "nodes"), [(None, "1 lift, 2 rotate, 3 stretch"), (42, "1 lift, 42 rotate, 3 stretch")])
def test_nodes_are_those_that_lss_has_stored(stored: int | None, nodes: str, tmp_path: Path) -> None:
    """CiA 305: the stored node-ID is the one with which the drive boots."""
    if stored is not None:
        ParameterStore(tmp_path / "rotate.json").configure(stored, 0)
    line = start_line("--machine", "scara", "--profile", "cia402-full", "--store", tmp_path)
    assert f"drives, nodes {nodes}, on ws://" in line


def test_a_node_without_an_id_is_told(tmp_path: Path) -> None:
    ParameterStore(tmp_path / "rotate.json").configure(255, 0)
    line = start_line("--machine", "scara", "--profile", "cia402-full", "--store", tmp_path)
    assert "nodes 1 lift, rotate without node-ID, 3 stretch, on" in line
