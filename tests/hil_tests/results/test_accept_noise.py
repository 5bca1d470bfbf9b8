"""The noise of a bench from several results: against numpy's own, and refused where the results tell none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from accept_bench import BENCH, BOOT, MOVE, acceptance_of, with_value
from accept_noise import noise_between

from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.results.results_file import Results, read_results, write_results
from drivetwin.hil_tests.verdict import CaseResult


def result_of(folder: Path, seed: int, *cases: CaseResult, machine: str = "scara") -> Results:
    bench = BENCH.model_copy(update={"seed": seed, "machine": machine})
    write_results(replace(acceptance_of(*cases), bench=bench), folder / "results.json")
    return read_results(folder / "results.json")


def test_it_is_the_standard_deviation_of_the_noisiest_case_rounded_up(tmp_path: Path) -> None:
    generator = np.random.default_rng(3)
    calm, wild = generator.normal(3e-4, 1e-7, 5), generator.normal(3e-4, 1e-6, 5)
    other = replace(MOVE, name="other")
    runs = [
        result_of(tmp_path, seed, BOOT, with_value(MOVE, calm[seed], None), with_value(other, wild[seed], None))
        for seed in range(5)
    ]
    noise = noise_between(runs)
    assert noise["bus load"] == 0.0
    of_lift = noise["tracking error"]
    assert isinstance(of_lift, dict)
    exact = float(np.std(wild, ddof=1))
    assert exact <= of_lift["lift"] <= 1.1 * exact
    assert of_lift["rotate"] == 0.0


def test_a_quantity_that_one_run_lacks_is_left_out(tmp_path: Path) -> None:
    runs = [result_of(tmp_path, seed, BOOT, *([MOVE] if seed else [])) for seed in range(3)]
    assert list(noise_between(runs)) == ["bus load"]


def test_too_few_one_seed_twice_and_another_bench_are_refused(tmp_path: Path) -> None:
    runs = [result_of(tmp_path, seed, MOVE) for seed in range(3)]
    with pytest.raises(UserError, match="give 3 or more"):
        noise_between(runs[:2])
    with pytest.raises(UserError, match="of one seed, of 0, 1, 2, 2"):
        noise_between([*runs, runs[2]])
    with pytest.raises(UserError, match="different benches"):
        noise_between([*runs, result_of(tmp_path, 3, MOVE, machine="stage")])
