"""The machines against mechanics done by hand: belts, straight blade, gravity, inertia; and what a machine file must be."""

from __future__ import annotations

from math import cos, pi, sin
from pathlib import Path

import mujoco
import numpy as np
import pytest
import yaml
from plant_bench import AXES, Array, PlantBench, placed

from drivetwin.emulator import machine as machine_module
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import MACHINES, available_machines, load_machine
from drivetwin.emulator.plant import Plant, truth_path
from drivetwin.foundation.errors import UserError

L3, L5 = 0.20, 0.24
GRAVITY = 9.81


def box(mass: float, half_a: float, half_b: float) -> float:
    """Central inertia of a box about the axis across both half sizes [kg·m²]."""
    return mass / 3.0 * (half_a**2 + half_b**2)


def test_known_machines() -> None:
    assert available_machines() == ("arm", "scara", "stage")


@pytest.mark.parametrize(("name", "axis"), AXES)
def test_every_axis_has_friction_and_stands_inside_its_switches(name: str, axis: str) -> None:
    bench = PlantBench(name, axis)
    assert {"coulomb", "viscous"} <= set(bench.true)
    switches = bench.machine.axes[axis].limit_switches
    assert switches.negative < bench.position < switches.positive
    low, high = bench.plant.model.joint(bench.machine.axes[axis].joint).range
    assert low < switches.negative < switches.positive < high
    assert bench.position == pytest.approx(bench.machine.axes[axis].power_on_position, abs=1e-12)
    assert bench.plant.motor_position[bench.index] == pytest.approx(bench.position * bench.gear[bench.index])


def fast_stretch() -> Array:
    """0.25 rad to about 1.3 rad with the motor's peak torque both ways; joints 2..5 or the tool at every servo period."""
    bench = PlantBench("scara", "stretch")
    data = bench.plant.data
    seen = []

    def look() -> None:
        joints = [float(data.joint(name).qpos[0]) for name in ("rotate", "stretch", "elbow", "wrist")]
        mujoco.mj_kinematics(bench.plant.model, data)
        seen.append([*joints, *data.site("tool").xpos, *data.joint("stretch").qvel])

    bench.run(lambda _: bench.rigid_body() + np.array([0.0, 0.0, 60.0]), 0.06, look)
    bench.run(lambda _: bench.rigid_body() + np.array([0.0, 0.0, -60.0]), 0.06, look)
    motion = np.array(seen)
    assert np.ptp(motion[:, 1]) > 0.5
    assert motion[:, -1].max() > 5.0
    return motion


def test_belts_and_straight_blade_in_a_fast_stretch() -> None:
    motion = fast_stretch()
    t2, t3, t4, t5, x, y = motion.T[:6]
    assert np.abs(t4 - (pi - 2.0 * t3)).max() < 1e-6
    assert np.abs(t5 - (-pi / 2.0 + t3)).max() < 1e-6
    assert np.abs(x - (L3 * (np.cos(t2 + t3) - np.cos(t2 - t3)) - L5 * np.sin(t2))).max() < 1e-6
    assert np.abs(y - (L3 * (np.sin(t2 + t3) - np.sin(t2 - t3)) + L5 * np.cos(t2))).max() < 1e-6
    assert np.abs(x * np.cos(t2) + y * np.sin(t2)).max() < 1e-6  # off the line along theta2 + 90 deg


def test_lift_inertia_is_the_sum_of_masses_and_the_motor() -> None:
    masses = 11.0 + 3.2 + 1.5 + 1.1 + 0.45
    assert PlantBench("scara", "lift").inertia()[0] == pytest.approx(masses + 2.8e-5 * (2.0 * pi / 0.01) ** 2, rel=1e-9)


def test_rotate_inertia_by_steiner() -> None:
    """At theta3 = 30 deg, in the frame of the hub (x along theta2): centres of the links and the blade."""
    t3 = pi / 6.0
    wrist = 2.0 * L3 * sin(t3)  # along y, x = 0
    elbow = np.array([L3 * cos(t3), L3 * sin(t3)])
    centres = {
        "upper_arm": (1.5, 0.5 * elbow, box(1.5, 0.12, 0.04)),
        "forearm": (1.1, elbow + 0.1 * np.array([-cos(t3), sin(t3)]), box(1.1, 0.115, 0.03)),
        "blade": (0.45, np.array([0.0, wrist + 0.12]), box(0.45, 0.14, 0.05)),
    }
    hub = 0.5 * 3.2 * 0.09**2
    by_hand = hub + sum(central + mass * float(at @ at) for mass, at, central in centres.values()) + 1.4e-5 * 50.0**2
    assert PlantBench("scara", "rotate").inertia()[1] == pytest.approx(by_hand, rel=1e-9)


def test_stretch_inertia_by_lagrange() -> None:
    """2 T / theta3'^2: links turn at +-theta3', the blade only slides along the line with 2 L3 cos(theta3) theta3'."""
    t3 = pi / 6.0
    upper = box(1.5, 0.12, 0.04) + 1.5 * 0.1**2
    forearm_speed = np.array([-(L3 - 0.1) * sin(t3), (L3 + 0.1) * cos(t3)])  # d/dt3 of elbow + 0.1 (-cos, sin)
    forearm = box(1.1, 0.115, 0.03) + 1.1 * float(forearm_speed @ forearm_speed)
    blade = 0.45 * (2.0 * L3 * cos(t3)) ** 2
    by_hand = upper + forearm + blade + 1.4e-5 * 50.0**2
    assert PlantBench("scara", "stretch").inertia()[2] == pytest.approx(by_hand, rel=1e-9)


