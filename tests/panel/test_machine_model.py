"""The machine in the page stands as the plant does, once the joints are where the drives say: also what a belt drives."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.plant import Plant
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
