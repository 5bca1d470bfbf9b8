"""What a drive's loops ask for, against a closed loop that the test itself runs; and what of it was not given."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import exp, pi
from pathlib import Path

import numpy as np
import pytest
from rig_bench import COULOMB, PERIOD, TURNING, VISCOUS, compared, ready, recording, swing, written_model
from scipy.signal import lfilter

from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.prepare.drive_law import NOT_RECORDED, OTHER_LAW, asked_of, law_missing
from drivetwin.diagnosis.prepare.rows import Rows
from drivetwin.diagnosis.propose.drives import DriveFound, drive_effects
from drivetwin.diagnosis.report.result import Array, Diagnosis, Verdict
from drivetwin.diagnosis.settings import Settings
from drivetwin.emulator.effects.current_bandwidth import CurrentBandwidth
from drivetwin.emulator.effects.torque_saturation import TorqueSaturation
from drivetwin.recording.recording import DriveLoops, Recording

SECONDS = 12.0
STEPS = 16
"""Of the plant, a sample."""
STEP = PERIOD / STEPS
POSITION_GAIN, GAIN, INTEGRAL_TIME, LAG = 15.0, TURNING * 2.0 * pi * 8.0, 0.1, 0.0005
DRIVE = DriveLoops(
    position_gain=POSITION_GAIN,
    velocity_gain=GAIN,
    integral_time=INTEGRAL_TIME,
    velocity_feedforward=1.0,
    servo_period=STEP,
    current_loop_time_constant=LAG,
)
SLOW = DRIVE.model_copy(update={"servo_period": PERIOD})
"""A servo that runs once a sample."""
STIFF, INTEGRAL = GAIN * POSITION_GAIN, GAIN * POSITION_GAIN * 4.0
PID = DriveLoops.model_validate(
    {
        "law": "pid",
        "proportional_gain": STIFF,
        "integral_gain": INTEGRAL,
        "derivative_gain": GAIN,
        "servo_period": STEP,
        "current_loop_time_constant": LAG,
    }
)


@dataclass(frozen=True)
class Moved:
    """One axis moved by its loops, sampled: what they asked, what the motor gave [N·m], where it was and should have been."""

    asked: Array
    given: Array
    position: Array
    demand: Array


def limited(limit: float) -> Callable[[float], float]:
    """A motor that gives the torque of its current loop up to `limit` [N·m]."""
    return lambda torque: min(max(torque, -limit), limit)


def closed_loop(
    lag: float = LAG, motor: Callable[[float], float] = float, servo: int = 1, seed: int = 2, pid: bool = False
) -> Moved:
    """Position P, velocity PI with feed-forward, or a PID; a current loop of first order, an inertia with friction.

    The servo runs every `servo` steps, its velocity is what the position has changed by since it last ran.
    """
    wanted = swing(seed, SECONDS, 0.8, 14.0)
    fine = np.arange(len(wanted.time) * STEPS) * STEP
    demand, speed = np.interp(fine, wanted.time, wanted.position), np.interp(fine, wanted.time, wanted.velocity)
    share = 1.0 - exp(-STEP / lag)
    position = velocity = integral = torque = last = ask = 0.0
    asked, given, positions = np.empty((3, len(fine)))
    for k in range(len(fine)):
        if k % servo == 0:
            behind, slower = demand[k] - position, speed[k] - (position - last) / (servo * STEP)
            ask, last = GAIN * (POSITION_GAIN * behind + slower) + integral, position
            rate = INTEGRAL * behind if pid else GAIN / INTEGRAL_TIME * (POSITION_GAIN * behind + slower)
            integral += rate * servo * STEP
        torque += share * (ask - torque)
        asked[k], given[k], positions[k] = ask, motor(torque), position
        friction = COULOMB["turn"] * np.tanh(velocity / 0.002) + VISCOUS["turn"] * velocity
        velocity += (given[k] - friction) / TURNING * STEP
        position += velocity * STEP
    return Moved(*(samples[::STEPS] for samples in (asked, given, positions, demand)))


def recorded(moved: Moved, drive: DriveLoops = DRIVE) -> Recording:
    """The column alone."""
    plain = recording({"turn": moved.given}, {"turn": moved.position}, seed=1, noise=3.0)
    plain.columns["turn"]["position_demand"] = moved.demand
    axes = {"turn": plain.info.axes["turn"].model_copy(update={"drive": drive})}
    return replace(plain, info=plain.info.model_copy(update={"axes": axes}))


def rows_of(folder: Path, moved: Moved, drive: DriveLoops = DRIVE) -> Rows:
    return compared(folder, recorded(moved, drive))


def found_in(rows: Rows) -> dict[str, DriveFound]:
    """The best of each effect of a drive on the column."""
    return {one.effect.name: one for one in drive_effects(rows.runs, "turn", (TorqueSaturation, CurrentBandwidth), Settings())}


def test_what_is_asked_is_what_the_loop_asked(tmp_path: Path) -> None:
    moved = closed_loop(servo=STEPS)
    run = rows_of(tmp_path, moved, SLOW).runs[0]
    told = asked_of(run, "turn")
    assert told is not None
    used = run.axes["turn"].used
    assert np.std(run.smooth(told.fast - moved.asked)[used]) < 1e-3 * np.std(run.smooth(moved.asked)[used])


def test_a_torque_limit_of_the_drive_is_part_of_what_it_asks(tmp_path: Path) -> None:
    run = rows_of(tmp_path, closed_loop(), DRIVE.model_copy(update={"torque_limit": 6.0})).runs[0]
    told = asked_of(run, "turn")
    assert told is not None
    assert np.abs(told.fast).max() == 6.0


def test_offsets_sent_are_part_of_what_is_asked(tmp_path: Path) -> None:
    plain = recorded(closed_loop())
    sent, torque = np.sin(plain.time), plain.columns["turn"]["torque"]
    without = asked_of(compared(tmp_path, plain).runs[0], "turn")
    plain.columns["turn"] |= {"torque_offset": sent, "torque": torque + sent}
    ahead = asked_of(compared(tmp_path, plain).runs[0], "turn")
    assert ahead is not None
    assert without is not None
    np.testing.assert_allclose(ahead.fast - without.fast, sent, atol=1e-9)


def test_a_recording_that_tells_no_loops_is_not_asked(tmp_path: Path) -> None:
    rows = rows_of(tmp_path, closed_loop(), DriveLoops(position_gain=15.0))
    assert asked_of(rows.runs[0], "turn") is None
    assert found_in(rows) == {}


@pytest.mark.parametrize("lag", [LAG, 1.0 / (2.0 * pi * 200.0)], ids=["as commissioned", "200 Hz"])
def test_a_sound_drive_has_no_effect(lag: float, tmp_path: Path) -> None:
    """What any effect takes away is below 0.5 % of the torque."""
    moved = closed_loop(lag)
    for one in found_in(rows_of(tmp_path, moved)).values():
        assert one.without.mean - one.left.mean < (0.005 * np.std(moved.given)) ** 2


@pytest.mark.parametrize(("servo", "drive"), [(STEPS, SLOW), (1, DRIVE)], ids=["at each sample", "faster"])
def test_a_saturated_motor_is_found_with_its_limit(servo: int, drive: DriveLoops, tmp_path: Path) -> None:
    found = found_in(rows_of(tmp_path, closed_loop(motor=limited(15.0), servo=servo), drive))
    saturation = found["torque_saturation"]
    assert isinstance(saturation.effect, TorqueSaturation)
    assert saturation.effect.limit == pytest.approx(15.0, rel=0.02)
    assert saturation.left.mean < 0.01 * saturation.without.mean
    assert list(found) == ["torque_saturation"], "a slow current loop would leave more"


def test_a_slow_current_loop_is_found_with_its_bandwidth(tmp_path: Path) -> None:
    """Its time constant to half a sample, within which the recording does not tell when the servo ran."""
    lag = 1.0 / (2.0 * pi * 25.0)
    found = found_in(rows_of(tmp_path, closed_loop(lag)))
    slow = found["current_bandwidth"]
    assert isinstance(slow.effect, CurrentBandwidth)
    assert 1.0 / (2.0 * pi * slow.effect.bandwidth) == pytest.approx(lag, abs=0.5 * PERIOD)
    assert slow.left.mean < 0.01 * slow.without.mean
    assert list(found) == ["current_bandwidth"], "a saturation would leave more"


def test_a_slow_current_loop_is_found_where_a_slow_log_stands_beside(tmp_path: Path) -> None:
    """At 50 Hz the law is known far worse than at the servo's rate: that recording decides nothing."""
    lag = 1.0 / (2.0 * pi * 18.0)
    whole, log = (recorded(closed_loop(lag, seed=seed)) for seed in (2, 5))
    every = round(0.02 / PERIOD)
    columns = {"turn": {name: values[::every] for name, values in log.columns["turn"].items()}}
    slow = replace(log, name="log", time=log.time[::every], columns=columns)
    found = found_in(compared(tmp_path, whole, slow))
    assert getattr(found["current_bandwidth"].effect, "bandwidth", 0.0) == pytest.approx(18.0, rel=0.1)


