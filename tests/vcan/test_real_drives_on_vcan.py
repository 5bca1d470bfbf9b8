"""The bench for can0, on vcan0: an emulator of its own has the drives, the judge listens beside the controller."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

from processes import drivetwin, emulator

BENCHES = Path(__file__).parents[2] / "hil_tests/benches"


def test_what_is_heard_on_vcan_is_judged(tmp_path: Path) -> None:
    """At a cycle that a kernel with one processor for all three keeps."""
    shutil.copy(BENCHES / "scara_can0.limits.yaml", tmp_path)
    text = (BENCHES / "scara_can0.yaml").read_text(encoding="utf-8")
    for before, after in (
        ("bus: can0", "bus: vcan0"),
        ("real: {limits: scara_can0.limits.yaml}", "real: {limits: scara_can0.limits.yaml, any_bus: true}"),
        ("cycle: 0.002", "cycle: 0.05"),
    ):
        assert text.count(before) == 1, before
        text = text.replace(before, after)
    bench = tmp_path / "bench.yaml"
    bench.write_text(text, encoding="utf-8")
    with emulator("--machine", "scara", bus="vcan0"):
        done = drivetwin("accept", "--bench", bench, "--real", "--select", "01_boot.*", "--out", tmp_path / "out")
    assert (done.status, done.err) == (0, ""), done.out
    cases = json.loads((tmp_path / "out" / "results.json").read_text(encoding="utf-8"))["cases"]
    assert {case["name"]: case["outcome"] for case in cases} == {
        "configured": "accepted",
        **dict.fromkeys(("node_missing", "sdo_refused", "sdo_silent"), "skipped"),
    }
    log = (tmp_path / "out" / "cases" / "01_boot.configured" / "bus.log").read_text(encoding="ascii")
    assert all(f" {0x700 + node:03X}#05" in log for node in (1, 2, 3))
