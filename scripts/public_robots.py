"""The table of docs/machines.md: what becomes of public robots that were fetched, and how well they are identified.

    python scripts/public_robots.py robots/ur_description robots/double_pendulum_description --identify --out out/robots

A robot is a URDF or MJCF file, or every such file below a folder; scenes, which only include one, are left out.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from xml.etree import ElementTree

import yaml

PARAMETERS = ("inertia", "coulomb", "viscous")
WITHIN = 0.03
"""Of an identified parameter, relative, that issue and page ask for."""
PATIENCE = 1800.0
"""Longest that one robot may take to be identified [s]."""
HEAD = ("robot", "axes", "`machine new`", "identified over the bus: median, largest error")


@dataclass(frozen=True)
class Row:
    """One robot: its axes, what `machine new` said, and the relative errors of what was identified, by axis and parameter."""

    robot: str
    axes: int
    said: str
    errors: dict[str, float]
    identified: str = ""

    def cells(self) -> tuple[str, ...]:
        """As the table has them."""
        axes = str(self.axes) if self.axes else ""
        return self.robot, axes, self.said, self.identified or _within(self.errors)


def robots(paths: Sequence[Path]) -> Iterator[Path]:
    """Files that describe a robot, in folders by name."""
    for path in paths:
        if path.is_file():
            yield path
        else:
            yield from (file for file in sorted(path.rglob("*")) if file.suffix in (".urdf", ".xml") and _is_robot(file))


def _is_robot(file: Path) -> bool:
    try:
        root = ElementTree.parse(file).getroot()
    except (ElementTree.ParseError, UnicodeDecodeError):
        return False
    return root.tag in ("robot", "mujoco") and any(True for _ in root.iter("joint")) and not file.name.startswith("scene")


def row(file: Path, out: Path, *, identify: bool) -> Row:
    """Make a machine of a file in OUT/NAME, and identify it if asked."""
    name, machine = file.stem, out / file.stem
    made = _drivetwin("machine", "new", str(file), "--out", str(machine), "--quiet")
    if made.returncode != 0:
        return Row(name, 0, f"refused: `{_told(made, file)}`", {})
    axes = len(yaml.safe_load((machine / "machine.yaml").read_text(encoding="utf-8"))["axes"])
    if not identify:
        return Row(name, axes, "works", {}, "not asked")
    found = out / f"{name}_found"
    done = _drivetwin("identify", "--machine", str(machine), "--out", str(found), "--quiet")
    if done.returncode != 0:
        return Row(name, axes, "works", {}, f"failed: `{_told(done, file)}`")
    return Row(name, axes, "works", errors_of(found / "identified.json"))


def errors_of(path: Path) -> dict[str, float]:
    """Of every parameter that the plant has: identified over true, less 1."""
    axes = json.loads(path.read_text(encoding="utf-8"))["axes"]
    return {
        f"{parameter} of {axis}": told["parameters"][parameter]["value"] / told["truth"][parameter] - 1.0
        for axis, told in axes.items()
        for parameter in PARAMETERS
        if told["truth"].get(parameter)
    }


def _within(errors: dict[str, float]) -> str:
    if not errors:
        return ""
    furthest = max(errors, key=lambda name: abs(errors[name]))
    beyond = sum(abs(error) > WITHIN for error in errors.values())
    more = f"; {beyond} of {len(errors)} beyond {WITHIN:.0%}" if beyond else ""
    middle = median(abs(error) for error in errors.values())
    return f"{middle:.2%}, {abs(errors[furthest]):.2%} ({furthest}){more}"


def _told(done: subprocess.CompletedProcess[str], file: Path) -> str:
    """The last line of an error, without the folder that the file is in."""
    line = (done.stderr.strip().splitlines() or ["no word"])[-1]
    return line.replace(f"{file.parent}/", "").replace("|", "/")


def _drivetwin(*words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "drivetwin", *words]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=False, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        return subprocess.CompletedProcess(command, 1, "", f"not done within {PATIENCE:g} s")


def main() -> None:
    """Print the table, a row as soon as it is known."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robots", nargs="+", type=Path, help="files, or folders of files")
    parser.add_argument("--identify", action="store_true", help="emulate and identify each machine as well")
    parser.add_argument("--out", type=Path, default=Path("out/robots"), help="where the machines appear")
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    print(f"| {' | '.join(HEAD)} |\n|{' --- |' * len(HEAD)}", flush=True)
    for file in robots(asked.robots):
        print(f"| {' | '.join(row(file, asked.out, identify=asked.identify).cells())} |", flush=True)


if __name__ == "__main__":
    main()