@pytest.mark.parametrize("known", [0, 1, 2])
def test_a_torque_that_is_recorded_late_is_no_slow_current_loop(known: int, tmp_path: Path) -> None:
    """By a sample more than the motion told: the law says as well at what time the torque is the one that it asked for."""
    moved, samples = closed_loop(), known + 1
    given = np.concatenate([np.full(samples, moved.given[0]), moved.given[:-samples]])
    rows = rows_of(tmp_path, replace(moved, given=given))
    assert not found_in(replace(rows, runs=[run.aligned({"turn": known * PERIOD}) for run in rows.runs]))


def test_a_pid_is_asked_as_a_cascade_is(tmp_path: Path) -> None:
    """What is left of its following error and its rate, which the recording shows at each sample only."""
    moved = closed_loop(pid=True, motor=limited(15.0))
    assert not_testable(tmp_path, moved, PID) == set()
    found = found_in(rows_of(tmp_path, moved, PID))
    saturation = found["torque_saturation"].effect
    assert isinstance(saturation, TorqueSaturation)
    assert saturation.limit == pytest.approx(15.0, rel=0.02)
    assert found_in(rows_of(tmp_path, closed_loop(pid=True), PID)) == {}


def not_testable(folder: Path, moved: Moved, drive: DriveLoops = DRIVE) -> set[str]:
    """Effects that the column is not asked for, for want of a demand or of a law that holds."""
    told = ready(folder, recorded(moved, drive)).testable["turn"].not_testable
    return {one.effect for one in told if (one.reason, one.needed) in (NOT_RECORDED, OTHER_LAW)}


