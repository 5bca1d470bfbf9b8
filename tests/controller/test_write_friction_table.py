"""Identified friction in a drive's own table: the closest table, as the drive reads it, and what it is worth on a move."""

from __future__ import annotations

import json
import re
import signal
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import astuple, dataclass, replace
from math import pi
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import Bounds, differential_evolution
from virtual_bench import VirtualBench

from drivetwin.controller.excitation import SPEED_LEVELS, excitation, strokes
from drivetwin.controller.friction_precontrol import Planned, check_drive_type, plan, read_points, write_friction
from drivetwin.controller.friction_table import UNUSED, friction_table
from drivetwin.controller.link import PumpedSdoClient
from drivetwin.controller.machine import load_machine
from drivetwin.controller.pacing import Lockstep
from drivetwin.controller.procedure import FIT
from drivetwin.controller.progress import Progress
from drivetwin.controller.session import Session, session_on
from drivetwin.controller.trajectory import stroke
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.drive.torque_precontrol import TorquePrecontrol
from drivetwin.foundation.errors import InterruptedByUserError, UserError
from drivetwin.identification import identify, load_model
from drivetwin.identification.friction_law import FrictionLaw
from drivetwin.identification.read import read_friction

LINE = FrictionLaw(coulomb=1.9, viscous=1.15)
STRIBECK = replace(LINE, static_rise=0.6, stribeck_velocity=0.05)
ROTATE = load_machine("scara").axes["rotate"]


@dataclass(frozen=True)
class Move:
    """A stroke of two radians: top speed [rad/s], acceleration [rad/s²], and what the table has to make of its peak error."""

    speed: float
    acceleration: float
    least_factor: float


MOVES = (Move(2.5, 6.0, least_factor=5.0), Move(0.75, 6.0, least_factor=2.5), Move(2.5, 20.0, least_factor=1.3))


def amount(law: FrictionLaw, speed: np.ndarray) -> np.ndarray:
    """Closed form of the symmetric law [N·m]."""
    level = law.coulomb + law.viscous * speed
    if law.stribeck_velocity is not None:
        level = level + law.static_rise * np.exp(-((speed / law.stribeck_velocity) ** law.stribeck_exponent))
    return np.asarray(level)


@pytest.mark.parametrize(
    ("axis", "law", "rpm", "per_cent"),
    [
        ("rotate", LINE, 2.5 * 50.0 / (2.0 * pi) * 60.0, [100.0 * level / 50.0 / 0.4 for level in (1.9, 3.3375, 4.775)]),
        (
            "lift",
            FrictionLaw(coulomb=31.0, viscous=165.0, offset=75.0),
            0.25 / 0.010 * 60.0,
            [100.0 * level / (2.0 * pi / 0.010) / 1.27 for level in (31.0, 51.625, 72.25)],
        ),
    ],
)
def test_per_cent_and_rpm_of_a_straight_law(axis: str, law: FrictionLaw, rpm: float, per_cent: list[float]) -> None:
    """Gear 1:50 and 0.4 N·m; a screw of 10 mm a turn and 1.27 N·m. A load (offset) is left out, a constant torque stays."""
    bench = VirtualBench("scara")
    number = list(bench.machine.axes).index(axis)
    drive, dictionary = bench.drives[number], bench.virtual.drives[number].dictionary
    for entry in range(1, 6):
        drive.write(7.0, 0x2182, entry)
    drive.write(3.0, 0x2184)
    change = plan(drive, law)
    write_friction([Planned(drive, change)])
    assert [dictionary[0x2182, entry].value for entry in range(1, 6)] == pytest.approx([*per_cent, 0.0, 0.0])
    speeds = [dictionary[0x2183, entry].value for entry in range(1, 6)]
    assert speeds == pytest.approx([0.0, 0.5 * rpm, rpm, 0.0, 0.0])
    assert dictionary[0x2184].value == 3.0
    assert change.table.deviation < 1e-6 * law.coulomb


