"""`drivetwin blind`: tests the diagnosis on machines whose true effects are withheld from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from drivetwin.blind.answer import NOMINALS
from drivetwin.blind.case import Case
from drivetwin.blind.cluster import cluster
from drivetwin.blind.diagnoser_process import refuse_other_code
from drivetwin.blind.draw import draw_cases
from drivetwin.blind.key import KEY
from drivetwin.blind.place import Place, code_hash
from drivetwin.blind.run import Order, run
from drivetwin.blind.table import terminal_table
from drivetwin.blind.task import Layout, Procedure
from drivetwin.blind.wide.choice import choice
from drivetwin.blind.wide.draw import draw_wide
from drivetwin.blind.wide.effects import LIBRARY
from drivetwin.blind.wide.families import FAMILIES
from drivetwin.blind.wide.foreign import FOREIGN
from drivetwin.blind.wide.record import record_wide
from drivetwin.cli.effects_from import EffectsFrom, use_effects
from drivetwin.cli.terminal import AsJson, Quiet, terminal
from drivetwin.emulator.effects import added_effects
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import INSTALLED

_BOTH = "both"

_NAMES = (
    f"Machines: {', '.join(FAMILIES)}, robots (with --robots). Effects: {', '.join(LIBRARY)}. Foreign: {', '.join(FOREIGN)}."
)

_WIDE = Layout("train_*", "validate_*", None)


class Generator(StrEnum):
    """What draws and records the cases."""

    WIDE = "wide"
    BUS = "bus"


def blind_command(
    cases: Annotated[int, typer.Option(min=1, help="Number of cases to draw.")] = 300,
    seed: Annotated[int, typer.Option(min=0, help="Seed of everything that is drawn.")] = 0,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Output folder for answers, key and score.")] = Path("out/blind"),
    nominal: Annotated[
        str, typer.Option(help="Parameters of the model: exact (the machine's own), off (each about 4 % off) or both.")
    ] = _BOTH,
    workers: Annotated[int, typer.Option(min=1, help="Worker processes on this machine.")] = 2,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="A running Dask scheduler, tcp://HOST:PORT, instead of --workers.")
    ] = None,
    keep_recordings: Annotated[bool, typer.Option("--keep-recordings", help="Keep the recordings of every case.")] = False,
    generator: Annotated[
        Generator, typer.Option(help="wide: an independent simulator of many machines; bus: a few machines over the bus.")
    ] = Generator.WIDE,
    family: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help=f"Wide generator: draw only these machines or effects; repeatable. {_NAMES}"),
    ] = None,
    without: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Do not draw these machines or effects; repeatable.")
    ] = None,
    robots: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Also draw from the MJCF robot models in this folder.")
    ] = None,
    effects_from: EffectsFrom = None,
    quiet: Quiet = False,
    json_: AsJson = False,
) -> None:
    """Test the diagnosis on machines whose effects it cannot know.

    Draws machines, effects, sizes and noise, seals that key, records every machine, diagnoses it in a process that cannot see
    the key, opens the key and scores. An interrupted run continues. See docs/blind.md.

    Example: drivetwin blind --cases 30 --seed 1 --out out/blind_30
    """
    console = terminal(silent=quiet or json_)
    if nominal not in (*NOMINALS, _BOTH):
        raise UserError(f"--nominal {nominal}: expected exact, off or both")
    refuse_other_code(INSTALLED)
    use_effects(effects_from)
    drawn, procedure = _generated(generator, cases, seed, _Asked(family or (), without or (), robots), workers)
    order = Order(drawn, seed, NOMINALS if nominal == _BOTH else (nominal,))
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as bars:
        watch = _Watch(bars, bars.add_task("cases", total=cases))
        scored = run(order, Place(out), replace(procedure, keep_recordings=keep_recordings), cluster(scheduler, workers), watch)
    console.print(f"key opened: {out / KEY} is what was sealed", highlight=False, soft_wrap=True)
    console.print(terminal_table(scored))
    console.print(f"{cases} cases scored: {out / 'score.html'}", highlight=False, soft_wrap=True)
    if json_:
        print((out / "score.json").read_text(encoding="utf-8"), end="")


@dataclass(frozen=True)
class _Asked:
    """What the wide generator may draw."""

    family: Sequence[str]
    without: Sequence[str]
    robots: Path | None


def _generated(generator: Generator, cases: int, seed: int, asked: _Asked, workers: int) -> tuple[Sequence[Case], Procedure]:
    """Cases, and how they are recorded."""
    effects = added_effects()
    code = code_hash(effects)
    if generator is Generator.WIDE:
        allowed = choice(asked.family, asked.without, asked.robots)
        recorder = partial(record_wide, robots=asked.robots)
        return draw_wide(cases, seed, allowed, workers), Procedure(code, record=recorder, layout=_WIDE, effects=effects)
    if asked.family or asked.without or asked.robots:
        raise UserError("--family, --without and --robots are of --generator wide; the bus generator draws its own machines")
    return draw_cases(cases, seed), Procedure(code, effects=effects)


class _Watch:
    """Prints the commitment, then counts cases on a progress bar; no running score, the key is sealed."""

    def __init__(self, bars: Progress, task: TaskID) -> None:
        self._bars, self._task = bars, task

    def sealed(self, commitment: str, answered: int) -> None:
        self._bars.console.print(f"key sealed: sha256 {commitment}", highlight=False, soft_wrap=True)
        self._bars.update(self._task, completed=answered)

    def of_other_code(self, failed: int) -> None:
        again = f"; {failed} cases that failed are not tried again, for that choose another --out" if failed else ""
        self._bars.console.print(f"answered by other code, scored as it is{again}", highlight=False, soft_wrap=True)

    def claims(self, count: int) -> None:
        if count:
            words = f"{count} answers call themselves indistinguishable from a true effect: tried by the fit"
            self._bars.console.print(words, highlight=False, soft_wrap=True)
        self._bars.reset(self._task, description="claims", total=count)

    def tried(self) -> None:
        self._bars.advance(self._task)

    def examined(self) -> None:
        self._bars.advance(self._task)
        if not self._bars.console.is_terminal:
            self._bars.console.print(f"{self._bars.tasks[self._task].completed:.0f} cases examined", highlight=False)
