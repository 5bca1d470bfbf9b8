"""Figures of speed beside the target that each has: ratios of what ran in turn, on one machine, in one run."""

from __future__ import annotations

import json
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
from bench_lockstep import lockstep_bench, scara_bench, virtual_bench
from bench_sdo import Row, in_process
from rich.table import Table

from drivetwin.controller.machine import Machine as KnownMachine
from drivetwin.controller.machine import load_machine
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.machine import Machine
from drivetwin.emulator.machine import load_machine as load_virtual_machine

AXES = (1, 3, 6, 12)
HELD = (1.0, 21.0)
"""For how long a master in C++ holds the drives enabled; the difference is what is measured [simulated s]."""

SIMULATED = 60.0
"""Between two looks at the memory [s]."""

MEGABYTE = bytes(range(250)) * 4000
"""What is sent by SDO in blocks."""

ROOT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Figure:
    """What was measured, in what unit, and the least or the most that it is to be; None where it could not be measured."""

    what: str
    value: float | None
    unit: str
    least: float | None = None
    most: float | None = None

    @property
    def reached(self) -> bool | None:
        """Whether it is within its bounds."""
        if self.value is None:
            return None
        return (self.least is None or self.value >= self.least) and (self.most is None or self.value <= self.most)


def targets(lockstep: float, share: float, rounds: int) -> list[Figure]:
    """Every figure with a target; `lockstep` and `share` (of bare `mj_step`) are measured before [x real time, 1]."""
    costs = per_axis(rounds)
    return [
        Figure("lockstep, three drives, in process", lockstep, "x real time", least=14.0),
        Figure("the same, of bare mj_step", share, "", least=0.5),
        Figure("master in C++ on the embedded bus", embedded_bus(), "x real time", least=10.0),
        *(Figure(f"an axis of {count}, to one of three", costs[count] / costs[3], "", most=1.3) for count in AXES if count > 3),
        *(sdo_figure(row) for row in in_process(MEGABYTE, rounds)),
        Figure("make run, installed", command_time("identify", "--machine", "scara"), "s", most=8.0),
        Figure("drivetwin --help", command_time("--help"), "s", most=0.4),
        Figure("memory after a simulated minute more", memory_growth(), "MB", most=1.0),
    ]


def sdo_figure(row: Row) -> Figure:
    """An SDO service of the drives beside canopen's LocalNode, and the most that a server can reach under that client."""
    return Figure(f"{row.what}, to LocalNode ({row.bound:.2f} is the bound)", row.ratio, "times as fast", least=3.0)


def targets_table(figures: Sequence[Figure]) -> Table:
    """Each figure, its target, and whether it is reached."""
    table = Table("figure", "measured", "target", "reached")
    for figure in figures:
        value = "not measured" if figure.value is None else f"{figure.value:.3g} {figure.unit}"
        target = f"at least {figure.least:g}" if figure.least is not None else f"at most {figure.most:g}"
        table.add_row(figure.what, value, target, {True: "yes", False: "no", None: ""}[figure.reached])
    return table


def per_axis(rounds: int) -> dict[int, float]:
    """Median processor time of a simulated second for each axis [s], by the number of axes, measured in turn."""
    with tempfile.TemporaryDirectory() as folder:
        benches = {count: many_axes(count, Path(folder)) for count in AXES}
        times: dict[int, list[float]] = {count: [] for count in AXES}
        for number in range(rounds + 1):
            for count, run in benches.items():
                speed = run()
                if number:  # the first round compiles
                    times[count].append(1.0 / speed / count)
    return {count: statistics.median(costs) for count, costs in times.items()}


def many_axes(count: int, folder: Path) -> Callable[[], float]:
    """A bench of `count` stages beside one another, each with its drive."""
    one, known = load_virtual_machine("stage"), load_machine("stage")
    spec = mujoco.MjSpec.from_file(str(one.model_path))
    spec.delete(spec.actuator("slide"))
    spec.delete(spec.body("carriage"))
    names = [f"slide_{number}" for number in range(count)]
    for number, name in enumerate(names):
        body = spec.worldbody.add_body(name=name, pos=(0.0, 0.5 * number, 0.12))
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=(0.1, 0.1, 0.04), mass=80.0, contype=0, conaffinity=0)
        body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=(1.0, 0.0, 0.0), range=(-0.17, 0.17))
        spec.add_actuator(name=name, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=name).set_to_motor()
    path = folder / f"stages_{count}.xml"
    path.write_text(spec.to_xml(), encoding="utf-8")
    places = [{"node_id": 1 + number, "joint": name, "actuator": name} for number, name in enumerate(names)]
    drives = {place["joint"]: one.axes["slide"].model_copy(update=place) for place in places}
    axes = {place["joint"]: known.axes["slide"].model_copy(update=place) for place in places}
    machine: Machine = one.model_copy(update={"axes": drives, "model": path.name, "directory": folder})
    told: KnownMachine = known.model_copy(update={"axes": axes, "groups": (tuple(names),)})
    return lockstep_bench(virtual_bench(SyncClock(), machine, ()).link, told)


def embedded_bus() -> float | None:
    """Speed of the example in C++, in a process of its own, at 1 kHz [x real time]; None without a compiler."""
    if shutil.which("g++") is None:
        return None
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        source, program = ROOT / "docs/examples/cpp_controller/main.cpp", folder / "controller"
        subprocess.run(["g++", "-std=c++17", "-O2", "-o", program, source], check=True)
        short, long = (held_for(seconds, program, folder) for seconds in HELD)
    return (HELD[1] - HELD[0]) / (long - short)


def held_for(seconds: float, program: Path, folder: Path) -> float:
    """Processor time of emulator and controller [s], where that holds the drives enabled for so long in the plant's time."""
    task = {"format": "task/1", "task": "enable", "machine": "scara", "profile": "servoone", "cycle": 0.001}
    (folder / "task.json").write_text(json.dumps(task | {"parameters": {"hold": seconds}}), encoding="utf-8")
    bus = f"unix:{folder}/bus"
    emulate = [sys.executable, "-m", "drivetwin", "emulate", "--machine", "scara", "--bus", bus, "--clock", "sync"]
    began = children_time()
    emulator = subprocess.Popen(emulate, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        while not Path(f"{folder}/bus").exists() and emulator.poll() is None:
            time.sleep(0.05)
        order = [program, folder / "task.json", "--bus", bus, "--clock", "sync", "--out", folder]
        subprocess.run(order, check=True, stdout=subprocess.DEVNULL)
    finally:
        emulator.terminate()
        emulator.wait()
    return children_time() - began


def command_time(*arguments: str) -> float:
    """Processor time of a command of drivetwin, in a folder of its own [s]."""
    began = children_time()
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, "-m", "drivetwin", *arguments], check=True, cwd=folder, stdout=subprocess.DEVNULL)
    return children_time() - began


def children_time() -> float:
    """Processor time of the children that have ended [s]: what they take on a machine that does nothing else."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def memory_growth() -> float:
    """What the process's most memory grows by in a simulated minute of lockstep, after a first stretch [MB]."""
    bench = scara_bench(SyncClock())
    run = lockstep_bench(bench.link, load_machine("scara"))
    run()
    before, began = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, bench.machine.now()
    while bench.machine.now() < began + SIMULATED:
        run()
    return (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024.0