@pytest.mark.parametrize(("velocity", "exponent"), [(0.05, 2.0), (0.05, 1.0), (0.05, 4.0), (0.5, 2.0)])
def test_no_other_three_points_are_closer(velocity: float, exponent: float) -> None:
    """A global search over all five free numbers, another method than the table's, finds nothing better."""
    law = replace(STRIBECK, stribeck_velocity=velocity, stribeck_exponent=exponent)
    speed = np.concatenate([np.geomspace(1e-3 * velocity, ROTATE.max_speed, 400), np.linspace(0.01, ROTATE.max_speed, 100)])

    def worst(shape: np.ndarray) -> float:
        first, middle = np.sort(np.exp(shape[:2]))
        compared = np.append(speed, [first, middle])
        return float(np.abs(np.interp(compared, [first, middle, ROTATE.max_speed], shape[2:]) - amount(law, compared)).max())

    bounds = Bounds([np.log(0.02 * velocity)] * 2 + [1.0] * 3, [np.log(ROTATE.max_speed)] * 2 + [6.0] * 3)
    found = differential_evolution(worst, bounds, rng=0, maxiter=600)
    table = friction_table(law, ROTATE)
    assert table.deviation < 1.005 * found.fun
    assert table.points[3:] == (UNUSED, UNUSED)


def test_the_drive_reads_the_table_as_it_was_meant() -> None:
    """The virtual drive's own torque over speed, held against the closed form: no further off than the table says."""
    bench = VirtualBench("scara")
    drive, virtual = bench.drives[1], bench.virtual.drives[1]
    change = plan(drive, STRIBECK)
    assert change.before == (UNUSED,) * 5
    write_friction([Planned(drive, change)])
    for written, meant in zip(read_points(drive), change.table.points, strict=True):
        assert (written.speed, written.torque) == pytest.approx((meant.speed, meant.torque), rel=1e-6)
    speed = np.concatenate([np.geomspace(1e-5, 2.5, 3000), np.linspace(0.001, 2.5, 1000)])
    given = np.array([TorquePrecontrol(virtual.axis).friction(np.full(2, one * 50.0))[-1] for one in speed]) * 50.0
    assert np.abs(given - amount(STRIBECK, speed)).max() == pytest.approx(change.table.deviation, rel=0.01)
    assert change.table.deviation < 0.05 * STRIBECK.static_rise


def test_what_differs_by_direction_is_a_deviation() -> None:
    law = replace(LINE, viscous_difference=-0.2, offset=4.0)
    assert friction_table(law, ROTATE).deviation == pytest.approx(0.2 * ROTATE.max_speed)


def file_of(folder: Path, axis: Mapping[str, object]) -> Path:
    """An identified.json of one axis, slide."""
    path = folder / "identified.json"
    axes = {"slide": {"joint": "slide", **axis}}
    path.write_text(json.dumps({"schema": "identified/1", "machine": "stage", "axes": axes}))
    return path


def in_units(values: Mapping[str, float]) -> dict[str, dict[str, object]]:
    """Parameters as the file has them; nobody reads the unit here."""
    return {name: {"value": value, "unit": "SI"} for name, value in values.items()}


def test_the_law_by_direction_is_read_where_it_is_real(tmp_path: Path) -> None:
    """20.6 + 170 v forwards, 20.2 + 240 v backwards; the symmetric fit beside it is a compromise, and left alone."""
    values = {"coulomb": 21.0, "viscous": 201.0, "offset": -3.0, "coulomb_positive": 20.6, "coulomb_negative": 20.2}
    values |= {"viscous_positive": 170.0, "viscous_negative": 240.0}
    axis = {"parameters": in_units(values), "direction": {"real": True}}
    speed = np.array([0.01, 0.1])
    law = read_friction(file_of(tmp_path, axis)).law("slide")
    assert law.torque(speed) == pytest.approx(20.6 + 170.0 * speed)
    assert law.torque(-speed) == pytest.approx(-20.2 - 240.0 * speed)


