"""The table of what the settings decide, on answers made by hand."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import sensitivity
from sensitivity import AS_IT_IS, BEGIN, END, Told, markdown, publish, rows, variants

from drivetwin.diagnosis.settings import Settings


def test_every_number_is_halved_and_doubled_one_at_a_time() -> None:
    usual, found = asdict(Settings()), variants()
    assert found[AS_IT_IS] == Settings()
    for name, settings in found.items():
        changed = {each for each, value in asdict(settings).items() if value != usual[each]}
        assert changed == (set() if name == AS_IT_IS else {name.split(" x ")[0]}), name
    assert found["misfit x 2"].misfit == 2.0 * Settings().misfit
    assert found["folds x 0.5"].folds == 2
    left_out = {each for each, value in usual.items() if isinstance(value, int | float)} - {"cutoff_hz", "seed"}
    assert {name.split(" x ")[0] for name in found} - {AS_IT_IS} == left_out


def answered(**changed: Told) -> dict[str, Told]:
    """A case with the same answer to every setting but those that are given, by their number in the list of variants."""
    same = Told("stribeck@x", frozenset({"stribeck@x"}))
    return {name: changed.get(f"at_{k}", same) for k, name in enumerate(variants())}


def test_changed_answers_are_counted_of_cases_that_are_done(tmp_path: Path) -> None:
    other = Told("unknown@x", frozenset({"stribeck@x", "inertia@x"}))
    unfinished = dict(list(answered().items())[:3])
    found = {"one": answered(at_1=other), "two": answered(), "three": unfinished}
    first, *rest = rows(found)
    assert first["halved"] == {"first": 1, "selected": 1}
    assert first["doubled"] == {"first": 0, "selected": 0}
    assert all(row["halved"] == {"first": 0, "selected": 0} for row in rest)
    assert "2 cases, 2 selected effects" in markdown(found)
    page = tmp_path / "page.md"
    page.write_text(f"# Title\n{BEGIN}\noutdated\n{END}\nafter\n", encoding="utf-8")
    publish(page, found, "code")
    text = page.read_text(encoding="utf-8")
    assert "outdated" not in text
    assert text.startswith("# Title")
    assert text.endswith("after\n")
    assert (tmp_path / "page.json").is_file()


def test_a_refused_case_is_an_answer(tmp_path: Path) -> None:
    told = sensitivity.ask(sensitivity.Asked("none", tmp_path / "none.xml", (), ()), Settings())
    assert told["first"] == "refused"
