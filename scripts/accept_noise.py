"""Prints the `noise` of a bench from results of the same suite with several seeds of sensor noise.

    for seed in 1 2 3 4 5; do drivetwin accept --bench bench.yaml --seed $seed --out out/noise/$seed; done
    python scripts/accept_noise.py out/noise/*/results.json
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import yaml

from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.results.noise import noise_between
from drivetwin.hil_tests.results.results_file import read_results


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
