"""An encoder error of one axis that passes faster than a log has samples: what the drive of the axis below gives for it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.prepared import prepared
from drivetwin.diagnosis.prepare.run import AxisRun
from drivetwin.diagnosis.settings import Settings
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.emulator.effects.base import PartEffect
from drivetwin.emulator.effects.coulomb import Coulomb
from drivetwin.emulator.effects.delay import Delay
from drivetwin.emulator.effects.elasticity import Elasticity
from drivetwin.emulator.effects.encoder_eccentricity import EncoderEccentricity
from drivetwin.emulator.effects.inertia import Inertia
from drivetwin.emulator.effects.position_friction import PositionFriction
from drivetwin.emulator.effects.torque_ripple import TorqueRipple
from drivetwin.emulator.effects.transmission_error import TransmissionError
from drivetwin.recording.recording import Recording, RecordingInfo
from drivetwin.twin.replay import replay

Array = NDArray[np.float64]

GEAR, FINE, SLOW = 400.0, 1e-3, 20
"""Of the upper axis [rad/m]; periods of the closed loop [s], and how many of them the log has one sample of."""
MODEL = f"""<mujoco model="carts"><option gravity="0 0 0"/><worldbody>
<body><joint name="lower" type="slide" axis="1 0 0" damping="2"/><inertial pos="0 0 0" mass="5" diaginertia="1 1 1"/>
<body><joint name="upper" type="slide" axis="1 0 0" damping="4"/><inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>
</body></body></worldbody>
<actuator><motor name="lower" joint="lower"/><motor name="upper" joint="upper" gear="{GEAR}"/></actuator></mujoco>"""
GAINS = {"lower": 700.0, "upper": 200.0}
"""Of velocity [N s/m]: both drives are as fast."""
TOLD = frozenset(GAINS)


def recorded(
    period: float, columns: dict[str, dict[str, Array]], gains: dict[str, float], late: float = 0.0, told: frozenset[str] = TOLD
) -> Recording:
    """`late` [s]: of the torque, as the log says; `told`: axes whose drive it describes."""
    drive = {"position_gain": 30.0, "integral_time": 0.1, "servo_period": 2.5e-4, "velocity_filter_hz": 500.0}
    axes: dict[str, Any] = {
        axis: {
            **{"joint": axis, "actuator": axis, "gear_ratio": ratio, "torque_delay": late},
            **({"drive": {**drive, "velocity_gain": gains[axis]}} if axis in told else {}),
        }
        for axis, ratio in (("lower", 1.0), ("upper", GEAR))
    }
    info = RecordingInfo.model_validate({"schema": "recording/2", "machine": "carts", "sample_period": period, "axes": axes})
    count = len(columns["upper"]["position"])
    return Recording("strokes", info, np.arange(count, dtype=np.float64) * period, columns)


def left_by(
    effects: Sequence[PartEffect], speed: float, folder: Path, *,
    lower: float = GAINS["lower"], upper: float = GAINS["upper"], rotor: float = 0.0, late: int = 0,
    told: frozenset[str] = TOLD,
) -> dict[str, float]:  # fmt: skip
    """Of the energy of each axis's gap, the share that the true effects of the upper one leave, at a share of full speed.

    `lower`, `upper`: gains of the drives; `rotor` [kg]: of the upper motor; `late`: periods by which the torques are recorded
    late; `told`: axes whose drive is known.
    """
    path = folder / "carts.xml"
    path.write_text(MODEL.replace('name="upper" type', f'name="upper" armature="{rotor}" type'), encoding="utf-8")
    time = np.arange(round(24.0 / FINE)) * FINE
    demands = {"lower": 0.3 * np.sin(0.9 * time), "upper": speed * (0.6 * np.sin(0.5 * time) + 0.3 * np.sin(2.4 * time))}
    asked = {axis: {"position": own, "torque": np.zeros_like(time), "position_demand": own} for axis, own in demands.items()}
    gains = {"lower": lower, "upper": upper}
    runs = replay(path, recorded(FINE, asked, gains), tuple(PlacedEffect("upper", one, {}) for one in effects))
    columns = {
        axis: {
            "position": run.position[::SLOW],
            "torque": np.roll(run.torque, late)[::SLOW],
            "position_demand": demands[axis][::SLOW],
        }
        for axis, run in runs.items()
    }
    log = recorded(SLOW * FINE, columns, gains, late * FINE, told)
    ready = prepared(path, [log], [log], Settings())
    (run,) = ready.runs
    found = {axis: own.torque - own.base for axis, own in run.axes.items()}
    dynamics = ready.simulation.dynamics()["upper"]
    for number, one in enumerate(effects):
        for axis, felt in run.cost("upper", one, dynamics).items():
            found[axis] = found[axis] - felt
        dynamics = ready.simulation.dynamics_of("upper", [PlacedEffect("upper", each, {}) for each in effects[: number + 1]])
    return {axis: _energy(found[axis], own) / _energy(own.torque - own.base, own) for axis, own in run.axes.items()}


def _energy(torque: Array, own: AxisRun) -> float:
    return float(np.mean(torque[own.used] ** 2))


def encoder(amplitude: float) -> PartEffect:
    return EncoderEccentricity(amplitude, 0.7)


def cogging(amplitude: float) -> PartEffect:
    """As large as such an error [N]."""
    return TorqueRipple(2.5e5 * amplitude, 1.0, 0.3)


def gear(amplitude: float) -> PartEffect:
    return TransmissionError(amplitude, 1.0, 0.7)


@pytest.mark.parametrize("lower", [250.0, 700.0, 1400.0])
@pytest.mark.parametrize("made", [encoder, gear])
def test_what_passes_faster_than_the_samples_is_felt_as_the_drives_of_both_axes_make_it(
    made: Callable[[float], PartEffect], lower: float, tmp_path: Path
) -> None:
    """Waves of up to 76 Hz in 50 samples a second, with a drive below that is a third, as and twice as fast. What the
    samples show of them would leave 1.1 to 1.6 of the lower axis's gap, the whole wave five times that.
    """
    left = left_by([made(2e-5)], 1.0, tmp_path, lower=lower)
    assert left["upper"] < 0.3
    assert left["lower"] < 0.3


@pytest.mark.parametrize("made", [encoder, gear])
def test_a_rotor_moves_with_the_motor_and_not_with_the_joint(made: Callable[[float], PartEffect], tmp_path: Path) -> None:
    """An error of the gear shakes the link, an error of the encoder both: a rotor as heavy as the cart on it."""
    left = left_by([made(2e-5)], 1.0, tmp_path, upper=400.0, rotor=2.0)
    assert left["lower"] < 0.15


@pytest.mark.parametrize("delay", [0.002, 0.004])
def test_a_late_encoder_is_late_in_the_loops_of_its_drive(delay: float, tmp_path: Path) -> None:
    """Not so in the loops, it left 8 and 26 % of the gap of its own axis as well."""
    left = left_by([Delay(delay), encoder(2e-5)], 1.0, tmp_path)
    assert left["upper"] < 0.08
    assert left["lower"] < 0.15


def test_a_torque_that_is_read_earlier_has_its_alias_turned(tmp_path: Path) -> None:
    left = left_by([encoder(2e-5)], 1.0, tmp_path, late=7)
    assert left["lower"] < 0.2


@pytest.mark.parametrize("lower", [100.0, 700.0, 6000.0])
def test_an_axis_whose_loops_are_unknown_feels_what_the_samples_show(lower: float, tmp_path: Path) -> None:
    """Held still, as only a stiff drive holds it, it would be said to feel up to 155 times its gap."""
    assert left_by([encoder(2e-5)], 1.0, tmp_path, lower=lower, told=frozenset({"upper"}))["lower"] < 1.5


@pytest.mark.parametrize("lower", [250.0, 700.0])
@pytest.mark.parametrize(
    "effects", [[cogging(2e-5)], [Coulomb(4.0), PositionFriction(3.0, 2.0 * np.pi / GEAR, 0.3)]]
)
def test_a_torque_that_varies_faster_than_the_samples_is_felt_too(
    effects: list[PartEffect], lower: float, tmp_path: Path
) -> None:
    """It shakes the upper cart, which the lower one was not said to feel: all of that gap was left."""
    assert left_by(effects, 1.0, tmp_path, lower=lower)["lower"] < 0.3


@pytest.mark.parametrize(("stiffness", "left"), [(2e6, 0.2), (2e5, 0.5), (2e4, 1.0)])
def test_a_link_on_a_stiff_spring_follows_its_motor(stiffness: float, left: float, tmp_path: Path) -> None:
    """Cogging before a spring on which the link swings with 160, 50 and 16 Hz; a spring takes nothing away that it passes."""
    effects = [cogging(2e-5), Elasticity(stiffness, 20.0)]
    assert left_by(effects, 1.0, tmp_path, upper=400.0, rotor=2.0)["lower"] < left


def test_a_joint_on_a_soft_spring_does_not_follow_a_fast_error_of_its_encoder(tmp_path: Path) -> None:
    """It was said to feel the wave that a rigid joint does not, which left eight times the lower axis's gap."""
    assert left_by([Elasticity(2e4, 20.0), encoder(2e-5)], 1.0, tmp_path, upper=400.0, rotor=2.0)["lower"] < 1.5


@pytest.mark.parametrize("made", [encoder, gear, cogging])
def test_a_rotor_that_the_model_lacks_moves_as_one_that_it_has(made: Callable[[float], PartEffect], tmp_path: Path) -> None:
    assert left_by([Inertia(2.0), made(2e-5)], 1.0, tmp_path, upper=400.0)["lower"] < 0.15


@pytest.mark.parametrize("made", [encoder, gear])
def test_what_the_samples_show_is_felt(made: Callable[[float], PartEffect], tmp_path: Path) -> None:
    """Waves of up to 15 Hz."""
    left = left_by([made(2e-4)], 0.2, tmp_path)
    assert left["upper"] < 0.05
    assert left["lower"] < 0.2