@pytest.mark.parametrize(
    ("extra", "real", "message"),
    [
        ({}, True, "no coulomb_positive and no coulomb_negative and no viscous_positive and no viscous_negative"),
        ({"coulomb_positive": 2.0, "coulomb_negative": 2.0, "viscous_positive": 1.0}, True, "no viscous_negative"),
        ({"static_torque": 3.0}, False, "no stribeck_velocity"),
        ({"stribeck_velocity": 0.1}, False, "no static_torque"),
    ],
)
def test_a_file_that_lacks_part_of_its_law_is_refused(
    tmp_path: Path, extra: dict[str, float], real: bool, message: str
) -> None:
    parameters = in_units({"coulomb": 2.0, "viscous": 1.0} | extra)
    path = file_of(tmp_path, {"parameters": parameters, "direction": {"real": real}})
    with pytest.raises(UserError, match=rf"{re.escape(str(path))}: axis slide has {message}(?! and)"):
        read_friction(path)


# -- refused --------------------------------------------------------------------------------------------------------------


def test_a_drive_type_without_a_table() -> None:
    bench = VirtualBench("scara", "cia402-full")
    sent = len(bench.sent)
    with pytest.raises(UserError, match="drives of type cia402-full have no friction table"):
        plan(bench.drives[1], LINE)
    with pytest.raises(UserError, match="drives of type dryve_d1 have no friction table"):
        check_drive_type(load_profile("dryve_d1"))
    assert len(bench.sent) == sent


def test_a_drive_of_another_vendor() -> None:
    bench = VirtualBench("scara")
    bench.drives[1].profile = replace(bench.profile, vendor_id=0x99)
    with pytest.raises(UserError, match=r"axis rotate \(node 2\) is a device of vendor 16h, and a servoone is of vendor 99h"):
        plan(bench.drives[1], LINE)


def test_a_drive_with_voltage_on() -> None:
    bench = VirtualBench("scara").up()
    change = plan(bench.drives[1], LINE)
    for word in (0x06, 0x07, 0x0F):
        bench.drives[1].controlword = word
        bench.cycle.run()
        bench.cycle.run()
        with pytest.raises(UserError, match=r"axis rotate .* may have voltage on .* take the voltage off first"):
            plan(bench.drives[1], LINE)
        with pytest.raises(UserError, match="may have voltage on"):
            write_friction([Planned(bench.drives[1], change)])
    assert read_points(bench.drives[1]) == (UNUSED,) * 5


def test_friction_that_is_none() -> None:
    with pytest.raises(UserError, match=r"friction of joint rotate would be -0\.1 at 2\.5 .*friction brakes at every speed"):
        friction_table(FrictionLaw(coulomb=1.9, viscous=-0.8), ROTATE)


def test_friction_beyond_the_drives_torque() -> None:
    """1.2 N·m of the motor at most: 60 N·m of the joint."""
    bench = VirtualBench("scara")
    plan(bench.drives[1], FrictionLaw(coulomb=59.9))
    with pytest.raises(UserError, match=r"takes 1\.202 N·m of the motor, and the drive gives 1\.2 N·m \(6072h\)"):
        plan(bench.drives[1], FrictionLaw(coulomb=60.1))


def test_a_value_beyond_the_objects_range() -> None:
    bench = VirtualBench("scara")
    limited = tuple(replace(one, high=23.0) if one.index == 0x2182 and one.subindex else one for one in bench.profile.objects)
    bench.drives[1].profile = replace(bench.profile, objects=limited)
    plan(bench.drives[1], replace(LINE, viscous=0.5))
    with pytest.raises(UserError, match=r"axis rotate .*: 24\.5 is outside the range of 2182h:03, -inf to 23"):
        plan(bench.drives[1], replace(LINE, viscous=1.2))


# -- ended early ----------------------------------------------------------------------------------------------------------


OLD = FrictionLaw(coulomb=1.0, viscous=0.3)


def with_old_tables() -> tuple[VirtualBench, list[Planned]]:
    """A bench whose lift and rotate have a table already, and what is planned to take its place."""
    bench = VirtualBench("scara")
    drives = bench.drives[:2]
    write_friction([Planned(drive, plan(drive, OLD)) for drive in drives])
    return bench, [Planned(drive, plan(drive, LINE)) for drive in drives]


