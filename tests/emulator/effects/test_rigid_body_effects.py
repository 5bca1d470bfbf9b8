"""Rigid-body effects in a plant against mechanics by hand: Steiner, pendulums, energy, two inertias and a shared rotor."""

from __future__ import annotations

from math import cos, pi, sqrt

import numpy as np
import pytest
from effect_bench import HINGE, LINK, MOTOR, PERIOD, WHOLE, Rig, effect, frequency, hinge, slide

from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.plant import Plant
from drivetwin.foundation.errors import UserError

TWO_LINKS = """<mujoco model="rig"><option gravity="0 0 -9.81" timestep="0.000125"/><worldbody>
<body name="upper"><joint name="a" type="hinge" axis="0 1 0"/><inertial pos="0 0 0" mass="1" diaginertia="0.2 0.2 0.2"/>
<body name="bracket" pos="0.1 0 0"><inertial pos="0 0 0" mass="0.001" diaginertia="1e-6 1e-6 1e-6"/>
<body name="lower" pos="0.3 0 0"><joint name="b" type="hinge" axis="0 1 0"/>
<inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/>
<body name="tool" pos="0.2 0 0"><inertial pos="0 0 0" mass="0.001" diaginertia="1e-6 1e-6 1e-6"/></body>
</body></body></body></worldbody>
<actuator><motor name="a" joint="a"/><motor name="b" joint="b"/></actuator></mujoco>"""


def two_links(*effects: object) -> Rig:
    return Rig(TWO_LINKS, *effects, axes=("a", "b"))  # type: ignore[arg-type]


def test_payload_adds_weight_and_inertia_by_steiner() -> None:
    """2 kg at (0.05, 0.4, 0.1) of the tool: 0.25 and 0.1 off axis b, 0.65 and 0.1 off axis a; y is along both."""
    plain, loaded = two_links(), two_links(effect("payload", "b", mass=2.0, x=0.05, y=0.4, z=0.1))
    gained = loaded.mechanism.inertia - plain.mechanism.inertia
    assert gained == pytest.approx([2.0 * (0.65**2 + 0.1**2), 2.0 * (0.25**2 + 0.1**2)], rel=1e-9)
    weight = loaded.data.qfrc_bias - plain.data.qfrc_bias
    assert weight == pytest.approx([-2.0 * 9.81 * 0.65, -2.0 * 9.81 * 0.25], rel=1e-9)


def test_payload_rides_on_the_last_body_before_the_next_driven_joint() -> None:
    """On axis a it is the bracket, 0.1 off, and b does not feel it."""
    gained = two_links(effect("payload", "a", mass=2.0)).mechanism.inertia - two_links().mechanism.inertia
    assert gained == pytest.approx([2.0 * 0.1**2, 0.0], abs=1e-12)


@pytest.mark.parametrize(("axis", "body"), [("lift", "carriage"), ("rotate", "hub"), ("stretch", "blade")])
def test_payload_on_the_wafer_handler(axis: str, body: str) -> None:
    plant = Plant(load_machine("scara"), (effect("payload", axis, mass=0.128),))
    load = plant.model.body(f"{axis}_payload")
    assert plant.model.body(load.parentid[0]).name == body
    assert load.mass[0] == 0.128


def test_a_weight_swings_about_its_angle() -> None:
    """f = sqrt(moment / J) / 2 pi for small swings, about the angle."""
    rig = hinge(effect("gravity", moment=4.0, angle=0.7))
    rig.start(0.7 + 0.01)
    trace = rig.run(4.0)
    assert frequency(trace) == pytest.approx(sqrt(4.0 / WHOLE) / (2.0 * pi), rel=1e-3)
    assert 0.5 * (trace.max() + trace.min()) == pytest.approx(0.7, abs=1e-4)


def test_energy_of_a_falling_weight() -> None:
    rig = hinge(effect("gravity", moment=4.0, angle=0.3))
    rig.start(0.3 + 2.5)
    rig.run(0.5)
    fallen = 4.0 * (cos(rig.position - 0.3) - cos(2.5))
    assert abs(rig.position - 2.8) > 0.5
    assert 0.5 * WHOLE * rig.velocity**2 == pytest.approx(fallen, rel=1e-3)


