"""A replay against MuJoCo's own actuators, against closed forms, and against what it refuses."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pyarrow.parquet as pq
import pytest
from replay_bench import (
    COULOMB,
    DAMPING,
    INERTIA,
    KI,
    KP,
    KV,
    MOTOR,
    PERIOD,
    PID,
    SERVO,
    STEP,
    Array,
    by_mujoco,
    demand,
    recording,
    write_model,
)

from drivetwin.cli import main
from drivetwin.emulator.dynamics import AxisDynamics
from drivetwin.emulator.effects import Effect, PlacedEffect, library, read_effects
from drivetwin.emulator.effects.coulomb import Coulomb
from drivetwin.emulator.effects.file import effects_payload
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import write_json
from drivetwin.recording.reader import read_recording
from drivetwin.recording.writer import write_recording
from drivetwin.twin.replay import replay

COUNT = 1500
GAINS = {"servo_period": STEP, "proportional_gain": KP, "derivative_gain": KV}
MOVED = float(np.sqrt(np.mean(demand(COUNT) ** 2)))


def placed(name: str, **parameters: float) -> PlacedEffect:
    kind: type[Effect] = library()[name]
    return PlacedEffect("turn", kind(**parameters), {})


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_a_position_actuator_of_the_model_moves_it_as_mujoco_does(tmp_path: Path) -> None:
    """Friction, damping and servo of MuJoCo itself, against the emulator's loops and friction at the same time step."""
    model = write_model(tmp_path, SERVO)
    measured = by_mujoco(model, COUNT)
    found = replay(model, measured, ())["turn"]
    assert found.loops.told_by == "position actuator turn of the model"
    assert rms(found.position - measured.columns["turn"]["position"]) < 2e-4 * MOVED
    assert rms(found.torque - measured.columns["turn"]["torque"]) < 5e-3 * rms(measured.columns["turn"]["torque"])


@pytest.mark.parametrize(
    ("drive", "actuator"),
    [
        ({"law": "pd_position_servo", **GAINS}, SERVO),
        ({"law": "pid", "integral_gain": KI, **GAINS}, PID),
        (  # a PI velocity loop in a P position loop is a PID of kv (P + 1/T) and kv P/T
            {"position_gain": 12.0, "velocity_gain": KV, "integral_time": 0.05, "servo_period": STEP},
            PID.replace(f'kp="{KP}"', f'kp="{KV * (12.0 + 20.0)}"').replace(f'ki="{KI}"', f'ki="{KV * 12.0 * 20.0}"'),
        ),
    ],
    ids=["pd position servo", "pid", "cascade"],
)
def test_loops_of_the_recording_move_a_model_as_mujocos_do(drive: dict[str, Any], actuator: str, tmp_path: Path) -> None:
    measured = by_mujoco(write_model(tmp_path, actuator), COUNT)
    told = recording(measured.columns["turn"], drive)
    found = replay(write_model(tmp_path, MOTOR), told, ())["turn"]
    assert rms(found.position - measured.columns["turn"]["position"]) < 2e-4 * MOVED
    assert rms(found.torque - measured.columns["turn"]["torque"]) < 0.01 * rms(measured.columns["turn"]["torque"])


@dataclass(frozen=True)
class Drag:
    """Resistance in proportion to velocity, as a stranger writes it."""

    viscous: float
    asked: list[float]

    def resistance(self, position: Array, velocity: Array, time: Array) -> Array:
        self.asked.extend(time)
        return np.asarray(self.viscous * velocity)


ASKED: list[float] = []


@dataclass(frozen=True)
class Dragging(Coulomb):
    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        return replace(super().add_to(spec, joint, axis), resisting=(Drag(3.0, ASKED),))


def test_a_resistance_written_in_python_acts_at_every_step(tmp_path: Path) -> None:
    """It moves the model as MuJoCo's own damping of the same size does."""
    measured = by_mujoco(write_model(tmp_path, SERVO, damping=DAMPING + 3.0), COUNT)
    model, dragging = write_model(tmp_path, SERVO), PlacedEffect("turn", Dragging(COULOMB), {})
    ASKED.clear()
    dragged, free = (replay(model, measured, effects)["turn"] for effects in ((dragging,), ()))
    assert pytest.approx(STEP * np.arange(round((COUNT - 1) * PERIOD / STEP) + 1)) == ASKED
    position = measured.columns["turn"]["position"]
    assert rms(dragged.position - position) < 0.01 * rms(free.position - position)


def test_a_replay_begins_in_the_middle_of_a_motion(tmp_path: Path) -> None:
    """The second half alone, from its position and velocity."""
    model = write_model(tmp_path, SERVO)
    columns = {name: values[600:] for name, values in by_mujoco(model, COUNT).columns["turn"].items()}
    found = replay(model, recording(columns), ())["turn"]
    assert abs(np.diff(columns["position"])[0]) / PERIOD > 0.5
    assert rms(found.position - columns["position"]) < 5e-4 * MOVED


