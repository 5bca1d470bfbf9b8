"""docs/acceptance.md names every key, task, condition, expectation, limit and verdict that there is, and no other."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any, get_args

import pytest
from pydantic import BaseModel

from drivetwin.controller.tasks.library import task_class
from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests import pytest_suite
from drivetwin.hil_tests.bench import Bench, read_bench
from drivetwin.hil_tests.conditions import read_condition
from drivetwin.hil_tests.evidence import Ending
from drivetwin.hil_tests.expectations.base import LIMIT
from drivetwin.hil_tests.expectations.library import library
from drivetwin.hil_tests.scenario import _File, read_scenario
from drivetwin.hil_tests.shares import PAYLOAD
from drivetwin.hil_tests.suite import CASES, find_cases
from drivetwin.hil_tests.task import TaskName

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs/acceptance.md").read_text(encoding="utf-8")
REAL = (ROOT / "docs/acceptance-ci.md").read_text(encoding="utf-8").partition("## The same cases on a real machine")[2]
BENCH = ROOT / "hil_tests/benches/scara.yaml"


def section(title: str) -> str:
    """What stands below a heading, to the next one."""
    (found,) = re.findall(rf"^##+ {re.escape(title)}\n(.*?)(?=^##|\Z)", TEXT, re.MULTILINE | re.DOTALL)
    return str(found)


def rows(title: str) -> dict[str, str]:
    """Rows of the tables of a section by their first word in backquotes; several in the first column share the row."""
    found: dict[str, Any] = {}
    for line in section(title).splitlines():
        if line.startswith("| `"):
            names, _, rest = line[2:].partition(" | ")
            found |= dict.fromkeys(re.findall(r"`([^`]+)`", names), rest)
    return found


def keys(model: type[BaseModel], before: str = "") -> Iterator[str]:
    """All keys of a file, those of an inner mapping as `outer.inner`."""
    for name, field in model.model_fields.items():
        inner = field.annotation
        if isinstance(inner, type) and issubclass(inner, BaseModel) and name != "task":
            yield from keys(inner, f"{name}.")
        else:
            yield before + name


def test_the_groups_are_those_of_the_cases() -> None:
    told = re.findall(r"^\| (\d+) \| `(\w+)` \|", section("The cases"), re.MULTILINE)
    assert told == [(str(int(group[:2])), group[3:]) for group in sorted(path.name for path in CASES.iterdir())]


def test_the_keys_of_a_bench_are_told() -> None:
    told = [key for key in rows("bench.yaml (bench/1)") if key not in {*named_limits(), PAYLOAD}]
    assert sorted(told) == sorted(set(keys(Bench)) - {"path"})


def named_limits() -> set[str]:
    """Limits that an expectation takes of the bench."""
    return {one.metadata[LIMIT] for kind in library().values() for one in fields(kind) if LIMIT in one.metadata}


def test_the_limits_are_those_that_expectations_take() -> None:
    table = section("bench.yaml (bench/1)").partition("| limit |")[2]
    told = re.findall(r"\| `(\w+)` (?=\|)", table)
    assert sorted(told) == sorted({*named_limits(), PAYLOAD})
    assert {*named_limits(), PAYLOAD} == set(read_bench(BENCH).limits)


def test_the_tasks_and_their_parameters_are_told() -> None:
    table = rows("What the controller receives (task/1)")
    names = get_args(TaskName)
    assert [name for name in table if name in names] == list(names)
    for name in names:
        for parameter in task_class(name).model_fields:
            assert f"`{parameter}`" in table[name].split(" | ")[0], f"{name}: {parameter}"


def test_the_keys_of_a_scenario_are_told() -> None:
    assert sorted(rows("Scenarios (scenario/1)")) == sorted(set(keys(_File)) - {"format"})


def test_the_conditions_are_told() -> None:
    with pytest.raises(UserError) as refusal:
        read_condition({"never": 1}, {"rotate": 2})
    known = str(refusal.value).partition("there are ")[2].split(", ")
    assert sorted(rows("Faults")) == sorted(known)


def test_the_expectations_are_told_with_their_parameters_and_limits() -> None:
    table = rows("Expectations")
    assert sorted(table) == sorted(library())
    for name, kind in library().items():
        parameters = table[name].split(" | ")[0]
        for one in fields(kind):
            limit = one.metadata.get(LIMIT)
            named = rf"`{one.name}`( s)? \(`{limit}`\)" if limit else f"`{one.name}`"
            assert re.search(named, parameters), f"{name}: {one.name}"
            if not limit and one.default not in (MISSING, None, ()):
                assert re.search(rf"`{one.name}` \((?P<default>[^)]*)\)", parameters), f"{name}: default of {one.name}"
        if kind.shorthand is not None:
            assert f"`- {name}: " in parameters


def real_rows(head: str) -> list[tuple[list[str], str]]:
    """Rows of the table with that head about real drives: what the first column names in backquotes, and the second column."""
    table = REAL.partition(f"| {head} |")[2].partition("\n\n")[0]
    return [(re.findall(r"`([^`]+)`", line.split(" | ")[0]), line.split(" | ")[1]) for line in table.splitlines()[2:]]


def test_what_is_judged_of_real_drives_is_told() -> None:
    table = real_rows("expectation")
    for prefix, needs_truth in (("judged", False), ("not judged", True)):
        told = [name for names, said in table if said.startswith(prefix) for name in names]
        assert sorted(told) == sorted(name for name, kind in library().items() if kind.needs_truth is needs_truth)


def test_what_is_skipped_on_real_drives_is_told() -> None:
    bench = read_bench(ROOT / "hil_tests/benches/scara_can0.yaml", real=True)
    skipped = {case.identity: case.skipped_because for case in find_cases(bench, [CASES], ()) if case.skipped_because}
    reasons = {
        "faults strike": "faults strike",
        "apart from the outcome": "apart from the controller",
        "its targets": "is to go to",
    }
    for names, said in real_rows("skipped"):
        (reason,) = [theirs for ours, theirs in reasons.items() if said.startswith(ours)]
        for name in names:
            cases = [case for case in skipped if case == name or case.startswith(f"{name}.")]
            assert cases, name
            assert all(reason in skipped.pop(case) for case in cases), name
    assert skipped == {}


def test_the_ways_to_end_are_told() -> None:
    assert sorted(rows("How a controller ends")) == sorted(ending.value for ending in Ending)


def test_the_fixtures_are_told() -> None:
    defined = {name for name, value in vars(pytest_suite).items() if type(value).__name__ == "FixtureFunctionDefinition"}
    assert defined
    assert set(rows("Your own cases in pytest")) == defined


def test_the_scenario_and_the_tests_of_the_page_work(tmp_path: Path) -> None:
    case = tmp_path / "02_enable" / "drive_fault.yaml"
    case.parent.mkdir()
    indented = re.search(r"^    format: scenario/1\n(?:    .*\n)+", TEXT, re.MULTILINE)
    code = re.search(r"```python\n(.*?)```", TEXT, re.DOTALL)
    assert indented is not None
    assert code is not None
    case.write_text(re.sub(r"^    ", "", indented.group(), flags=re.MULTILINE), encoding="utf-8")
    own = tmp_path / "test_own.py"
    own.write_text(code.group(1), encoding="utf-8")
    assert read_scenario(case, read_bench(BENCH)).identity == "02_enable.drive_fault"
    plugins = ["-p", "drivetwin.hil_tests.pytest_plugin", "-p", "no:cacheprovider"]
    command = [sys.executable, "-m", "pytest", *plugins, "-c", os.devnull]
    environment = os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    ran = subprocess.run(
        [*command, "--rootdir", str(tmp_path), "--bench", str(BENCH), str(own)],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "2 passed" in ran.stdout
