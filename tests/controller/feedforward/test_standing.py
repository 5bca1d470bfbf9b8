"""What the loops hold at rest: gravity in closed form, and the ramp of an integrator that stiction keeps from its end."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from streaming_bench import streaming

from drivetwin.controller.feedforward.alignment import loops_of
from drivetwin.controller.feedforward.rest import LEAD_IN
from drivetwin.controller.feedforward.standing import HOLD, held_torque
from drivetwin.controller.motion import Offsets, positions_now, stream
from drivetwin.emulator.effects import PlacedEffect, read_effects
from drivetwin.emulator.machine import load_machine

GRAVITY = 9.81
SCARA = load_machine("scara")
STICKING: tuple[PlacedEffect, ...] = read_effects(SCARA.effects_path)
LIFT, ROTATE = 0, 1


def moved_mass() -> float:
    """All bodies of the plant [kg]: the lift carries every one."""
    return float(mujoco.MjModel.from_xml_path(str(SCARA.model_path)).body_mass.sum())


def noise_of_the_mean(axis: str) -> float:
    """Standard deviation of a mean over `HOLD` of the measured torque, joint side, 1 kHz."""
    info = SCARA.axes[axis]
    return float(info.current_sensor.noise * info.motor.rated_torque * info.gear_ratio / np.sqrt(HOLD / 0.001))


@pytest.mark.parametrize("profile", ["servoone", "cia402-full"])
def test_without_friction_the_lift_holds_its_weight(profile: str, tmp_path: Path) -> None:
    with streaming("scara", profile, (), tmp_path / "bus.log") as bench:
        held = held_torque(bench.session, loops_of(bench.session.drives, bench.session.axes))
    assert held[LIFT] == pytest.approx(moved_mass() * GRAVITY, abs=4.0 * noise_of_the_mean("lift"))
    for number, axis in enumerate(("rotate", "stretch"), start=ROTATE):
        assert held[number] == pytest.approx(0.0, abs=4.0 * noise_of_the_mean(axis))


def test_what_is_sent_to_the_drive_is_not_what_its_loops_hold(tmp_path: Path) -> None:
    """A torque offset of 60 N takes its share from the integrator; the sum stays the weight."""
    told = 60.0
    with streaming("scara", "servoone", (), tmp_path / "bus.log") as bench:
        session = bench.session
        standing = np.tile(positions_now(session.drives), (300, 1))
        stream(session.cycle, session.drives, standing, Offsets(np.tile([told, 0.0, 0.0], (300, 1))))
        step = session.drives[LIFT].joint_torque(session.drives[LIFT].rated_torque) / 1000.0
        sent = session.drives[LIFT].torque_offset * step
        held = held_torque(session, loops_of(session.drives, session.axes))
        assert abs(sent - told) <= step
        assert bench.joint_torque(LIFT) == pytest.approx(moved_mass() * GRAVITY, abs=1.0)
    assert held[LIFT] == pytest.approx(moved_mass() * GRAVITY - sent, abs=4.0 * noise_of_the_mean("lift"))


@pytest.mark.parametrize("beside", [8e-6, -8e-6])
def test_an_integrator_that_stiction_keeps_waiting_is_foreseen(beside: float, tmp_path: Path) -> None:
    """Rotate sticks 8 urad beside its demand: its torque runs on by Kv Kp e / Ti; where it is `LEAD_IN` later is told.

    It came from the side to which it is pushed now, so that it does not break away.
    """
    with streaming("scara", "servoone", STICKING, tmp_path / "bus.log") as bench:
        session, joints = bench.session, bench.virtual.plant.joint_positions
        loops = loops_of(session.drives, session.axes)
        session.go_to({"rotate": 0.2 * np.sign(beside)})
        session.go_to({"rotate": 0.0})
        demand = positions_now(session.drives)
        demand[ROTATE] = session.drives[ROTATE].position * session.drives[ROTATE].unit + beside
        stream(session.cycle, session.drives, np.tile(demand, (10, 1)))
        stuck, before = float(joints()[ROTATE]), bench.joint_torque(ROTATE)
        held = held_torque(session, loops)
        stream(session.cycle, session.drives, np.tile(demand, (round(LEAD_IN / session.cycle.period), 1)))
        true, after = bench.joint_torque(ROTATE), float(joints()[ROTATE])
    assert after == pytest.approx(stuck, abs=1e-6), "it stuck all the while"
    assert abs(true - before) > 20.0 * noise_of_the_mean("rotate"), "there was something to foresee"
    assert held[ROTATE] == pytest.approx(true, abs=6.0 * noise_of_the_mean("rotate"))
