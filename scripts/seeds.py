"""Repeats the identification over many seeds of sensor noise and counts how often the intervals hold the truth.

Each seed is one `drivetwin identify` in a process of its own; the table is read from what it wrote.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from rich import box
from rich.console import Console
from rich.progress import track
from rich.table import Table

from drivetwin.foundation.files import provenance, write_json

COUNTED = ("coulomb", "viscous")
"""The coefficients that the promise is about: within 2 % of the truth, and nine of ten in their 90 % interval."""

console = Console(width=110)


def main() -> int:
    """Run the seeds, print the table, write seeds.json; status 1 where the promise is not kept."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--machine", default="scara")
    parser.add_argument("--out", type=Path, default=Path("out/seeds"))
    options = parser.parse_args()
    with ThreadPoolExecutor(max_workers=2) as pool:
        runs = pool.map(lambda seed: identify(options.machine, options.out, seed), range(options.seeds))
        results = list(track(runs, total=options.seeds, description="seeds", console=console))
    summary = {(axis, name): column(results, axis, name) for axis in results[0] for name in COUNTED}
    show(summary)
    inside = int(sum(entry["inside"].sum() for entry in summary.values()))
    total = sum(len(entry["inside"]) for entry in summary.values())
    worst = max(float(np.abs(entry["error"]).max()) for entry in summary.values())
    console.print(
        f"{inside} of {total} coefficients inside their 90 % interval; worst error {100 * worst:.2f} %", highlight=False
    )
    files = [options.out / f"seed_{seed:03d}" / "identified.json" for seed in range(options.seeds)]
    payload = {
        "schema": "seeds/1",
        **provenance(0, files, options.out),
        "machine": options.machine,
        "inside": inside,
        "total": total,
        "worst_error": worst,
        "coefficients": {f"{axis}.{name}": figures(entry) for (axis, name), entry in summary.items()},
    }
    write_json(options.out / "seeds.json", payload)
    low, high = bounds(total)
    return 0 if low <= inside <= high and worst < 0.02 else 1


def identify(machine: str, out: Path, seed: int) -> dict[str, dict[str, object]]:
    """The axes of identified.json of one run."""
    directory = out / f"seed_{seed:03d}"
    command = [
        str(Path(sys.executable).parent / "drivetwin"),
        "identify",
        "--machine",
        machine,
        "--seed",
        str(seed),
        "--out",
        str(directory),
    ]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    axes: dict[str, dict[str, object]] = json.loads((directory / "identified.json").read_text(encoding="utf-8"))["axes"]
    return axes


def column(results: list[dict], axis: str, name: str) -> dict[str, np.ndarray]:
    """Over the seeds (n,): relative error, relative half width of the interval, and whether it holds the truth."""
    truth = results[0][axis]["truth"][name]
    values = np.array([result[axis]["parameters"][name]["value"] for result in results])
    intervals = np.array([result[axis]["parameters"][name]["ci90"] for result in results])
    return {
        "error": values / truth - 1.0,
        "half_width": (intervals[:, 1] - intervals[:, 0]) / 2.0 / truth,
        "inside": (intervals[:, 0] <= truth) & (truth <= intervals[:, 1]),
    }


def figures(entry: dict[str, np.ndarray]) -> dict[str, float]:
    """What is said of one coefficient: errors in per cent of the truth, half width of the interval likewise, hits."""
    error = 100.0 * entry["error"]
    return {
        "mean_error": float(error.mean()),
        "sd": float(error.std(ddof=1)) if len(error) > 1 else 0.0,
        "worst": float(np.abs(error).max()),
        "half_width": float(100.0 * entry["half_width"].mean()),
        "inside": int(entry["inside"].sum()),
    }


def show(summary: dict[tuple[str, str], dict[str, np.ndarray]]) -> None:
    """One row a coefficient, as a table that docs/figures.md takes over."""
    table = Table("axis", "coefficient", "mean error %", "sd %", "worst %", "half width %", "inside", box=box.MARKDOWN)
    for (axis, name), entry in summary.items():
        found = figures(entry)
        numbers = [f"{found['mean_error']:+.3f}", *(f"{found[key]:.3f}" for key in ("sd", "worst", "half_width"))]
        table.add_row(axis, name, *numbers, f"{found['inside']} of {len(entry['error'])}")
    console.print(table)


def bounds(total: int) -> tuple[int, int]:
    """How many of `total` honest 90 % intervals may hold the truth: 99 to 116 of 120, in proportion."""
    return int(np.ceil(total * 99 / 120)), int(np.floor(total * 116 / 120))


if __name__ == "__main__":
    sys.exit(main())
