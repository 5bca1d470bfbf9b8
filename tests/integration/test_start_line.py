"""The line with which `drivetwin emulate` says that others can join: on which bus, and which nodes are there."""

from __future__ import annotations

import json
import signal
from pathlib import Path

import pytest
from processes import PATIENCE, start

from drivetwin.controller import machines
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


def test_what_is_added_is_beside_the_machines_own_and_what_gives_way_is_said(tmp_path: Path) -> None:
    effects = tmp_path / "added.json"
    parameters = {"asymmetry": {"value": -20.0, "unit": "N·s/m"}}
    entry = {"effect": "viscous_asymmetry", "axis": "slide", "parameters": parameters}
    effects.write_text(json.dumps({"schema": "effects/1", "effects": [entry]}), encoding="utf-8")
    model = Path(machines.__file__).parent / "stage" / "model.xml"
    process = start("emulate", "--bus", "ws://127.0.0.1:0", "--machine", "stage", "--model", model, "--effects", effects)
    assert process.stdout is not None
    line = process.stdout.readline()
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=PATIENCE)
    assert line.startswith("stage: servoone drives, nodes 1 slide, on ws://")
    assert err == "drivetwin: slide: the added viscous_asymmetry takes the place of the machine's own (asymmetry -36)\n"
    assert process.returncode == 0
