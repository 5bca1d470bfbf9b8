"""The machine in the page stands as the plant does, once the joints are where the drives say: also what a belt drives."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.plant import Plant
from drivetwin.foundation.errors import UserError
from drivetwin.panel.machine_model import MachineModel


def test_every_geom_is_where_the_plant_has_it() -> None:
    machine = load_machine("scara")
    plant = Plant(machine, read_effects(machine.effects_path))
    joints = {"lift": 0.21, "rotate": -1.1, "stretch": 0.9}
    for name, position in joints.items():
        plant.data.joint(name).qpos[0] = position
    plant.data.joint("elbow").qpos[0] = np.pi - 2.0 * joints["stretch"]  # the belts of the SCARA, as its file says them
    plant.data.joint("wrist").qpos[0] = -np.pi / 2.0 + joints["stretch"]
    mujoco.mj_kinematics(plant.model, plant.data)
    drawn = MachineModel(machine.model_path)
    drawn.stand(joints)
    told: list[dict[str, Any]] = drawn.told()
    assert len(told) == plant.model.ngeom
    assert np.allclose([geom["place"] for geom in told], plant.data.geom_xpos, atol=1e-5)
    assert np.allclose([geom["turned"] for geom in told], plant.data.geom_xmat, atol=1e-5)


CORNERS = np.array([[0.1, 0.0, 0.0], [0.4, 0.0, 0.0], [0.1, 0.2, 0.0], [0.1, 0.0, 0.5]])
TETRAHEDRON = f"""<mujoco><asset><material name="paint" rgba="0.2 0.4 0.6 1"/>
<mesh name="wedge" vertex="{" ".join(map(str, CORNERS.ravel()))}"/></asset><worldbody>
<body pos="1 2 3"><joint name="turn" axis="0 0 1"/><geom type="mesh" mesh="wedge" material="paint"/></body>
<geom type="plane" size="1 1 1"/></worldbody></mujoco>"""


def test_a_mesh_stands_where_its_file_has_it(tmp_path: Path) -> None:
    """MuJoCo keeps a mesh about its centre of mass, and moves the geom to make up for it."""
    (tmp_path / "wedge.xml").write_text(TETRAHEDRON)
    drawn = MachineModel(tmp_path / "wedge.xml")
    drawn.stand({"turn": np.pi / 2.0})
    (geom,) = drawn.told()
    told: dict[str, Any] = dict(geom)
    assert (told["shape"], told["mesh"], drawn.left_out) == ("mesh", 0, 1)
    assert told["colour"] == pytest.approx([0.2, 0.4, 0.6, 1.0])
    packed = drawn.mesh(0)
    vertices = np.frombuffer(base64.b64decode(packed["vertices"]), "<f4").reshape(-1, 3)
    triangles = np.frombuffer(base64.b64decode(packed["triangles"]), "<u4").reshape(-1, 3)
    stands = vertices @ np.reshape(told["turned"], (3, 3)).T + told["place"]
    quarter_turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    assert np.allclose(stands, CORNERS @ quarter_turn.T + [1.0, 2.0, 3.0], atol=1e-5)
    assert sorted(map(sorted, triangles.tolist())) == [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]
    with pytest.raises(UserError, match="1 meshes, and no mesh 1"):
        drawn.mesh(1)
