"""The container image: what Containerfile says held against the project; `make test-long` builds it where a builder answers."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest
from foreign import installed
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name
from repeats import LONG

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
FILE = ROOT / "Containerfile"
BUILDERS = ("docker", "podman")


def instructions() -> list[tuple[str, str]]:
    """Each instruction of the file with what follows it, lines that are continued as one."""
    text = re.sub(r"\\\n\s*", "", FILE.read_text(encoding="utf-8"))
    lines = (line.partition(" ") for line in text.splitlines() if line and not line.startswith("#"))
    return [(name, rest) for name, _, rest in lines]


def said(name: str) -> list[str]:
    return [rest for instruction, rest in instructions() if instruction == name]


def test_it_has_no_instruction_that_there_is_not() -> None:
    known = {"FROM", "WORKDIR", "COPY", "RUN", "USER", "ENV", "ENTRYPOINT", "CMD"}
    assert {name for name, _ in instructions()} == known
    assert instructions()[0][0] == "FROM"


def test_its_python_is_one_that_the_project_allows() -> None:
    versions = re.findall(r"^python:(\d+\.\d+)-slim", "\n".join(said("FROM")), re.MULTILINE)
    assert len(versions) == len(said("FROM"))
    assert all(version in SpecifierSet(PROJECT["requires-python"]) for version in versions)


def test_it_starts_the_project_s_command_as_a_user_without_rights() -> None:
    (entry,) = said("ENTRYPOINT")
    assert entry == '["drivetwin"]'
    assert "drivetwin" in PROJECT["scripts"]
    (user,) = said("USER")
    assert f"useradd --no-create-home --uid {user} drivetwin" in "\n".join(said("RUN"))


def test_whoever_runs_it_may_write_where_it_writes() -> None:
    """A mounted folder keeps its owner, so the command is run as that user, who has no home there and owns nothing."""
    (environment,) = said("ENV")
    places = dict(pair.split("=") for pair in environment.split())
    assert {places["HOME"], str(Path(places["NUMBA_CACHE_DIR"]).parent)} == {"/tmp"}
    assert said("WORKDIR")[-1] == "/out"
    assert any("mkdir --mode 1777 /out" in line for line in said("RUN"))
    assert '--user "$(id -u):$(id -g)" --volume "$PWD/out:/out"' in FILE.read_text(encoding="utf-8")


def test_it_installs_extras_that_exist() -> None:
    (extras,) = re.findall(r"\.whl\)\[([a-z,]+)\]", "\n".join(said("RUN")))
    assert set(extras.split(",")) == set(PROJECT["optional-dependencies"]) - {"dev"}


def test_its_versions_are_those_of_the_lock_file(tmp_path: Path) -> None:
    """The RUN line that makes them, run here: one version of every dependency, by name and marker."""
    (line,) = (command for rest in said("RUN") for command in rest.split(" && ") if command.startswith("sed "))
    subprocess.run(["sh", "-c", line.replace("/wheels/", f"{tmp_path}/")], cwd=ROOT, check=True, timeout=60)
    locked = [Requirement(each) for each in (tmp_path / "versions.txt").read_text(encoding="utf-8").splitlines()]
    assert all([pin.operator for pin in each.specifier] == ["=="] for each in locked)
    needed = {canonicalize_name(Requirement(each).name) for each in PROJECT["dependencies"]}
    assert needed <= {canonicalize_name(each.name) for each in locked}


def test_what_is_not_sent_to_the_builder_is_not_in_the_wheel() -> None:
    left_out = (ROOT / ".dockerignore").read_text(encoding="utf-8").split()
    rooms = {path.name for path in (ROOT / "drivetwin").iterdir() if path.is_symlink()}
    assert not rooms & set(left_out)
    assert {".git", ".venv", "out"} <= set(left_out)


def test_what_it_copies_and_installs_from_is_there() -> None:
    """It copies the checkout, and reads the lock file of it; the wheel bears the project's name."""
    assert said("COPY") == [". ."]
    named = [word for rest in said("RUN") for word in rest.split() if word.endswith(".lock")]
    assert named
    assert all((ROOT / name).is_file() for name in named)
    assert f"/wheels/{PROJECT['name']}-*.whl" in "\n".join(said("RUN"))


def test_a_linter_has_nothing_to_say() -> None:
    done = subprocess.run([str(installed("hadolint/bin/hadolint")), str(FILE)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "")


@pytest.mark.skipif(not LONG, reason="minutes, and the builder downloads: make test-long")
def test_it_builds_and_answers_and_writes_as_who_runs_it(tmp_path: Path) -> None:
    builder = next((name for name in BUILDERS if shutil.which(name) and answers(name)), None)
    if builder is None:
        pytest.skip(f"no builder of container images answers here: neither of {', '.join(BUILDERS)}")
    tag = "drivetwin-under-test"
    subprocess.run([builder, "build", "--file", str(FILE), "--tag", tag, str(ROOT)], check=True, timeout=1800)
    done = subprocess.run([builder, "run", "--rm", tag, "--version"], capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout.startswith("drivetwin ")
    as_who = ["--userns", "keep-id"] if builder == "podman" else ["--user", f"{os.getuid()}:{os.getgid()}"]
    own = [*as_who, "--volume", f"{tmp_path}:/out"]
    writes = ["eds", "--profile", "cia402-full", "--out", "/out/drive.eds"]
    subprocess.run([builder, "run", "--rm", *own, tag, *writes], check=True, timeout=300)
    assert (tmp_path / "drive.eds").stat().st_uid == os.getuid()


def answers(builder: str) -> bool:
    """Whether the builder can work: a client whose daemon does not run cannot."""
    return subprocess.run([builder, "info"], capture_output=True, timeout=60, check=False).returncode == 0