def test_a_drive_is_asked_where_its_law_gives_the_recorded_torque(tmp_path: Path) -> None:
    assert not_testable(tmp_path, closed_loop()) == set()
    assert not_testable(tmp_path, closed_loop(motor=limited(15.0))) == set()


def test_what_an_integral_held_before_the_recording_is_not_asked_of_its_first_sample(tmp_path: Path) -> None:
    """A spike in the first sample of the torque is nothing that the integral held, and no other law."""
    moved = closed_loop()
    moved.given[0] += 3.0
    assert not_testable(tmp_path, moved) == set()


def begun_at_once(limit: float, lag: float = LAG) -> Moved:
    """A recording that begins at rest, in full acceleration: the motor is at its limit before anything else."""
    moved = closed_loop(lag=lag, motor=limited(limit))
    first = int(np.argmax(np.abs(moved.given) >= 0.999 * limit))
    return Moved(moved.asked[first:], moved.given[first:], moved.position[first:], moved.demand[first:])


@pytest.mark.parametrize("limit", [10.0, 12.0])
def test_a_recording_that_begins_at_the_limit_of_the_motor_shows_it(limit: float, tmp_path: Path) -> None:
    found = found_in(rows_of(tmp_path, begun_at_once(limit)))
    assert getattr(found["torque_saturation"].effect, "limit", 0.0) == pytest.approx(limit, rel=0.05)


def test_a_limit_behind_a_slow_current_loop_is_found_beside_it(tmp_path: Path) -> None:
    found = found_in(rows_of(tmp_path, closed_loop(lag=1.0 / (2.0 * pi * 25.0), motor=limited(15.0))))
    assert getattr(found["torque_saturation"].effect, "limit", 0.0) == pytest.approx(15.0, rel=0.05)
    assert getattr(found["current_bandwidth"].effect, "bandwidth", 0.0) == pytest.approx(25.0, rel=0.15)


