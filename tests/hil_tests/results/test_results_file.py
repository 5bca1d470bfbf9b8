"""results.json: what is written is read again, byte for byte the same from run to run, and what is wrong is refused by name."""

from __future__ import annotations

import json
from dataclasses import replace
from math import inf, nan
from pathlib import Path

import pytest
from accept_bench import BENCH, FAULT, MOVE, acceptance_of, with_value

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import sha256
from drivetwin.hil_tests.results.results_file import read_results, write_results


def test_it_holds_what_was_measured_and_what_failed(tmp_path: Path) -> None:
    bench = tmp_path / "bench.yaml"
    bench.write_text("format: bench/1\n")
    write_results(acceptance_of(replace(FAULT, folder=tmp_path / "cases" / "x")), tmp_path / "results.json", [bench])
    payload = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert payload["schema"] == "accept/1"
    assert payload["inputs"] == {"bench.yaml": sha256(bench)}
    assert payload["accepted"] is False
    assert payload["bench"]["limits"] == {
        "stop_time": 0.2, "tracking_error": {"lift": 5e-4, "rotate": 1e-3}, "travel": {"lift": [0.0, 0.3]},
    }  # fmt: skip
    (case,) = payload["cases"]
    assert case["folder"] == "cases/x"
    assert "wall" not in case
    assert case["failures"][0] == {
        "expectation": "stopped", "message": "still moves <0.3 s> after the fault", "axis": "rotate",
        "time": 1.0625, "measured": 0.3, "limit": 0.2, "unit": "s",
    }  # fmt: skip
    assert case["measured"] == [
        {"name": "time to rest", "axis": "rotate", "value": 0.3, "unit": "s", "limit": 0.2, "noise": 0.001}
    ]


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    write_results(acceptance_of(), tmp_path / "results.json")
    read = read_results(tmp_path / "results.json")
    assert read.bench.limits == BENCH.limits
    assert [(case.number, case.name, case.outcome) for case in read.cases] == [
        (case.number, case.name, case.outcome) for case in acceptance_of().cases
    ]
    write_results(acceptance_of(), tmp_path / "again.json")
    assert (tmp_path / "again.json").read_bytes() == (tmp_path / "results.json").read_bytes()


@pytest.mark.parametrize("never", [inf, nan])
def test_what_never_came_about_is_null(tmp_path: Path, never: float) -> None:
    write_results(acceptance_of(with_value(MOVE, never, None)), tmp_path / "results.json")
    assert read_results(tmp_path / "results.json").cases[0].measured[0].value is None


def test_an_acceptance_of_skipped_cases_only_is_none() -> None:
    assert not acceptance_of(*acceptance_of().cases[4:]).accepted
    assert acceptance_of(MOVE).accepted
    assert not acceptance_of(MOVE, FAULT).accepted


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("{", "is not a valid accept/1 file"),
        ('{"schema": "gap-report/1"}', "schema"),
        ("[]", "is not a valid accept/1 file"),
    ],
)
def test_a_file_that_is_none_is_refused_in_one_line(tmp_path: Path, content: str, said: str) -> None:
    path = tmp_path / "results.json"
    path.write_text(content)
    with pytest.raises(UserError) as refused:
        read_results(path)
    assert str(path) in str(refused.value)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_no_file_says_who_writes_one(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"`drivetwin accept` writes results\.json"):
        read_results(tmp_path / "results.json")
