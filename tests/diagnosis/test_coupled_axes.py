"""A cart on a cart: where the upper one moves otherwise than its encoder says, the motor of the lower one feels it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from carts_bench import CUTOFF, GEAR, LOWER, MODEL, MOTOR, PERIOD, STIFFNESS, TIME, UPPER, VISCOUS, slope, waves

from drivetwin.diagnosis.prepare.prepared import prepared
from drivetwin.diagnosis.prepare.rows import Column, Rows
from drivetwin.diagnosis.propose.search import movable_fields, tangents
from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.settings import Settings
from drivetwin.emulator.effects import AxisEffect, Effect
from drivetwin.emulator.effects.backlash import Backlash
from drivetwin.emulator.effects.delay import Delay
from drivetwin.emulator.effects.elasticity import Elasticity
from drivetwin.emulator.effects.encoder_eccentricity import EncoderEccentricity
from drivetwin.emulator.effects.stribeck import Stribeck
from drivetwin.emulator.effects.transmission_error import TransmissionError
from drivetwin.recording.recording import Recording, RecordingInfo


@dataclass(frozen=True)
class Case:
    """An effect of the upper cart: how its motor stands and what is read, for where the cart is and the force it needs."""

    effect: AxisEffect
    motor: Callable[[Array, Array], Array]
    read: Callable[[Array], Array]


def before_the_gear(at: Array) -> Array:
    """Where a motor stands whose gear has the cart 0.2 mm sin(2 motor's turns + 0.4) ahead of it."""
    motor = at
    for _ in range(10):
        motor = at - 2e-4 * np.sin(2.0 * GEAR * motor + 0.4)
    return motor


CASES = (
    Case(Elasticity(STIFFNESS), lambda at, force: at + force / STIFFNESS, lambda motor: motor),
    Case(TransmissionError(2e-4, 2.0, 0.4), lambda at, _: before_the_gear(at), lambda motor: motor),
    Case(EncoderEccentricity(3e-4, 0.9), lambda at, _: at, lambda motor: motor + 3e-4 * np.sin(GEAR * motor + 0.9)),
    Case(Delay(0.003), lambda at, _: at, lambda motor: np.concatenate([np.full(3, motor[0]), motor[:-3]])),
)


def compared(folder: Path, case: Case) -> Rows:
    """The carts moved: Newton's second law for both, the lower one's with the true motion of the upper one."""
    lower = waves((0.15, 0.4, 0.0), (0.01, 2.1, 1.0))
    upper = waves((0.2, 0.6, 0.5), (0.02, 2.7, 0.0), (0.001, 7.0, 2.0))
    force = UPPER * (slope(slope(lower)) + slope(slope(upper))) + VISCOUS * slope(upper)
    motor = case.motor(upper, force)
    uneven = isinstance(case.effect, TransmissionError)
    ratio = 1.0 + 4e-4 * GEAR * np.cos(2.0 * GEAR * motor + 0.4) if uneven else 1.0
    torques = {
        "lower": (LOWER + UPPER) * slope(slope(lower)) + UPPER * slope(slope(upper)),
        "upper": MOTOR * slope(slope(motor)) + force * ratio,
    }
    read = {"lower": lower, "upper": case.read(motor)}
    columns = {axis: {"position": read[axis], "torque": torques[axis]} for axis in torques}
    axes = {
        axis: {"joint": axis, "actuator": axis, "torque_resolution": 1e-3, "position_resolution": 1e-8, "gear_ratio": gear}
        for axis, gear in (("lower", 1.0), ("upper", GEAR))
    }
    info = RecordingInfo.model_validate({"schema": "recording/1", "machine": "carts", "sample_period": PERIOD, "axes": axes})
    recording = Recording("waves", info, TIME, columns)
    path = folder / "carts.xml"
    path.write_text(MODEL, encoding="utf-8")
    return prepared(path, [recording], [recording], Settings(cutoff_hz=CUTOFF)).rows


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.effect.name)
def test_the_other_axis_feels_how_the_joint_truly_moves(case: Case, tmp_path: Path) -> None:
    rows = compared(tmp_path, case)
    cost = rows.cost("upper", case.effect, rows.simulation.dynamics()["upper"])
    for axis, gap in rows.target.items():
        assert np.sum((gap - cost[axis]) ** 2) < 1e-3 * np.sum(gap**2)


@pytest.mark.parametrize("case", CASES[1:], ids=lambda case: case.effect.name)
def test_the_slope_of_an_effect_that_is_not_there_yet_is_felt_by_the_other_axis(case: Case, tmp_path: Path) -> None:
    rows = compared(tmp_path, case)
    dynamics = rows.simulation.dynamics()["upper"]
    size = type(case.effect).parameters[0].name
    none, small = (replace(case.effect, **{size: share * getattr(case.effect, size)}) for share in (0.0, 0.01))

    def cost(effect: Effect) -> Column:
        assert isinstance(effect, AxisEffect)
        return rows.cost("upper", effect, dynamics)

    def slope_of(effect: AxisEffect) -> Column:
        field = movable_fields(effect, rows.motion["upper"], dynamics, Settings().wide_step)[0]
        return {axis: own / field.size for axis, own in tangents(effect, [field], cost)[0].items()}

    there, expected = slope_of(none), slope_of(small)
    assert set(there) == {"lower", "upper"}
    for axis, rows_of in expected.items():
        assert np.linalg.norm(there[axis] - rows_of) < 0.1 * np.linalg.norm(rows_of)


def test_nobody_feels_a_joint_that_moves_as_measured(tmp_path: Path) -> None:
    rows = compared(tmp_path, CASES[0])
    dynamics = rows.simulation.dynamics()
    assert set(rows.cost("upper", Stribeck(1.0, 0.1), dynamics["upper"])) == {"upper"}


def test_play_lets_the_upper_cart_coast_which_the_lower_one_feels(tmp_path: Path) -> None:
    """While the flanks part the cart slows by its damping alone: the force on the lower one is -damping times its speed."""
    rows = compared(tmp_path, CASES[0])
    run = rows.runs[0]
    motion = run.axes["upper"].motion
    play = Backlash(0.02, 1e5, 50.0)
    dynamics = rows.simulation.dynamics()["upper"]
    torque, strays = play.predict_with_joint(motion, dynamics)
    assert strays is not None
    through = torque + motion.rigid_torque + VISCOUS * motion.velocity - MOTOR * motion.acceleration
    parted = (np.abs(through) < 1e-9) & (np.abs(motion.velocity) > 0.05)
    true = motion.acceleration + strays.acceleration
    inside = parted & np.roll(parted, 2) & np.roll(parted, -2)
    assert inside.sum() > 100
    lower = run.axes["lower"].motion.acceleration
    speed = np.cumsum(true) * run.period
    force = UPPER * (true + lower)[inside]
    fitted = np.polyfit(speed[inside], force, 1)
    assert fitted[0] == pytest.approx(-VISCOUS, rel=0.01)
