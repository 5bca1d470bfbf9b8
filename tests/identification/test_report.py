"""The identification's report in words: what a reader sees beside the figures."""

from __future__ import annotations

from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import pytest
import synthetic
from matplotlib.figure import Figure

from drivetwin.identification import Identification, identify, plots
from drivetwin.identification.figures import residual_figure
from drivetwin.identification.report import write_report
from drivetwin.identification.result import Parameter
from drivetwin.identification.wording import row_of


@pytest.fixture(scope="module")
def found() -> Identification:
    motions = {"strokes": synthetic.strokes(), "sweep": synthetic.sweep()}
    recordings = [
        synthetic.record(motion, synthetic.STRIBECK, np.random.default_rng(k), name=name)
        for k, (name, motion) in enumerate(motions.items())
    ]
    return identify(synthetic.turntable(), recordings)


@pytest.mark.parametrize(
    ("true", "said"), [(1.0, "yes"), (1.0526, "no, by 0.25 %"), (0.9, "no, by 5.56 %"), (0.0, "no"), (None, "")]
)
def test_by_how_much_an_interval_misses_the_true_value(true: float | None, said: str) -> None:
    assert row_of("inertia", Parameter(1.0, "kg", (0.95, 1.05)), true).interval_holds == said


def test_speeds_are_in_the_unit_and_digits_that_fit(found: Identification, tmp_path: Path) -> None:
    turn = replace(found.axes["turn"], minimum_velocity=0.0107962, standstill_velocity=0.00050029)
    write_report(replace(found, axes={"turn": turn}), tmp_path / "report.html", {}, "Identified")
    page = unescape((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert "Minimum friction at 10.8 mrad/s." in page
    assert "In motion: faster than turn 0.5003 mrad/s." in page


def test_the_lines_in_the_residual_name_the_recordings_that_begin_there(found: Identification) -> None:
    figure = residual_figure(found.axes["turn"])
    lines = [shape.x0 for shape in figure.layout.shapes]
    names = {note.text: note.x for note in figure.layout.annotations}
    assert list(names) == ["strokes", "sweep"]
    assert names["strokes"] == 0.0
    assert lines == [names["sweep"]]


def test_the_picture_of_the_residual_names_them_too(found: Identification) -> None:
    axes = Figure().subplots()
    plots._residual(axes, found.axes["turn"])
    assert [text.get_text() for text in axes.texts] == ["strokes", "sweep"]