def test_no_limit_is_found_far_below_the_torque(tmp_path: Path) -> None:
    """At one speed in each recording, one way: what varies passes for late, and the level for what the integral held."""
    rng = np.random.default_rng(3)
    runs = []
    for number, speed in enumerate((0.1, 0.2, 0.35, 0.5)):
        time = np.arange(2000) * PERIOD
        position = np.asarray(speed * time)
        level = COULOMB["turn"] * 6.0 + VISCOUS["turn"] * speed
        torque = level + 0.02 * rng.standard_normal(len(time))
        moved = Moved(torque, torque, position, position + (4.0 - 8.0 * np.exp(-time / 0.3)) / STIFF)
        runs.append(replace(recorded(moved), name=f"pass {number}"))
    assert not drive_effects(compared(tmp_path, *runs).runs, "turn", (TorqueSaturation, CurrentBandwidth), Settings())


def test_a_drive_that_is_built_otherwise_is_not_asked(tmp_path: Path) -> None:
    """Its loops are not those that the recording tells: half the gain, and no integral."""
    other = DRIVE.model_copy(update={"velocity_gain": 0.5 * GAIN, "integral_time": None})
    assert not_testable(tmp_path, closed_loop(), other) == {"torque_saturation", "current_bandwidth"}
    assert not_testable(tmp_path, closed_loop(), DriveLoops()) == {"torque_saturation", "current_bandwidth"}


def diagnosed(folder: Path, motor: Callable[[float], float], channel: Callable[[Array], Array] = np.asarray) -> Diagnosis:
    """`channel`: from the torque that the motor gave to what was recorded of it."""
    moved = [closed_loop(motor=motor, seed=seed) for seed in (2, 5)]
    fitted, held = (recorded(replace(each, given=channel(each.given))) for each in moved)
    return diagnose(written_model(folder), [fitted], [held], Settings(), lambda _stage, _share: None)


def test_a_saturated_motor_is_the_first_cause(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, limited(15.0))
    assert (found.causes[0].effect, found.causes[0].axis) == ("torque_saturation", "turn")
    assert found.causes[0].parameters["limit"].value == pytest.approx(15.0, rel=0.05)
    assert [one.effect.name for one in found.selected] == ["torque_saturation"]


def test_a_sound_drive_on_a_sound_machine_has_no_gap(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, float)
    assert (found.verdict, found.selected) == (Verdict.NO_GAP, ())


def filtered(given: Array) -> Array:
    """Through a low-pass of 45 Hz."""
    share = 1.0 - exp(-PERIOD * 2.0 * pi * 45.0)
    return np.asarray(lfilter([share], [1.0, share - 1.0], given))


def late(given: Array) -> Array:
    """Two samples late."""
    return np.concatenate([np.full(2, given[0]), given[:-2]])


@pytest.mark.parametrize("channel", [filtered, late])
def test_a_slow_channel_of_the_torque_is_no_slow_current_loop(channel: Callable[[Array], Array], tmp_path: Path) -> None:
    """The motion feels the motor's torque at once, only its record is late. A slow current loop is late for both."""
    found = diagnosed(tmp_path, float, channel)
    assert "current_bandwidth" not in {one.effect for one in found.causes}
    assert found.selected == ()


def test_what_is_missing_of_a_law_is_told(tmp_path: Path) -> None:
    """No demand, a demand with a hole, and gains of another drive are three reasons, and ask for three things."""
    made = recorded(closed_loop())
    columns = made.columns["turn"]
    torn = columns["position_demand"].copy()
    torn[100:103] = np.nan
    cases = {
        "not recorded": {name: values for name, values in columns.items() if name != "position_demand"},
        "no number in 3 rows of": columns | {"position_demand": torn},
    }
    for reason, own in cases.items():
        runs = compared(tmp_path, replace(made, columns=made.columns | {"turn": own})).runs
        missing = law_missing(runs, "turn")
        assert missing is not None
        assert reason in missing[0]
    other = DRIVE.model_copy(update={"velocity_gain": 0.4 * GAIN})
    assert law_missing(rows_of(tmp_path, closed_loop(), other).runs, "turn") == OTHER_LAW
    assert law_missing(rows_of(tmp_path, closed_loop()).runs, "turn") is None
