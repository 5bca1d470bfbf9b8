"""`drivetwin record` beside a foreign master: what the drive truly did, in scales that the drive itself told."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import can
import numpy as np
import pytest
import yaml
from mcap_bench import messages_of
from processes import PATIENCE, drivetwin, emulator, start

from drivetwin.emulator.machine import load_machine
from drivetwin.panel.power_states import PowerState, power_state
from drivetwin.recording.reader import read_recording

MAP = {
    "machine": "arm",
    "axes": {
        "shoulder": {
            "node": 1,
            "columns": {
                "position": {"object": "6064h", "unit": "user"},
                "torque": {"object": "21A3h", "type": "float32", "unit": "N·m", "side": "motor"},
                "position_demand": {"object": "60C1h:1", "unit": "user", "optional": True},
            },
        }
    },
}
GEAR = load_machine("arm").axes["shoulder"].gear_ratio


def write_map(folder: Path, **changes: object) -> Path:
    path = folder / "map.yaml"
    path.write_text(yaml.safe_dump(MAP | changes), encoding="utf-8")
    return path


def test_what_a_master_moves_is_recorded_in_the_drives_own_scales(tmp_path: Path) -> None:
    """The map has no scale at all: encoder, feed and gear are asked of the drive, or set by the master in the log."""
    moves = {"moves": [{"axis": "shoulder", "to": 0.4}]}
    task = tmp_path / "task.json"
    told = {"format": "task/1", "task": "move", "machine": "arm", "profile": "servoone", "parameters": moves}
    task.write_text(json.dumps(told), encoding="utf-8")
    with emulator("--machine", "arm", "--clock", "sync") as bus:
        words = ("--map", write_map(tmp_path), "--lockstep", "--mcap", "--out", tmp_path / "found")
        recorder = start("record", "--bus", bus, *words)
        while "recording" not in recorder.stdout.readline():
            assert recorder.poll() is None
        master = [sys.executable, "-m", "drivetwin.controller", str(task), "--bus", bus, "--out", str(tmp_path / "out")]
        assert subprocess.run(master, timeout=PATIENCE, check=False).returncode == 0
        recorder.send_signal(signal.SIGINT)
        _, err = recorder.communicate()
    assert (recorder.returncode, err) == (0, "")
    (found,) = read_recording(tmp_path / "found")
    columns = found.columns["shoulder"]
    assert found.info.sample_period == pytest.approx(0.001)
    assert columns["position"][-1] == pytest.approx(0.4, abs=1e-4)
    assert found.info.axes["shoulder"].gear_ratio == pytest.approx(GEAR)
    messages = messages_of(tmp_path / "found/recording.mcap")
    said = [message["statusword"] for message in messages["/shoulder"] if "statusword" in message]  # none before the first TPDO
    assert {power_state(int(word)) for word in said} >= {PowerState.SWITCH_ON_DISABLED, PowerState.OPERATION_ENABLED}
    assert [message["position"] for message in messages["/joint_states"]] == [[each] for each in columns["position"]]
    last = slice(-400, None)  # of the move; while it homes the drive makes its own demand
    assert np.ptp(columns["position"][last]) > 0.02
    assert np.max(np.abs(columns["position"] - columns["position_demand"])[last]) < 0.02
    assert np.max(np.abs(columns["torque"])) > 1.0
    frames = can.CanutilsLogReader(tmp_path / "found/bus.log")
    asked = {bytes(frame.data[:4]) for frame in frames if frame.arbitration_id == 0x601}
    assert bytes.fromhex("408F6001") in asked


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "nothing says which objects to record: give --map MAP.yaml, or --eds FILE and --node ID of each drive"),
        (["--map", "none.yaml"], "none.yaml does not exist"),
        (["--eds", __file__, "--node", 1], "no bus at ws://127.0.0.1:1"),
    ],
)
def test_a_wrong_input_is_one_line(tmp_path: Path, words: list[str], said: str) -> None:
    ended = drivetwin("record", "--bus", "ws://127.0.0.1:1", *words, "--out", tmp_path / "found")
    assert ended.status == 2
    assert said in ended.err
    assert ended.err.count("\n") == 1
    assert not (tmp_path / "found").exists()


def test_silence_is_no_recording(tmp_path: Path) -> None:
    """Nobody moves the drive: no SYNC, one line, and no recording; what was heard stays, under the name that the map has."""
    with emulator("--machine", "arm", "--clock", "sync") as bus:
        words = ("--map", write_map(tmp_path, bus={"channel": "vcan7"}), "--seconds", 0.1, "--out", tmp_path / "found")
        ended = drivetwin("record", "--bus", bus, *words)
    assert ended.status == 2
    assert "0 SYNC frames" in ended.err
    assert not (tmp_path / "found").exists()
    kept = tmp_path / "found.failed.log"
    assert str(kept) in ended.err
    assert " vcan7 601#" in kept.read_text(encoding="ascii")
