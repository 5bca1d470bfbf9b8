"""`drivetwin excite`: the motion that distinguishes what a gap report could not."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from drivetwin.cli.effects_from import EffectsFrom, use_effects
from drivetwin.cli.terminal import AsJson, Quiet, terminal
from drivetwin.diagnosis.excitation.choice import open_question
from drivetwin.diagnosis.excitation.limits import read_limits
from drivetwin.diagnosis.excitation.plan import Plan, plan
from drivetwin.diagnosis.excitation.write import write_plan
from drivetwin.diagnosis.report.schema import read_report
from drivetwin.diagnosis.report.wording import name_of
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import new_directory, refuse_foreign, refuse_to_replace
from drivetwin.foundation.quantities import number


def excite_command(
    model: Annotated[Path, typer.Argument(metavar="MODEL.xml", help="MuJoCo model that was diagnosed; its ranges apply.")],
    *,
    report: Annotated[Path, typer.Option(metavar="FILE", help="report.json of `drivetwin diagnose`.")],
    axis: Annotated[str, typer.Option(metavar="AXIS", help="Axis on which causes are to be distinguished.")],
    limits: Annotated[Path, typer.Option(metavar="FILE", help="YAML: speed, acceleration, jerk, travel of each axis.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Output folder for set-points, motion.json and motion.png.")],
    period: Annotated[float, typer.Option(metavar="S", help="Time between two set-points, in seconds.")] = 0.001,
    effects_from: EffectsFrom = None,
    quiet: Quiet = False,
    json_: AsJson = False,
) -> None:
    """Write the motion that distinguishes what a report could not: move the machine, record, diagnose again.

    Example: drivetwin excite model.xml --report out/gap/report.json --axis lift --limits limits.yaml --out out/motion

    Writes setpoints.parquet and setpoints.csv (time and position of each moving axis, one row per cycle), motion.json (what
    each part is for) and motion.png. Every set-point stays within travel, speed, acceleration and jerk of the limits.
    """
    if not 1e-4 <= period <= 0.02:
        raise UserError(f"--period {period:g}: expected a controller's cycle, 0.0001 to 0.02 s")
    use_effects(effects_from)
    inputs = [model, report, limits, *(effects_from or ())]
    refuse_foreign(out)
    refuse_to_replace(out, inputs)
    found = plan(open_question(read_report(report), axis), read_limits(limits, model), period)
    with new_directory(out) as staged:
        write_plan(found, inputs, staged)
    console = terminal(silent=quiet or json_)
    effects = ", ".join(name_of(effect) for effect in found.question.effects)
    console.print(f"To distinguish on {axis}: {effects}; {number(float(found.time[-1]))} s of motion", highlight=False)
    console.print(_passages(found))
    console.print("  ".join(str(out / name) for name in ("setpoints.csv", "motion.json", "motion.png")), highlight=False)
    if json_:
        print((out / "motion.json").read_text(encoding="utf-8"), end="")


def _passages(found: Plan) -> Table:
    table = Table("from, s", "to, s", "motion", "what it shows")
    for each in found.passages:
        name = each.excitation.name.replace("_", " ")
        table.add_row(f"{each.begin:.1f}", f"{each.end:.1f}", name, each.excitation.purpose)
    return table
