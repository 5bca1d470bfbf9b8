"""A blind test from the sealed key to the score: every case recorded and diagnosed, each answer on disk as it comes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Protocol

from distributed import Client, Future, as_completed

from drivetwin.blind.answer import ALIKE, FAILED, answered, read_answer
from drivetwin.blind.case import Case
from drivetwin.blind.claims import claims
from drivetwin.blind.duration import Duration, read_seconds, write_times
from drivetwin.blind.key import open_key, seal
from drivetwin.blind.page import write_score_page
from drivetwin.blind.place import Place, claim
from drivetwin.blind.score import Score, score
from drivetwin.blind.score_file import write_score
from drivetwin.blind.table import write_markdown
from drivetwin.blind.task import SECONDS, Examined, Procedure, examine, pack, try_claims, unpack
from drivetwin.foundation.files import new_directory, new_file, write_json


@dataclass(frozen=True)
class Order:
    """What is to be answered: `cases`, drawn from `seed`, each with every one of `nominals`."""

    cases: Sequence[Case]
    seed: int
    nominals: tuple[str, ...]


class Watch(Protocol):
    """Who is told how far a run is."""

    def sealed(self, commitment: str, answered: int) -> None:
        """The key is sealed, nothing is recorded yet; so many cases are answered from before."""

    def of_other_code(self, failed: int) -> None:
        """OUT is scored as it is, for it was answered by other code; so many cases that failed are not tried again."""

    def examined(self) -> None:
        """One more case is answered."""

    def claims(self, count: int) -> None:
        """The key is open; so many answers that call themselves indistinguishable from a true effect are tried by the fit."""

    def tried(self) -> None:
        """One more of them is done."""


def run(order: Order, place: Place, procedure: Procedure, workers: AbstractContextManager[Client], watch: Watch) -> Score:
    """Seal the key, examine what is not answered yet on the `workers`, open the key, score, and write all of it to `place`.

    What calls itself indistinguishable from a true effect is tried by the fit once the key is open.
    Answers by other code are scored as they are, where it tried every case. Raises UserError where `place` is of another run,
    or other code has answered some of it only.
    """
    key = seal(order.cases, order.seed)
    code = claim(place, key, procedure.code, order.cases, order.nominals)
    todo = place.pending(order.cases, order.nominals)
    watch.sealed(key.commitment, len(order.cases) - len(todo))
    with ExitStack() as held:
        client = cache(lambda: held.enter_context(workers))
        if code != procedure.code:
            watch.of_other_code(len(todo))
        elif todo:
            _examine(client(), order.cases, todo, place, procedure, watch)
        open_key(key, place.out)
        if code == procedure.code:
            _try_claims(client, order, place, procedure, watch)
    answers = {name: [read_answer(place.outcome(case.number, name)) for case in order.cases] for name in order.nominals}
    scored = score(order.cases, answers, seed=order.seed, commitment=key.commitment, code=code)
    _publish(scored, _durations(order, place), place)
    return scored


def _examine(
    client: Client, cases: Sequence[Case], todo: dict[int, tuple[str, ...]], place: Place, procedure: Procedure, watch: Watch
) -> None:
    """Have every case of `todo` examined, and keep what came of each as it comes."""
    asked = [case for case in cases if case.number in todo]
    waiting = {client.submit(examine, case, todo[case.number], procedure, pure=False): case.number for case in asked}
    for future in as_completed(list(waiting)):
        number = waiting.pop(future)
        _keep(place, number, todo[number], future)
        future.release()
        watch.examined()


def _keep(place: Place, number: int, nominals: tuple[str, ...], future: Future[Examined]) -> None:
    """Write what came of a case, each folder whole or not at all."""
    error = future.exception()
    if error is not None:  # not recorded, or its worker died again and again: counts as not answered, and is tried again
        for nominal in nominals:
            with new_directory(place.outcome(number, nominal)) as staged:
                write_json(staged / FAILED, {"failed": f"not examined: {type(error).__name__}: {error}"})
        return
    examined = future.result()
    if examined.recordings is not None:
        with new_directory(place.recordings(number)) as staged:
            unpack(examined.recordings, staged)
    for outcome in examined.outcomes:
        with new_directory(place.outcome(number, outcome.nominal)) as staged:
            unpack(outcome.content, staged)


def _try_claims(client: Callable[[], Client], order: Order, place: Place, procedure: Procedure, watch: Watch) -> None:
    """Have every claim to be indistinguishable from a true effect tried by the fit, once; the key is open."""
    waiting: dict[Future[str], Path] = {}
    for case in order.cases:
        for nominal in order.nominals:
            folder = place.outcome(case.number, nominal)
            asked = claims(case, read_answer(folder).report)
            if asked and not (folder / ALIKE).exists():
                own = client().submit(try_claims, case, nominal, asked, pack(folder), procedure, pure=False)
                waiting[own] = folder / ALIKE
    if not waiting:
        return
    watch.claims(len(waiting))
    for future in as_completed(list(waiting)):
        with new_file(waiting.pop(future)) as part:
            part.write_text(future.result(), encoding="utf-8")
        watch.tried()


def _durations(order: Order, place: Place) -> list[Duration]:
    """How long each answer took, in the order of the cases."""
    return [
        Duration(case.number, case.machine, nominal, read_seconds(folder / SECONDS))
        for case in order.cases
        for nominal in order.nominals
        if answered(folder := place.outcome(case.number, nominal))
    ]


def _publish(scored: Score, durations: Sequence[Duration], place: Place) -> None:
    write_times(place.out / "times.json", durations)
    write_markdown(place.out / "table.md", scored)
    write_score_page(place.out / "score.html", scored, durations)
    write_score(place.out / "score.json", scored)
