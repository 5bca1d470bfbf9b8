"""`drivetwin emulate --panel`: the panel beside the emulator knows its machine, strikes no fault, and ends with it."""

from __future__ import annotations

import re
import signal
from pathlib import Path

import pytest
from panel_bench import Served, page
from processes import drivetwin, start


def test_a_panel_beside_an_emulator_draws_its_machine_and_only_reads(tmp_path: Path) -> None:
    process = start("emulate", "--machine", "stage", "--bus", "ws://127.0.0.1:0", "--control", tmp_path / "control", "--panel")
    process.stdout.readline()
    found = re.search(r"panel on (http://[^/]+/): nodes 1 slide, on (.+); reads only", process.stderr.readline())
    assert found is not None
    with page(Served(*found.groups())) as looking:
        looking.ask("watch", view="machine")
        told = looking.until(lambda told: told["axes"][0]["switches"] is not None and told["axes"][0]["position"] is not None)
        assert told["machine"] == "stage"
        assert told["axes"][0] | {"position": 0.0, "torque": None} == {
            "name": "slide", "position": 0.0, "unit": "m", "torque": None, "torque_unit": "N", "switches": [],
        }  # fmt: skip
        assert "sto" in looking.ask("faults")["answer"]
        assert "--allow-writes" in looking.ask("strike", told={"fault": "sto", "node": 1}, seconds=None)["refused"]
        looking.ask("watch", view="commissioning")
        assert looking.until(lambda told: told["view"] == "commissioning")["desk"] is None
    process.send_signal(signal.SIGINT)
    assert process.communicate() == ("", "")
    assert process.returncode == 0


@pytest.mark.parametrize("more", [("--machine", "stage"), ("--control", "/nowhere")])
def test_what_a_bus_has_on_it_is_said_of_a_bus_that_is_joined(more: tuple[str, str]) -> None:
    ended = drivetwin("panel", "--port", 0, *more)
    assert ended.status == 2
    assert "--machine and --control describe a bus that is joined: give --bus" in ended.err
