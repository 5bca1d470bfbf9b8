"""`drivetwin machine`: a machine of one's own made from a robot's model, and checked."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterable
from enum import StrEnum
from math import pi
from pathlib import Path
from typing import Annotated

import mujoco
import typer
import yaml
from rich.table import Table

from drivetwin.cli.terminal import AsJson, Quiet, terminal
from drivetwin.controller.machine import Machine as Known
from drivetwin.controller.machine import load_machine
from drivetwin.controller.session import Streaming, roomy
from drivetwin.emulator.drive.homing_methods import METHODS
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import Axis, Machine
from drivetwin.emulator.machine import load_machine as load_virtual_machine
from drivetwin.emulator.plant import Plant
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import new_directory, provenance, refuse_foreign, refuse_to_replace, write_json
from drivetwin.foundation.machine_file import FILE
from drivetwin.foundation.quantities import quantity, span
from drivetwin.motion.inverse_dynamics import load_model
from drivetwin.twin.new_bench import FILE as BENCH
from drivetwin.twin.new_bench import new_bench
from drivetwin.twin.new_machine import NewMachine, new_machine

logger = logging.getLogger(__name__)

LATE = 0.5
"""Phase [rad] by which current loop and speed filter may delay a velocity loop at its bandwidth."""
CYCLE = 0.001
"""Shortest cycle in which set-points come [s]."""
BENCH_CYCLE = 0.002
"""Shortest cycle of an acceptance [s]: heartbeats and SDO take their share of the bus besides."""
NEGATIVE_SWITCH, POSITIVE_SWITCH = (1, 17), (2, 18)
"""Homing methods on a limit switch (CiA 402-2, 6098h)."""


class Action(StrEnum):
    """What to do with a machine."""

    NEW = "new"
    CHECK = "check"


def machine_command(
    action: Annotated[Action, typer.Argument(help="new: make one from a robot's model; check: say whether one can be used.")],
    path: Annotated[
        Path, typer.Argument(metavar="ROBOT.xml|DIR|FILE.yaml", help="new: the MJCF or URDF file; check: the machine.")
    ],
    *,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="new: the machine's folder.")] = None,
    name: Annotated[str | None, typer.Option(help="new: the machine's name; default: the model's.")] = None,
    bandwidth: Annotated[float, typer.Option(metavar="HZ", help="new: bandwidth of the velocity loops.")] = 15.0,
    quiet: Quiet = False,
    json_: AsJson = False,
) -> None:
    """Make a machine of your own from a robot's model, or check one.

    Example: drivetwin machine new robot.xml --out out/robot, then drivetwin emulate --machine out/robot

    The folder contains machine.yaml (docs/machines.md), model.xml, effects.json and bench.yaml. Whatever the model does not
    contain is assumed, and listed.
    """
    console = terminal(silent=quiet or json_)
    if action is Action.NEW:
        if out is None:
            raise UserError("--out DIR is missing: the folder for the machine")
        if not 1.0 <= bandwidth <= 60.0:
            raise UserError(f"--bandwidth {bandwidth:g}: expected 1 to 60 Hz, which loops of 8 kHz can have")
        refuse_foreign(out)
        refuse_to_replace(out, [path])
        mujoco.set_mju_user_warning(logger.info)  # what matters is among the assumptions; MuJoCo would write a log file here
        made = new_machine(path, name, bandwidth)
        with new_directory(out) as staged:
            _write(made, path, staged)
            _write_bench(staged)
        for line in made.assumed:
            console.print(f"assumed: {line}", highlight=False, markup=False)
    virtual, known = _checked(path if out is None else out)
    plant = Plant(virtual, read_effects(virtual.effects_path))
    inertia = {axis: told["inertia"] for axis, told in plant.truth().items()}
    console.print(_table(virtual, known, inertia))
    if json_:
        print(json.dumps({"machine": known.machine, "axes": list(known.axes), "inertia": inertia}, ensure_ascii=False))


def _write(made: NewMachine, source: Path, folder: Path) -> None:
    (folder / "model.xml").write_text(made.model_xml, encoding="utf-8")
    write_json(folder / "effects.json", {"schema": "effects/1", "effects": []} | provenance(0, [source], folder))
    assumed = "".join(f"# {line}\n" for line in made.assumed)
    text = yaml.safe_dump(made.description, sort_keys=False, allow_unicode=True, width=120, default_flow_style=None)
    head = "# Made by `drivetwin machine new`. Assumed, because the model does not contain it:\n"
    (folder / FILE).write_text(head + assumed + text, encoding="utf-8")


def _write_bench(folder: Path) -> None:
    """bench.yaml of the machine that stands there, which is checked."""
    virtual, known = _checked(folder)
    plant = Plant(virtual, read_effects(virtual.effects_path))
    edge_speed = {name: axis.homing.edge_speed for name, axis in known.axes.items()}
    cycle = round(roomy(Streaming(BENCH_CYCLE), len(known.axes)).period, 6)
    bench = new_bench(known.axes, edge_speed, virtual, plant.model, plant.truth(), cycle)
    text = yaml.safe_dump(bench, sort_keys=False, allow_unicode=True, width=120, default_flow_style=None)
    head = "# Made by `drivetwin machine new` for the reference controller (docs/acceptance.md); limits on the joint side.\n"
    (folder / BENCH).write_text(head + text, encoding="utf-8")


def _checked(path: Path) -> tuple[Machine, Known]:
    """Both halves of a machine. Raises UserError naming file, key and axis for what cannot be used."""
    place = str(path.absolute())
    virtual, known = load_virtual_machine(place), load_machine(place)
    where = known.axes_path
    plant = Plant(virtual, read_effects(virtual.effects_path))
    nominal = load_model(known.model_path)
    told = plant.truth()
    for name, axis in virtual.axes.items():
        at = f"{where}: axes.{name}"
        if axis.joint not in nominal.joints:
            has = ", ".join(nominal.joints)
            raise UserError(f"{at}.joint: {known.model_path} has no hinge or slide {axis.joint!r}; it has {has}")
        _check_places(at, axis, known)
        _check_loops(at, axis, told[name]["inertia"])
    return virtual, known


def _check_places(at: str, axis: Axis, known: Known) -> None:
    motion = next(each for each in known.axes.values() if each.joint == axis.joint)
    low, high = axis.limit_switches.negative, axis.limit_switches.positive
    if not low < motion.travel[0] < motion.travel[1] < high:
        raise UserError(f"{at}.motion.travel: {list(motion.travel)} is not between the limit switches, {low:g} and {high:g}")
    for key, value, ends in (
        ("motion.rest", motion.rest, motion.travel),
        ("drive.power_on_position", axis.power_on_position, (low, high)),
    ):
        if not ends[0] <= value <= ends[1]:
            raise UserError(f"{at}.{key}: {value:g} is not between {ends[0]:g} and {ends[1]:g}")
    if motion.max_speed * CYCLE > motion.travel[1] - motion.travel[0]:
        raise UserError(
            f"{at}.motion.max_speed: {motion.max_speed:g} crosses the travel within a cycle of 1 ms: in m/s, rad/s?"
        )
    if motion.homing.method not in METHODS and not -128 <= motion.homing.method < 0:
        raise UserError(f"{at}.motion.homing.method: {motion.homing.method} is none of 6098h; there are {_numbers(METHODS)}")
    for methods, end in ((NEGATIVE_SWITCH, low), (POSITIVE_SWITCH, high)):
        if motion.homing.method in methods and abs(motion.homing.switch_position - end) > 0.01 * (high - low):
            raise UserError(
                f"{at}.motion.homing.switch_position: {motion.homing.switch_position:g}, and the switch of method "
                f"{motion.homing.method} stands at {end:g}"
            )


def _check_loops(at: str, axis: Axis, inertia: float) -> None:
    loops, width = axis.loops, axis.loops.velocity_gain / inertia
    if loops.position_gain > width:
        raise UserError(
            f"{at}.drive.loops.position_gain: {loops.position_gain:g} 1/s is faster than the velocity loop, {width:.3g} 1/s"
        )
    late = axis.current_loop_time_constant + 1.0 / (2.0 * pi * axis.loops.velocity_filter_hz)
    if width * late > LATE:
        raise UserError(
            f"{at}.drive.loops.velocity_gain: {axis.loops.velocity_gain:g} on an inertia of {inertia:.3g} is a loop of "
            f"{width / 2.0 / pi:.3g} Hz, which current loop and speed filter make unstable; {LATE / late * inertia:.3g} at most"
        )


def _numbers(methods: Iterable[int]) -> str:
    return ", ".join(map(str, sorted(methods)))


def _table(virtual: Machine, known: Known, inertia: dict[str, float]) -> Table:
    table = Table("axis", "node", "joint", "gear", "travel", "speed", "inertia", "velocity loop", title=known.machine)
    for name, axis in virtual.axes.items():
        motion = known.axes[name]
        unit, of = ("m", "kg") if motion.prismatic else ("rad", "kg·m²")
        gear = quantity(axis.gear_ratio, "rad/m" if motion.prismatic else "1")
        table.add_row(
            name,
            str(axis.node_id),
            axis.joint,
            gear,
            span(*motion.travel, unit),
            quantity(motion.max_speed, f"{unit}/s", 3),
            quantity(inertia[name], of, 3),
            f"{axis.loops.velocity_gain / inertia[name] / 2.0 / pi:.3g} Hz",
        )
    return table
