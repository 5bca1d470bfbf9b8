"""The tutorial's own machine: its commands as the page says them, for a gantry and an arm, and what must come of them."""

from __future__ import annotations

import argparse
import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from xml.etree import ElementTree

from drivetwin.motion.inverse_dynamics import load_model

ROOT = Path(__file__).resolve().parent.parent
PAGE, SECTION = ROOT / "docs/tutorial.md", "## 5. A machine of your own"
MACHINES = ("gantry", "arm6")
EXAMPLE = "gantry"
"""In whose name the page writes its commands."""
SERVER = "drivetwin emulate "
"""Runs until the command after it has ended."""
WITHIN = 0.02
"""Of an identified inertia or friction, relative."""
FRICTION = {"coulomb": "frictionloss", "viscous": "damping"}
"""Of identified.json, by its name in MJCF."""
PATIENCE = 30.0
"""Longest that an emulator may take to end [s]."""


class WrongError(Exception):
    """A step of the page did not lead where the page says."""


def commands(page: str, machine: str) -> list[str]:
    """The section's commands for a machine; lines that end in a backslash go on."""
    _, _, section = page.partition(SECTION)
    section = re.split(r"^## ", section, maxsplit=1, flags=re.MULTILINE)[0].replace("\\\n", "")
    lines = (line.strip() for line in section.splitlines() if line.startswith("    "))
    return [re.sub(r"\s+", " ", line.replace(EXAMPLE, machine)) for line in lines if line]


def follow(lines: Sequence[str], folder: Path) -> None:
    """Run them in `folder`, an emulator beside what follows it. Raises WrongError for one that fails."""
    server: subprocess.Popen[str] | None = None
    for line in lines:
        print(f"$ {line}", flush=True)
        if line.startswith(SERVER):
            server = subprocess.Popen(["bash", "-c", f"exec {line}"], cwd=folder, stdout=subprocess.PIPE, text=True)
            assert server.stdout is not None
            print(server.stdout.readline(), end="", flush=True)
            continue
        try:
            status = subprocess.run(["bash", "-c", line], cwd=folder, check=False).returncode
        finally:
            if server is not None:
                end(server)
                server = None
        if status != 0:
            raise WrongError(f"exit status {status}: {line}")


def end(server: subprocess.Popen[str]) -> None:
    """Ctrl-C; raises WrongError for an emulator that goes on, and kills it."""
    server.send_signal(signal.SIGINT)
    try:
        server.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        server.kill()
        server.wait()
        raise WrongError(f"the emulator did not end within {PATIENCE:g} s of Ctrl-C") from None


def check(machine: str, folder: Path) -> None:
    """What the page promises. Raises WrongError."""
    for line in (*_identified(machine, folder), *_found(machine, folder), *_closer(machine, folder)):
        print(line, flush=True)


def _identified(machine: str, folder: Path) -> Iterator[str]:
    axes = json.loads((folder / f"out/{machine}_found/identified.json").read_text(encoding="utf-8"))["axes"]
    path = folder / f"out/{machine}/model.xml"
    joints = {joint.get("name"): joint for joint in ElementTree.parse(path).iter("joint")}
    model = load_model(path)
    for axis, told in axes.items():
        friction = {name: float(str(joints[axis].get(key)).split()[0]) for name, key in FRICTION.items()}
        for parameter, true in {**friction, "inertia": model.inertia(axis)}.items():
            value = told["parameters"][parameter]["value"]
            if abs(value / true - 1.0) > WITHIN:
                raise WrongError(f"{axis}: {parameter} {value:.4g}, and the model has {true:.4g}")
            yield f"{machine} {axis}: {parameter} {value:.4g}, {value / true - 1.0:+.2%}"


def _found(machine: str, folder: Path) -> Iterator[str]:
    hidden = json.loads((folder / f"docs/examples/{machine}/hidden.json").read_text(encoding="utf-8"))["effects"]
    report = json.loads((folder / f"out/{machine}_gap/report.json").read_text(encoding="utf-8"))
    selected = {(one["effect"], one["axis"]) for one in report["selected"]}
    if missing := {(one["effect"], one["axis"]) for one in hidden} - selected:
        raise WrongError(f"hidden and not found: {sorted(missing)}; found: {sorted(selected)}")
    yield f"{machine}: {report['verdict']}: {sorted(selected)}"


def _closer(machine: str, folder: Path) -> Iterator[str]:
    recordings = json.loads((folder / f"out/{machine}_replay/replay.json").read_text(encoding="utf-8"))["recordings"]
    hidden = json.loads((folder / f"docs/examples/{machine}/hidden.json").read_text(encoding="utf-8"))["effects"]
    for axis in dict.fromkeys(one["axis"] for one in hidden):
        signals = recordings[f"validation_{axis}"]["axes"][axis]["signals"]
        for name in ("torque", "following_error"):
            before, after = (signals[name][run]["relative_error"] for run in ("model", "with_effects"))
            if not after < before:
                raise WrongError(f"{axis}: the replay's {name} is {before:.2%} off, and with the effects {after:.2%}")
            yield f"{machine} {axis}: replayed {name} {before:.2%} off, with the effects {after:.2%}"


def main() -> None:
    """Follow the page for each machine; exit status 1 where it does not lead where it says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machine", action="append", choices=MACHINES, help="only this one; repeatable")
    chosen = parser.parse_args().machine or MACHINES
    os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    page = PAGE.read_text(encoding="utf-8")
    try:
        for machine in chosen:
            follow(commands(page, machine), ROOT)
            check(machine, ROOT)
    except WrongError as error:
        sys.exit(f"the tutorial: {error}")


if __name__ == "__main__":
    main()
