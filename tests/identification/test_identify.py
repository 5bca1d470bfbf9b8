"""Several recordings, axes that stand, data that cannot tell, and the files that come out."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import synthetic
from typer import Typer
from typer.testing import CliRunner

from drivetwin.cli.fit import fit_command
from drivetwin.foundation.errors import UserError
from drivetwin.identification import Settings, identify, write_results
from drivetwin.identification.friction_law import FrictionLaw
from drivetwin.identification.residuals import error_if_moving, error_of_fit
from drivetwin.identification.wording import headline
from drivetwin.motion.axis_motion import axis_motions
from drivetwin.motion.moving import standstill_velocity
from drivetwin.recording.recording import AxisInfo, Recording
from drivetwin.recording.writer import write_into


@pytest.fixture
def strokes() -> Recording:
    return synthetic.record(synthetic.strokes(), synthetic.STRIBECK, np.random.default_rng(1))


@pytest.fixture
def sweep() -> Recording:
    return sweep_of(synthetic.STRIBECK)


def test_axis_that_is_held_in_one_recording_does_not_disturb(strokes: Recording, sweep: Recording) -> None:
    alone = identify(synthetic.turntable(), [strokes, sweep]).axes["turn"].parameters
    held = synthetic.record(_standing(4.0), synthetic.STRIBECK, np.random.default_rng(3), name="held")
    beside = identify(synthetic.turntable(), [strokes, held, sweep]).axes["turn"].parameters
    for name, parameter in alone.items():
        assert beside[name].value == pytest.approx(parameter.value, rel=2e-3, abs=2e-3)


def test_recordings_of_different_rates_go_together(strokes: Recording, sweep: Recording) -> None:
    axis = identify(synthetic.turntable(), [_every_other(strokes), sweep]).axes["turn"]
    assert axis.parameters["coulomb"].value == pytest.approx(1.9, rel=0.01)
    assert axis.parameters["viscous"].value == pytest.approx(1.15, rel=0.02)


def test_noisy_recording_counts_less() -> None:
    motion, law = synthetic.strokes(), synthetic.PLAIN
    quiet = [synthetic.record(motion, law, np.random.default_rng(k), name="quiet", noise=0.05) for k in range(12)]
    loud = [synthetic.record(motion, law, np.random.default_rng(k + 50), name="loud", noise=0.5) for k in range(12)]
    together = [_coulomb([q, n]) - 1.9 for q, n in zip(quiet, loud, strict=True)]
    only_loud = [_coulomb([n]) - 1.9 for n in loud]
    assert np.std(together) < 0.35 * np.std(only_loud)


def test_direction_dependence_is_found() -> None:
    law = FrictionLaw(coulomb=1.9, viscous=1.15, viscous_difference=-0.15)
    recording = synthetic.record(synthetic.strokes(), law, np.random.default_rng(4))
    axis = identify(synthetic.turntable(), [recording]).axes["turn"]
    assert axis.direction is not None
    assert axis.direction.real
    assert axis.parameters["viscous_positive"].value == pytest.approx(1.0, rel=0.02)
    assert axis.parameters["viscous_negative"].value == pytest.approx(1.3, rel=0.02)


def test_one_direction_cannot_tell_an_offset() -> None:
    velocity = np.abs(synthetic.strokes().velocity)
    recording = synthetic.record(synthetic.from_velocity(velocity), synthetic.PLAIN, np.random.default_rng(5))
    axis = identify(synthetic.turntable(), [recording]).axes["turn"]
    assert "offset" not in axis.parameters
    assert "one direction" in axis.unidentifiable["offset"]
    assert axis.direction is None
    assert axis.parameters["coulomb"].value == pytest.approx(1.9, rel=0.01)


def test_velocity_alone_is_enough(strokes: Recording, sweep: Recording) -> None:
    def without_position(recording: Recording) -> Recording:
        columns = recording.columns["turn"]
        velocity = np.gradient(columns["position"], synthetic.PERIOD)
        return replace(recording, columns={"turn": {"torque": columns["torque"], "velocity": velocity}})

    axis = identify(synthetic.turntable(), [without_position(strokes), without_position(sweep)]).axes["turn"]
    assert axis.parameters["coulomb"].value == pytest.approx(1.9, rel=0.01)


def test_nothing_moves() -> None:
    held = synthetic.record(_standing(3.0), synthetic.PLAIN, np.random.default_rng(6), name="held")
    with pytest.raises(UserError, match="nothing moves in held"):
        identify(synthetic.turntable(), [held])


def test_rounding_does_not_move_an_axis_that_stands() -> None:
    """Without a resolution, the filter's rounding of a constant is all the noise there is."""
    random = np.random.default_rng(7)
    for place in random.uniform(-2.0, 2.0, 200):
        held = synthetic.record(_standing(3.0), synthetic.PLAIN, random, name="held")
        turn = held.info.axes["turn"].model_copy(update={"position_resolution": None})
        info = held.info.model_copy(update={"axes": {"turn": turn}})
        columns = {"turn": {**held.columns["turn"], "position": np.full(len(held.time), place)}}
        assert standstill_velocity(axis_motions(synthetic.turntable(), replace(held, info=info, columns=columns), 20.0)) is None


def test_too_short(strokes: Recording) -> None:
    columns = {name: values[:60] for name, values in strokes.columns["turn"].items()}
    with pytest.raises(UserError, match="60 samples; the filter needs"):
        identify(synthetic.turntable(), [replace(strokes, time=strokes.time[:60], columns={"turn": columns})])


