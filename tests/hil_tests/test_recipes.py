"""The recipes for a CI: they parse, every command in them exists, and what they publish is what the command writes."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
import typer
import yaml
from stage_bench import bench_file

from drivetwin.cli.commands import COMMANDS
from drivetwin.controller.__main__ import app as controller
from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.bench import read_bench

ROOT = Path(__file__).parents[2]
RECIPES = ROOT / "docs/examples/ci"
GITLAB, GITHUB, JENKINS = RECIPES / "gitlab-ci.yml", RECIPES / "github-actions.yml", RECIPES / "Jenkinsfile"

JUNIT, OUT = "out/accept/junit.xml", "out/accept/"

NAMES_OF_HOSTS = re.compile(r"https?://|index-url|\bpypi\b|\bnpmjs\b", re.IGNORECASE)


def options(command: str) -> set[str]:
    """Options of a command of `drivetwin`."""
    found = COMMANDS[command].load(command)
    return {option for parameter in found.params for option in parameter.opts}


def drivetwin_commands(text: str) -> list[list[str]]:
    """Words of each line that starts `drivetwin COMMAND`, with or without a path before it; continued lines joined."""
    joined = text.replace("\\\n", " ")
    lines = re.findall(r"^[^\n]*?(?:^|[\s/;])drivetwin (\w[\w-]* [^\n#;]*)", joined, re.MULTILINE)
    return [shlex.split(line.split("`")[0].replace("$BASELINE", "--baseline acceptance/baseline.json")) for line in lines]


@pytest.mark.parametrize(
    "path",
    [
        *(GITLAB, GITHUB, JENKINS),
        *(ROOT / "docs" / name for name in ("acceptance.md", "acceptance-ci.md")),
        *(ROOT / "docs/examples" / name / "README.md" for name in ("cpp_controller", "javascript_controller")),
    ],
    ids=lambda path: f"{path.parent.name}/{path.name}",
)
def test_every_command_and_option_exists(path: Path) -> None:
    commands = drivetwin_commands(path.read_text(encoding="utf-8"))
    assert "accept" in [words[0] for words in commands]
    for words in commands:
        told = {word.split("=")[0] for word in words if word.startswith("--")}
        assert told <= options(words[0]), words


@pytest.mark.parametrize("path", [GITLAB, GITHUB, JENKINS], ids=lambda path: path.name)
def test_a_recipe_installs_what_is_locked_and_names_no_registry(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert not NAMES_OF_HOSTS.search(text)
    assert "pip install --require-hashes -r drivetwin/requirements.lock" in text
    assert (ROOT / "requirements.lock").is_file()
    (accept,) = [words for words in drivetwin_commands(text) if words[0] == "accept"]
    assert accept[accept.index("--junit") + 1] == JUNIT
    assert accept[accept.index("--out") + 1] == OUT.rstrip("/")


def test_gitlab_reads_the_junit_file_and_keeps_the_folder_of_a_rejected_controller() -> None:
    recipe: dict[str, Any] = yaml.safe_load(GITLAB.read_text(encoding="utf-8"))
    job = recipe["accept"]
    assert job["stage"] in recipe["stages"]
    assert job["artifacts"]["reports"] == {"junit": JUNIT}
    assert OUT in job["artifacts"]["paths"]
    assert job["artifacts"]["when"] == "always"


def test_github_reads_the_junit_file_and_keeps_the_folder_of_a_rejected_controller() -> None:
    recipe: dict[Any, Any] = yaml.safe_load(GITHUB.read_text(encoding="utf-8"))
    assert recipe[True] == ["push", "pull_request"]  # YAML 1.1 reads `on` as a truth value, GitHub as a key
    steps = recipe["jobs"]["accept"]["steps"]
    used = {step["uses"].split("@")[0]: step for step in steps if "uses" in step}
    assert all(re.fullmatch(r"v\d+", step["uses"].split("@")[1]) for step in used.values())
    report, kept = used["mikepenz/action-junit-report"], used["actions/upload-artifact"]
    assert report["with"]["report_paths"] == JUNIT
    assert kept["with"]["path"] == OUT
    assert report["if"] == kept["if"] == "always()"
    assert recipe["permissions"]["checks"] == "write"


def test_jenkins_reads_the_junit_file_and_keeps_the_folder_of_a_rejected_controller() -> None:
    """There is no Groovy parser here: braces and quotes match, and the steps stand in `post { always`."""
    text = JENKINS.read_text(encoding="utf-8")
    code = re.sub(r"//[^\n]*", "", text)
    assert code.count("{") == code.count("}")
    assert code.count("'''") % 2 == 0
    always = code[code.index("always {") :]
    assert f"junit testResults: '{JUNIT}'" in always
    assert f"archiveArtifacts artifacts: '{OUT}**'" in always


@pytest.mark.parametrize("bus", ["can0", "slcan0"])
def test_the_suite_brings_its_drives_onto_no_bus_that_may_have_real_ones(tmp_path: Path, bus: str) -> None:
    path = bench_file(tmp_path, ["true"], bus=bus)
    with pytest.raises(UserError, match=rf"bench.yaml: bus: {bus} may have real drives.* embedded, vcan0 or ws://127.0.0.1:PORT"):
        read_bench(path)


def test_what_a_real_machine_is_given_are_options_of_the_controller() -> None:
    command = read_bench(ROOT / "hil_tests/benches/scara_can0.yaml", real=True).controller.command
    known = {option for parameter in typer.main.get_command(controller).params for option in parameter.opts}
    told = {word for word in command if word.startswith("--")}
    assert {"--limits", "--yes"} <= told <= known
