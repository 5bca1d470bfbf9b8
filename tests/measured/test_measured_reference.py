"""The reference least squares: on machines made by formula, and on the measured ones against what was published of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from measured.cases import Case, read_cases
from measured.columns import OFFSET, Choice, gap_share, stribeck_choices, waves
from measured.motion import Band, read_motion
from measured.recipes import FRICTION, NO_CHOICE, RECIPES, RIGID, Recipe
from measured.reference import Reference, fit, reference
from measured.run import Place, import_inputs
from measured_bench import MODEL, rigid, swing, write_prediction, write_recording

from drivetwin.foundation.errors import UserError

DATA = Path(__file__).resolve().parents[2].parent / "shared" / "data"
BAND = Band(40.0, 0.3)
ORDER, SIZE = 8.0, 0.2


@pytest.fixture
def model(tmp_path: Path) -> Path:
    file = tmp_path / "nominal.xml"
    file.write_text(MODEL, encoding="utf-8")
    return file


def rippled(folder: Path, phase: float, ripple_phase: float = 0.7) -> Path:
    """A recording of the machine as the model has it, and a ripple of eight waves a turn."""
    time, position, velocity, acceleration = swing(phase=phase)
    torque = rigid(velocity, acceleration) + SIZE * np.sin(ORDER * position + ripple_phase)
    return write_recording(folder, time, position, torque)


def test_what_is_lacking_is_the_gap_before_and_nothing_is_left(tmp_path: Path, model: Path) -> None:
    training, validation = rippled(tmp_path / "train", 0.0), rippled(tmp_path / "validate", 0.4)
    found = reference(Recipe(BAND, (*RIGID, *waves(ORDER))), model, [training], [validation], BAND, None)
    motion = read_motion(validation, BAND)
    ripple = SIZE * np.sin(ORDER * motion.raw + 0.7)[motion.fitted]
    assert found.before == pytest.approx(np.sqrt(np.mean(ripple**2)), rel=0.01)
    assert found.after < 0.01 * found.before
    assert found.closed > 0.9999
    assert found.carried == found.after
    assert found.fitted == "inertia, coulomb, viscous, order 8"


def test_orders_that_are_not_there_close_nothing(tmp_path: Path, model: Path) -> None:
    training, validation = rippled(tmp_path / "train", 0.0), rippled(tmp_path / "validate", 0.4)
    found = reference(Recipe(BAND, (*RIGID, *waves(5.3))), model, [training], [validation], BAND, None)
    assert abs(found.closed) < 0.1


def test_a_phase_of_its_own_in_every_recording_is_fitted_there_and_not_carried(tmp_path: Path, model: Path) -> None:
    training, validation = rippled(tmp_path / "train", 0.0), rippled(tmp_path / "validate", 0.4, ripple_phase=3.0)
    found = reference(Recipe(BAND, RIGID, within_file=waves(ORDER)), model, [training], [validation], BAND, None)
    assert found.closed > 0.95
    assert found.closed_carried < 0.1
    assert found.within_file == "order 8"


def test_gap_and_samples_are_those_of_the_prediction(tmp_path: Path, model: Path) -> None:
    training, validation = rippled(tmp_path / "train", 0.0), rippled(tmp_path / "validate", 0.4)
    motion = read_motion(validation, BAND)
    used = np.zeros(len(motion.raw), dtype=np.bool_)
    used[3000:7000] = motion.fitted[3000:7000]
    flat = np.zeros(len(motion.raw))
    torque = motion.torque
    write_prediction(tmp_path / "prediction" / "validate.parquet", torque - 2.0, torque - 0.5, torque, used)
    write_prediction(tmp_path / "short" / "validate.parquet", flat[1:], flat[1:], flat[1:], used[1:])
    recipe = Recipe(BAND, (*RIGID, *waves(ORDER)))
    found = reference(recipe, model, [training], [validation], BAND, tmp_path / "prediction")
    assert (found.before, found.diagnosed) == pytest.approx((2.0, 0.5))
    assert found.torque == pytest.approx(np.sqrt(np.mean(motion.torque[used] ** 2)))
    assert found.after < 0.01
    with pytest.raises(UserError, match=r"validate\.parquet is missing"):
        reference(recipe, model, [training], [validation], BAND, tmp_path)
    with pytest.raises(UserError, match="has 9999 rows, its recording 10000"):
        reference(recipe, model, [training], [validation], BAND, tmp_path / "short")


def test_a_stribeck_curve_that_has_faded_at_the_slowest_speed_is_not_fitted(tmp_path: Path) -> None:
    """A carriage that never moves below 0.2 rad/s, and stands a little off at its slowest: an extrapolation would explode."""
    time = np.arange(0.0, 10.0, 1e-3)
    speed = 0.6 + 0.4 * np.sin(1.1 * time)
    position = np.concatenate(([0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1])) * 1e-3))
    torque = 0.5 + 0.1 * speed + 0.3 * np.exp(-((speed / 0.5) ** 2)) + 1e-3 * np.exp(-(((speed - 0.2) / 1e-3) ** 2))
    motion = read_motion(write_recording(tmp_path / "slow", time, position, torque), Band(40.0, 0.1))
    choice, _ = fit(FRICTION, stribeck_choices(0.01, 10.0), [motion])
    (column,) = choice.columns
    assert np.abs(column.of(motion)[motion.fitted]).max() >= 0.05
    with pytest.raises(ValueError, match="empty"):
        fit(FRICTION, stribeck_choices(1e-3, 1e-2), [motion])


def test_what_the_reference_closes_does_not_depend_on_when_a_diagnosis_reads_the_torque(tmp_path: Path, model: Path) -> None:
    training, validation = rippled(tmp_path / "train", 0.0), rippled(tmp_path / "validate", 0.4)
    motion = read_motion(validation, BAND)
    modelled = rigid(motion.velocity, motion.acceleration)
    recipe, found = Recipe(BAND, (*RIGID, *waves(ORDER))), []
    for earlier in (0, 5):
        read = np.roll(motion.torque, -earlier)
        write_prediction(tmp_path / f"{earlier}" / "validate.parquet", modelled, read, read, motion.fitted)
        found.append(reference(recipe, model, [training], [validation], BAND, tmp_path / f"{earlier}"))
    assert found[1].before != pytest.approx(found[0].before, rel=0.01)
    assert (found[1].recorded, found[1].closed) == (found[0].recorded, found[0].closed)


def test_recordings_weigh_by_their_duration(tmp_path: Path, model: Path) -> None:
    training = rippled(tmp_path / "train", 0.0)
    predictions, validation, errors = tmp_path / "prediction", [], {"long": (1.0, 1), "coarse": (3.0, 4)}
    for name, (error, stride) in errors.items():
        time, position, velocity, acceleration = (each[::stride] for each in swing(8.0))
        validation.append(write_recording(tmp_path / name, time, position, rigid(velocity, acceleration)))
        zero = np.zeros(len(time))
        write_prediction(predictions / f"{name}.parquet", zero, zero, zero + error, np.ones(len(time), dtype=np.bool_))
    found = reference(Recipe(BAND, RIGID), model, [training], validation, BAND, predictions)
    assert found.before == pytest.approx(np.sqrt((1.0**2 + 3.0**2) / 2.0))  # eight seconds each, whatever the rate


def test_friction_is_not_negative(tmp_path: Path) -> None:
    time, position, velocity, acceleration = swing()
    motion = read_motion(write_recording(tmp_path / "odd", time, position, 0.02 * acceleration - 0.5 * np.sign(velocity)), BAND)
    _, parameters = fit(RIGID, NO_CHOICE, [motion])
    assert parameters == pytest.approx([0.02, 0.0, 0.0], abs=0.005)


def test_the_stribeck_velocity_is_found_among_the_choices(tmp_path: Path) -> None:
    time, position, velocity, _ = swing(amplitude=1.0)
    level = 1.0 + 0.5 * np.exp(-((np.abs(velocity) / 0.8) ** 2.0)) + 0.2 * np.abs(velocity)
    motion = read_motion(write_recording(tmp_path / "slow", time, position, level * np.sign(velocity)), BAND)
    near = tuple(each for each in stribeck_choices(0.8 / 4.0, 0.8 * 4.0) if "exponent 0.5" not in each.name)
    choice, parameters = fit((*FRICTION, OFFSET), near, [motion])
    assert isinstance(choice, Choice)
    assert choice.name == "v_s 0.8 rad/s, exponent 2"
    assert parameters == pytest.approx([1.0, 0.2, 0.0, 0.5], abs=0.02)


def test_force_through_a_gap_over_a_stroke_and_back() -> None:
    out = np.linspace(0.0, 0.020, 2001)
    share = gap_share(np.concatenate([out, out[::-1]]), gap=0.004, flank=0.002)
    there, back = share[:2001], share[2001:]
    expected = np.clip((out - 0.002) / 0.002, 0.0, 1.0)
    assert there == pytest.approx(expected, abs=1e-9)
    travelled = 0.020 - out[::-1]
    falls = np.interp(travelled, [0.0, 0.002, 0.006, 0.008, 0.020], [1.0, 0.0, 0.0, -1.0, -1.0])
    assert back == pytest.approx(falls, abs=1e-9)


def test_a_weight_is_in_the_simulation_as_it_stands(tmp_path: Path) -> None:
    time, position, velocity, acceleration = swing()
    mass, length = 2.0, 0.3
    weight = mass * 9.81 * length * np.sin(position)
    model = tmp_path / "pendulum.xml"
    model.write_text(
        '<mujoco><option gravity="0 0 -9.81"/><worldbody><body><joint type="hinge" axis="0 1 0" frictionloss="0.5"/>'
        f'<inertial mass="{mass}" pos="0 0 -{length}" diaginertia="0.01 0.01 0.01"/></body></worldbody></mujoco>',
        encoding="utf-8",
    )
    torque = (0.01 + mass * length**2) * acceleration + 0.5 * np.sign(velocity) + weight
    recording = write_recording(tmp_path / "swing", time, position, torque)
    found = reference(Recipe(BAND, RIGID), model, [recording], [recording], BAND, None)
    assert found.before < 0.01 * found.torque


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Case]:
    if not (DATA / "measured" / "labels.json").is_file():
        pytest.skip("measured data are not beside the project")
    place = Place(tmp_path_factory.mktemp("measured"))
    found = read_cases(DATA, place.inputs)
    for case in found:
        import_inputs(case, place, "code", 300.0)
    return {case.name: case for case in found}


def of(case: Case) -> Reference:
    recipe = RECIPES[case.name]
    return reference(recipe, case.model, case.training, case.validation, recipe.band, None)


def test_there_are_eighteen_cases_and_a_recipe_for_each(cases: dict[str, Case]) -> None:
    assert len(cases) == 18
    assert set(cases) == set(RECIPES)
    assert all((path / "recording.json").is_file() for case in cases.values() for path in (*case.training, *case.validation))
    assert len(cases["epos_screw"].training) + len(cases["epos_screw"].validation) == 32
    assert cases["emps"].machine == "emps"


def test_emps_leaves_the_published_relative_force_error(cases: dict[str, Case]) -> None:
    found = of(cases["emps"])
    assert found.after / found.torque == pytest.approx(0.0534, abs=0.0010)  # README of the data, by direction, on the pulses


@pytest.mark.parametrize(
    ("name", "before", "left", "tolerance"),
    [
        ("arts_backlash_30lb", 7514.0, 1232.0, 0.07),
        ("arts_backlash_36lb", 13142.0, 2143.0, 0.07),
        ("arts_tension_backlash", 11274.0, 3289.0, 0.07),
        ("epos2_turn_a", 1.009e-3, 0.618e-3, 0.05),
        ("epos2_turn_b", 0.560e-3, 0.387e-3, 0.08),
        ("laas_inertia_seeded", 0.1026 * 0.0318, 0.0160 * 0.0318, 0.15),
        ("laas_cogging_off", 0.1388 * 0.0318, 0.0298 * 0.0318, 0.15),
    ],
)
def test_what_is_left_is_as_the_readme_of_the_data_has_it(
    cases: dict[str, Case], name: str, before: float, left: float, tolerance: float
) -> None:
    found = of(cases[name])  # the README weighs samples alike and cuts ends otherwise: some per cent
    assert found.before == pytest.approx(before, rel=tolerance)
    assert found.after == pytest.approx(left, rel=tolerance)


def test_the_gap_of_the_damper_is_four_millimetres(cases: dict[str, Case]) -> None:
    assert "gap 4 mm" in of(cases["arts_backlash_30lb"]).fitted


def test_the_control_has_nothing_to_close(cases: dict[str, Case]) -> None:
    assert of(cases["laas_no_gap"]).closed < 0.1


