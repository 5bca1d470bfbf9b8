"""The patched simulation as MJCF: the model with the bodies whose mass was found off put right."""

from __future__ import annotations

from collections.abc import Mapping

from diagnosis.prepare.simulation import Simulation


def patched_xml(simulation: Simulation, heavier: Mapping[int, float]) -> str:
    """MJCF of the model; `heavier`: by what share of its mass and inertia a body, by number, is heavier."""
    spec = simulation.spec()
    compiled = spec.compile()
    for number, share in heavier.items():
        body = spec.body(simulation.model.body(number).name)
        body.mass = float(compiled.body_mass[number]) * (1.0 + share)
        body.inertia = compiled.body_inertia[number] * (1.0 + share)
        body.ipos, body.iquat = compiled.body_ipos[number], compiled.body_iquat[number]
        body.explicitinertial = True
    spec.compile()
    return str(spec.to_xml())
