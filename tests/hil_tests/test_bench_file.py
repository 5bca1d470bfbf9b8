"""bench.yaml: what is wrong is told by file and key."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from stage_bench import LIMITS, bench_file

from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.bench import mapping_entry, read_bench

COMMAND = ["true"]


def test_a_bench_knows_its_machine_drives_and_truth(tmp_path: Path) -> None:
    bench = read_bench(bench_file(tmp_path, COMMAND))
    assert bench.axes == ("slide",)
    assert bench.drive_type.name == "servoone"
    assert [placed.axis for placed in bench.effects]
    assert bench.pdo["rpdo 1"].entries == (0x60400010, 0x60C10120, 0x60B20010)
    assert bench.limit("settling_time") == 0.3


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"format": "bench/2"}, r"bench.yaml: format: .*'bench/1'"),
        ({"machine": "mill"}, "unknown machine 'mill'; known are arm, scara, stage"),
        ({"profile": "acme"}, "acme"),
        ({"bit_rate": 3}, "bench.yaml: bit_rate: .*10000"),
        ({"colour": "red"}, "bench.yaml: colour: is not a known key; there are bit_rate, bit_timing, bus"),
        ({"timeouts": {"begin": 3}}, "bench.yaml: timeouts.begin: is not a known key; there are silence, simulated, start"),
        ({"controller": {"name": "x", "command": [], "tasks": []}}, "controller.command: .*at least 1"),
        ({"controller": {"name": "x", "command": ["x"], "tasks": ["dance"]}}, "controller.tasks.0: .*'boot'"),
        ({"pdo": {"rpdo 9": {"objects": [], "transmission": 1}}}, "'rpdo 9' is not a PDO; expected rpdo 1, "),
        ({"pdo": {"rpdo 1": {"objects": ["6040"], "transmission": 1}}}, "'6040' is not an object of a PDO; write index:"),
        ({"limits": {"speed": {"wheel": 1.0}}}, "limits.speed: machine stage has no axis 'wheel', only slide"),
        ({"truth": "nowhere.json"}, "no effects file .*nowhere.json"),
    ],
)
def test_what_is_wrong_is_told(tmp_path: Path, changes: dict[str, Any], expected: str) -> None:
    with pytest.raises(UserError, match=expected):
        read_bench(bench_file(tmp_path, COMMAND, **changes))


def test_what_is_no_bench_is_told(tmp_path: Path) -> None:
    path = tmp_path / "bench.yaml"
    with pytest.raises(UserError, match="does not exist"):
        read_bench(path)
    path.write_text("a: [")
    with pytest.raises(UserError, match="is not YAML"):
        read_bench(path)
    path.write_text("- a")
    with pytest.raises(UserError, match="not a mapping"):
        read_bench(path)


def test_a_limit_that_is_not_there_names_those_that_are(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=f"there is no 'heat'; this bench has {', '.join(LIMITS)}"):
        read_bench(bench_file(tmp_path, COMMAND)).limit("heat")


def test_the_truth_of_a_bench_stands_beside_it(tmp_path: Path) -> None:
    (tmp_path / "own.json").write_text('{"schema": "effects/1", "effects": []}')
    assert read_bench(bench_file(tmp_path, COMMAND, truth="own.json")).effects == ()


def test_a_mapping_entry_is_that_of_cia_301() -> None:
    assert mapping_entry("6064:00:32") == 0x60640020
    assert mapping_entry("60C1:0A:8") == 0x60C10A08
