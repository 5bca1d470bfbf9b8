"""Whether an answer that calls itself indistinguishable from a true effect is so: the fit says, with the true one in its place.

An answer may name a true effect only among what it cannot be distinguished from. Then the set of effects of its patch is fitted
again to the recordings that it was fitted to, with the true effect in the place of the chosen one. Where that leaves as much of
the gap on the validation recordings, but for the share that makes an effect worth a name, these recordings do not decide, and
the answer counts. Where it leaves more or less, they would have told, and the answer is wrong.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import MISSING, asdict, dataclass, fields, replace
from pathlib import Path

from threadpoolctl import threadpool_limits

from drivetwin.blind.case import Case, Cause
from drivetwin.blind.claims import Claim
from drivetwin.blind.told import Told, read_told
from drivetwin.diagnosis.diagnose import on_every_row, proposer_of
from drivetwin.diagnosis.prepare.inputs import read_inputs
from drivetwin.diagnosis.prepare.prepared import Prepared, prepared
from drivetwin.diagnosis.propose.placing import in_order, placed
from drivetwin.diagnosis.report.prediction import Patch, gap_rms, predict
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.colouring import coloured
from drivetwin.diagnosis.weigh.refit import refitted
from drivetwin.diagnosis.weigh.state import State, state_of
from drivetwin.diagnosis.weigh.yielding import best_together, settled_on, yields
from drivetwin.emulator.effects import DriveEffect, Effect, PlacedEffect, library, read_effects
from drivetwin.foundation.errors import UserError

SCHEMA = "blind-alike/1"

STEPS = 20
"""Gauss-Newton steps at most, with which the set moves to where the evidence gains no more."""


@dataclass(frozen=True)
class Checked:
    """A claim, and the share of the gap's energy that is left with what was chosen and with the true effect in its place.

    Of the axis on which the two differ most. `why`: where the true effect could not be fitted at all, the reason. Then the
    claim does not hold.
    """

    claim: Claim
    chosen_leaves: float
    truth_leaves: float | None
    allowed: float
    why: str = ""

    @property
    def holds(self) -> bool:
        """Whether the true effect explains the validation recordings as well, and no better: else they would tell."""
        return self.truth_leaves is not None and abs(self.truth_leaves - self.chosen_leaves) <= self.allowed


@dataclass(frozen=True)
class Material:
    """What a check needs of a case: the model as it was patched, the recordings, the effects and the report of the answer."""

    model: Path
    training: Sequence[Path]
    validation: Sequence[Path]
    effects: Path
    report: Path


def checked(case: Case, asked: Sequence[Claim], material: Material) -> list[Checked]:
    """Each claim by the fit; of several with one true effect the first that holds, for it stands in one place only."""
    ready, settings, report = _ready(material)
    chosen = read_effects(material.effects)
    before = {axis: told.gap_rms for axis, told in report.axes.items() if told.significant}
    left = _as_reported(material.report, before, _left(ready, before, Patch(in_order(chosen))))
    found: list[Checked] = []
    taken: set[tuple[str, str]] = set()
    for claim in asked:
        if (claim.truth, claim.axis) in taken:
            continue
        one = _checked(case, claim, ready, chosen, (before, left), settings)
        found.append(one)
        if one.holds:
            taken.add((claim.truth, claim.axis))
    return found


def _ready(material: Material) -> tuple[Prepared, Settings, Told]:
    """The recordings as the diagnosis compared them."""
    report = read_told(material.report)
    settings = _settings(material.report)
    inputs = read_inputs(material.model, material.training, material.validation, cutoff_hz=None, allow_gaps=False)
    return prepared(material.model, inputs.training, inputs.validation, settings), settings, report


def _settings(report: Path) -> Settings:
    """Of the diagnosis, at the cut-off frequency that it chose."""
    told = json.loads(report.read_text(encoding="utf-8"))
    known = {one.name for one in fields(Settings)}
    settings = Settings(**{name: value for name, value in told.get("settings", {}).items() if name in known})
    cutoffs = [axis["cutoff_hz"] for axis in told["axes"].values() if "cutoff_hz" in axis]
    return replace(settings, cutoff_hz=max(cutoffs)) if cutoffs else settings


def _checked(
    case: Case,
    claim: Claim,
    ready: Prepared,
    chosen: Sequence[PlacedEffect],
    known: tuple[dict[str, float], dict[str, float]],
    settings: Settings,
) -> Checked:
    before, left = known
    own = [one for one in chosen if (one.effect.name, one.axis) == (claim.effect, claim.axis)]
    nothing = Checked(claim, left.get(claim.axis, 1.0), None, settings.least_share)
    kind = library().get(claim.truth)
    if not own or kind is None or issubclass(kind, DriveEffect):
        return replace(nothing, why="not part of the patch" if not own else "not told by a motion")
    truth = next(one for one in case.all_effects if (one.effect, one.axis) == (claim.truth, claim.axis))
    rest = [one for one in chosen if one is not own[0] and not isinstance(one.effect, DriveEffect)]
    drives = [one for one in chosen if isinstance(one.effect, DriveEffect)]
    with threadpool_limits(1):
        try:
            fitted = _fitted(ready, rest, truth, kind, settings)
        except UserError as error:
            return replace(nothing, why=str(error))
        if fitted is None:
            return replace(nothing, why=f"{claim.truth} can follow these recordings from no start")
        values = refitted(on_every_row(fitted, ready, settings), ())
        now = _left(ready.aligned(values.late, values.state.apart()), before, Patch(in_order([*values.effects, *drives])))
    worst = max(before, key=lambda axis: abs(now[axis] - left[axis]), default=claim.axis)
    return replace(nothing, chosen_leaves=left.get(worst, 1.0), truth_leaves=now.get(worst, 1.0))


def _fitted(
    ready: Prepared, rest: Sequence[PlacedEffect], truth: Cause, kind: type[Effect], settings: Settings
) -> State | None:
    """The other effects with the true one: from its true parameters, and where it yields also from the library's own starts."""
    bench = proposer_of(ready, settings).bench
    begun = []
    if (start := _true(truth, kind)) is not None:
        whole = state_of(bench, [*rest, placed(ready.rows, truth.axis, start)], bench.white, {})
        begun.append(settled_on(coloured(whole, ()), STEPS))
    if yields(kind):
        beside = state_of(bench, rest, bench.white, {})
        searched = best_together(coloured(beside, ()), truth.axis, kind)
        begun += [settled_on(searched, STEPS)] if searched is not None else []
    return min(begun, key=lambda one: sum(one.left.values()), default=None)


