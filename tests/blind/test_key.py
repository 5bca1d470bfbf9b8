"""The key's hash commits to the truth, and cannot be had from the truth alone."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest

from drivetwin.blind.case import Case, Cause
from drivetwin.blind.key import COMMITMENT, KEY, commit, open_key, seal
from drivetwin.foundation.errors import UserError

CASES = (
    Case(0, 11, "arm", "clean", (), "lugre"),
    Case(1, 12, "stage", "single", (Cause("stribeck", "slide", {"static_torque": 1.3, "stribeck_velocity": 0.01}),), "lugre"),
)


def changed(**values: Any) -> tuple[Case, ...]:
    return (CASES[0], replace(CASES[1], **values))


@pytest.mark.parametrize(
    "cases",
    [
        CASES[:1],
        CASES[::-1],
        changed(seed=13),
        changed(machine="lift"),
        changed(kind="double"),
        changed(formulation="maxwell_slip"),
        changed(causes=(Cause("stribeck", "slide", {"static_torque": 1.3, "stribeck_velocity": 0.010000000000000002}),)),
        changed(causes=(Cause("stribeck", "rotate", {"static_torque": 1.3, "stribeck_velocity": 0.01}),)),
    ],
)
def test_every_change_of_the_truth_changes_the_hash(cases: tuple[Case, ...]) -> None:
    assert seal(cases, 0).commitment != seal(CASES, 0).commitment


def test_same_truth_has_the_same_hash() -> None:
    parameters = {"stribeck_velocity": 0.01, "static_torque": 1.3}
    assert seal(changed(causes=(Cause("stribeck", "slide", parameters),)), 0) == seal(CASES, 0)


def test_seed_changes_the_hash_of_the_same_truth() -> None:
    assert seal(CASES, 1).commitment != seal(CASES, 0).commitment


def test_commitment_is_the_sha256_of_the_opened_file(tmp_path: Path) -> None:
    key = seal(CASES, 0)
    commit(key, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [COMMITMENT]
    open_key(key, tmp_path)
    content = (tmp_path / KEY).read_bytes()
    assert (tmp_path / COMMITMENT).read_text() == f"{hashlib.sha256(content).hexdigest()}  {KEY}\n"
    assert json.loads(content)["cases"] == json.loads(json.dumps([asdict(case) for case in CASES]))


def test_key_that_was_not_committed_to_is_refused(tmp_path: Path) -> None:
    commit(seal(CASES, 0), tmp_path)
    with pytest.raises(UserError, match="commits to"):
        open_key(seal(CASES[:1], 0), tmp_path)
    assert not (tmp_path / KEY).exists()


def test_commitment_takes_an_opened_key_away(tmp_path: Path) -> None:
    key = seal(CASES, 0)
    commit(key, tmp_path)
    open_key(key, tmp_path)
    commit(key, tmp_path)
    assert not (tmp_path / KEY).exists()
