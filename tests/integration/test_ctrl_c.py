"""Ctrl-C and SIGTERM while axes move: seen by a third node on the bus, which reads along."""

from __future__ import annotations

import signal
from pathlib import Path

import can
import pytest
from processes import PATIENCE, emulator, start, wait_for

from drivetwin.bus.channel import open_bus

STREAMING = 0x1F
"""Controlword: operation enabled, interpolated position active."""

ENOUGH = 400
"""Cycles of streaming before the interruption."""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_controller_stops_every_axis(tmp_path: Path, number: signal.Signals) -> None:
    out = tmp_path / "out" / "run"
    with emulator("--machine", "stage", "--clock", "sync") as bus:
        witness = open_bus(bus)
        controller = start("identify", "--machine", "stage", "--clock", "sync", "--bus", bus, "--out", out)
        wait_for(witness, ENOUGH, lambda frame: frame.arbitration_id == 0x201 and frame.data[0] == STREAMING)
        for _ in range(5):  # an impatient user
            controller.send_signal(number)
        _, err = controller.communicate(timeout=PATIENCE)
        words, states = read_along(witness)
        witness.shutdown()
    assert controller.returncode == 130
    assert err == "drivetwin: interrupted; every axis was stopped and is without voltage\n"
    assert list(tmp_path.iterdir()) == []
    assert words.index(0x02) < words.index(0x00), "quick stop, then disable voltage"
    assert words[-1] == 0x00
    assert states[-1] & 0x4F == 0x40, "switch on disabled"


def read_along(witness: can.BusABC) -> tuple[list[int], list[int]]:
    """Controlwords and statuswords that were on the bus until it fell silent."""
    words, states = [], []
    while (frame := witness.recv(1.0)) is not None:
        if frame.arbitration_id == 0x201:
            words.append(frame.data[0])
        elif frame.arbitration_id == 0x181:
            states.append(int.from_bytes(frame.data[:2], "little"))
    return words, states
