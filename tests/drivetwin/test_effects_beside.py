"""Effects that `drivetwin apply` wrote beside a model: who forgets them is told."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

import pytest

from drivetwin.cli.effects_from import say_what_lies_beside
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.emulator.effects.coulomb_asymmetry import CoulombAsymmetry
from drivetwin.emulator.effects.file import effects_payload
from drivetwin.foundation.files import write_json

ONE = (PlacedEffect("slide", CoulombAsymmetry(-36.0), {"asymmetry": "N"}),)


def said(folder: Path, effects: Sequence[PlacedEffect], given: Path | None, caplog: pytest.LogCaptureFixture) -> str:
    write_json(folder / "twin.effects.json", effects_payload(effects))
    with caplog.at_level(logging.WARNING):
        say_what_lies_beside(folder / "twin.xml", given)
    return caplog.text


def test_what_was_not_given_is_named_with_the_option_that_takes_it(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    assert f"add --effects {tmp_path / 'twin.effects.json'}" in said(tmp_path, ONE, None, caplog)


def test_nothing_is_said_of_what_is_given(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    assert said(tmp_path, ONE, tmp_path / "twin.effects.json", caplog) == ""


def test_nothing_is_said_of_a_file_without_effects(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    assert said(tmp_path, (), None, caplog) == ""
