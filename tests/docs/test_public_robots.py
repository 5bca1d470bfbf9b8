"""The table of public robots: which files are robots, what a refusal looks like, and how errors are told."""

from __future__ import annotations

import json
from pathlib import Path

import public_robots
import pytest

URDF = """<robot name="bar"><link name="base"/><link name="arm"><inertial><mass value="1"/><origin xyz="0 0 0.2"/>
<inertia ixx="0.1" iyy="0.1" izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="turn" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="50" velocity="2"/></joint></robot>"""
SCENE = '<mujoco><include file="bar.xml"/><worldbody><body><joint/><geom size="1"/></body></worldbody></mujoco>'


def test_robots_are_files_with_joints_that_are_no_scenes(tmp_path: Path) -> None:
    files = {"a/bar.urdf": URDF.format(izz=0.1), "a/scene.xml": SCENE, "a/package.xml": "<package/>", "b.urdf": "<"}
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    assert list(public_robots.robots([tmp_path])) == [tmp_path / "a/bar.urdf"]
    assert list(public_robots.robots([tmp_path / "b.urdf"])) == [tmp_path / "b.urdf"]


@pytest.mark.parametrize(("izz", "axes", "said"), [(0.1, 1, "works"), (0.5, 0, "refused: `")])
def test_a_row_says_what_machine_new_said(tmp_path: Path, izz: float, axes: int, said: str) -> None:
    path = tmp_path / "bar.urdf"
    path.write_text(URDF.format(izz=izz), encoding="utf-8")
    row = public_robots.row(path, tmp_path / "out", identify=False)
    assert (row.robot, row.axes) == ("bar", axes)
    assert row.said.startswith(said)
    assert str(tmp_path) not in row.said


def test_errors_are_of_parameters_that_the_plant_has(tmp_path: Path) -> None:
    values = {"inertia": 2.02, "coulomb": 0.01, "viscous": 4.2}
    truth = {"inertia": 2.0, "coulomb": 0.0, "viscous": 4.0}
    told = {"parameters": {name: {"value": value} for name, value in values.items()}, "truth": truth}
    path = tmp_path / "identified.json"
    path.write_text(json.dumps({"axes": {"turn": told}}), encoding="utf-8")
    errors = public_robots.errors_of(path)
    assert errors == pytest.approx({"inertia of turn": 0.01, "viscous of turn": 0.05})
    row = public_robots.Row("bar", 1, "works", errors)
    assert row.cells() == ("bar", "1", "works", "3.00%, 5.00% (viscous of turn); 1 of 2 beyond 3%")
