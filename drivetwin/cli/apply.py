"""`drivetwin apply`: what was identified or diagnosed, written into a model."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from drivetwin.cli.effects_from import EffectsFrom, use_effects
from drivetwin.cli.out_file import refuse_out_file
from drivetwin.cli.terminal import AsJson, Quiet, terminal
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.emulator.effects.file import effects_payload
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import new_file, provenance, write_json
from drivetwin.twin.apply import Applied
from drivetwin.twin.findings import apply_findings


def apply_command(
    findings: Annotated[
        Path, typer.Argument(metavar="FINDINGS.json", help="identified.json of identify or fit, or effects.json of diagnose.")
    ],
    model: Annotated[Path, typer.Argument(metavar="MODEL.xml", help="MuJoCo model (MJCF); it is not changed.")],
    *,
    out: Annotated[Path, typer.Option(metavar="FILE.xml", help="The model to write; FILE.effects.json appears beside it.")],
    joint: Annotated[
        list[str] | None,
        typer.Option(metavar="AXIS=JOINT", help="Joint of an axis whose name neither a joint nor its motor has; repeatable."),
    ] = None,
    effects_from: EffectsFrom = None,
    quiet: Quiet = False,
    json_: AsJson = False,
) -> None:
    """Write what was identified or diagnosed into a model.

    Example: drivetwin apply out/emps_fit/identified.json docs/examples/emps/model.xml --out out/emps_twin.xml

    Friction becomes the joint's frictionloss and damping, inertia its armature (or lighter bodies), a payload a body. What MJCF
    cannot hold is written as effects to FILE.effects.json, for `drivetwin replay --effects` and `drivetwin emulate --effects`.
    """
    refuse_out_file(out, "twin.xml")
    use_effects(effects_from)
    beside = out.with_suffix(".effects.json")
    inputs = [findings, model, *(effects_from or ())]
    for file in (out, beside):
        if file.resolve() in {each.resolve() for each in inputs}:
            raise UserError(f"{file} is read, and --out {out} would replace it: choose another --out")
    applied = apply_findings(findings, model, _joints(joint or []))
    with new_file(out) as part:
        part.write_text(applied.xml, encoding="utf-8")
        write_json(beside, effects_payload(applied.beside) | provenance(0, inputs))
    console = terminal(silent=quiet or json_)
    if applied.changes:
        console.print(_table(applied))
    console.print(_said(applied.beside, out, beside), highlight=False, soft_wrap=True)
    if json_:
        print(json.dumps(_payload(applied, out, beside), ensure_ascii=False))


def _joints(given: Sequence[str]) -> dict[str, str]:
    found = {}
    for text in given:
        axis, equals, name = text.partition("=")
        if not (axis and equals and name):
            raise UserError(f"--joint {text}: expected AXIS=JOINT, for example --joint x=slide_x")
        found[axis] = name
    return found


def _table(applied: Applied) -> Table:
    table = Table("axis", "of the model", "was", "is", "unit")
    for change in applied.changes:
        table.add_row(change.axis, change.quantity, f"{change.before:.6g}", f"{change.after:.6g}", change.unit)
    return table


def _said(effects: Sequence[PlacedEffect], out: Path, beside: Path) -> str:
    if not effects:
        return f"{out} contains everything; {beside} is empty"
    named = ", ".join(f"{placed.effect.name} of {placed.axis}" for placed in effects)
    return f"{out}; MJCF cannot express {named}: see {beside}"


def _payload(applied: Applied, out: Path, beside: Path) -> dict[str, object]:
    changes = [
        {"axis": one.axis, "quantity": one.quantity, "before": one.before, "after": one.after, "unit": one.unit}
        for one in applied.changes
    ]
    return {"model": str(out), "changes": changes, "effects_file": str(beside), **effects_payload(applied.beside)}
