"""Recordings with a zero of their own, of a pendulum whose torque is a formula: placed by what was found on others, or by the
weight."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.model.unknown import components
from drivetwin.diagnosis.prepare.positions import left_out, positions
from drivetwin.diagnosis.prepare.prepared import Prepared, prepared
from drivetwin.diagnosis.prepare.simulation import simulation
from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.report.prediction import Patch, gap_rms, predict
from drivetwin.diagnosis.report.zeros import placed_by, with_aside
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.bench import bench_of
from drivetwin.diagnosis.weigh.state import state_of
from drivetwin.emulator.effects.position_friction import PositionFriction
from drivetwin.emulator.effects.spring import Spring
from drivetwin.emulator.effects.torque_offset import TorqueOffset
from drivetwin.emulator.effects.viscous import Viscous
from drivetwin.recording.recording import Recording, RecordingInfo

PERIOD, MASS, LENGTH, COULOMB, CUTOFF = 0.002, 2.0, 0.3, 0.4, 48.0
WEIGHT = MASS * 9.81 * LENGTH
INERTIA = MASS * LENGTH**2 + 0.01
MODEL = """<mujoco model="pendulum"><option gravity="0 0 {gravity}"/><worldbody><body>
<joint name="swing" axis="0 1 0" range="-180 180" limited="true" frictionloss="0.4"/>
<inertial pos="0 0 -0.3" mass="2" diaginertia="0.01 0.01 0.01"/></body></worldbody>
<actuator><motor name="swing" joint="swing" gear="{gear}"/></actuator></mujoco>"""


def model(folder: Path, gravity: float = -9.81, gear: float = 1.0) -> Path:
    path = folder / "model.xml"
    path.write_text(MODEL.format(gravity=gravity, gear=gear), encoding="utf-8")
    return path


def swinging(
    name: str,
    zero: float | None,
    seed: int,
    weight: float = WEIGHT,
    seconds: float = 20.0,
    offset: float = 0.0,
    pace: float = 1.0,
) -> Recording:
    """Of which the position is told from `zero` [rad] on and said to be relative; None: as it is. `offset` of the torque,
    `pace` of the motion.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(round(seconds / PERIOD), dtype=np.float64) * PERIOD
    slow, fast = pace * rng.uniform(1.5, 2.0), pace * rng.uniform(4.0, 5.0)
    position = 0.9 * np.sin(slow * time) + 0.2 * np.sin(fast * time)
    velocity = 0.9 * slow * np.cos(slow * time) + 0.2 * fast * np.cos(fast * time)
    acceleration = -0.9 * slow**2 * np.sin(slow * time) - 0.2 * fast**2 * np.sin(fast * time)
    torque = INERTIA * acceleration + weight * np.sin(position) + COULOMB * np.sign(velocity)
    torque = torque + offset + 0.01 * rng.standard_normal(len(time))
    told = {"joint": "swing", "position_resolution": 1e-7, "torque_resolution": 1e-3, "position_relative": zero is not None}
    info = RecordingInfo.model_validate(
        {"schema": "recording/1", "machine": "pendulum", "sample_period": PERIOD, "axes": {"swing": told}}
    )
    columns = {"position": position - (zero or 0.0), "position_demand": position - (zero or 0.0), "torque": torque}
    return Recording(name, info, time, {"swing": columns})


def test_relative_recordings_are_left_aside_where_others_are_enough(tmp_path: Path) -> None:
    given = [swinging("one", None, 1), swinging("two", 0.7, 2), swinging("three", None, 3)]
    found = positions(simulation(model(tmp_path), given[0].info.axes), given, CUTOFF)
    assert [one.name for one in found.recordings] == ["one", "three"]
    assert found.aside == (given[1],)
    assert left_out(found) == ("two: left out, for the position is relative; that of one, three is absolute.",)


@pytest.mark.parametrize("zero", [-1.2, 0.0, 0.7, 2.0])
def test_a_zero_is_where_the_weight_says(zero: float, tmp_path: Path) -> None:
    """Demand and position are both moved; to a thousandth of a radian, some tenths of which are the velocity's filter."""
    given = swinging("only", zero, 4)
    (found,) = positions(simulation(model(tmp_path), given.info.axes), [given], CUTOFF).recordings
    for name in ("position", "position_demand"):
        np.testing.assert_allclose(found.columns["swing"][name] - given.columns["swing"][name], zero, atol=1e-3)


