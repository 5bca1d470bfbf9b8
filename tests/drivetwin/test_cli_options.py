"""What the command line says of itself: help without loading a library of numbers, version, completion, JSON for programs."""

from __future__ import annotations

import inspect
import json
import subprocess
import sys
from importlib import import_module
from importlib.metadata import version
from itertools import pairwise
from pathlib import Path

import pytest

from drivetwin.cli import main
from drivetwin.cli.commands import COMMANDS

HEAVY = {"can", "canopen", "distributed", "matplotlib", "mujoco", "numba", "numpy", "plotly", "pyarrow", "scipy"}

LOADED = """
import sys
from drivetwin.cli import main
try:
    main()
finally:
    print(*sorted({name.partition(".")[0] for name in sys.modules}), file=sys.stderr)
"""


def python(*words: str, environment: dict[str, str] | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *words], capture_output=True, text=True, check=False, env=environment, stdin=subprocess.DEVNULL
    )


@pytest.mark.parametrize("words", [["--help"], ["-h"], ["--version"], []])
def test_what_lists_commands_loads_none(words: list[str]) -> None:
    done = python("-c", LOADED, *words)
    loaded = set(done.stderr.splitlines()[-1].split())
    assert "drivetwin" in loaded
    assert not HEAVY & loaded


def test_completion_of_a_command_loads_none() -> None:
    asked = {"_DRIVETWIN_COMPLETE": "complete_bash", "COMP_WORDS": "drivetwin di", "COMP_CWORD": "1"}
    code = LOADED.replace("import sys", "import sys; sys.argv[0] = 'drivetwin'", 1)
    done = python("-c", code, environment=asked)
    assert done.stdout.split() == ["diagnose"]
    assert not HEAVY & set(done.stderr.splitlines()[-1].split())


@pytest.mark.parametrize("name", COMMANDS)
def test_the_list_says_of_a_command_what_its_own_help_begins_with(name: str) -> None:
    module, _, function = COMMANDS[name].place.partition(":")
    told = inspect.getdoc(getattr(import_module(f"drivetwin.cli.{module}"), function))
    assert told is not None
    assert COMMANDS[name].summary == " ".join(told.partition("\n\n")[0].split())


def test_every_command_has_short_help(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    for name, entry in COMMANDS.items():
        monkeypatch.setattr(sys, "argv", ["drivetwin", name, "-h"])
        main()
        assert entry.summary.split()[0] in capsys.readouterr().out


@pytest.mark.parametrize("name", COMMANDS)
def test_a_terminal_breaks_the_lines_of_a_paragraph_where_they_are_full(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In 80 columns no line of a paragraph has room for the first word of the next."""
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr(sys, "argv", ["drivetwin", name, "-h"])
    main()
    before_the_options = capsys.readouterr().out.partition("╭")[0].splitlines()
    for line, following in pairwise(each.strip() for each in before_the_options):
        if line and following:
            assert len(line) + 1 + len(following.split()[0]) > 77, line


def test_the_package_is_the_command() -> None:
    done = python("-m", "drivetwin", "--version")
    assert (done.returncode, done.stdout, done.stderr) == (0, f"drivetwin {version('drivetwin')}\n", "")


def test_a_misspelt_command_is_told_the_one_that_was_meant() -> None:
    done = python("-m", "drivetwin", "diagnos")
    assert done.returncode == 2
    assert done.stderr == "drivetwin: No such command 'diagnos'. Did you mean 'diagnose'; see: drivetwin --help\n"


def test_faults_as_json(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "argv", ["drivetwin", "fault", "--list", "--json"])
    main()
    told = json.loads(capsys.readouterr().out)
    assert told["friction_rise"]["lasts"] is True
    assert told["friction_rise"]["parameters"]["torque"]["needed"] is True


def test_bus_load_as_json(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """A SYNC is 51 bits and this frame 119, each millisecond, on 1000 bits a millisecond."""
    log = tmp_path / "bus.log"
    frames = ("080#", "281#FFFFFFFF6DE2E43B")
    stamped = (f"({cycle / 1000:.6f}) can0 {frame}\n" for cycle in range(200) for frame in frames)
    log.write_text("".join(stamped), encoding="ascii")
    monkeypatch.setattr(sys, "argv", ["drivetwin", "bus-load", str(log), "--json"])
    main()
    told = json.loads(capsys.readouterr().out)
    assert told["fits"] is True
    assert told["mean"]["load"] == pytest.approx(0.17)
    assert sorted(told["mean"]["bits_by_service"].values()) == [200 * 51, 200 * 119]
    assert told["cycles"]["overrun"] == 0