def tables(bench: VirtualBench) -> list[list[float]]:
    """What the drives of lift and rotate hold, from inside: torques [per cent], then speeds [rpm]."""
    return [
        [float(drive.dictionary[index, entry].value) for index in (0x2182, 0x2183) for entry in range(1, 6)]
        for drive in bench.virtual.drives[:2]
    ]


def test_a_drive_that_refuses_in_the_middle_leaves_every_table_as_it_was() -> None:
    bench, planned = with_old_tables()
    before = tables(bench)

    def refuse(_value: object) -> None:
        raise SdoAbort(AbortCode.VALUE_TOO_HIGH)

    bench.virtual.drives[1].dictionary[0x2182, 2].on_write = refuse
    back = r"to 2182h:02 was aborted .*; the former friction table of axis lift \(node 1\), axis rotate \(node 2\) is back"
    with pytest.raises(UserError, match=back) as error:
        write_friction(planned)
    assert "NOT" not in str(error.value)
    assert tables(bench) == before


@pytest.mark.parametrize("entry", [(0, 0x2182, 1), (0, 0x2183, 3), (1, 0x2182, 2), (1, 0x2183, 5)])
def test_ctrl_c_in_the_middle_leaves_every_table_as_it_was(entry: tuple[int, int, int]) -> None:
    bench, planned = with_old_tables()
    before = tables(bench)
    number, index, subindex = entry
    pressed: list[object] = []

    def press(value: object) -> None:
        if not pressed:
            signal.raise_signal(signal.SIGINT)
        pressed.append(value)

    bench.virtual.drives[number].dictionary[index, subindex].on_write = press
    back = r"^interrupted; the former friction table of axis lift .* is back$"
    with bench.link, pytest.raises(InterruptedByUserError, match=back):
        write_friction(planned)
    assert pressed
    assert tables(bench) == before


def test_a_drive_that_falls_silent_is_named_and_the_others_are_put_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(PumpedSdoClient, "RESPONSE_TIMEOUT", 0.02)
    bench, planned = with_old_tables()
    before = tables(bench)
    bench.virtual.drives[1].dictionary[0x2182, 2].on_write = lambda _value: bench.silent.add(2)
    with pytest.raises(UserError) as error:
        write_friction(planned)
    ended, back, doubtful = str(error.value).split("; ")
    assert ended.startswith("axis rotate (node 2) does not answer")
    assert back == "the former friction table of axis lift (node 1) is back"
    assert doubtful.startswith("NOT KNOWN TO BE BACK: axis rotate (node 2)")
    assert tables(bench)[0] == before[0]


def test_whatever_else_ends_it_says_what_became_of_the_tables() -> None:
    bench, planned = with_old_tables()
    before = tables(bench)

    def fail(_message: object) -> None:
        if tables(bench)[1] != before[1]:
            bench.link.log = None
            raise OSError("no space left for the log")

    bench.link.log = fail
    with pytest.raises(OSError, match="no space left") as error:
        write_friction(planned)
    assert error.value.__notes__ == ["the former friction table of axis lift (node 1), axis rotate (node 2) is back"]
    assert tables(bench) == before


def test_voltage_on_one_drive_leaves_all_as_they_are() -> None:
    bench, planned = with_old_tables()
    before = tables(bench)
    bench.up()
    bench.drives[1].controlword = 0x06
    bench.cycle.run()
    bench.cycle.run()
    with pytest.raises(UserError, match=r"axis rotate .* may have voltage on"):
        write_friction(planned)
    assert tables(bench) == before


# -- the circle, through the bus ------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Circle:
    """What came of one virtual SCARA whose rotation was identified, given its table, and moved before and after."""

    identified: FrictionLaw
    read: FrictionLaw
    truth: Mapping[str, float]
    deviation: float
    before: dict[Move, float]
    after: dict[Move, float]