def test_many_relative_recordings_are_placed_beside_a_short_absolute_one(tmp_path: Path) -> None:
    given = [swinging("short", None, 1, seconds=4.0), swinging("long", 0.5, 2)]
    found = positions(simulation(model(tmp_path), given[0].info.axes), given, CUTOFF)
    assert [one.name for one in found.recordings] == ["short", "long"]
    assert found.recordings[0] is given[0]
    assert found.notes == ("long: the position is relative; by the model's torque its zero is at swing +0.5 rad.",)


def test_a_cause_that_moved_a_zero_gives_it_back(tmp_path: Path) -> None:
    """The model that finds the zero lacks the offset, and takes an angle for it: beside it no more than the second order
    of that angle is left."""
    given = [swinging("one", 0.5, 2, offset=0.6), swinging("two", -0.7, 3, offset=0.6)]
    ready = prepared(model(tmp_path), given, given, Settings(cutoff_hz=CUTOFF))
    bench = bench_of(ready.rows, Settings(cutoff_hz=CUTOFF), ready.absolute)
    true = state_of(bench, [placed(ready.rows, "swing", TorqueOffset(0.6))], bench.white, {})
    left = np.sqrt(true.left["swing"] * ready.rows.gap_energy["swing"] / ready.rows.count("swing"))
    assert left < 0.5 * WEIGHT * (0.6 / WEIGHT) ** 2


def test_a_position_that_no_torque_depends_on_stays(tmp_path: Path) -> None:
    given = swinging("level", 0.7, 4, weight=0.0)
    found = positions(simulation(model(tmp_path, gravity=0.0), given.info.axes), [given], CUTOFF)
    assert (found.recordings, found.notes) == ((given,), ())


def test_a_relative_validation_has_the_gap_of_an_absolute_one(tmp_path: Path) -> None:
    """What the model lacks is noise alone: a tenth of a radian off would be half a newton metre."""
    fitted, held = swinging("fitted", None, 1), swinging("held", 0.7, 2)
    ready = prepared(model(tmp_path), [fitted], [held], Settings())
    (check,) = ready.checks
    own = check.axes["swing"]
    assert np.sqrt(np.mean((own.torque - own.base)[own.used] ** 2)) < 0.02
    assert len(ready.notes) == 1
    moved = replace(held, columns={"swing": {**held.columns["swing"], "position": held.columns["swing"]["position"] + 0.6}})
    told = held.info.axes["swing"].model_copy(update={"position_relative": False})
    wrong = replace(moved, info=held.info.model_copy(update={"axes": {"swing": told}}))
    own = prepared(model(tmp_path), [fitted], [wrong], Settings()).checks[0].axes["swing"]
    assert np.sqrt(np.mean((own.torque - own.base)[own.used] ** 2)) > 0.2


WAVES = PositionFriction(0.2, 0.9, 0.4)


def rubbing(
    name: str,
    at: float | None,
    seed: int,
    weight: float = 0.0,
    offset: float = 0.0,
    pace: float = 1.0,
    waves: PositionFriction = WAVES,
) -> Recording:
    """`swinging`, with friction that has `waves` over the position."""
    plain = swinging(name, at, seed, weight=weight, offset=offset, pace=pace)
    own = plain.columns["swing"]
    joint = own["position"] + (at or 0.0)
    angle = 2.0 * np.pi * joint / waves.period + waves.phase
    more = waves.amplitude * np.sin(angle) * np.sign(np.gradient(joint))
    return replace(plain, columns={"swing": {**own, "torque": own["torque"] + more}})


@pytest.mark.parametrize("zero", [-1.0, 0.3])
def test_a_validation_without_a_zero_is_placed_by_what_was_found(zero: float, tmp_path: Path) -> None:
    """Nothing hangs on this pendulum, so its model tells no zero; friction that has waves over the position does."""
    training, validation = [rubbing("one", None, 1)], [rubbing("two", zero, 2)]
    ready = prepared(model(tmp_path, gravity=0.0), training, validation, Settings())
    assert ready.adrift == {"two": ("swing",)}
    patch = Patch((placed(ready.rows, "swing", WAVES),))
    found = placed_by(ready, patch)
    gaps = [gap_rms([predict(each.simulation, each.checks[0], patch)], "swing", "after") for each in (ready, found)]
    assert gaps[1] < 0.2 * gaps[0]
    moved = found.checks[0].axes["swing"].motion.position - ready.checks[0].axes["swing"].motion.position
    waves_off = (moved - zero) / 0.9
    np.testing.assert_allclose(waves_off, np.round(waves_off), atol=0.02, err_msg="a whole wave farther is as good")
    assert "two: the position is relative; by what was found its zero is at swing" in found.notes[-1]
    assert placed_by(ready, Patch()).checks == ready.checks, "nothing was found that depends on it"


