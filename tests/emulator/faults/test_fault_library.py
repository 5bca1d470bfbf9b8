"""The library of faults: what there is, how a fault is read, and what is said of one that is told wrongly."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import pytest
from fault_bench import FaultBench

from drivetwin.emulator import faults
from drivetwin.emulator.faults.base import LastingFault
from drivetwin.emulator.faults.drive_fault import DriveFault
from drivetwin.emulator.faults.frames_lost import FramesLost
from drivetwin.emulator.faults.library import library, read_fault, required
from drivetwin.emulator.faults.sto import Sto
from drivetwin.foundation.errors import UserError

EVERY = [
    *("bus_off", "drive_fault", "encoder_glitch", "encoder_loss", "frames_corrupted", "frames_doubled", "frames_late"),
    *("frames_lost", "friction_rise", "heartbeat_lost", "jam", "limit_switch", "node_changes_id", "node_dies", "node_resets"),
    *("payload", "power_cycle", "probe_input", "sdo_refused", "sdo_silent", "sto", "undervoltage"),
]
DOCS = Path(__file__).parents[3] / "docs" / "faults.md"
FAULTS = library()
INSTANT = {"drive_fault", "encoder_glitch", "node_changes_id", "node_dies", "node_resets", "power_cycle"}
VALUES = {"probe": 1, "new_id": 40, "index": 0x607F, "increments": 100, "side": "negative", "code": 0x4210, "mass": 0.1}
VALUES |= {"torque": 0.1}


def test_every_fault_is_a_file_of_its_name() -> None:
    assert sorted(FAULTS) == EVERY
    folder = Path(faults.__file__).parent
    assert all((folder / f"{name}.py").is_file() for name in FAULTS)
    assert {name for name, kind in FAULTS.items() if not issubclass(kind, LastingFault)} == INSTANT


def test_every_fault_is_documented() -> None:
    """docs/faults.md has a row for each fault and none for what is not there."""
    rows = re.findall(r"^\| `(\w+)` \| (lasts|once) \|", DOCS.read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(rows) == [(name, "once" if name in INSTANT else "lasts") for name in EVERY]


@pytest.mark.parametrize("name", EVERY)
def test_parameters_are_the_fields(name: str) -> None:
    kind = FAULTS[name]
    assert [parameter.name for parameter in kind.parameters] == [field.name for field in fields(kind)]
    assert kind.__doc__
    assert all(parameter.meaning and parameter.expected for parameter in kind.parameters)


@pytest.mark.parametrize("name", EVERY)
def test_every_fault_strikes_ends_and_strikes_again(name: str) -> None:
    """On every drive; afterwards the plant still runs and the wires of a fault that has ended are sound again."""
    bench = FaultBench()
    told = {key: VALUES[key] for key in required(FAULTS[name]) - {"node"}}
    fault = read_fault({"fault": name, "node": "all", **told})
    for _ in range(2):
        fault.strike(bench.virtual)
        bench.sync(5)
        if isinstance(fault, LastingFault):
            fault.end(bench.virtual)
            fault.end(bench.virtual)
        bench.sync(5)
    assert all(wire.receive == wire.device.receive for wire in bench.virtual.wires)
    assert bench.virtual.now() == pytest.approx(0.02)


@pytest.mark.parametrize("text", [False, True])
def test_values_of_yaml_and_of_a_command_line(text: bool) -> None:
    """Numbers as they are and as text; None stands for the default."""
    told: dict[str, object] = {"node": 2, "code": 0x2310}
    assert read_fault({"fault": "drive_fault"} | (_as_text(told) if text else told)) == DriveFault(node=2, code=0x2310)
    assert read_fault({"fault": "drive_fault", "node": "lift", "code": "0x2310"}) == DriveFault(node="lift", code=0x2310)
    told = {"node": "all", "direction": "received", "cob_id": 0x80, "probability": 0.25, "seed": 3}
    lost = FramesLost(node="all", direction="received", cob_id=0x80, probability=0.25, seed=3)
    assert read_fault({"fault": "frames_lost", "every": None} | (_as_text(told) if text else told)) == lost


def _as_text(told: dict[str, object]) -> dict[str, object]:
    return {key: str(value) for key, value in told.items()}


@pytest.mark.parametrize(
    ("told", "expected"),
    [
        ({}, "unknown fault None; there are bus_off, drive_fault"),
        ({"fault": "fire"}, "unknown fault 'fire'; there are bus_off, drive_fault"),
        ({"fault": "sto"}, "sto needs node"),
        ({"fault": "sto", "node": 2, "code": 1}, "sto has no parameter 'code'; it has node"),
        ({"fault": "sto", "node": 128}, "sto: node is 128, expected a node-ID from 1 to 127, an axis's name, or all"),
        ({"fault": "sto", "node": True}, "sto: node is True, expected a node-ID"),
        ({"fault": "drive_fault", "node": 1}, "drive_fault needs code"),
        ({"fault": "drive_fault", "node": 1, "code": 12}, "code is 12, expected a whole number from 0x1000 to 0xFFFF"),
        ({"fault": "drive_fault", "node": 1, "code": "stop"}, "code is 'stop', expected a whole number from 0x1000"),
        ({"fault": "undervoltage", "node": 1, "level": 0.6}, "level is 0.6, expected a number from 0 to 0.59"),
        ({"fault": "undervoltage", "node": 1, "level": "nan"}, "level is 'nan', expected a number from 0 to 0.59"),
        ({"fault": "payload", "node": 1, "mass": -1}, "mass is -1, expected a number from 0 to 10000 kg"),
        ({"fault": "limit_switch", "node": 1, "side": "left"}, "side is 'left', expected negative or positive"),
        ({"fault": "frames_lost", "node": 1, "cob_id": 0x800}, "cob_id is 2048, expected a whole number from 0x0 to 0x7FF"),
        ({"fault": "frames_lost", "node": 1, "every": 1.5}, "every is 1.5, expected a whole number from 1 to 1000000"),
        ({"fault": "frames_lost", "node": 1, "every": 2, "probability": 0.1}, "give every or probability, not both"),
    ],
)
def test_what_is_told_wrongly(told: dict[str, object], expected: str) -> None:
    with pytest.raises(UserError) as raised:
        read_fault(told)
    assert expected in str(raised.value)


@pytest.mark.parametrize("node", [7, "elbow"])
def test_a_node_that_the_machine_has_not(node: int | str) -> None:
    bench = FaultBench()
    expected = f"sto: scara has no node {node!r}; it has 1 \\(lift\\), 2 \\(rotate\\), 3 \\(stretch\\), or say all"
    for act in (Sto(node).axes, Sto(node).strike, Sto(node).end):
        with pytest.raises(UserError, match=expected):
            act(bench.virtual)


def test_an_axis_is_meant_by_name_and_by_id() -> None:
    virtual = FaultBench().virtual
    assert (Sto("rotate").axes(virtual), Sto(2).axes(virtual), Sto("all").axes(virtual)) == ((1,), (1,), (0, 1, 2))