def test_a_weight_on_a_slide_is_a_constant_force() -> None:
    rig = slide(effect("gravity", moment=0.6))
    rig.run(0.5)
    assert rig.velocity == pytest.approx(-0.6 * 0.5 / WHOLE, rel=1e-6)


@pytest.mark.parametrize("make", [hinge, slide])
def test_spring_swings_about_its_rest_and_keeps_its_energy(make: object) -> None:
    rig = make(effect("spring", stiffness=30.0, rest=0.2))  # type: ignore[operator]
    trace = rig.run(2.0)
    assert frequency(trace) == pytest.approx(sqrt(30.0 / WHOLE) / (2.0 * pi), rel=1e-3)
    assert (trace.min(), trace.max()) == (pytest.approx(0.0, abs=1e-3), pytest.approx(0.4, abs=1e-3))
    energy = 0.5 * WHOLE * rig.velocity**2 + 0.5 * 30.0 * (rig.position - 0.2) ** 2
    assert energy == pytest.approx(0.5 * 30.0 * 0.2**2, rel=1e-2)


def test_spring_beside_one_that_the_model_has_in_a_model_in_degrees() -> None:
    """10 N·m/rad at 57.3 deg and 30 N·m/rad at -0.2 rad rest at (10 - 6) / 40 rad."""
    xml = HINGE.format(joint='stiffness="10" springref="57.29577951308232" damping="3"')
    rig = Rig(xml.replace('angle="radian"', 'angle="degree"'), effect("spring", stiffness=30.0, rest=-0.2))
    rig.run(4.0)
    assert rig.position == pytest.approx(0.1, abs=1e-6)


def test_coupling_shares_its_inertia_between_both_axes() -> None:
    """Concentric links: M = [[Ja + Jb + m r², Jb], [Jb, Jb]] with the motors on the diagonal, plus I (q_b' + r q_a')² / 2."""
    inertia, ratio = 0.3, -1.5
    xml = TWO_LINKS.replace('pos="0.3 0 0"', 'pos="-0.1 0 0"').replace("-9.81", "0")
    rig = Rig(xml, effect("coupling", "b", inertia=inertia, ratio=ratio), axes=("a", "b"))
    small = 1e-6
    tool = 0.001 * 0.2**2 + small
    link = 0.1 + tool
    mass = np.array([[MOTOR + LINK + 0.001 * 0.1**2 + small + link, link], [link, MOTOR + link]])
    mass += inertia * np.array([[ratio**2, ratio], [ratio, 1.0]])
    for torque in ([1.0, 0.0], [0.0, 1.0]):
        rig.data.qvel[:] = 0.0
        rig.mechanism.motor_torque[:] = np.array(torque) / 50.0
        rig.mechanism.step()
        assert rig.data.qvel / PERIOD == pytest.approx(np.linalg.solve(mass, torque), rel=1e-6)


def test_coupling_of_the_first_axis_is_refused() -> None:
    with pytest.raises(UserError, match="no driven joint stands before 'a' in its chain; name the axis after it"):
        two_links(effect("coupling", "a", inertia=0.1))


def test_coupling_on_the_wafer_handler_is_with_the_axis_before() -> None:
    plant = Plant(load_machine("scara"), (effect("coupling", "stretch", inertia=0.01),))
    first = plant.model.tendon_adr[plant.model.tendon("stretch_coupling").id]
    joints = {plant.model.joint(int(joint)).name for joint in plant.model.wrap_objid[first : first + 2]}
    assert joints == {"stretch", "rotate"}


def test_less_inertia_than_none_is_refused() -> None:
    with pytest.raises(UserError, match="axis axis: inertia takes more off than the armature of joint 'axis' is"):
        hinge(effect("inertia", difference=-1.01 * MOTOR))


def test_less_inertia_is_what_is_left() -> None:
    rig = hinge(effect("inertia", difference=-0.5 * MOTOR))
    rig.run(0.1, 1.0)
    assert rig.velocity == pytest.approx(0.1 / (0.5 * MOTOR + LINK), rel=1e-6)