def test_stage_and_arm_inertia() -> None:
    assert PlantBench("stage", "slide").inertia()[0] == pytest.approx(80.0 + 3.8e-5 * (2.0 * pi / 0.01) ** 2, rel=1e-9)
    arm = box(1.2, 0.025, 0.2) + 1.2 * 0.2**2
    tool = 1.5 / 12.0 * (3.0 * 0.04**2 + 0.08**2) + 1.5 * 0.4**2
    assert PlantBench("arm", "shoulder").inertia()[0] == pytest.approx(arm + tool + 1.4e-5 * 100.0**2, rel=1e-9)


def test_gravity_by_hand() -> None:
    lift = PlantBench("scara", "lift").rigid_body()
    assert lift == pytest.approx([17.25 * GRAVITY, 0.0, 0.0], abs=1e-9)
    arm = PlantBench("arm", "shoulder")
    assert arm.rigid_body()[0] == pytest.approx((1.2 * 0.2 + 1.5 * 0.4) * GRAVITY * sin(arm.position), rel=1e-9)


def test_acceleration_is_torque_by_inertia() -> None:
    """The moving plant agrees with the told inertia: rotate with stretch held by stiction, at theta3 = 0.25 rad."""
    bench = PlantBench("scara", "rotate", (placed("stretch", "coulomb", coulomb=50.0),))
    wrist, elbow = 2.0 * L3 * sin(0.25), np.array([L3 * cos(0.25), L3 * sin(0.25)])
    forearm = elbow + 0.1 * np.array([-cos(0.25), sin(0.25)])
    inertia = 0.5 * 3.2 * 0.09**2 + 1.4e-5 * 50.0**2 + box(1.5, 0.12, 0.04) + 1.5 * 0.01 + box(1.1, 0.115, 0.03)
    inertia += 1.1 * float(forearm @ forearm) + box(0.45, 0.14, 0.05) + 0.45 * (wrist + 0.12) ** 2
    bench.push(0.5, 0.1)
    assert bench.velocity == pytest.approx(0.5 * 0.1 / inertia, rel=1e-4)


def test_inertia_effect_adds_to_the_axis() -> None:
    plain = PlantBench("scara", "rotate", ()).inertia()
    heavier = PlantBench("scara", "rotate", (placed("rotate", "inertia", difference=0.125),)).inertia()
    assert heavier - plain == pytest.approx([0.0, 0.125, 0.0], abs=1e-12)


def test_truth_is_what_the_effects_file_says() -> None:
    truth = PlantBench("stage", "slide").plant.truth()["slide"]
    assert truth == {
        "inertia": pytest.approx(95.0014, rel=1e-4),
        "coulomb": 20.4,
        "viscous": 203.5,
        "coulomb_positive": 20.4,
        "coulomb_negative": 20.4,
        "viscous_positive": pytest.approx(167.5),
        "viscous_negative": pytest.approx(239.5),
    }
    rotate = PlantBench("scara", "rotate").plant.truth()["rotate"]
    assert (rotate["static_torque"], rotate["stribeck_velocity"], rotate["exponent"]) == (2.5, 0.05, 2.0)


def test_effects_on_an_axis_that_the_machine_has_not() -> None:
    with pytest.raises(UserError, match="axis 'tilt'; machine scara has lift, rotate, stretch"):
        Plant(load_machine("scara"), (placed("tilt", "coulomb", coulomb=1.0),))


@pytest.mark.parametrize("name", ["coulomb", "viscous"])
def test_friction_that_would_push_is_refused(name: str) -> None:
    effects = (placed("slide", name, **{name: 1.0}), placed("slide", f"{name}_asymmetry", asymmetry=-1.1))
    with pytest.raises(UserError, match=f"axis slide: {name}_asymmetry -1.1 is more than {name} 1"):
        Plant(load_machine("stage"), effects)


def test_given_truth_comes_before_the_machines_own(tmp_path: Path) -> None:
    machine = load_machine("arm")
    assert truth_path(machine, None) == MACHINES / "arm" / "effects.json"
    assert truth_path(machine, tmp_path / "mine.json") == tmp_path / "mine.json"
    assert read_effects(truth_path(machine, None))


def test_unknown_machine() -> None:
    with pytest.raises(UserError, match="unknown machine 'crane'; known are arm, scara, stage"):
        load_machine("crane")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"gear_ratio": 0.0}, "axes.slide.gear_ratio: Input should be greater than 0"),
        ({"node_id": 128}, "axes.slide.node_id: Input should be less than or equal to 127"),
        ({"limit_switches": {"negative": 0.1, "positive": -0.1}}, "limit_switches: negative is 0.1 and positive -0.1"),
        ({"home_switch": {"negative": 0.1, "positive": 0.1}}, "axes.slide.home_switch: negative is 0.1 and positive 0.1"),
        ({"colour": "red"}, "axes.slide.colour: is not a known key"),
    ],
)
def test_wrong_machine_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: dict[str, object], message: str) -> None:
    content = yaml.safe_load((MACHINES / "stage" / "machine.yaml").read_text(encoding="utf-8"))
    content["axes"]["slide"].update(change)
    (tmp_path / "bent").mkdir()
    (tmp_path / "bent" / "machine.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    monkeypatch.setattr(machine_module, "MACHINES", tmp_path)
    with pytest.raises(UserError, match=message):
        load_machine("bent")


def test_a_node_id_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    content = yaml.safe_load((MACHINES / "scara" / "machine.yaml").read_text(encoding="utf-8"))
    content["axes"]["rotate"]["node_id"] = 1
    (tmp_path / "bent").mkdir()
    (tmp_path / "bent" / "machine.yaml").write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    monkeypatch.setattr(machine_module, "MACHINES", tmp_path)
    with pytest.raises(UserError, match=r"machine\.yaml: axes: lift and rotate both have node_id 1; give each its own"):
        load_machine("bent")
