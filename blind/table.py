"""The score as tables: on the terminal, and as the Markdown that documentation keeps."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from rich.table import Table

from drivetwin.blind.rates import Rate
from drivetwin.blind.score import Extra, Miss, NominalScore, Score, Target
from drivetwin.blind.strict import Called
from drivetwin.foundation.files import new_file

WORDS = {True: "reached", False: "missed", None: "no case"}
HEAD = ("nominal", "what", "found", "90 % interval", "of", "promised", "")


def target_rows(score: Score) -> list[tuple[str, ...]]:
    """One row a promised figure, under `HEAD`."""
    return [_target_row(target) for target in score.targets]


def _target_row(target: Target) -> tuple[str, ...]:
    found = (percent(target.value), interval(target.ci90), str(target.of))
    return (target.nominal, target.words, *found, percent(target.wanted), WORDS[target.reached])


def percent(share: float | None) -> str:
    """A share in per cent, with one decimal; a dash for None."""
    return "-" if share is None else f"{100.0 * share:.1f} %"


def interval(bounds: tuple[float, float] | None) -> str:
    """Two shares in per cent; a dash for None."""
    return "-" if bounds is None else f"{100.0 * bounds[0]:.1f} to {100.0 * bounds[1]:.1f} %"


def rate_row(name: str, found: Rate) -> tuple[str, ...]:
    """A rate as name, right, of, share, interval."""
    return (name, str(found.hits), str(found.of), percent(found.value), interval(found.ci90))


RATE_HEAD = ("", "right", "of", "share", "90 % interval")


def calibration_rows(calibration: Iterable[Called]) -> list[tuple[str, ...]]:
    """One row a bin of called probabilities, under `CALIBRATION_HEAD`."""
    return [(f"{bin_.low:g} to {bin_.high:g}", percent(bin_.mean), *rate_row("", bin_.right)[1:]) for bin_ in calibration]


CALIBRATION_HEAD = ("called", "mean", *RATE_HEAD[1:])

MISS_HEAD = ("case", "kind", "machine", "formulation", "truth", "answer", "called", "failed because")


def miss_row(miss: Miss) -> tuple[str, ...]:
    """One row a case that is not right, under `MISS_HEAD`."""
    called = "-" if miss.probability is None else f"{miss.probability:.2f}"
    return (f"{miss.number}", miss.kind, miss.machine, miss.formulation, miss.truth, miss.answer, called, miss.failed or "")


EXTRA_HEAD = ("case", "machine", "truth", "selected beside it")


def extra_row(extra: Extra) -> tuple[str, ...]:
    """One row a case of which effects were selected that are not there, under `EXTRA_HEAD`."""
    return (f"{extra.number}", extra.machine, extra.truth, ", ".join(extra.others))


def nothing_else(score: NominalScore) -> str:
    """How often no effect was selected that is not there, in words."""
    found = score.nothing_else
    return (
        f"Of {found.of} answers to cases with effects of the library, {found.hits} select none that is not there: "
        f"{percent(found.value)} ({interval(found.ci90)})."
    )


def strict_rows(score: NominalScore) -> list[tuple[str, ...]]:
    """The strict figures, under `RATE_HEAD`."""
    found = score.strict
    named = (
        ("single: the true cause itself first", found.exact_first),
        ("single: first is indistinguishable from it, says so, and is so by the fit", found.alike_first),
        ("single: the right one first, parameters of the model that are off aside", found.beside_the_model),
        ("first is there, if only as a nuisance", found.there_first),
        ("four axes: all four selected", found.all_four),
        ("selected and not there, of all selected", found.absent),
        ("selected, not there and not indistinguishable from what is", score.or_alike.absent),
        ("named as indistinguishable from a true effect: is so by the fit", score.or_alike.claims),
        ("axes made worse on validation motion", found.worse),
        ("90 % interval of a parameter holds the truth", found.covered),
    )
    return [rate_row(words, figure) for words, figure in named]


def strict_words(score: NominalScore) -> str:
    """The strict Brier score, and how far told shares of the gap are off."""
    found = score.strict
    alike = score.or_alike.brier
    told = "no probability was called" if found.brier is None else f"strict Brier score {found.brier:.3f}"
    contract = "" if alike is None else f", {alike:.3f} by the event of the contract"
    off = found.share_error
    error = "no share of a true cause was stated" if off is None else f"stated shares are {off:.2f} off (median)"
    untried = score.or_alike.untried
    claims = f" {untried} claims to be indistinguishable were not tried by the fit and count as wrong." if untried else ""
    return f"{told[0].upper()}{told[1:]}{contract}; {error}.{claims}"


def terminal_table(score: Score) -> Table:
    """The promised figures."""
    table = Table(title=f"{score.cases} cases, seed {score.seed}", title_justify="left")
    for at, head in enumerate(HEAD):
        table.add_column(head, justify="right" if 2 <= at <= 5 else "left", no_wrap=at != 1)
    for row in target_rows(score):
        table.add_row(*row)
    return table


def write_markdown(path: Path, score: Score) -> None:
    """Write the tables that documentation keeps."""
    lines = [f"{score.cases} cases, seed {score.seed}; key {score.commitment}.", "", *markdown(HEAD, target_rows(score))]
    for of_nominal in score.nominal:
        lines += ["", f"### Nominal parameters {of_nominal.nominal}", "", *_nominal_markdown(of_nominal)]
    with new_file(path) as part:
        part.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _nominal_markdown(score: NominalScore) -> list[str]:
    lines = [*markdown(CALIBRATION_HEAD, calibration_rows(score.calibration)), ""]
    lines += [f"Brier score {score.brier:.3f}." if score.brier is not None else "No probability was called.", ""]
    lines += [*markdown(("strictly", *RATE_HEAD[1:]), strict_rows(score)), "", strict_words(score), ""]
    lines += [*markdown(("called, strict event", *CALIBRATION_HEAD[1:]), calibration_rows(score.strict.reliability)), ""]
    contract = calibration_rows(score.or_alike.reliability)
    lines += [*markdown(("called, event of the contract", *CALIBRATION_HEAD[1:]), contract), ""]
    lines += [nothing_else(score), "", *markdown(EXTRA_HEAD, map(extra_row, score.extras)), ""]
    for what, named in (("truth", score.by_effect), ("machine", score.by_machine), ("formulation", score.by_formulation)):
        lines += [*markdown((what, *RATE_HEAD[1:]), [rate_row(one.name, one.rate) for one in named]), ""]
    return lines[:-1]


def markdown(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """The lines of a Markdown table."""
    return [f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *rows)]
