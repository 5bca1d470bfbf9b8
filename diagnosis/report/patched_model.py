"""The patched simulation as MJCF: the user's own file, with the bodies heavier that were found so."""

from __future__ import annotations

from collections.abc import Mapping

from drivetwin.diagnosis.prepare.simulation import Simulation
from drivetwin.motion.model_file import as_mjcf, named_model, state_springs


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
    return as_mjcf(spec, model)
