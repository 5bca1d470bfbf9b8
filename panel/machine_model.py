"""The machine as its MuJoCo model draws it, standing where the drives say that it stands: no truth of the plant."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import mujoco

_SHAPES = {
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "capsule",
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): "ellipsoid",
}

_MOST_VISIBLE_GROUP = 2
"""Groups above are hidden by MuJoCo's own viewer, too."""


class MachineModel:
    """Geoms of a model; those of other shapes (meshes, planes) are counted in `left_out`."""

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
        """For the page: shape, size [m], colour, place [m] and rotation (9,), row by row."""
        return [
            {
                "shape": _SHAPES[int(self._model.geom_type[geom])],
                "size": self._model.geom_size[geom].tolist(),
                "colour": self._model.geom_rgba[geom].tolist(),
                "place": [round(float(each), 6) for each in self._data.geom_xpos[geom]],
                "turned": [round(float(each), 6) for each in self._data.geom_xmat[geom]],
            }
            for geom in self._geoms
        ]
