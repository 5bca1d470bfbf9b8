"""The notebooks: their cells run in order, and end with what an independent source says."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest

ROOT = Path(__file__).parents[2]
NOTEBOOKS = ROOT / "docs/examples/notebooks"
EMPS = ROOT.parent / "shared" / "data" / "emps"


def cells(name: str) -> list[dict[str, Any]]:
    notebook = json.loads((NOTEBOOKS / f"{name}.ipynb").read_text(encoding="utf-8"))
    return list(notebook["cells"])


def run(name: str, monkeypatch: pytest.MonkeyPatch, out: Path) -> dict[str, Any]:
    """What the cells leave behind, run one after the other in the root folder; pictures are drawn on nothing."""
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr("tempfile.tempdir", str(out))
    monkeypatch.setattr(plt, "show", lambda: None)
    mpl.use("Agg")
    left: dict[str, Any] = {}
    for number, cell in enumerate(cells(name)):
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), f"{name}.ipynb, cell {number}", "exec"), left)
    left["figures"] = plt.get_fignums()
    plt.close("all")
    return left


@pytest.mark.parametrize("path", sorted(NOTEBOOKS.glob("*.ipynb")), ids=lambda path: path.stem)
def test_a_notebook_has_no_output(path: Path) -> None:
    codes = [cell for cell in cells(path.stem) if cell["cell_type"] == "code"]
    assert codes
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in codes)


def test_friction(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """20.4 N and 203.5 N·s/m, and 36 N·s/m by direction: effects.json of the stage."""
    left = run("friction", monkeypatch, tmp_path)
    assert left["model"].dof_frictionloss[0] == pytest.approx(20.4, rel=0.01)
    assert left["model"].dof_damping[0] == pytest.approx(203.5, rel=0.01)
    (viscous,) = (placed.effect for placed in left["twin"].beside if placed.effect.name == "viscous_asymmetry")
    assert viscous.asymmetry == pytest.approx(-36.0, rel=0.01)
    assert left["figures"] == [1]


def test_hidden_effect(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The ripple is found, nothing else is, and with it the replay is nearer to the machine."""
    left = run("hidden_effect", monkeypatch, tmp_path)
    gap, slide = left["gap"], left["slide"]
    assert gap.verdict == "explained"
    (ripple,) = (placed.effect for placed in gap.selected)
    assert (ripple.name, ripple.order) == ("torque_ripple", 6.0)
    assert (ripple.amplitude, ripple.phase) == pytest.approx((6.0, 0.7), rel=0.02)
    without, with_it = (slide.runs[name].apart["torque"].relative for name in ("model", "with_effects"))
    assert with_it < 0.3 * without
    assert left["figures"] == [1]


@pytest.mark.skipif(not EMPS.is_dir(), reason="needs the EMPS data in ../shared/data/emps")
def test_measured_axis(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The published parameters within 0.2 %, and errors no larger than the published ones."""
    left = run("measured_axis", monkeypatch, tmp_path)
    carriage = left["carriage"]
    for name in ("inertia", "viscous", "coulomb"):
        assert carriage.parameters[name].value == pytest.approx(left["published"][name], rel=0.002)
    assert carriage.relative_error < 0.0409
    assert carriage.validation_relative_error < 0.0599
    assert left["figures"] == [1]