def test_a_constant_torque_is_a_parabola_in_closed_form(tmp_path: Path) -> None:
    """Law torque: the recorded torque on an inertia alone, from a velocity; no position comes in after the start."""
    model = write_model(tmp_path, damping=0.0, coulomb=0.0)
    time = np.arange(500, dtype=np.float64) * PERIOD
    position = 0.1 + 0.4 * time + 0.5 * 2.0 / INERTIA * time**2
    columns = {"position": position, "torque": np.full(500, 2.0)}
    found = replay(model, recording(columns, {"law": "torque"}), ())["turn"]
    assert found.position == pytest.approx(position, abs=2e-4)


def test_an_integral_holds_the_recorded_torque_from_the_first_row(tmp_path: Path) -> None:
    """A weight that hangs still: without it the axis would drop until the integral had grown."""
    model = tmp_path / "hung.xml"
    text = write_model(tmp_path, coulomb=0.0).read_text(encoding="utf-8")
    hanging = text.replace('gravity="0 0 0"', 'gravity="0 -10 0"').replace('pos="0 0 0" mass="1"', 'pos="0.3 0 0" mass="1"')
    model.write_text(hanging, encoding="utf-8")
    still = {"position": np.zeros(400), "position_demand": np.zeros(400), "torque": np.full(400, 3.0)}
    drive = {"position_gain": 20.0, "velocity_gain": 30.0, "integral_time": 0.05, "servo_period": STEP}
    assert np.abs(replay(model, recording(still, drive), ())["turn"].position).max() < 1e-9


def test_an_effect_moves_the_model_by_what_it_costs(tmp_path: Path) -> None:
    """A PD servo gives way to a torque that the drive does not report by torque / kp."""
    model = write_model(tmp_path, coulomb=0.0)
    still = {"position": np.zeros(2000), "position_demand": np.zeros(2000)}
    told = recording(still, {"law": "pd_position_servo", **GAINS})
    assert np.abs(replay(model, told, ())["turn"].position).max() == 0.0
    assert replay(model, told, (placed("torque_offset", offset=3.0),))["turn"].position[-1] == pytest.approx(3.0 / KP, rel=1e-3)


def test_a_position_is_what_the_encoder_reads(tmp_path: Path) -> None:
    """Loops close on the reading: an encoder disc off its centre errs by 0.05 rad where the joint is, not in what is told."""
    model = write_model(tmp_path, coulomb=0.0, damping=0.0)
    swings = demand(COUNT)
    told = recording({"position": swings, "position_demand": swings}, {"law": "pd_position_servo", **GAINS})
    exact = replay(model, told, ())["turn"].position
    read = replay(model, told, (placed("encoder_eccentricity", amplitude=0.05, phase=1.2),))["turn"].position
    assert abs(read[0] - swings[0]) < 1e-6
    assert rms(read - exact) < 0.1 * rms(0.05 * np.sin(swings + 1.2))


def test_a_table_of_what_has_no_name_is_replayed_from_its_file(tmp_path: Path) -> None:
    """At rest only what is over the position pulls; written to effects.json and read again."""
    model = write_model(tmp_path, coulomb=0.0)
    knots = {f"position_{k:02d}": 3.0 for k in range(13)} | {"forward_1": 0.3, "backward_1": 0.3}
    table = placed("residual_table", low=-1.0, high=1.0, top=2.0, **knots)
    units = {one.name: one.unit.revolute for one in table.effect.parameters}
    write_json(tmp_path / "effects.json", effects_payload([replace(table, units=units)]))
    still = {"position": np.zeros(2000), "position_demand": np.zeros(2000)}
    told = recording(still, {"law": "pd_position_servo", **GAINS})
    found = replay(model, told, read_effects(tmp_path / "effects.json"))["turn"]
    assert found.position[-1] == pytest.approx(-3.0 / KP, rel=1e-3)


def test_a_slow_power_stage_and_one_that_ends_short_are_the_plants(tmp_path: Path) -> None:
    """`torque_saturation` ends the torque that the motor gives, which the loops do not know."""
    measured = by_mujoco(write_model(tmp_path, SERVO), COUNT)
    most = float(np.abs(measured.columns["turn"]["torque"]).max())
    told = recording(measured.columns["turn"], {"law": "pd_position_servo", **GAINS})
    found = replay(write_model(tmp_path), told, (placed("torque_saturation", limit=0.5 * most),))["turn"]
    assert np.abs(found.torque).max() == pytest.approx(0.5 * most)


