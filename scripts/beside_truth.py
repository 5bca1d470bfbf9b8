"""For development: how far the set of effects that a search finds is from the true one, in nats of evidence.

    python -m drivetwin.blind.wide.write --count 24 --seed 1 --out out/wide
    python scripts/beside_truth.py --cases out/wide

A truth that is worth more than the set that was found is one that the search did not see. One that is worth less was seen, or
would not have helped: then it is the judgement, or the data, that miss it. Both sets are settled, each in the noise that it
leaves itself. What the library or the recordings cannot ask for is in neither.
"""

from __future__ import annotations

import json
from argparse import ArgumentParser
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from threadpoolctl import threadpool_limits

from drivetwin.blind.with_and_without import no_progress
from drivetwin.diagnosis.diagnose import proposer_of
from drivetwin.diagnosis.prepare.prepared import prepared
from drivetwin.diagnosis.propose.placing import in_order, placed
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.colouring import coloured, in_its_noise, read_anew
from drivetwin.diagnosis.weigh.moves import Search
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.state import State, state_of
from drivetwin.diagnosis.weigh.yielding import settled_on
from drivetwin.emulator.effects import Effect, PlacedEffect, library
from drivetwin.emulator.effects.presliding import Presliding
from drivetwin.recording.reader import read_recording

LEAST = 0.01
"""Of an axis's gap, that a true effect takes to be in the true set: what is less, nobody needs."""
ROUNDS = 3
"""Of settling and colouring, after which neither changes much."""


@dataclass(frozen=True)
class Beside:
    """Of one case: the sets by name and axis, and by how many nats the true one is worth more."""

    found: tuple[str, ...]
    true: tuple[str, ...]
    more: float


def true_effects(told: Sequence[Mapping[str, Any]], proposer: Proposer) -> list[PlacedEffect]:
    """The causes and nuisances of a key that can be asked for, with their true parameters.

    Presliding of a machine's friction is told by the way on which it yields.
    """
    rows, dynamics = proposer.bench.rows, proposer.bench.rows.simulation.dynamics()
    found = []
    for one in told:
        axis, kind = str(one["axis"]), library().get(str(one["effect"]))
        if kind is None or kind not in proposer.kinds.get(axis, ()) or float(one["share"]) < LEAST:
            continue
        level = dynamics[axis].friction.coulomb
        found.append(placed(rows, axis, _with_values(kind, one["parameters"], level)))
    return found


def _with_values(kind: type[Effect], values: Mapping[str, float], level: float) -> Effect:
    return Presliding(1.6 * level / values["displacement"]) if "displacement" in values else kind(**values)


def beside_truth(folder: Path, told: Mapping[str, Any]) -> Beside:
    """A search on the recordings of a case, and its set beside the true one."""
    settings = Settings()
    training, validation = (
        [recording for path in sorted(folder.glob(f"{part}_*")) for recording in read_recording(path)]
        for part in ("train", "validate")
    )
    proposer = proposer_of(prepared(folder / "model.xml", training, validation, settings), settings)
    found = Search(proposer, no_progress).run().state
    true = _settled(true_effects([*told["causes"], *told["nuisances"]], proposer), proposer)
    worth = [proposer.rated(in_its_noise(state, found)) for state in (found, true)]
    return Beside(_names(found), _names(true), worth[1] - worth[0])


def _settled(effects: Sequence[PlacedEffect], proposer: Proposer) -> State:
    state = state_of(proposer.bench, in_order(effects), proposer.bench.white, {})
    for _ in range(ROUNDS):
        state = coloured(read_anew(settled_on(state), ()), ())
    return settled_on(state)


def _names(state: State) -> tuple[str, ...]:
    return tuple(sorted(f"{one.effect.name} {one.axis}" for one in state.effects))


def main() -> None:
    """Print a line for each case, as soon as it is known."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=Path, required=True, help="a folder of case_NNN and key.json")
    parser.add_argument("--only", type=int, action="append", default=[], help="number of a case; repeatable")
    asked = parser.parse_args()
    if not (asked.cases / "key.json").is_file():
        parser.error(f"no key.json in {asked.cases}: write cases with python -m drivetwin.blind.wide.write")
    console = Console()
    for case in json.loads((asked.cases / "key.json").read_text(encoding="utf-8"))["cases"]:
        if asked.only and case["number"] not in asked.only:
            continue
        with threadpool_limits(1), Console(stderr=True).status(f"case {case['number']:03d}: a minute or two"):
            one = beside_truth(asked.cases / f"case_{case['number']:03d}", case)
        table = Table(title=f"case {case['number']:03d}, {case['machine']}, {case['kind']}", title_justify="left")
        for name in ("the truth is worth more by [nats]", "only in the truth", "only found"):
            table.add_column(name)
        only_true, only_found = sorted(set(one.true) - set(one.found)), sorted(set(one.found) - set(one.true))
        table.add_row(f"{one.more:.0f}", "\n".join(only_true) or "-", "\n".join(only_found) or "-")
        console.print(table)


if __name__ == "__main__":
    main()
