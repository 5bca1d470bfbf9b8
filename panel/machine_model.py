"""The machine as its MuJoCo model draws it, standing where the drives say that it stands: no truth of the plant."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.foundation.errors import UserError

_SHAPES = {
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "capsule",
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): "ellipsoid",
    int(mujoco.mjtGeom.mjGEOM_MESH): "mesh",
}

_MOST_VISIBLE_GROUP = 2
"""Groups above are hidden by MuJoCo's own viewer, too."""


class MachineModel:
    """Geoms of a model; those of other shapes (planes, height fields) are counted in `left_out`."""

    def __init__(self, path: Path) -> None:
        self._model = mujoco.MjModel.from_xml_path(str(path))
        self._data = mujoco.MjData(self._model)
        visible = [geom for geom in range(self._model.ngeom) if self._model.geom_group[geom] <= _MOST_VISIBLE_GROUP]
        self._geoms = [geom for geom in visible if int(self._model.geom_type[geom]) in _SHAPES]
        self.left_out = len(visible) - len(self._geoms)

    def stand(self, positions: Mapping[str, float]) -> None:
        """Put joints where they are [rad or m], by name, and what follows them by a joint equality."""
        qpos = self._data.qpos
        qpos[:] = self._model.qpos0
        for name, position in positions.items():
            qpos[self._model.joint(name).qposadr[0]] = position
        self._follow()
        mujoco.mj_kinematics(self._model, self._data)

    def _follow(self) -> None:
        """joint1 - its qpos0 is a polynomial of joint2 - its qpos0 (MuJoCo, XML reference, equality/joint)."""
        model, qpos = self._model, self._data.qpos
        for number in range(model.neq):
            if model.eq_type[number] != mujoco.mjtEq.mjEQ_JOINT or model.eq_obj2id[number] < 0:
                continue
            follower, leader = (model.jnt_qposadr[objects[number]] for objects in (model.eq_obj1id, model.eq_obj2id))
            moved = qpos[leader] - model.qpos0[leader]
            curve = sum(float(factor) * moved**power for power, factor in enumerate(model.eq_data[number, :5]))
            qpos[follower] = model.qpos0[follower] + curve

    def told(self) -> list[dict[str, object]]:
        """For the page: shape, size [m], mesh (-1: none), colour, place [m] and rotation (9,), row by row."""
        return [
            {
                "shape": _SHAPES[int(self._model.geom_type[geom])],
                "size": self._model.geom_size[geom].tolist(),
                "mesh": int(self._model.geom_dataid[geom]),
                "colour": self._colour(geom),
                "place": [round(float(each), 6) for each in self._data.geom_xpos[geom]],
                "turned": [round(float(each), 6) for each in self._data.geom_xmat[geom]],
            }
            for geom in self._geoms
        ]

    def mesh(self, number: int) -> dict[str, str]:
        """Vertices (n, 3) [m] in its geom's frame as 32-bit floats and triangles (m, 3) as 32-bit integers, in base 64.

        Raises UserError for a mesh that there is not.
        """
        model = self._model
        if not 0 <= number < model.nmesh:
            raise UserError(f"the machine's model has {model.nmesh} meshes, and no mesh {number}")
        vertices = _part(model.mesh_vert, model.mesh_vertadr[number], model.mesh_vertnum[number])
        triangles = _part(model.mesh_face, model.mesh_faceadr[number], model.mesh_facenum[number])
        return {"vertices": _packed(vertices.astype("<f4")), "triangles": _packed(triangles.astype("<u4"))}

    def _colour(self, geom: int) -> list[float]:
        """Red, green, blue and opacity 0..1; its material's where it has no colour of its own, as MuJoCo draws it."""
        own, material = self._model.geom_rgba[geom], int(self._model.geom_matid[geom])
        shown = own if material < 0 or not np.array_equal(own, _DEFAULT_COLOUR) else self._model.mat_rgba[material]
        return [float(each) for each in shown]


_DEFAULT_COLOUR = np.array([0.5, 0.5, 0.5, 1.0], np.float32)


def _part(rows: NDArray[Any], first: int, count: int) -> NDArray[Any]:
    return rows[first : first + count]


def _packed(values: NDArray[Any]) -> str:
    return b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")