def test_steady_friction_is_the_models(tmp_path: Path) -> None:
    """A ramp asks for coulomb + damping v once it is steady."""
    time = np.arange(1500, dtype=np.float64) * PERIOD
    columns = {"position": 0.7 * time, "position_demand": 0.7 * time}
    drive = {"position_gain": 20.0, "velocity_gain": 30.0, "integral_time": 0.05, "servo_period": STEP}
    found = replay(write_model(tmp_path), recording(columns, drive), ())["turn"]
    assert found.torque[-200:] == pytest.approx(COULOMB + DAMPING * 0.7, rel=2e-3)


def test_joints_that_were_not_recorded_stand(tmp_path: Path) -> None:
    """A limp joint beyond the axis, and one with a servo, weigh on it as they stand at qpos0, and follow nothing."""
    beyond = """<body pos="0.4 0 0"><joint name="{0}" axis="0 1 0"/><inertial pos="0.1 0 0" mass="2" diaginertia="0.1 0.1 0.1"/>
</body>"""
    text = write_model(tmp_path, SERVO).read_text(encoding="utf-8")
    loose = text.replace("</body></worldbody>", f"{beyond.format('limp')}{beyond.format('held')}</body></worldbody>")
    loose = loose.replace("</actuator>", '<position name="other" joint="held" kp="5"/></actuator>')
    bolted = beyond.replace('<joint name="{0}" axis="0 1 0"/>', "")
    fixed = text.replace("</body></worldbody>", f"{bolted}{bolted}</body></worldbody>")
    (tmp_path / "loose.xml").write_text(loose.replace('gravity="0 0 0"', 'gravity="0 0 -10"'), encoding="utf-8")
    (tmp_path / "fixed.xml").write_text(fixed, encoding="utf-8")
    told = by_mujoco(tmp_path / "fixed.xml", 500)
    found = replay(tmp_path / "loose.xml", told, ())["turn"]
    assert rms(found.position - told.columns["turn"]["position"]) < 5e-4 * MOVED


def test_a_follower_moves_with_its_axis(tmp_path: Path) -> None:
    """A belt at -2 to a wheel of 0.05 kg·m²: 0.2 kg·m² more on the axis."""
    wheel = '<body><joint name="wheel" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="0.05 0.05 0.05"/></body>'
    belt = '<equality><joint joint1="wheel" joint2="turn" polycoef="0 -2 0 0 0"/></equality></mujoco>'
    text = write_model(tmp_path, SERVO).read_text(encoding="utf-8")
    (tmp_path / "belt.xml").write_text(
        text.replace("</worldbody>", f"{wheel}</worldbody>").replace("</mujoco>", belt), encoding="utf-8"
    )
    told = by_mujoco(write_model(tmp_path, SERVO, inertia=INERTIA + 0.2), 800)
    found = replay(tmp_path / "belt.xml", told, ())["turn"]
    assert rms(found.position - told.columns["turn"]["position"]) < 1e-3 * MOVED


@pytest.mark.parametrize(
    ("columns", "drive", "said"),
    [
        ({"position": np.zeros(50)}, {"law": "pd_position_servo", **GAINS}, "axis turn: no column position_demand"),
        ({"velocity": np.zeros(50)}, {"law": "pd_position_servo", **GAINS}, "no column position: a replay begins where"),
        ({"position": np.zeros(50)}, None, "no loop is known: recording.json has no `drive`"),
        ({"position": np.zeros(50)}, {"law": "unknown"}, "no loop is known"),
        ({"position": np.zeros(50)}, {"law": "pid", "proportional_gain": 3.0}, "law pid needs integral_gain, a number of 0 or"),
        ({"position": np.zeros(50)}, {"position_gain": 3.0}, "a cascade needs position_gain and velocity_gain"),
        ({"position": np.zeros(50)}, {"law": "torque"}, "no column torque"),
        (
            {"position": np.zeros(50), "position_demand": np.full(50, np.nan)},
            {"law": "pd_position_servo", **GAINS},
            "position_demand row 1 is not a number",
        ),
        (
            {"position": np.zeros(500), "position_demand": np.ones(500)},
            {"law": "pd_position_servo", "proportional_gain": 1e18, "derivative_gain": 0.0, "servo_period": 0.01},
            "is unstable at steps of 0.000125 s",
        ),
    ],
)
def test_what_cannot_be_replayed_is_said(
    columns: dict[str, Array], drive: dict[str, Any] | None, said: str, tmp_path: Path
) -> None:
    mujoco.set_mju_user_warning(lambda _message: None)  # of the unstable one it has to warn
    with pytest.raises(UserError, match=said):
        replay(write_model(tmp_path), recording(columns, drive), ())