def _true(truth: Cause, kind: type[Effect]) -> Effect | None:
    """The true effect in the library's words; None where the machine was drawn in others."""
    needed = {one.name for one in fields(kind) if one.default is MISSING}
    known = {one.name: truth.parameters[one.name] for one in kind.parameters if one.name in truth.parameters}
    if needed - set(known):
        return None
    bounds = {one.name: (one.low, one.high) for one in kind.parameters}
    return kind(**{name: min(max(value, bounds[name][0]), bounds[name][1]) for name, value in known.items()})


def _left(ready: Prepared, before: dict[str, float], patch: Patch) -> dict[str, float]:
    """Share of the energy of each axis's gap that a patch leaves on the validation recordings."""
    told = [predict(ready.simulation, run, patch) for run in ready.checks]
    return {axis: (gap_rms(told, axis, "after") / max(gap, 1e-300)) ** 2 for axis, gap in before.items()}


def _as_reported(report: Path, before: dict[str, float], found: dict[str, float]) -> dict[str, float]:
    """The share that the patch leaves, as the report has it where that is less: it read torque that came late earlier."""
    told = json.loads(report.read_text(encoding="utf-8")).get("after", {})
    shares = {axis: (told[axis]["gap_rms"] / max(gap, 1e-300)) ** 2 for axis, gap in before.items() if axis in told}
    return {axis: min(share, shares.get(axis, share)) for axis, share in found.items()}


def untried(asked: Sequence[Claim], why: str) -> list[Checked]:
    """Claims that could not be tried: none of them holds."""
    return [Checked(one, 1.0, None, 0.0, why) for one in asked]


def alike_payload(found: Iterable[Checked]) -> dict[str, object]:
    """alike.json: every claim of an answer, and what came of it."""
    return {"schema": SCHEMA, "claims": [{**asdict(one.claim), **_figures(one)} for one in found]}


def _figures(one: Checked) -> dict[str, object]:
    figures = {"chosen_leaves": one.chosen_leaves, "truth_leaves": one.truth_leaves, "allowed": one.allowed}
    return {**figures, "holds": one.holds, "why": one.why}
