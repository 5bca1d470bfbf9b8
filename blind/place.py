"""The folder of a run: what of it is answered, and whether this run and this code may go on with it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from drivetwin.blind.answer import answered, tried
from drivetwin.blind.case import Case
from drivetwin.blind.key import Key, commit
from drivetwin.emulator.effects import EffectFile
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import INSTALLED, refuse_unwritable, write_json

SCHEMA = "blind-run/1"
RUN = "run.json"

_ANSWERED_BY = (
    *("blind", "bus", "controller", "diagnosis", "drive_profiles", "emulator"),
    *("foundation", "identification", "motion", "recording"),
)


@dataclass(frozen=True)
class Place:
    """Where everything of a run stands."""

    out: Path

    def outcome(self, number: int, nominal: str) -> Path:
        """The folder of one diagnosis."""
        return self.out / "cases" / f"{number:03d}" / nominal

    def recordings(self, number: int) -> Path:
        """The recordings of one case, where they are kept."""
        return self.out / "cases" / f"{number:03d}" / "recordings"

    def pending(self, cases: Sequence[Case], nominals: Sequence[str]) -> dict[int, tuple[str, ...]]:
        """By case number, the nominals for which there is no answer yet."""
        missing = {
            case.number: tuple(nominal for nominal in nominals if not answered(self.outcome(case.number, nominal)))
            for case in cases
        }
        return {number: names for number, names in missing.items() if names}

    def may_be_scored_by_other_code(self, cases: Sequence[Case], nominals: Sequence[str]) -> bool:
        """Whether every case was tried, and some have answers: nothing but what failed would be tried again."""
        outcomes = [self.outcome(case.number, nominal) for case in cases for nominal in nominals]
        return all(tried(folder) for folder in outcomes) and any(answered(folder) for folder in outcomes)


def claim(place: Place, key: Key, code: str, cases: Sequence[Case], nominals: Sequence[str]) -> str:
    """Make OUT the folder of this run, or find it so, and commit to the key; hash of the code by which OUT's answers are.

    Raises UserError where OUT holds anything else, or other code's answers to some of the cases only. run.json has no seed,
    from which anyone could draw the truth.
    """
    if (place.out / RUN).exists():
        found = json.loads((place.out / RUN).read_text(encoding="utf-8"))
        if found["commitment"] != key.commitment:
            same = "give the same ones to go on with it, or another --out"
            raise UserError(f"{place.out} holds a run with another --seed or --cases; {same}")
        if found["code"] != code and not place.may_be_scored_by_other_code(cases, nominals):
            mixed = "new ones cannot be mixed with them: choose another --out"
            raise UserError(f"{place.out} holds answers of other code; {mixed}")
        code = found["code"]
    else:
        _refuse_foreign(place.out)
        write_json(place.out / RUN, {"schema": SCHEMA, "commitment": key.commitment, "code": code})
    commit(key, place.out)
    return str(code)


def code_hash(effects: Sequence[EffectFile] = ()) -> str:
    """SHA-256 over every file that has a part in an answer, those with effects of others too."""
    digest = hashlib.sha256("".join(file.text for file in effects).encode())
    for package in _ANSWERED_BY:
        for path in sorted((INSTALLED / package).rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                digest.update(f"{path.relative_to(INSTALLED)}\0".encode() + path.read_bytes())
    return digest.hexdigest()


def _refuse_foreign(out: Path) -> None:
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise UserError(f"{out} is not of `drivetwin blind`; choose an empty or a new directory for --out")
    refuse_unwritable(out / "key.json")