def test_what_is_wrong_in_a_column_names_the_file_of_the_columns(tmp_path: Path) -> None:
    columns = {"position": np.zeros(50), "torque": np.zeros(50), "position_demand": np.full(50, np.nan)}
    write_recording(recording(columns, {"law": "pd_position_servo", **GAINS}), tmp_path / "swing")
    [read] = read_recording(tmp_path / "swing")
    with pytest.raises(UserError, match=rf"{tmp_path / 'swing' / 'signals.parquet'}: axis turn: position_demand row 1 is not"):
        replay(write_model(tmp_path), read, ())


def test_the_command_writes_figures_signals_and_a_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """replay.json can be recomputed from signals/; the page needs no network."""
    model = write_model(tmp_path, SERVO)
    told = replace(by_mujoco(model, COUNT, 0.0), name="swings")
    write_recording(told, tmp_path / "swings")
    effects = {"schema": "effects/1", "effects": [{"effect": "torque_offset", "axis": "turn", "parameters": OFFSET}]}
    (tmp_path / "effects.json").write_text(json.dumps(effects), encoding="utf-8")
    out = tmp_path / "out"
    words = [str(model), str(tmp_path / "swings"), "--effects", str(tmp_path / "effects.json"), "--out", str(out), "--quiet"]
    monkeypatch.setattr(sys, "argv", ["drivetwin", "replay", *words])
    main()
    report = json.loads((out / "replay.json").read_text(encoding="utf-8"))
    signals = report["recordings"]["swings"]["axes"]["turn"]["signals"]
    assert list(signals) == ["position", "velocity", "acceleration", "torque", "following_error"]
    table = pq.read_table(out / "signals" / "swings.parquet").to_pydict()
    used = np.array(table["turn.used"])
    for run in ("model", "with_effects"):
        apart = (np.array(table["turn.following_error_measured"]) - np.array(table[f"turn.following_error_{run}"]))[used]
        assert signals["following_error"][run]["rms_error"] == pytest.approx(rms(apart))
    assert signals["position"]["with_effects"]["rms_error"] > 10.0 * signals["position"]["model"]["rms_error"]
    assert set(report["inputs"]) >= {str(model), str(tmp_path / "effects.json")}
    page = (out / "replay.html").read_text(encoding="utf-8")
    assert "position actuator turn of the model" in page
    figures = page.partition("Rms apart")[2].partition("</table>")[0]
    rms_error = signals["position"]["with_effects"]["rms_error"]
    assert rms_error < 0.1
    assert "<td>position</td><td>mrad</td>" in figures
    assert f">{1e3 * rms_error:.3g}</td>" in figures
    picture = page.partition("<h2>Machine</h2>")[2].partition("</section>")[0]
    assert "</svg>" in picture
    assert ">turn</text>" in picture
    assert "http://" not in page.split("<script id=")[0]


OFFSET = {"offset": {"value": 2.0, "unit": "N·m"}}


def test_an_axis_at_rest_has_no_row_because_its_noise_is_all_there_is_to_relate_to(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """replay.json contains it; the table and the page relate differences to motion only."""
    model = write_model(tmp_path, SERVO)
    moving = by_mujoco(model, COUNT)
    still = {name: np.zeros(COUNT) for name in ("position", "torque", "position_demand")}
    still["position"] = still["position"] + 1e-6 * np.sin(np.arange(COUNT))
    for name, told in (("swings", moving), ("rests", recording(still))):
        write_recording(replace(told, name=name), tmp_path / name)
    words = [str(model), str(tmp_path / "swings"), str(tmp_path / "rests"), "--out", str(tmp_path / "out")]
    monkeypatch.setattr(sys, "argv", ["drivetwin", "replay", *words])
    main()
    said, page = capsys.readouterr().out, (tmp_path / "out" / "replay.html").read_text(encoding="utf-8")
    table = page.partition("How far apart")[2].partition("</section>")[0]
    for shown in (said.partition("Axes at rest")[0], table.partition("Axes at rest")[0]):
        assert "swings" in shown
        assert "rests" not in shown
    assert "Axes at rest in a recording are not shown" in said
    report = json.loads((tmp_path / "out" / "replay.json").read_text(encoding="utf-8"))
    assert list(report["recordings"]) == ["swings", "rests"]


def test_an_input_that_is_refused_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write_recording(recording({"position": np.zeros(100), "torque": np.zeros(100)}), tmp_path / "still")
    words = [str(write_model(tmp_path)), str(tmp_path / "still"), "--out", str(tmp_path / "out")]
    monkeypatch.setattr(sys, "argv", ["drivetwin", "replay", *words])
    with pytest.raises(SystemExit, match="2"):
        main()
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "no loop is known" in err
    assert not (tmp_path / "out").exists()