@pytest.fixture(scope="module")
def circle(tmp_path_factory: pytest.TempPathFactory) -> Circle:
    """Identify by strokes and an exciting move, as `drivetwin identify`; write the table with voltage off; move again."""
    folder = tmp_path_factory.mktemp("circle")
    bench = VirtualBench("scara")
    with session(bench, folder) as running:
        before = {move: peak_error(running, move) for move in MOVES}
        period = running.cycle.period
        running.go_to({"rotate": 0.0})
        paths = {"strokes": strokes(ROTATE, SPEED_LEVELS, period), "exciting": excitation(ROTATE, 0, period)}
        recordings = [running.capture(name, {"rotate": path}) for name, path in paths.items()]
    found = identify(load_model(bench.machine.model_path), recordings, (), FIT)
    (folder / "identified.json").write_text(json.dumps(found.to_json()), encoding="utf-8")
    law = read_friction(folder / "identified.json").law("rotate")
    change = plan(bench.drives[1], law)
    write_friction([Planned(bench.drives[1], change)])
    with session(bench, folder) as running:
        after = {move: peak_error(running, move) for move in MOVES}
    truth = bench.virtual.plant.truth()["rotate"]
    return Circle(found.axes["rotate"].law, law, truth, change.table.deviation, before, after)


def session(bench: VirtualBench, folder: Path) -> AbstractContextManager[Session]:
    """The bench's machine homed and streaming."""
    return session_on(bench.bus, bench.machine, bench.profile, Lockstep(), None, Progress(), folder / "bus.log")


def peak_error(running: Session, move: Move) -> float:
    """Greatest following error [rad] in the second of two strokes there and back, by what came over the bus."""
    there = stroke(-1.0, 1.0, move.speed, move.acceleration, running.cycle.period)
    pause = np.full(100, 1.0)
    repetition = np.concatenate([there, pause, there[::-1], -pause])
    running.go_to({"rotate": -1.0})
    columns = running.capture("there and back", {"rotate": np.tile(repetition, 2)}).columns["rotate"]
    return float(np.abs(columns["position_demand"] - columns["position"])[len(repetition) :].max())


def test_the_file_says_what_was_identified(circle: Circle) -> None:
    assert astuple(circle.read) == pytest.approx(astuple(circle.identified))


def test_identified_friction_is_the_plants(circle: Circle) -> None:
    assert circle.read.coulomb == pytest.approx(circle.truth["coulomb"], rel=0.01)
    assert circle.read.viscous == pytest.approx(circle.truth["viscous"], rel=0.01)
    assert circle.read.coulomb + circle.read.static_rise == pytest.approx(circle.truth["static_torque"], rel=0.01)


@pytest.mark.parametrize("move", MOVES)
def test_the_table_lowers_the_peak_following_error(circle: Circle, move: Move) -> None:
    """What remains is inertia, which the table knows nothing of: the more, the harder the axis accelerates."""
    factor = circle.before[move] / circle.after[move]
    print(f"{move}: {circle.before[move]:.3g} rad without, {circle.after[move]:.3g} rad with the table: {factor:.2f}")
    assert factor > move.least_factor


@pytest.mark.parametrize(
    ("name", "value", "complaint"),
    [
        ("stribeck_velocity", 0.0, "stribeck_velocity is 0, expected 1e-09 to 1e"),
        ("stribeck_velocity", -0.05, "stribeck_velocity is -0.05"),
        ("stribeck_exponent", 0.0, "stribeck_exponent is 0, expected 0.1 to 10"),
        ("coulomb", 1e308, "axes.rotate.parameters.coulomb.value: Input should be less than or equal to 1000000000"),
    ],
)
def test_values_that_no_machine_has(name: str, value: float, complaint: str, tmp_path: Path) -> None:
    values = {"coulomb": 1.9, "viscous": 1.15, "static_torque": 2.4, "stribeck_velocity": 0.05} | {name: value}
    axis = {"joint": "rotate", "parameters": in_units(values)}
    payload = {"schema": "identified/1", "machine": "scara", "axes": {"rotate": axis}}
    (tmp_path / "identified.json").write_text(json.dumps(payload))
    with pytest.raises(UserError) as refused:
        read_friction(tmp_path / "identified.json")
    assert complaint in str(refused.value)


def test_no_friction_at_all_is_no_table() -> None:
    with pytest.raises(UserError, match="friction brakes at every speed"):
        friction_table(FrictionLaw(), ROTATE)
