"""`drivetwin fit`: the identification on recordings, whoever made them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn
from rich.table import Table

from drivetwin.cli.terminal import AsJson, Quiet, terminal
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import new_directory, refuse_to_replace
from drivetwin.foundation.machine_picture import machine_picture
from drivetwin.foundation.quantities import quantity
from drivetwin.identification import AxisIdentification, Identification, Model, Settings, identify, load_model, write_results
from drivetwin.identification.wording import LABELS, percent, row_of
from drivetwin.motion.coupled_motion import check_axes_move_alone
from drivetwin.motion.pieces import read_all
from drivetwin.recording.reader import check_joints, check_torque
from drivetwin.recording.recording import Recording


def fit_command(
    model: Annotated[Path, typer.Argument(metavar="MODEL.xml", help="MuJoCo model of the machine.")],
    recordings: Annotated[
        list[Path], typer.Argument(metavar="RECORDING...", help="Recordings to fit, or folders of recordings.")
    ],
    *,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Output folder for identified.json, report.html and plots.")],
    validate: Annotated[
        list[Path] | None, typer.Option(metavar="RECORDING", help="Validation recording: measured, not fitted; repeatable.")
    ] = None,
    cutoff: Annotated[float, typer.Option(metavar="HZ", help="Cut-off frequency of the zero-phase filter, in Hz.")] = 48.0,
    standstill: Annotated[
        list[str] | None,
        typer.Option(metavar="[AXIS=]SPEED", help="Speed above which an axis moves, in rad/s or m/s; default: automatic."),
    ] = None,
    reversal_margin: Annotated[
        float, typer.Option(metavar="S", help="Time left out on each side of each reversal, in seconds.")
    ] = 0.0,
    delay: Annotated[
        bool, typer.Option("--delay", help="Also fit the delay between torque and motion (captures over a bus).")
    ] = False,
    allow_gaps: Annotated[bool, typer.Option("--allow-gaps", help="Split a recording at lost samples.")] = False,
    quiet: Quiet = False,
    json_: AsJson = False,
) -> None:
    """Identify inertia and friction from recordings by least squares.

    Example: drivetwin fit docs/examples/emps/model.xml out/emps --validate out/emps_pulses --out out/emps_fit

    Writes identified.json (parameters with 90 % intervals, errors, verdicts), report.html and two plots per axis.
    docs/identification.md describes the method.
    """
    console = terminal(silent=quiet or json_)
    _refuse_unless("--cutoff", cutoff, cutoff > 0.0, "a frequency above 0 Hz")
    _refuse_unless("--reversal-margin", reversal_margin, reversal_margin >= 0.0, "a time of 0 s or more")
    machine = load_model(model)
    fitted = _read(recordings, machine, cutoff, allow_gaps)
    held = _read(validate or [], machine, cutoff, allow_gaps)
    axes = {axis for recording in fitted for axis in recording.info.axes}
    settings = Settings(
        cutoff_hz=cutoff,
        standstill_velocity=_thresholds(standstill or [], axes),
        reversal_margin=reversal_margin,
        estimate_delay=delay,
    )
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    refuse_to_replace(out, [model, *(file for recording in (*fitted, *held) for file in recording.files)])
    with new_directory(out) as staged, Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("filtering", total=2 * len(axes) + 2)
        found = identify(machine, fitted, held, settings, _Step(progress, task, "fitting"))
        inputs = [model]
        title = f"{found.machine}: identification from recordings"
        picture = machine_picture(machine.given, {axis.joint for axis in found.axes.values()})
        written = _Step(progress, task, "writing")
        write_results(found, [*fitted, *held], staged, title=title, picture=picture, inputs=inputs, progress=written)
    for axis in found.axes.values():
        console.print(_table(axis))
        console.print(_verdict(axis), highlight=False)
    for name, why in found.skipped.items():
        console.print(f"{name} has no result: {why}", highlight=False)
    console.print(_written(found, out), highlight=False, soft_wrap=True)
    if json_:
        print((out / "identified.json").read_text(encoding="utf-8"), end="")


def _refuse_unless(option: str, value: float, good: bool, expected: str) -> None:
    """One line where an option is no finite number in its range."""
    if not (good and math.isfinite(value)):
        raise UserError(f"{option} {value:g}: expected {expected}")


def _read(paths: Iterable[Path], model: Model, cutoff_hz: float, allow_gaps: bool) -> list[Recording]:
    """All recordings in `paths`, checked against the model."""
    read = read_all(paths, cutoff_hz, allow_gaps=allow_gaps)
    for recording in read:
        check_joints(recording, model.joints)
        check_torque(recording, "drivetwin fit")
        check_axes_move_alone(model, {axis: info.joint for axis, info in recording.info.axes.items()})
    return read


def _thresholds(given: list[str], axes: set[str]) -> dict[str, float]:
    """--standstill values by axis: 0.002 is for every axis, rotate=0.002 for one."""
    thresholds: dict[str, float] = {}
    for text in given:
        axis, _, speed = text.rpartition("=")
        if axis and axis not in axes:
            raise UserError(f"--standstill {text}: no axis '{axis}' in the recordings; there are: {', '.join(sorted(axes))}")
        try:
            value = float(speed)
        except ValueError:
            raise UserError(f"--standstill {text}: '{speed}' is not a number; write 0.002 or AXIS=0.002") from None
        if not value > 0:
            raise UserError(f"--standstill {text}: the speed must be above 0")
        thresholds |= dict.fromkeys([axis] if axis else axes, value)
    return thresholds


class _Step:
    """A callback that advances a progress bar by one and names what comes next."""

    def __init__(self, progress: Progress, task: TaskID, verb: str) -> None:
        self._progress, self._task, self._verb = progress, task, verb

    def __call__(self, what: str) -> None:
        self._progress.update(self._task, advance=1, description=f"{self._verb} {what}")


def _table(axis: AxisIdentification) -> Table:
    table = Table(title=f"Axis {axis.axis}", title_justify="left")
    table.add_column("parameter")
    table.add_column("value", justify="right", no_wrap=True)
    table.add_column("90 % interval", justify="right", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    for name, parameter in axis.parameters.items():
        row = row_of(name, parameter, None)
        table.add_row(row.label, row.value, f"{row.low} to {row.high}", row.unit)
    return table


def _verdict(axis: AxisIdentification) -> str:
    """The errors and what the tests say, in words."""
    lines = [f"{LABELS.get(name, name)} is not identifiable: {why}" for name, why in axis.unidentifiable.items()]
    lines.append(_error_line("relative error of the torque", axis.relative_error, axis.validation_relative_error))
    if axis.relative_error_directional is not None:
        lines.append(_error_line("by direction", axis.relative_error_directional, axis.validation_relative_error_directional))
    if axis.direction:
        lines.append(f"direction: {axis.direction.note}")
    lines.append(f"Stribeck: {axis.stribeck.note}")
    if axis.minimum_velocity is not None:
        lines.append(f"minimum friction at {quantity(axis.minimum_velocity, axis.units.velocity)}")
    return "\n".join(lines)


def _error_line(name: str, fitted: float, held: float | None) -> str:
    return f"{name} {percent(fitted)}" + (f", on validation recordings {percent(held)}" if held is not None else "")


def _written(found: Identification, out: Path) -> str:
    return f"{len(found.axes)} {'axis' if len(found.axes) == 1 else 'axes'} identified: {out / 'report.html'}"
