"""The worked examples: EMPS and the EPOS lead screw, on the measured data where they lie."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
import typer
from numpy.typing import NDArray
from scipy.signal import butter, filtfilt
from typer.testing import CliRunner

from drivetwin.cli.import_ import import_command
from drivetwin.foundation.errors import UserError
from drivetwin.recording.reader import check_joints, read_recording
from drivetwin.recording.recording import Recording

ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data"
EXAMPLES = ROOT / "docs" / "examples"
EMPS = DATA / "emps"
EPOS = DATA / "epos_screw_drive_1" / "steady_state" / "0.096kg"

needs_emps = pytest.mark.skipif(not EMPS.is_dir(), reason="needs the EMPS data in ../shared/data/emps")
needs_epos = pytest.mark.skipif(not EPOS.is_dir(), reason="needs the EPOS data in ../shared/data/epos_screw_drive_1")

Floats = NDArray[np.float64]

CUT_OFF = 48.0
END = 100
STANDSTILL = 1e-3


def run(*arguments: Path | str) -> str:
    app = typer.Typer()
    app.command("import")(import_command)
    result = CliRunner().invoke(app, [str(argument) for argument in arguments], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def emps(name: str, out: Path) -> Recording:
    run(EMPS / f"{name}.mat", "--map", EXAMPLES / "emps" / "import.yaml", "--out", out / name)
    (recording,) = read_recording(out / name)
    return recording


def regression(recording: Recording) -> tuple[Floats, Floats]:
    """Regressors (n, 4) of acceleration, velocity, its sign and 1, and the force (n,), in motion and off the ends."""
    period = recording.info.sample_period
    b, a = butter(4, 2 * CUT_OFF * period)
    carriage = recording.columns["carriage"]
    velocity = np.gradient(filtfilt(b, a, carriage["position"]), period)
    signs = filtfilt(b, a, np.sign(velocity))
    terms = np.stack([np.gradient(velocity, period), velocity, signs, np.ones_like(velocity)], axis=1)
    force = filtfilt(b, a, carriage["torque"])
    kept = np.flatnonzero(np.abs(velocity) > STANDSTILL)
    kept = kept[(kept >= END) & (kept < len(velocity) - END)]
    return terms[kept], force[kept]


def error(terms: Floats, force: Floats, parameters: Floats) -> float:
    return float(np.linalg.norm(force - terms @ parameters) / np.linalg.norm(force))


@needs_emps
def test_emps_gives_the_published_coefficients(tmp_path: Path) -> None:
    terms, force = regression(emps("DATA_EMPS", tmp_path))
    parameters = np.asarray(np.linalg.lstsq(terms, force, rcond=None)[0], dtype=np.float64)
    np.testing.assert_allclose(parameters[:3], [95.1089, 203.5034, 20.3935], rtol=0.01)
    assert parameters[3] == pytest.approx(-3.1648, rel=0.05)
    assert error(terms, force, parameters) < 0.0409
    pulses = emps("DATA_EMPS_PULSES", tmp_path)
    assert error(*regression(pulses), parameters) < 0.0599


@needs_emps
def test_emps_recording_is_what_the_readme_says(tmp_path: Path) -> None:
    identification = emps("DATA_EMPS", tmp_path)
    assert len(identification.time) == 24841
    assert identification.info.sample_period == 0.001
    assert "torque_offset" not in identification.columns["carriage"]
    pulses = emps("DATA_EMPS_PULSES", tmp_path).columns["carriage"]["torque_offset"]
    np.testing.assert_allclose(np.unique(pulses), [0, 175.753], atol=1e-3)
    drive = identification.info.axes["carriage"].drive
    assert drive is not None
    assert (drive.position_gain, drive.velocity_feedforward, drive.integral_time) == (160.18, 0.0, None)


@needs_emps
def test_a_map_that_names_a_missing_column_writes_nothing(tmp_path: Path) -> None:
    text = (EXAMPLES / "emps" / "import.yaml").read_text().replace("column: vir", "column: tau")
    (tmp_path / "map.yaml").write_text(text)
    with pytest.raises(
        UserError, match=r"DATA_EMPS\.mat: no column 'tau' for carriage\.torque; the columns are: qg, qm"
    ):
        run(EMPS / "DATA_EMPS.mat", "--map", tmp_path / "map.yaml", "--out", tmp_path / "out")
    assert [path.name for path in tmp_path.iterdir()] == ["map.yaml"]


@needs_epos
def test_epos_gives_the_stribeck_curve(tmp_path: Path) -> None:
    out = tmp_path / "epos"
    output = run(*EPOS.glob("*.csv"), "--map", EXAMPLES / "epos_screw" / "import.yaml", "--out", out)
    assert "32 recordings" in output
    torque = {}
    for folder in out.iterdir():
        if not folder.is_dir():
            continue
        (recording,) = read_recording(folder)
        assert recording.info.derived == ["screw.position"]
        speed = int(folder.name.replace("n", "-"))
        screw = recording.columns["screw"]
        assert np.mean(screw["velocity"]) * 60 / 2 / np.pi == pytest.approx(speed, abs=1.0)
        torque[speed] = float(np.mean(screw["torque"]))
    assert len(torque) == 32
    assert min((speed for speed in torque if speed > 0), key=lambda speed: torque[speed]) == 50
    assert max((speed for speed in torque if speed < 0), key=lambda speed: torque[speed]) == -40
    offsets = [torque[speed] + torque[-speed] for speed in torque if speed > 0]
    assert np.mean(offsets) / 2 == pytest.approx(-0.35e-3, rel=0.1)


@pytest.mark.parametrize(("example", "mass"), [("emps", 95.1089), ("epos_screw", 2.7e-7)])
def test_models_load_and_have_the_joint_of_the_map(example: str, mass: float) -> None:
    model = mujoco.MjModel.from_xml_path(str(EXAMPLES / example / "model.xml"))
    text = (EXAMPLES / example / "import.yaml").read_text()
    joint, actuator = model.joint(0), model.actuator(0)
    assert f"joint: {joint.name}\n" in text
    assert f"actuator: {actuator.name}\n" in text
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert model.dof_M0[0] == pytest.approx(mass)


def test_check_joints_on_the_example(tmp_path: Path) -> None:
    if not EMPS.is_dir():
        pytest.skip("needs the EMPS data in ../shared/data/emps")
    with pytest.raises(UserError, match=r"recording\.json: axis carriage .*'carriage'.*its joints: screw"):
        check_joints(emps("DATA_EMPS", tmp_path), ["screw"])
