"""The patched simulation as MJCF: the user's own file, with the bodies heavier that were found so."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from drivetwin.diagnosis.prepare.model_file import named_model, state_inertia, state_springs
from drivetwin.diagnosis.prepare.simulation import Simulation

EXACT = 1e-12
"""Share by which mass and inertia that are read again may differ."""


def patched_xml(simulation: Simulation, heavier: Mapping[int, float]) -> str:
    """The model with some bodies, by number, heavier by a share of their mass and inertia; every number to the last digit.

    What is not changed stays as it is written, but for comments, included files and shortcuts, which are written out.
    """
    spec, model = named_model(simulation.path)
    if heavier:
        state_springs(spec, model)
    for body, share in heavier.items():
        model.body_mass[body] *= 1.0 + share
        model.body_inertia[body] *= 1.0 + share
    spec.compiler.savecompiled = spec.compiler.savecanonical = False
    if (xml := _as_written(spec, model)) is not None:
        return xml
    state_inertia(spec, model)
    return str(spec.to_xml())


def _as_written(spec: mujoco.MjSpec, model: mujoco.MjModel) -> str | None:
    """None where the file infers inertia anew, or where one file cannot infer it as those did of which it is made."""
    try:
        spec.copy_back(model)
        xml = str(spec.to_xml())
        again = mujoco.MjModel.from_xml_string(xml)
    except (ValueError, mujoco.FatalError):
        return None
    names = ("body_mass", "body_inertia", "body_ipos", "body_iquat")
    same = (np.allclose(getattr(again, name), getattr(model, name), rtol=EXACT, atol=EXACT) for name in names)
    return xml if again.nbody == model.nbody and all(same) else None