def moved_by(ready: Prepared, given: Recording) -> float:
    """Zero [rad] at which a recording that had none is fitted."""
    run = next(run for run in ready.runs if run.recording.name == given.name)
    return float(np.mean(run.recording.columns["swing"]["position"] - given.columns["swing"]["position"]))


@pytest.mark.parametrize("zero", [-1.0013, 0.3021])
@pytest.mark.parametrize("waves", [WAVES, replace(WAVES, period=0.005)], ids=["long waves", "short waves"])
def test_a_recording_beside_an_absolute_one_is_placed_by_what_was_found_on_that(
    waves: PositionFriction, zero: float, tmp_path: Path
) -> None:
    """As above, where no weight tells the zero: within a wave, which is enough for waves, and not for a spring."""
    given = [rubbing("one", None, 1, pace=0.05, waves=waves), rubbing("two", zero, 2, pace=0.05, waves=waves)]
    ready = prepared(model(tmp_path, gravity=0.0, gear=20), given, [rubbing("three", None, 3, pace=0.05)], Settings())
    assert [run.recording.name for run in ready.runs] == ["one"]
    found = with_aside(ready, Patch((placed(ready.rows, "swing", waves),)))
    assert [run.recording.name for run in found.runs] == ["one", "two"]
    waves_off = (moved_by(found, given[1]) - zero) / waves.period
    assert waves_off == pytest.approx(round(waves_off), abs=0.02), "a whole wave farther is as good"
    assert (found.runs[1].unplaced, found.runs[1].waves_within) == (frozenset({"swing"}), {"swing": waves.period})
    dynamics = found.simulation.dynamics()["swing"]
    costs = {
        effect: np.abs(found.runs[1].cost("swing", effect, dynamics)["swing"]).max()
        for effect in (*(replace(waves, period=share * waves.period) for share in (1.0, 1.0 / 3.0, 0.7)), Spring(1.0, 0.0))
    }
    assert [cost > 0.0 for cost in costs.values()] == [True, True, False, False]
    note = "two: the position is relative; by the model and what was found on the others its zero is at swing"
    assert found.notes[-1].startswith(note)
    assert found.notes[-1].endswith(
        "but for whole waves nothing shows the zero of swing: springs and weights are sought on the others."
    )


def test_effects_of_the_position_are_asked_for_where_the_zero_is_known(tmp_path: Path) -> None:
    """What needs no position is asked for on all recordings."""
    given = [rubbing("one", None, 1), rubbing("two", 0.3, 2)]
    ready = prepared(model(tmp_path, gravity=0.0), given, [rubbing("three", None, 3)], Settings())
    found = with_aside(ready, Patch())
    assert found.testable["swing"].kinds == ready.testable["swing"].kinds
    dynamics, run = found.simulation.dynamics()["swing"], found.rows.of["swing"].run
    for effect in (WAVES, Spring(1.0, 0.0)):
        cost = found.rows.cost("swing", effect, dynamics)["swing"]
        assert np.abs(cost[run == 0]).max() > 0.1
        assert not cost[run == 1].any()
    assert np.abs(found.rows.cost("swing", Viscous(0.1), dynamics)["swing"][run == 1]).max() > 0.1
    for one in components(found.rows, "swing", 8.0, absolute=True, known=np.zeros((len(run), 1))):
        assert one.columns[run == 0].any()
        assert one.columns[run == 1].any() == (one.goes_with != "position")
    assert found.notes[-1] == (
        "two: the position is relative; nothing shows the zero of swing: effects of the position are sought on the others."
    )