def test_joint_that_the_model_lacks(strokes: Recording) -> None:
    info = strokes.info.model_copy(update={"axes": {"turn": AxisInfo(joint="wrist")}})
    with pytest.raises(UserError, match="no hinge or slide joint 'wrist'"):
        identify(synthetic.turntable(), [replace(strokes, info=info)])


def test_no_data_is_no_perfect_fit() -> None:
    with pytest.raises(UserError, match="no sample in motion"):
        error_of_fit([])
    assert error_if_moving([]) is None


def test_torque_that_is_zero_throughout_is_refused(strokes: Recording) -> None:
    columns = strokes.columns["turn"]
    silent = replace(strokes, columns={"turn": columns | {"torque": np.zeros_like(columns["torque"])}})
    with pytest.raises(UserError):
        identify(synthetic.turntable(), [silent])


def test_results_are_as_the_contract_says(strokes: Recording, sweep: Recording, tmp_path: Path) -> None:
    truth = {"turn": {"coulomb": 1.9, "viscous": 1.15, "static_torque": 2.4, "stribeck_velocity": 0.05}}
    found = identify(synthetic.turntable(), [strokes], [sweep], Settings(standstill_velocity={"turn": 0.004}))
    write_results(found, [strokes, sweep], tmp_path, truth=truth, seed=7, title="A & B")
    written = json.loads((tmp_path / "identified.json").read_text())
    assert written["schema"] == "identified/1"
    assert written["seed"] == 7
    assert {"version", "inputs", "machine"} <= set(written)
    assert written["filter"]["cutoff_hz"] == 48.0
    assert written["filter"]["standstill_velocity"] == {"turn": 0.004}
    assert written["settings"] == {
        "cutoff_hz": 48.0,
        "standstill_velocity": {"turn": 0.004},
        "reversal_margin": 0.0,
        "estimate_delay": False,
        "confidence": 0.9,
        "stribeck_exponent": 2.0,
        "stribeck_exponent_bounds": [0.5, 4.0],
        "stribeck_gain": 0.1,
        "direction_gain": 0.1,
        "significance": 1e-4,
    }
    axis = written["axes"]["turn"]
    assert axis["parameters"]["stribeck_exponent"]["unit"] == "1"
    assert axis["truth"] == truth["turn"]
    assert axis["parameters"]["viscous"]["unit"] == "N·m·s/rad"
    low, high = axis["parameters"]["viscous"]["ci90"]
    assert low < axis["parameters"]["viscous"]["value"] < high
    assert 0 < axis["relative_error"] < 0.1
    assert 0 < axis["validation_relative_error"] < 0.1
    page = (tmp_path / "report.html").read_text()
    assert "A &amp; B" in page
    assert "<script src" not in page
    assert (tmp_path / "turn_torque_speed.png").stat().st_size > 10_000
    assert (tmp_path / "turn_residual.png").stat().st_size > 10_000


def test_the_headline_names_the_stribeck_curve_where_there_is_one(strokes: Recording, sweep: Recording) -> None:
    plain = [synthetic.record(synthetic.strokes(), synthetic.PLAIN, np.random.default_rng(1))]
    truth = {"turn": {"inertia": 1.0, "coulomb": 1.9, "viscous": 1.15, "stribeck_velocity": 0.05}}
    with_curve = headline(identify(synthetic.turntable(), [strokes, sweep]), truth)
    without = headline(identify(synthetic.turntable(), [*plain, sweep_of(synthetic.PLAIN)]), truth)
    assert with_curve.endswith("contain the true value, including those of the shape of the Stribeck curve.")
    assert without.endswith("of 3 intervals at 90 % contain the true value.")


def sweep_of(law: FrictionLaw) -> Recording:
    return synthetic.record(synthetic.sweep(), law, np.random.default_rng(2), name="sweep")


def test_fit_command(strokes: Recording, tmp_path: Path) -> None:
    model = tmp_path / "model.xml"
    model.write_text(synthetic.TURNTABLE)
    write_into(strokes, tmp_path / "strokes")
    app = Typer()
    app.command()(fit_command)
    out = tmp_path / "out"
    done = CliRunner().invoke(app, [str(model), str(tmp_path / "strokes"), "--out", str(out)])
    assert done.exit_code == 0, done.output
    assert "Coulomb friction" in done.output
    assert (out / "identified.json").exists()
    refused = CliRunner().invoke(
        app, [str(model), str(tmp_path / "strokes"), "--standstill", "wrist=1", "--out", str(tmp_path / "none")]
    )
    assert isinstance(refused.exception, UserError)
    assert "no axis 'wrist'" in str(refused.exception)
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize("value", ["-1", "nan", "inf"])
@pytest.mark.parametrize("option", ["--reversal-margin", "--cutoff"])
def test_fit_refuses_numbers_that_make_no_sense(option: str, value: str, tmp_path: Path) -> None:
    app = Typer()
    app.command()(fit_command)
    arguments = ["model.xml", "recording", option, value, "--out", str(tmp_path / "out")]
    refused = CliRunner().invoke(app, arguments)
    assert isinstance(refused.exception, UserError)
    assert str(refused.exception).startswith(f"{option} {value}: expected")
    assert not (tmp_path / "out").exists()


def _coulomb(recordings: list[Recording]) -> float:
    return identify(synthetic.turntable(), recordings).axes["turn"].parameters["coulomb"].value


def _standing(seconds: float) -> synthetic.Motion:
    still = np.zeros(round(seconds / synthetic.PERIOD))
    return synthetic.Motion(still, still, still)


def _every_other(recording: Recording) -> Recording:
    columns = {name: values[::2] for name, values in recording.columns["turn"].items()}
    info = recording.info.model_copy(update={"sample_period": 2 * recording.info.sample_period})
    return replace(recording, info=info, time=recording.time[::2], columns={"turn": columns})
