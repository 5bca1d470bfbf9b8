"""Margins against closed forms, the multisine against its definition, and what estimates refuse."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.foundation.errors import UserError
from drivetwin.identification.frequency.cascade import cascade_of
from drivetwin.identification.frequency.margins import margins
from drivetwin.identification.frequency.phasors import Excited, response
from drivetwin.identification.frequency.wave import HIGHEST, lines_in, multisine
from drivetwin.recording.recording import AxisInfo, DriveLoops, Recording, RecordingInfo

FREQUENCY = np.geomspace(0.01, 100.0, 4000)
S = (1j * FREQUENCY).astype(np.complex128)


def test_margins_of_three_equal_lags_are_those_of_the_closed_form() -> None:
    loop = 4.0 / (1.0 + S) ** 3
    found = margins(FREQUENCY, loop)
    crossover = np.sqrt(4.0 ** (2.0 / 3.0) - 1.0)
    assert found.crossover == pytest.approx(crossover, rel=1e-4)
    assert found.phase == pytest.approx(180.0 - 3.0 * np.degrees(np.arctan(crossover)), abs=0.01)
    assert found.phase_crossover == pytest.approx(np.sqrt(3.0), rel=1e-4)
    assert found.gain == pytest.approx(20.0 * np.log10(8.0 / 4.0), abs=0.001)


def test_unstable_loop_has_negative_margins() -> None:
    found = margins(FREQUENCY, 16.0 / (1.0 + S) ** 3)
    assert found.phase is not None
    assert found.gain is not None
    assert found.phase < 0.0
    assert found.gain == pytest.approx(20.0 * np.log10(8.0 / 16.0), abs=0.001)


def test_integrator_never_crosses_180_degrees() -> None:
    found = margins(FREQUENCY, 1.0 / S)
    assert found.crossover == pytest.approx(1.0, rel=1e-4)
    assert found.phase == pytest.approx(90.0)
    assert found.gain is None
    assert found.phase_crossover is None


def test_multisine_has_its_amplitudes_at_its_lines_and_nothing_between() -> None:
    lines = lines_in(1000, 40)
    sizes = np.linspace(1.0, 2.0, len(lines))
    spectrum = np.abs(np.fft.rfft(multisine(1000, lines, sizes, seed=3).samples)) / 500.0
    assert spectrum[lines] == pytest.approx(sizes)
    assert np.delete(spectrum, lines) == pytest.approx(0.0, abs=1e-9)
    assert lines[0] == 1
    assert lines[-1] == HIGHEST * 1000


def _excited(periods: int, noise: float) -> Excited:
    """An axis that answers each line with 2 in torque and 3j in position, on a way at constant speed."""
    wave = multisine(200, lines_in(200, 10), np.ones(len(lines_in(200, 10))), seed=0)
    torque = np.tile(wave.samples, periods)
    spectrum = np.fft.rfft(torque)
    quarter = np.fft.irfft(1j * spectrum, len(torque))
    random = np.random.default_rng(1)
    columns = {
        "torque": 2.0 * torque + 7.0 + noise * random.standard_normal(len(torque)),
        "position": 3.0 * quarter + 0.01 * np.arange(len(torque)),
        "torque_offset": torque,
    }
    info = RecordingInfo(machine="one", sample_period=0.001, axes={"a": AxisInfo(joint="a")})
    recording = Recording("excited", info, np.arange(len(torque), dtype=np.float64) * 0.001, {"a": columns})
    return Excited(recording, "a", wave, [200 * period for period in range(periods)], periods)


def test_response_is_exact_beside_a_way_at_constant_speed() -> None:
    found = response(_excited(4, noise=0.0))
    assert found.torque == pytest.approx(np.full(len(found.torque), 2.0 + 0j))
    assert found.position == pytest.approx(np.full(len(found.torque), 3j))
    assert found.coherence == pytest.approx(1.0)
    assert found.deviation == pytest.approx(0.0, abs=1e-9)


def test_deviation_is_what_the_noise_makes_of_the_response() -> None:
    many = response(_excited(400, noise=1.0))
    of_a_line = np.sqrt(2.0 / (200.0 * 400.0)) / 2.0
    assert np.median(many.deviation) == pytest.approx(of_a_line, rel=0.1)
    assert (np.abs(many.torque - 2.0) / 2.0 < 4.0 * many.deviation).all()


def test_one_period_has_no_coherence() -> None:
    with pytest.raises(UserError, match="1 excited periods; a coherence needs at least two"):
        response(_excited(1, noise=0.0))


def test_drive_that_tells_no_gains_is_refused_by_name() -> None:
    with pytest.raises(UserError, match="axis lift: its drive has no gains"):
        cascade_of("lift", DriveLoops())