@pytest.mark.parametrize("zero", [-1.2, 0.7])
def test_what_was_found_takes_its_part_before_the_weight_says_where_the_zero_is(zero: float, tmp_path: Path) -> None:
    """An offset of the torque looks like a turn of 0.1 rad, a ninth of a wave; beside it the zero is right to a hundredth of
    one."""
    given = [rubbing("one", None, 1, WEIGHT, 0.6), rubbing("two", zero, 2, WEIGHT, 0.6)]
    ready = prepared(model(tmp_path), given, [rubbing("three", None, 3, WEIGHT, 0.6)], Settings())
    (aside,) = ready.aside
    assert abs(aside.zeros["swing"] - zero) > 0.05
    patch = Patch((placed(ready.rows, "swing", WAVES), placed(ready.rows, "swing", TorqueOffset(-0.6))))
    found = with_aside(ready, patch)
    assert moved_by(found, given[1]) == pytest.approx(zero, abs=0.01)
    run = found.runs[1]
    left = predict(found.simulation, run, patch).axes["swing"]
    assert np.sqrt(np.mean((left.measured - left.after)[left.used] ** 2)) < 0.02, "its weight is that at the zero"


def test_relative_recordings_do_not_wait_for_others_that_begin_at_one_place(tmp_path: Path) -> None:
    """Two that begin there in full motion have a zero each, whatever they say. The model places what is relative."""
    short = [swinging(name, None, seed, seconds=4.0) for name, seed in (("one", 1), ("two", 2))]
    given = [*short, swinging("three", 0.7, 3)]
    ready = prepared(model(tmp_path), given, [swinging("four", None, 4)], Settings())
    assert ready.aside == ()
    assert [run.recording.name for run in ready.runs] == ["one", "two", "three"]
    assert moved_by(ready, given[2]) == pytest.approx(0.7, abs=1e-3)


def test_relative_recordings_do_not_wait_for_one_that_stands(tmp_path: Path) -> None:
    standing = swinging("one", None, 1, seconds=8.0, pace=0.0)
    ready = prepared(model(tmp_path), [standing, swinging("two", 0.7, 2)], [swinging("three", None, 3)], Settings())
    assert [run.recording.name for run in ready.runs] == ["one", "two"]


def test_relative_recordings_do_not_wait_where_their_own_blocks_are_held_back(tmp_path: Path) -> None:
    given = [swinging("one", None, 1, seconds=6.0), swinging("two", 0.7, 2)]
    ready = prepared(model(tmp_path), given, [], Settings())
    assert ready.aside == ()
    assert {run.recording.name for run in ready.checks} == {"one", "two"}


@pytest.mark.parametrize("number", [0, 1])
def test_relative_recordings_do_not_wait_beside_an_integrated_position(number: int, tmp_path: Path) -> None:
    """It begins anywhere, and is not said to be relative."""
    given = [swinging("one", None, 1), swinging("two", 0.7, 2)]
    derived = given[number].info.model_copy(update={"derived": ["swing.position"]})
    given[number] = replace(given[number], info=derived)
    ready = prepared(model(tmp_path), given, [swinging("three", None, 3)], Settings())
    assert ready.aside == ()


def test_a_recording_that_nothing_places_is_moved_amid_the_others(tmp_path: Path) -> None:
    """A count of 300 rad would wind up a spring that was found on the others, and stretch what is told over the position."""
    given = [rubbing("one", None, 1), rubbing("two", 300.0, 2)]
    ready = prepared(model(tmp_path, gravity=0.0), given, [rubbing("three", None, 3)], Settings())
    run = with_aside(ready, Patch()).runs[1]
    assert np.abs(run.axes["swing"].motion.position).max() < 2.0


def test_what_only_a_relative_recording_shows_is_found(tmp_path: Path) -> None:
    """Drag that grows with the square of the speed, where the absolute recording goes at a thirtieth of it."""
    given, held = [dragged("slow", None, 1, 0.03), dragged("fast", 0.7, 2)], [dragged("held", None, 3)]
    alone = diagnose(model(tmp_path), given[:1], held, Settings(), lambda *_: None)
    assert all(cause.probability < 0.5 for cause in alone.causes if cause.effect == "viscous_nonlinear")
    found = diagnose(model(tmp_path), given, held, Settings(), lambda *_: None)
    first = found.causes[0]
    assert (first.effect, first.axis) == ("viscous_nonlinear", "swing")
    assert first.probability > 0.9
    assert first.gap_closed is not None
    assert first.gap_closed.validation > 0.95


def dragged(name: str, at: float | None, seed: int, pace: float = 1.0) -> Recording:
    """`swinging`, at so much of its pace, with a drag."""
    plain = swinging(name, at, seed, pace=pace)
    own = plain.columns["swing"]
    velocity = np.gradient(own["position"], PERIOD)
    return replace(plain, columns={"swing": {**own, "torque": own["torque"] + 0.15 * velocity * np.abs(velocity)}})
