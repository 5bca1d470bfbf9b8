"""Effects on a model that is written in degrees, MJCF's own default: what they place in angles is where it belongs."""

from __future__ import annotations

from math import pi

import pytest
from effect_bench import Rig, effect

BELT = """<mujoco model="rig"><option gravity="0 0 0" timestep="0.000125"/><worldbody>
<body><joint name="axis" type="hinge" axis="0 1 0" ref="30"/><inertial pos="0 0 0" mass="1" diaginertia="0.2 0.2 0.2"/>
<body><joint name="follower" type="hinge" axis="0 1 0" ref="-40"/>
<inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body>
</body></worldbody><equality><joint joint1="follower" joint2="axis" polycoef="0 -2 0 0 0"/></equality>
<actuator><motor name="axis" joint="axis"/></actuator></mujoco>"""
"""A belt 1:-2; joint reference angles in degrees."""


@pytest.mark.parametrize(
    "added",
    [
        effect("belt_elasticity", stiffness=400.0, damping=0.1),
        effect("elasticity", stiffness=400.0),
        effect("spring", stiffness=20.0, rest=0.25),
    ],
)
def test_a_model_at_rest_stays_at_rest(added: object) -> None:
    rig = Rig(BELT, added, position=0.25)  # type: ignore[arg-type]
    before = rig.data.qpos.copy()
    rig.run(0.2)
    assert rig.data.qpos == pytest.approx(before, abs=1e-6)
    follower = float(rig.data.qpos[rig.model.joint("follower").qposadr[0]])
    assert follower == pytest.approx(-40.0 * pi / 180.0 - 2.0 * (0.25 - 30.0 * pi / 180.0), abs=1e-6)


def test_payload_and_rotor_in_degrees() -> None:
    rig = Rig(BELT, effect("elasticity", stiffness=400.0), effect("payload", mass=0.5, x=0.2))
    assert rig.model.qpos0[rig.model.joint("axis_motor").qposadr[0]] == pytest.approx(30.0 * pi / 180.0)
