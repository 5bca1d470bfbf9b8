"""identified.json, the pictures and the report, in one directory."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from drivetwin.foundation.files import write_json
from drivetwin.identification.plots import draw_axis, draw_errors, draw_overview
from drivetwin.identification.report import write_report
from drivetwin.identification.result import Identification, Truth
from drivetwin.identification.truth import true_law
from drivetwin.recording.recording import Recording


def write_results(
    identification: Identification,
    recordings: Sequence[Recording],
    directory: Path,
    *,
    truth: Truth | None = None,
    seed: int = 0,
    title: str = "Identification",
    picture: str = "",
    inputs: Sequence[Path] = (),
    progress: Callable[[str], None] | None = None,
) -> None:
    """Write identified.json, report.html, friction.png, errors.png and two pictures an axis into `directory`, which exists.

    `recordings` are those that were fitted and validated on: the sha256 of their files goes into the JSON, with that of
    `inputs` (the model). `truth` is by axis and parameter, `picture` the machine as SVG. `progress` is told the name of each
    file before it is made.
    """
    told = progress or (lambda _name: None)
    known = truth or {}
    files = [*inputs, *(file for recording in recordings for file in recording.files)]
    told("identified.json")
    write_json(directory / "identified.json", identification.to_json(truth, seed, files, directory))
    for name, axis in identification.axes.items():
        told(f"{name} plots")
        draw_axis(axis, directory, true_law(known.get(name), axis.best_offset))
    told("friction.png")
    draw_overview(
        identification,
        directory,
        {name: true_law(known.get(name), axis.best_offset) for name, axis in identification.axes.items()},
    )
    told("errors.png")
    draw_errors(identification, directory, known)
    told("report.html")
    write_report(identification, directory / "report.html", known, title, picture)
