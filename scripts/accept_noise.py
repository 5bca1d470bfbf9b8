"""Prints the `noise` of a bench from results of the same suite with several seeds of sensor noise.

    for seed in 1 2 3 4 5; do drivetwin accept --bench bench.yaml --seed $seed --out out/noise/$seed; done
    python scripts/accept_noise.py out/noise/*/results.json
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from collections.abc import Mapping, Sequence
from math import ceil, floor, log10
from pathlib import Path
from statistics import stdev

import yaml

from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.results.results_file import Results, read_results
from drivetwin.hil_tests.results.wording import case_name

FEWEST = 3
"""Runs, below which a standard deviation says nothing."""

_DIGITS = 2


def noise_between(runs: Sequence[Results]) -> dict[str, float | dict[str, float]]:
    """Standard deviation of each quantity, by axis where it has one: the largest of any case that measured it in all runs.

    Rounded up to two digits. Raises UserError for fewer than 3 runs, for two of one seed and for runs of different benches.
    """
    _check(runs)
    values: dict[tuple[str, str | None, str], list[float]] = defaultdict(list)
    for case in (case for run in runs for case in run.cases):
        for measured in case.measured:
            if measured.value is not None:
                values[measured.name, measured.axis, case_name(case)].append(measured.value)
    largest: dict[str, dict[str | None, float]] = defaultdict(dict)
    for (name, axis, _), measurements in values.items():
        if len(measurements) == len(runs):
            spread = stdev(measurements)
            largest[name][axis] = max(spread, largest[name].get(axis, 0.0))
    return {name: _by_axis({axis: _rounded_up(spread) for axis, spread in axes.items()}) for name, axes in largest.items()}


def _by_axis(spreads: Mapping[str | None, float]) -> float | dict[str, float]:
    """A number where the quantity is of no axis."""
    return spreads[None] if None in spreads else {str(axis): spread for axis, spread in spreads.items()}


def _check(runs: Sequence[Results]) -> None:
    if len(runs) < FEWEST:
        raise UserError(f"{len(runs)} results say nothing of noise; give {FEWEST} or more, each with a --seed of its own")
    seeds = sorted(run.seed for run in runs)
    if len(set(seeds)) < len(seeds):
        raise UserError(f"two of the results are of one seed, of {', '.join(map(str, seeds))}; run each with its own --seed")
    benches = {run.bench.model_copy(update={"seed": 0}).model_dump_json() for run in runs}
    if len(benches) > 1:
        raise UserError("the results are of different benches; run all with one bench file, and other seeds only")


def _rounded_up(value: float) -> float:
    """The least number of two digits that is not less."""
    if value <= 0.0:
        return 0.0
    place = _DIGITS - 1 - floor(log10(value))
    return float(round(ceil(value * 10.0**place) / 10.0**place, max(0, place)))


def main() -> int:
    """Read, compare, print; status 2 where the files cannot be compared."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=Path, nargs="+")
    try:
        noise = noise_between([read_results(path) for path in parser.parse_args().results])
    except UserError as error:
        print(f"accept_noise: {error}", file=sys.stderr)
        return error.exit_status
    print(yaml.safe_dump({"noise": noise}, allow_unicode=True, default_flow_style=None, sort_keys=True, width=120), end="")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
