"""A machine made of a model: what it takes from the model, and that it runs."""

from __future__ import annotations

import json
from math import pi
from pathlib import Path

import mujoco
import pytest
from new_machine_bench import PEAK_Z, ROTOR_Z, gantry, run

from drivetwin.controller.machine import load_machine
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine as load_virtual_machine
from drivetwin.emulator.plant import Plant
from drivetwin.hil_tests.bench import read_bench
from drivetwin.hil_tests.suite import CASES, find_cases


def test_both_halves_are_of_the_model(made: Path) -> None:
    virtual, known = load_virtual_machine(str(made)), load_machine(str(made / "machine.yaml"))
    assert virtual.machine == known.machine == "gantry"
    assert {name: axis.node_id for name, axis in virtual.axes.items()} == {"x": 1, "z": 2}
    assert virtual.axes["x"].gear_ratio == pytest.approx(2.0 * pi / 0.02)
    assert known.axes["x"].gear_ratio == pytest.approx(2.0 * pi / 0.02)
    assert known.axes["z"].feed == 0.01
    assert known.axes["x"].travel == pytest.approx((-0.276, 0.276))
    assert virtual.axes["x"].limit_switches.negative == pytest.approx(-0.294)
    assert known.axes["x"].motor_inertia == pytest.approx(12.0 / (2.0 * pi / 0.02) ** 2)
    assert known.groups == (("x",), ("z",))


def test_loops_torque_and_brake_are_by_what_hangs_on_the_axis(made: Path) -> None:
    """x moves 12 + 46 kg; z 6 kg, which weigh 6 x 9.81 N, and the rotor of a motor that bears twice that and the friction."""
    virtual = load_virtual_machine(str(made))
    x, z = virtual.axes["x"], virtual.axes["z"]
    assert x.loops.velocity_gain == pytest.approx(2.0 * pi * 15.0 * 58.0, rel=1e-3)
    assert z.loops.velocity_gain == pytest.approx(2.0 * pi * 15.0 * (6.0 + ROTOR_Z), rel=1e-3)
    assert x.motor.holding_brake == 0.0
    assert z.motor.holding_brake * z.gear_ratio == pytest.approx(1.5 * 6.0 * 9.81, rel=1e-3)
    assert z.motor.peak_torque * z.gear_ratio == pytest.approx(PEAK_Z, rel=1e-3)


def test_the_plant_has_the_models_friction_and_inertia(made: Path) -> None:
    virtual = load_virtual_machine(str(made))
    truth = Plant(virtual, read_effects(virtual.effects_path)).truth()
    assert (truth["x"]["coulomb"], truth["x"]["viscous"], truth["z"]["coulomb"]) == (30.0, 90.0, 8.0)
    assert truth["x"]["inertia"] == pytest.approx(58.0)
    assert truth["z"]["inertia"] == pytest.approx(6.0 + ROTOR_Z)


def test_what_was_assumed_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    run(monkeypatch, "machine", "new", gantry(tmp_path, z=""), "--out", tmp_path / "made")
    said = capsys.readouterr().out
    for line in (
        "z: travel -0.25 to 0.25 m, for",
        "z: armature 0.962 kg, the rotor of a motor of its torque",
        "z: a screw of 10 mm a turn",
        "x: speed 0.5 m/s, acceleration 3.33 m/s²; velocity loop of 15 Hz",
    ):
        assert f"assumed: {line}" in said
        assert f"# {line}" in (tmp_path / "made/machine.yaml").read_text(encoding="utf-8")
    assert "x: armature" not in said
    (row,) = [line.replace("│", " ") for line in said.splitlines() if line.replace("│", " ").split()[:3] == ["x", "1", "x"]]
    assert "314.2 rad/m" in row
    assert "0.5 m/s" in row


def test_an_actuators_force_is_the_motors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run(monkeypatch, "machine", "new", gantry(tmp_path, 'forcerange="-100 100"'), "--out", tmp_path / "made", "-q")
    axis = load_virtual_machine(str(tmp_path / "made")).axes["z"]
    assert axis.motor.peak_torque * axis.gear_ratio == pytest.approx(100.0, rel=1e-3)


def test_homing_stops_before_the_mechanical_end(made: Path) -> None:
    """A limit switch is 1 % of the room before the end; at the speed of the search an axis stops within half of that."""
    for axis, room in zip(load_machine(str(made)).axes.values(), (0.6, 0.2), strict=True):
        homing = axis.homing
        assert homing.search_speed**2 / (2.0 * homing.acceleration) < 0.00501 * room


def test_its_bench_runs_every_case_in_limits_of_the_machine(made: Path) -> None:
    """All but the one of the wall clock; an axis may follow as far behind as a loop of 15 Hz without integral does."""
    bench = read_bench(made / "bench.yaml")
    assert bench.machine_place == str(made.resolve())
    skipped = [case.identity for case in find_cases(bench, [CASES], ()) if case.skipped_because is not None]
    assert skipped == ["09_bus.sync_jitter"]
    (single,) = find_cases(bench, [CASES], ["04_moves.single"])
    to = {move["axis"]: move["to"] for move in single.task.parameters["moves"]}
    assert -0.276 < to["x"] < 0.276
    axis = load_virtual_machine(str(made)).axes["x"]
    behind = (load_machine(str(made)).axes["x"].max_acceleration + 30.0 / 58.0) / (2.0 * pi * 15.0 * axis.loops.position_gain)
    told = bench.limit("tracking_error")
    assert isinstance(told, dict)
    assert told["x"] == pytest.approx(2.0 * behind, rel=1e-2)


def test_it_is_identified_over_the_bus(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Brought up, homed, moved and fitted as any machine: within 2 % of what model.xml says."""
    assert run(monkeypatch, "identify", "--machine", made, "--out", tmp_path / "found", "--quiet") == 0
    found = json.loads((tmp_path / "found/identified.json").read_text(encoding="utf-8"))["axes"]
    values = {name: {key: one["value"] for key, one in axis["parameters"].items()} for name, axis in found.items()}
    assert values["x"]["inertia"] == pytest.approx(58.0, rel=0.02)
    assert values["x"]["coulomb"] == pytest.approx(30.0, rel=0.02)
    assert values["x"]["viscous"] == pytest.approx(90.0, rel=0.02)
    assert values["z"]["inertia"] == pytest.approx(6.0 + ROTOR_Z, rel=0.02)
    assert values["z"]["coulomb"] == pytest.approx(8.0, rel=0.02)


def test_a_name_is_still_a_name(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A folder `stage` here does not hide the built-in machine of that name."""
    (tmp_path / "stage").mkdir()
    monkeypatch.chdir(tmp_path)
    assert load_virtual_machine("stage").built_in
    assert load_machine("stage").axes_path.name == "axes.yaml"
    assert mujoco.MjModel.from_xml_path(str(load_machine("stage").model_path)).nv == 1


def test_a_load_is_by_the_last_body_that_has_a_mass(tmp_path: Path) -> None:
    """A frame at the tool, without any, is no reason to move a load of nothing."""
    path = gantry(tmp_path)
    text = path.read_text(encoding="utf-8").replace(
        'diaginertia="1 1 1"/>\n</body>', 'diaginertia="1 1 1"/><body name="tool"/>\n</body>'
    )
    path.write_text(text, encoding="utf-8")
    assert 'name="tool"' in text
    with pytest.MonkeyPatch.context() as patch:
        assert run(patch, "machine", "new", path, "--out", tmp_path / "made", "--quiet") == 0
    assert read_bench(tmp_path / "made/bench.yaml").limit("payload") == pytest.approx(0.3 * 6.0)
